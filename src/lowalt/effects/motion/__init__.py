"""Effects on a target's motion: angles, offsets and tilts added to the poses of the motion table."""
