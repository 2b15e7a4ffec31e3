"""Measuring: what accuracy, effects and networks cost in time. Nothing here makes data or draws."""
