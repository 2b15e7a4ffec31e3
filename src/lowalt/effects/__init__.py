"""Effects beyond the paper: each a small module at its place in the chain, imported only where a scene names it."""
