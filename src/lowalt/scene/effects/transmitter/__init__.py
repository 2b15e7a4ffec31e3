"""Effects on what a station sends."""
