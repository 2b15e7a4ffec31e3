"""Numbers from predictions: accuracy, confusion, calibration, thresholds and false alarms.

NumPy alone is needed.
Intervals of means and differences are those of `lowalt.recognition.intervals`.
"""

from typing import NamedTuple

import numpy as np

from lowalt.recognition.intervals import Interval, model_weights
from lowalt.recognition.predictions import Predictions

BINS = 15
"""Bins of confidence of the calibration error."""
REPEATS = 400
"""Bootstrap samples of an interval."""
LOOKED_FOR = 0
"""Label of the target class, whose detections and false alarms are counted: the first class."""
FEWEST_MISSED = 10
"""A threshold must leave at least this many validation samples of the target class undetected.

The standard deviation of that number is then a third of it.
"""


class AlarmPart(NamedTuple):
    """Data for counting false alarms, each (samples,): scores, label, motion model, subtype."""

    scores: np.ndarray
    labels: np.ndarray
    motion: np.ndarray
    subtypes: np.ndarray


def cross_entropy(probabilities: np.ndarray, labels: np.ndarray) -> float:
    """Mean negative log of the true class's probability.

    probabilities: (samples, classes); labels: (samples,).
    """
    chosen = probabilities[np.arange(len(labels)), labels]
    return float(-np.log(np.maximum(chosen, np.finfo(float).tiny)).mean())


def accuracy_by(groups: np.ndarray, correct: np.ndarray) -> dict:
    """Share of correct samples and their number in each group, in sorted order of the groups."""
    names, group = np.unique(groups, return_inverse=True)
    counts = np.bincount(group)
    hits = np.bincount(group, weights=correct)
    shares = {}
    for name, hit, count in zip(names, hits, counts, strict=True):
        shares[name.item()] = (float(hit / count), int(count))
    return shares


def confusion(labels: np.ndarray, guesses: np.ndarray, classes: int) -> np.ndarray:
    """Counts (classes, classes), true class by row, guessed class by column."""
    return np.bincount(labels * classes + guesses, minlength=classes**2).reshape(classes, classes)


def calibration(probabilities: np.ndarray, labels: np.ndarray) -> dict[str, float]:
    """Expected calibration error, Brier score and cross entropy.

    The calibration error has BINS bins of confidence of equal width.
    Source: Guo et al., On calibration of modern neural networks, 2017; Brier 1950 (sum over the
    classes).
    """
    confidence = probabilities.max(1)
    guesses = probabilities.argmax(1)
    bin_of = np.minimum((confidence * BINS).astype(int), BINS - 1)
    gap = np.bincount(bin_of, weights=confidence - (guesses == labels), minlength=BINS)
    truth = np.eye(probabilities.shape[1])[labels]
    return {
        "calibration_error": float(np.abs(gap).sum() / len(labels)),
        "brier": float(((probabilities - truth) ** 2).sum(1).mean()),
        "cross_entropy": cross_entropy(probabilities, labels),
    }


def threshold(scores: np.ndarray, labels: np.ndarray, detection: float) -> float:
    """Largest threshold on the target class's probability that detects a share `detection` of it.

    scores (samples,), labels (samples,); a sample is detected where its score is at least the
    threshold. Set it on validation samples, never on the samples that it is then tested on.
    """
    wanted = scores[labels == LOOKED_FOR]
    return _weighted_threshold(wanted, np.ones(len(wanted)), detection)


def measurable(labels: np.ndarray, detection: float) -> bool:
    """Whether validation samples can set a threshold for `detection`.

    At least `FEWEST_MISSED` samples of the target class must be below it.

    labels (samples,) of the validation samples. With fewer, a handful of samples would decide the
    threshold.
    """
    return (1 - detection) * np.sum(labels == LOOKED_FOR) >= FEWEST_MISSED - 1e-9


def _weighted_threshold(scores: np.ndarray, weights: np.ndarray, detection: float) -> float:
    """Return `threshold` of scores (n,), where the i-th score counts weights[i] times."""
    order = np.argsort(-scores, kind="stable")
    reached = np.cumsum(weights[order])
    # The subtrahend keeps the rounding of a product that is whole from asking for one more score.
    needed = detection * reached[-1] - 1e-9
    return float(scores[order][np.searchsorted(reached, needed)])


