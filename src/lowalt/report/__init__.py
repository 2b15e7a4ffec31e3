"""Report: one self-contained page of what a run made, how well it was recognised and what each stage cost."""
