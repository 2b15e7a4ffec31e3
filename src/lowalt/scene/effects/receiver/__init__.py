"""Effects on the time samples that a station receives."""
