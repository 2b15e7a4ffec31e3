"""Effects on the motion of a target and its parts; all stations see the same motion."""
