"""File access for all stages: atomic writing, strict readers, and error messages of one sentence."""
