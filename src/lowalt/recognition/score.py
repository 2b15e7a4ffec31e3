"""The scorer for other people's predictions, which takes the truth from the shards alone."""

from pathlib import Path

import numpy as np

from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.recognition.predictions import probability_columns, shares_of
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Facts
from lowalt.recognition.statistics import accuracy_by, calibration, confusion
from lowalt.recognition.views import facts_of
from lowalt.shards import ShardSet


def _probabilities(path: str | Path, columns: tuple[str, ...]) -> dict[str, list[float]]:
    """Read and check the class probabilities of a prediction file: {key: probabilities}."""
    by_key: dict[str, list[float]] = {}
    for line, row in enumerate(read_csv(path, "key", *columns, what="predictions"), start=2):
        if row["key"] in by_key:
            raise InputError(f"{path} line {line}: key {row['key']!r} stands twice")
        by_key[row["key"]] = shares_of(row, columns, f"{path} line {line}")
    return by_key


def score(path: str | Path, index: str | Path, protocol: str) -> dict:
    """Return accuracies, confusion and calibration of a prediction file on a protocol's test part.

    The file needs the columns `key` and a probability for each class of the data set. Rows of other
    samples are ignored.
    Raises: InputError where a test sample has no prediction, or a row is malformed.
    """
    pairs = folds(protocol, "test")
    shards = ShardSet(
        index,
        sorted({group for group, _ in pairs}),
        sorted({fold for _, fold in pairs}),
        check=False,
    )
    facts = facts_of(shards, np.arange(len(shards)), placed=False)
    by_key = _probabilities(path, probability_columns(shards.classes))
    missing = [key for key in facts.key.tolist() if key not in by_key]
    if missing:
        raise InputError(
            f"{path}: {len(missing)} test samples have no prediction, the first is {missing[0]!r}"
        )
    probabilities = np.array([by_key[key] for key in facts.key.tolist()])
    return {"protocol": protocol, **scores(facts, probabilities)}


def scores(facts: Facts, probabilities: np.ndarray) -> dict:
    """Return accuracies (mean over the SNRs, by SNR, by subtype), confusion and calibration.

    probabilities: (samples, classes), in the order of `facts`.
    """
    guesses = probabilities.argmax(1)
    classes = probabilities.shape[1]
    correct = guesses == facts.label
    by_snr = accuracy_by(facts.snr_db, correct)
    by_subtype = accuracy_by(facts.subtype, correct)
    confusion_by_snr = {}
    for snr in by_snr:
        some = facts.snr_db == snr
        matrix = confusion(facts.label[some], guesses[some], classes)
        confusion_by_snr[f"{snr:g}"] = matrix.tolist()
    return {
        "samples": len(facts),
        "accuracy_percent": 100 * float(np.mean([share for share, _ in by_snr.values()])),
        "by_snr_percent": {f"{snr:g}": 100 * share for snr, (share, _) in by_snr.items()},
        "by_subtype_percent": {name: 100 * share for name, (share, _) in by_subtype.items()},
        "confusion": confusion(facts.label, guesses, classes).tolist(),
        "confusion_by_snr": confusion_by_snr,
        **calibration(probabilities, facts.label),
    }
