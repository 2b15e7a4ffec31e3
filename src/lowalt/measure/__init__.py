"""Measurements of computing time against accuracy and scale. Nothing here makes data."""
