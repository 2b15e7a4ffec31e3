"""Report: one self-contained page of a run, and the figures of all measured tables."""
