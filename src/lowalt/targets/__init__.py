"""Targets: from a subtype's record (built-in model, mesh or mocap) to its point cloud."""
