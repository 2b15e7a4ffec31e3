"""Models of other runs on this run's test samples, next to this run's own.

They show how training on other data changes accuracy. Both models classify the same test samples,
and their results are compared sample by sample.

transfer.csv, one row per protocol, scheme, other run and SNR ("avg": mean over SNRs):
    trained_on          the other run
    accuracy_percent    of the other run's model on this run's test samples, mean over its seeds
    own_percent         of this run's own model
    difference_points, low, high
                        the other's minus this run's own, with the 95 % interval that resamples
                        training seeds, motion models and, in the unseen protocol, subtypes
    samples, hardware   of this run's test samples
    seeds, spread_points
                        training seeds of the other's model, and the standard deviation of accuracy
                        between the seeds of a model, pooled over both models (empty for one seed)
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition.evaluated import Evaluated, difference, spread_points
from lowalt.recognition.tables import snr_text

COLUMNS = (
    "protocol",
    "scheme",
    "trained_on",
    "snr_db",
    "accuracy_percent",
    "own_percent",
    "difference_points",
    "low",
    "high",
    "samples",
    "hardware",
    "seeds",
    "spread_points",
)


def check_folds(own: dict, other: dict) -> None:
    """Refuse two runs of which the other may have trained with a motion model that this one tests.

    own, other: the configurations of this run and of the other. Folds follow from (seed, subtype,
    number of the motion model) and the split: with equal seeds, only equal splits test the same
    motion models; with other seeds, all motion models are different.
    Raises: InputError naming both splits.
    """
    if own["seed"] == other["seed"] and own["split"] != other["split"]:
        raise InputError(
            f"transfer: run {other['run']!r} has the same seed {own['seed']} and split "
            f"{other['split']}, this run has {own['split']}; motion models tested here may have "
            "trained there. Expected equal splits"
        )


def comparison(
    own: list[Evaluated], other: list[Evaluated], name: str, seed: int
) -> Iterable[list]:
    """Yield the columns from snr_db on, in percent and points, of one scheme.

    own, other: runs (seeds) of the two models; name: the other run, which keys the bootstrap's
    stream with `seed`.
    Raises: InputError where they were tested on different samples.
    """
    test = own[0].test
    for run in (*own, *other):
        if run.classes != own[0].classes:
            raise InputError(
                f"transfer: {name} has the classes {run.classes}, expected {own[0].classes} as "
                "this run"
            )
        if not np.array_equal(run.test.key, test.key):
            raise InputError(
                f"transfer: {run.scheme} of {name} was tested on other samples than this run's own"
            )
    mine = np.mean([run.test.correct for run in own], axis=0)
    theirs = np.mean([run.test.correct for run in other], axis=0)
    snrs = np.unique(test.snr_db).tolist()
    # The mean over all samples is the mean over the SNRs, since every SNR has as many samples.
    for snr in (*snrs, None):
        rows = slice(None) if snr is None else test.snr_db == snr
        word = "avg" if snr is None else snr_text(snr)
        generator = stream(seed, "transfer-bootstrap", own[0].protocol, own[0].scheme, name, word)
        interval = difference(other, own, generator, snr)
        shares = (theirs[rows].mean(), mine[rows].mean(), *interval)
        numbers = [f"{100 * value:.4f}" for value in shares]
        of_own = [100 * run.test.correct[rows].mean() for run in own]
        of_other = [100 * run.test.correct[rows].mean() for run in other]
        spread = spread_points(of_own, of_other)
        spread_cell = "" if spread is None else f"{spread:.4f}"
        yield [word, *numbers, len(mine[rows]), own[0].hardware, len(other), spread_cell]


def write(
    own: list[Evaluated], other: list[Evaluated], order: list[str], out: str | Path, seed: int
) -> None:
    """Write transfer.csv; schemes stand in `order`, protocols seen first.

    Each of `other` says which run trained it.
    Raises: InputError where a model has no counterpart in this run.
    """
    mine: dict[tuple[str, str], list[Evaluated]] = {}
    theirs: dict[tuple[str, str, str], list[Evaluated]] = {}
    for run in own:
        mine.setdefault((run.protocol, run.scheme), []).append(run)
    for run in other:
        theirs.setdefault((run.protocol, run.scheme, run.trained_on), []).append(run)
    lines = []
    for key in sorted(theirs, key=lambda key: (key[0], order.index(key[1]))):
        protocol, scheme, trained_on = key
        if (protocol, scheme) not in mine:
            raise InputError(
                f"transfer: {trained_on} has {scheme} in the {protocol} protocol, this run has not"
            )
        rows = comparison(mine[protocol, scheme], theirs[key], trained_on, seed)
        lines += [[*key, *row] for row in rows]
    write_csv(out, COLUMNS, lines)
