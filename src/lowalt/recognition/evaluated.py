"""Evaluated schemes, read from prediction files and their records, and differences between them."""

from pathlib import Path

import numpy as np

from lowalt.config.classes import stated
from lowalt.files.errors import InputError
from lowalt.recognition import predictions
from lowalt.recognition.intervals import Interval, model_shares, strict_difference
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.protocols import folds


class Evaluated:
    """One evaluated scheme: its predictions and the record of the run."""

    def __init__(self, path: str | Path) -> None:
        """Read a prediction file and the record next to it.

        path: the prediction file; the JSON file next to it holds protocol, scheme, seed and
        hardware.
        Raises: InputError where either is missing or the test part is empty.
        """
        self.about = about = predictions.record(path)
        try:
            self.protocol = about["protocol"]
            self.scheme = about["scheme"]
            self.seed = about["seed"]
            self.hardware = about["hardware"]
            self.trained_on = about.get("trained_on", "")
            self.classes = stated(about)
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{Path(path).with_suffix('.json')}: not a run record ({error!r})"
            ) from error
        self.all = predictions.read(path, self.classes)
        self.test = self.part("test")
        if not len(self.test):
            raise InputError(
                f"{path}: no predictions for the test part of the {self.protocol} protocol"
            )

    def part(self, name: str) -> Predictions:
        """Return the predictions of a part of the run's protocol."""
        return self.all.of(folds(self.protocol, name))


def difference(
    first: list[Evaluated],
    second: list[Evaluated],
    generator: np.random.Generator,
    snr_db: float | None = None,
) -> Interval:
    """Return the mean over seeds of first - second, in shares of correct samples.

    Its interval is that of 95 %. first, second: trainings of the two schemes, one per seed; snr_db:
    the SNR whose samples count, None for all. The interval resamples seeds, subtypes (unseen
    protocol) and motion models. The difference of a scheme to itself is 0.
    Raises: InputError where the trainings were tested on different samples. Source:
    `intervals.strict_difference`.
    """
    test = first[0].test
    for run in (*first, *second):
        if not np.array_equal(run.test.key, test.key):
            raise InputError(f"{first[0].scheme} and {run.scheme} were tested on different samples")
    if first is second:
        return Interval(0.0, 0.0, 0.0)
    rows = slice(None) if snr_db is None else test.snr_db == snr_db
    motion = test.motion[rows]
    sample, count, ours = model_shares(motion, [run.test.correct[rows] for run in first])
    _, _, theirs = model_shares(motion, [run.test.correct[rows] for run in second])
    subtypes = test.subtype[rows][sample]
    return strict_difference(ours, theirs, count, subtypes, whole_subtypes(first), generator)


def whole_subtypes(runs: list[Evaluated]) -> bool:
    """Return whether intervals resample whole subtypes, as where results speak of other ones."""
    return runs[0].protocol == "unseen"


def spread_points(*groups: list[float]) -> float | None:
    """Return the standard deviation between seeds, pooled over groups; None for one seed.

    groups: accuracies in percent, one a seed.
    """
    several = [np.array(group) for group in groups if len(group) > 1]
    freedom = sum(len(group) - 1 for group in several)
    if not freedom:
        return None
    squares = sum(((group - group.mean()) ** 2).sum() for group in several)
    return float(np.sqrt(squares / freedom))
