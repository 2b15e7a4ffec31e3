"""Effects on the time samples of a station's receiver."""
