"""File access for all stages: atomic writing, strict readers, errors of one sentence."""
