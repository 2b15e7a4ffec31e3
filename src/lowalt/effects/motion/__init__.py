"""Effects on how a target moves: what is added to the poses of the motion table."""
