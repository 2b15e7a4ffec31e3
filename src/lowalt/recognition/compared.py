"""The difference of two schemes' accuracies on the same samples, over all their training seeds.

Only schemes of one protocol are compared here; which differences a table shows is the table's business.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.intervals import Interval, model_shares, strict_difference


def difference(
    first: list[Evaluated], second: list[Evaluated], generator: np.random.Generator, snr_db: float | None = None
) -> Interval:
    """Return the mean over seeds of first - second, with its 95 % interval; all in shares of correct samples.

    first, second: trainings of the two schemes, one a seed; snr_db: the SNR whose samples count, None for all. The
    interval resamples seeds, in the unseen protocol subtypes, and motion models. A scheme differs from itself by 0.
    Raises: InputError where the trainings were tested on different samples. Source: `intervals.strict_difference`.
    """
    test = first[0].test
    for run in (*first, *second):
        if not np.array_equal(run.test.key, test.key):
            raise InputError(f"{first[0].scheme} and {run.scheme} were tested on different samples")
    if first is second:
        return Interval(0.0, 0.0, 0.0)
    rows = slice(None) if snr_db is None else test.snr_db == snr_db
    shares = [model_shares(test.motion[rows], [run.test.correct[rows] for run in runs]) for runs in (first, second)]
    (place, count, ours), (*_, theirs) = shares
    return strict_difference(ours, theirs, count, test.subtype[rows][place], whole_subtypes(first), generator)


def whole_subtypes(runs: list[Evaluated]) -> bool:
    """Return whether results of these trainings are to hold for other subtypes, so that whole subtypes are drawn."""
    return runs[0].protocol == "unseen"


def spread_points(*groups: list[float]) -> float | None:
    """Return the standard deviation between seeds, pooled over groups of accuracies in percent; None for one seed."""
    several = [np.array(group) for group in groups if len(group) > 1]
    freedom = sum(len(group) - 1 for group in several)
    return float(np.sqrt(sum(((group - group.mean()) ** 2).sum() for group in several) / freedom)) if freedom else None
