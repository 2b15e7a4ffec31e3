"""Effects on range cells: what happens before the strongest is taken, and which one is taken."""
