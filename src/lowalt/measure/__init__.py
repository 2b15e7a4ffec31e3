"""Measuring: the time that accuracy, effects and networks cost. Nothing here makes data or draws."""
