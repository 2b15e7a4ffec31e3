"""Measuring: the time that accuracy and larger scales cost. Nothing here makes data or draws."""
