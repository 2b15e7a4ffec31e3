"""Effects on range cells: filters before one is chosen, and the choice."""
