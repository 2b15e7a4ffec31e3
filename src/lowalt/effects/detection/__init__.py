"""Effects on range cells and on the choice of the strongest one."""
