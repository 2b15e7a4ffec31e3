"""Effects on range cells: filters before the strongest is chosen, and errors of that choice."""
