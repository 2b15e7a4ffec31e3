"""Intervals of means and differences by resampling training seeds, subtypes and motion models.

Motion models, not samples, are the independent units: all SNRs of a motion model share its echo, so
intervals resample whole motion models (cluster bootstrap; Field and Welsh, J. R. Stat. Soc. B 69,
2007). Intervals of differences between schemes also resample training seeds and, for unseen
subtypes, the subtypes (`strict_difference`).
"""

from typing import NamedTuple

import numpy as np


class Interval(NamedTuple):
    """A value with the bounds of its 95 % interval."""

    value: float
    low: float
    high: float


def bootstrap(
    clusters: np.ndarray, values: np.ndarray, generator: np.random.Generator, repeats: int = 4000
) -> Interval:
    """Mean of `values` (samples,) with the percentile interval from resampling whole clusters.

    clusters: (samples,).
    Source: Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13; clusters as in the
    module's docstring.
    """
    _, cluster = np.unique(clusters, return_inverse=True)
    count = np.bincount(cluster).astype(float)
    total = np.bincount(cluster, weights=values)
    means = np.empty(repeats)
    for repeat in range(repeats):
        chosen = generator.integers(0, len(count), len(count))
        means[repeat] = total[chosen].sum() / count[chosen].sum()
    low, high = np.quantile(means, [0.025, 0.975])
    return Interval(float(np.mean(values)), float(low), float(high))


def model_shares(
    motion: np.ndarray, correct: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the first sample, number of samples and share of correct ones of each motion model.

    The first two are (models,); the share is (seeds, models).
    motion (samples,): name of the motion model; correct: (samples,) of every training seed.
    """
    _, first, model, count = np.unique(
        motion, return_index=True, return_inverse=True, return_counts=True
    )
    sums = np.array([np.bincount(model, weights=row) for row in correct])
    return first, count, sums / count


def _seed_weights(seeds: int, repeats: int, generator: np.random.Generator) -> np.ndarray:
    """Return how often each seed is drawn, (repeats, seeds), as a share of the draws.

    Deviations from 1 / seeds are multiplied by `_stretch`. Two schemes with `seeds` seeds each have
    2 (seeds - 1) degrees of freedom.
    """
    if seeds == 1:
        return np.ones((repeats, 1))
    shares = generator.multinomial(seeds, np.full(seeds, 1 / seeds), repeats) / seeds
    return 1 / seeds + (shares - 1 / seeds) * _stretch(seeds, 2 * (seeds - 1))


def _stretch(count: int, freedom: int) -> float:
    """Return by what factor an interval from resampling `count` values is too narrow.

    Resampling n values gives (n - 1) / n of the variance of their mean. A spread that is estimated
    with `freedom` degrees of freedom needs Student's quantile instead of the normal one. Source:
    Davison and Hinkley, Bootstrap Methods and their Application, 1997, section 2; Hesterberg, What
    Teachers Should Know about the Bootstrap, 2015.
    """
    # Imported late and not from scipy.stats (same values, one second), because the Snakefile
    # imports this module.
    from scipy.special import ndtri, stdtrit

    return float(np.sqrt(count / (count - 1)) * stdtrit(freedom, 0.975) / ndtri(0.975))


def _subtype_weights(
    subtypes: np.ndarray, repeats: int, generator: np.random.Generator
) -> np.ndarray:
    """Weight of each motion model, (repeats, models), when whole subtypes are drawn.

    Models are not resampled within a drawn subtype, because the spread between subtypes includes
    theirs. Deviations are stretched for few subtypes, so a weight may be slightly negative. Source:
    Davison and Hinkley 1997, section 3.8.
    """
    names, subtype = np.unique(subtypes, return_inverse=True)
    if len(names) == 1:
        return np.ones((repeats, len(subtypes)))
    drawn = generator.multinomial(len(names), np.full(len(names), 1 / len(names)), repeats)
    return (1 + (drawn - 1) * _stretch(len(names), len(names) - 1))[:, subtype]


def model_weights(
    subtypes: np.ndarray, whole: bool, repeats: int, generator: np.random.Generator
) -> np.ndarray:
    """Return how often each motion model is drawn, (repeats, models).

    subtypes (models,): the subtype each motion model belongs to; whole: draw subtypes first, then
    models within each.
    """
    if not whole:
        return generator.multinomial(
            len(subtypes), np.full(len(subtypes), 1 / len(subtypes)), repeats
        ).astype(float)
    names, subtype = np.unique(subtypes, return_inverse=True)
    drawn = generator.multinomial(len(names), np.full(len(names), 1 / len(names)), repeats)
    weights = np.zeros((repeats, len(subtypes)))
    for number in range(len(names)):
        members = np.flatnonzero(subtype == number)
        # For a subtype drawn twice, its motion models are drawn twice, independently.
        weights[:, members] = generator.multinomial(
            drawn[:, number] * len(members), np.full(len(members), 1 / len(members))
        )
    return weights


def strict_difference(
    first: np.ndarray,
    second: np.ndarray,
    count: np.ndarray,
    subtypes: np.ndarray,
    whole_subtypes: bool,
    generator: np.random.Generator,
    repeats: int = 4000,
) -> Interval:
    """Mean of first - second over seeds and samples, with its 95 % interval.

    The interval resamples seeds, subtypes and models.

    first, second (seeds, models): share of correct samples of each motion model, a row per training
    seed; the seeds of both are drawn independently, because equal seeds give two schemes different
    numbers. count (models,): samples of each model; subtypes (models,): the subtype each belongs
    to. whole_subtypes: draw whole subtypes instead of motion models, for results that should
    generalise to other subtypes. With one seed the interval is valid only for these trained
    networks. The coverage of these intervals is simulated in `benchmarks/interval_coverage.py`.
    Source: as `_stretch`.
    """
    if whole_subtypes:
        weights = _subtype_weights(subtypes, repeats, generator) * count
    else:
        weights = model_weights(subtypes, False, repeats, generator) * count
    weights /= weights.sum(1, keepdims=True)
    means = [
        ((weights @ shares.T) * _seed_weights(len(shares), repeats, generator)).sum(1)
        for shares in (first, second)
    ]
    low, high = np.quantile(means[0] - means[1], [0.025, 0.975])
    value = np.average(first.mean(0) - second.mean(0), weights=count)
    return Interval(float(value), float(low), float(high))
