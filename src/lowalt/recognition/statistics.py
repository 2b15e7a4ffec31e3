"""Numbers from predictions: accuracy, confusion, intervals, tests, calibration, false alarms. NumPy and SciPy only.

Motion models, not samples, are the independent units: all SNRs of a motion model share its echo, so intervals
resample whole motion models (cluster bootstrap; Field and Welsh, J. R. Stat. Soc. B 69, 2007).
"""

from typing import NamedTuple

import numpy as np

from lowalt.targets.cloud import CATEGORIES

CLASSES = len(CATEGORIES)
UAV = CATEGORIES.index("UAV")


def cross_entropy(probabilities: np.ndarray, labels: np.ndarray) -> float:
    """Mean negative log of the true class's probability; probabilities (samples, classes), labels (samples,)."""
    chosen = probabilities[np.arange(len(labels)), labels]
    return float(-np.log(np.maximum(chosen, np.finfo(float).tiny)).mean())


def accuracy_by(groups: np.ndarray, correct: np.ndarray) -> dict:
    """Share of correct samples and their number in each group, in sorted order: {group: (share, samples)}."""
    names, place = np.unique(groups, return_inverse=True)
    count = np.bincount(place)
    hits = np.bincount(place, weights=correct)
    return {name.item(): (float(h / n), int(n)) for name, h, n in zip(names, hits, count, strict=True)}


def confusion(labels: np.ndarray, guesses: np.ndarray) -> np.ndarray:
    """Counts (4, 4), true class by row, guessed class by column."""
    return np.bincount(labels * CLASSES + guesses, minlength=CLASSES**2).reshape(CLASSES, CLASSES)


class Interval(NamedTuple):
    """A value with the bounds of its 95 % interval."""

    value: float
    low: float
    high: float


def bootstrap(
    clusters: np.ndarray, values: np.ndarray, generator: np.random.Generator, repeats: int = 4000
) -> Interval:
    """Mean of `values` (samples,) with the percentile interval from resampling whole clusters (samples,).

    Source: Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13; clusters as in the module's docstring.
    """
    _, place = np.unique(clusters, return_inverse=True)
    count = np.bincount(place).astype(float)
    total = np.bincount(place, weights=values)
    means = np.empty(repeats)
    for repeat in range(repeats):
        chosen = generator.integers(0, len(count), len(count))
        means[repeat] = total[chosen].sum() / count[chosen].sum()
    low, high = np.quantile(means, [0.025, 0.975])
    return Interval(float(np.mean(values)), float(low), float(high))


def paired_difference(
    clusters: np.ndarray, one: np.ndarray, other: np.ndarray, generator: np.random.Generator
) -> Interval:
    """Mean of one - other, two measures (samples,) of the same samples, with its interval as `bootstrap` gives it."""
    return bootstrap(clusters, np.asarray(one, float) - other, generator)


def mcnemar(first: np.ndarray, second: np.ndarray) -> tuple[int, int, float]:
    """Samples only the first gets right, only the second, and the exact two-sided p value that both are as likely.

    first, second: (samples,) bool. Source: McNemar, Psychometrika 12, 1947, with the exact binomial distribution.
    """
    from scipy.stats import binomtest

    only_first, only_second = int(np.sum(first & ~second)), int(np.sum(second & ~first))
    if only_first + only_second == 0:
        return 0, 0, 1.0
    return only_first, only_second, float(binomtest(only_first, only_first + only_second).pvalue)


def calibration(probabilities: np.ndarray, labels: np.ndarray, bins: int = 15) -> dict[str, float]:
    """Expected calibration error (equal-width bins of confidence), Brier score and cross entropy.

    Source: Guo et al., On calibration of modern neural networks, 2017; Brier 1950 (sum over the classes).
    """
    confidence, guesses = probabilities.max(1), probabilities.argmax(1)
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    gap = np.bincount(place, weights=confidence - (guesses == labels), minlength=bins)
    truth = np.eye(probabilities.shape[1])[labels]
    return {
        "calibration_error": float(np.abs(gap).sum() / len(labels)),
        "brier": float(((probabilities - truth) ** 2).sum(1).mean()),
        "cross_entropy": cross_entropy(probabilities, labels),
    }


def reliability(probabilities: np.ndarray, labels: np.ndarray, bins: int = 15) -> list[tuple]:
    """Return (from, to, mean confidence, accuracy, samples) of each equal-width bin of confidence that has samples.

    Source: Guo et al. 2017, as `calibration`, whose error is the mean gap of these bins weighted by their samples.
    """
    confidence, correct = probabilities.max(1), probabilities.argmax(1) == labels
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    return [
        (index / bins, (index + 1) / bins, float(confidence[place == index].mean()),
         float(correct[place == index].mean()), int((place == index).sum()))
        for index in np.unique(place).tolist()
    ]  # fmt: skip


def threshold(scores: np.ndarray, labels: np.ndarray, detection: float) -> float:
    """Largest threshold on the UAV probability at which at least `detection` of the UAVs are called UAV.

    scores (samples,), labels (samples,); a sample is called UAV where its score is at least the threshold. To be set on
    validation samples, never on those it is then judged by.
    """
    uavs = np.sort(scores[labels == UAV])[::-1]
    needed = int(np.ceil(detection * len(uavs) - 1e-9))
    return float(uavs[max(needed, 1) - 1])


def alarm_rates(scores: np.ndarray, labels: np.ndarray, level: float) -> tuple[float, np.ndarray]:
    """UAV detection rate at a threshold, and the false alarm rates (3,) of birds, vehicles and pedestrians."""
    called = scores >= level
    return float(called[labels == UAV].mean()), np.array(
        [called[labels == other].mean() if (labels == other).any() else np.nan for other in range(1, CLASSES)]
    )


def pareto(cost: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Which points (n,) no other beats: none costs at most as much and is worth at least as much, one of them strictly.

    Points whose cost or value is NaN are never on the front.
    """
    cheaper, better = cost[:, None] <= cost, value[:, None] >= value
    strictly = (cost[:, None] < cost) | (value[:, None] > value)
    return ~(cheaper & better & strictly).any(0) & ~np.isnan(cost) & ~np.isnan(value)