def alarm_intervals(
    validation: list["AlarmPart"],
    test: list["AlarmPart"],
    detection: float,
    whole_subtypes: bool,
    generator: np.random.Generator,
    classes: int,
    repeats: int = REPEATS,
) -> np.ndarray:
    """Bounds (classes, 2) of the 95 % intervals of detection and of the false alarm rates.

    The first row is the detection of the first class, the others are the false alarms of each other
    class.

    validation, test: one part for each training seed, samples in the same order. Every repeat draws
    seeds, motion models of both parts and, with `whole_subtypes`, subtypes of the test part. It
    sets its thresholds on the drawn validation samples.
    Source: `lowalt.recognition.intervals.strict_difference`.
    """

    def sample_weights(part: AlarmPart, whole: bool) -> np.ndarray:
        """Return how often each repeat draws each sample, (repeats, samples), by its model."""
        _, first, model = np.unique(part.motion, return_index=True, return_inverse=True)
        return model_weights(part.subtypes[first], whole, repeats, generator)[:, model]

    judged = sample_weights(test[0], whole_subtypes)
    set_on = sample_weights(validation[0], False)
    wanted = validation[0].labels == LOOKED_FOR
    of_class = [test[0].labels == label for label in range(classes)]
    drawn = generator.integers(0, len(test), (repeats, len(test)))
    resampled = np.full((repeats, classes), np.nan)
    for repeat in range(repeats):
        rates = []
        for seed in drawn[repeat]:
            level = _weighted_threshold(
                validation[seed].scores[wanted], set_on[repeat, wanted], detection
            )
            called = test[seed].scores >= level
            of_seed = np.full(classes, np.nan)
            for label, members in enumerate(of_class):
                weights = judged[repeat, members]
                if weights.sum():
                    of_seed[label] = weights @ called[members] / weights.sum()
            rates.append(of_seed)
        resampled[repeat] = np.mean(rates, axis=0)
    kept = resampled[~np.isnan(resampled).any(1)]
    if not len(kept):
        return np.full((classes, 2), np.nan)
    return np.quantile(kept, [0.025, 0.975], axis=0).T


def alarm_rates(
    scores: np.ndarray, labels: np.ndarray, level: float, classes: int
) -> tuple[float, np.ndarray]:
    """Detection rate at a threshold, and false alarm rates (classes - 1,) of the other classes."""
    called = scores >= level
    alarms = np.full(classes - 1, np.nan)
    for other in range(1, classes):
        members = labels == other
        if members.any():
            alarms[other - 1] = called[members].mean()
    return float(called[labels == LOOKED_FOR].mean()), alarms


def pareto(cost: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return which points (n,) are on the Pareto front.

    A point is on it if no other point has cost <= its cost and value >= its value with one of them
    strict. Points whose cost or value is NaN are never on the front.
    """
    cheaper = cost[:, None] <= cost
    better = value[:, None] >= value
    strictly = (cost[:, None] < cost) | (value[:, None] > value)
    return ~(cheaper & better & strictly).any(0) & ~np.isnan(cost) & ~np.isnan(value)


def macro_f1(counts: np.ndarray) -> np.ndarray:
    """Return the macro F1 (...,) of confusion counts (..., classes, classes), true class by row.

    Classes without samples are left out of the mean. F1 of a class is 2 TP / (2 TP + FP + FN).
    Source: van Rijsbergen, Information Retrieval, 1979, ch. 7; Sokolova and Lapalme, Inf. Process.
    Manag. 45, 2009.
    """
    counts = np.asarray(counts, dtype=float)
    hits = np.diagonal(counts, axis1=-2, axis2=-1)
    true = counts.sum(-1)
    guessed = counts.sum(-2)
    present = true > 0
    f1 = np.where(present, 2 * hits / np.where(present, true + guessed, 1), 0)
    return f1.sum(-1) / np.maximum(present.sum(-1), 1)


def _counts(
    predictions: Predictions, chosen: np.ndarray, model: np.ndarray, models: int, classes: int
) -> np.ndarray:
    """Confusion counts (models, classes, classes) of the samples `chosen`.

    model (samples,): the number of each sample's motion model.
    """
    cell = (model * classes + predictions.label) * classes + predictions.guesses
    return np.bincount(cell[chosen], minlength=models * classes**2).reshape(
        models, classes, classes
    )


def f1_by_snr(
    parts: list[Predictions],
    classes: int,
    whole_subtypes: bool,
    generator: np.random.Generator,
) -> dict[float | str, Interval]:
    """Return macro F1 with its 95 % interval at each SNR, and as "avg" the mean over the SNRs.

    parts: the same samples as every training seed predicted them; F1 is the mean over the seeds.
    Every repeat draws seeds, subtypes where `whole_subtypes`, and motion models, the same for all
    SNRs.
    Source: `lowalt.recognition.statistics.alarm_intervals`, which draws likewise.
    """
    test = parts[0]
    _, first, model = np.unique(test.motion, return_index=True, return_inverse=True)
    weights = model_weights(test.subtype[first], whole_subtypes, REPEATS, generator)
    drawn = generator.integers(0, len(parts), (REPEATS, len(parts)))
    values: dict[float | str, float] = {}
    resampled: dict[float | str, np.ndarray] = {}
    for snr in np.unique(test.snr_db).tolist():
        counts = [
            _counts(predictions, test.snr_db == snr, model, len(first), classes)
            for predictions in parts
        ]
        values[snr] = float(np.mean([macro_f1(seed.sum(0)) for seed in counts]))
        of_seed = np.stack([macro_f1(np.tensordot(weights, seed, 1)) for seed in counts], axis=1)
        resampled[snr] = np.take_along_axis(of_seed, drawn, axis=1).mean(1)
    values["avg"] = float(np.mean(list(values.values())))
    resampled["avg"] = np.mean(list(resampled.values()), axis=0)
    bounds = {snr: np.quantile(means, [0.025, 0.975]) for snr, means in resampled.items()}
    return {snr: Interval(float(value), *map(float, bounds[snr])) for snr, value in values.items()}
