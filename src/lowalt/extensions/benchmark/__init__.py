"""The benchmark lowalt-40: its definition, tracks, scores of submissions, and table of baselines.

`load(track, part)` gives the samples of a track's part, `write(path, samples, probabilities)` a
submission.
"""

from lowalt.extensions.benchmark.benchmark_tracks import INNER, TRACKS
from lowalt.extensions.benchmark.part_samples import load
from lowalt.extensions.benchmark.submission import write

__all__ = ["INNER", "TRACKS", "load", "write"]
