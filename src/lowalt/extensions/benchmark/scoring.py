"""Scores of a submission: headline number, macro F1, paired differences to the kept baselines.

Every headline number is a weighted mean of one value per motion model. For accuracy the value is
the model's share of correct samples. AUROC is the mean, over both strata (trained classes, held-out
class), of the share of the other stratum that a sample is ranked correctly against; the value is 2
V - AUROC, with V the model's mean share, so that the spread of the weighted mean is that of AUROC
to first order. Intervals resample training seeds, motion models and, where results should hold for
other subtypes, whole subtypes (`intervals.strict_difference`).
Source: DeLong, DeLong and Clarke-Pearson, Biometrics 44, 1988 (components of AUROC).
"""

from typing import NamedTuple

import numpy as np

from lowalt.extensions.benchmark.baseline_table import by_subtype
from lowalt.extensions.benchmark.benchmark_tracks import UNKNOWN, Track
from lowalt.extensions.benchmark.definition import MAIN, named_seed
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions
from lowalt.recognition.intervals import Interval, model_shares, strict_difference
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.samples import Facts
from lowalt.recognition.statistics import accuracy_by, f1_by_snr

ACCEPTED = 0.95
"""Share of the samples of trained classes that the track open-set accepts."""


class Values(NamedTuple):
    """One value per motion model and training seed, (seeds, models), with weights and subtypes.

    weight, subtypes: (models,), of each motion model in the order of their names.
    """

    values: np.ndarray
    weight: np.ndarray
    subtypes: np.ndarray


def _above(scores: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Share (n,) of `others` (m,) that lie below each of `scores` (n,); equal ones count half."""
    ordered = np.sort(others)
    below = np.searchsorted(ordered, scores, "left")
    below_or_equal = np.searchsorted(ordered, scores, "right")
    return (below + below_or_equal) / (2 * len(ordered))


def ranked(scores: np.ndarray, held_out: np.ndarray) -> tuple[float, np.ndarray]:
    """Return AUROC, and how much of the other stratum each sample is ranked correctly against.

    The latter are shares (n,).
    scores (n,): how strongly a sample is held to be of no trained class; held_out (n,) bool:
    whether it is.
    """
    share = np.empty(len(scores))
    share[held_out] = _above(scores[held_out], scores[~held_out])
    share[~held_out] = 1 - _above(scores[~held_out], scores[held_out])
    return float(share[held_out].mean()), share


def tested(track: Track, facts: Facts, probabilities: np.ndarray) -> Predictions:
    """Return the predictions of a track's test samples."""
    return predictions.from_facts(facts, track.stations, probabilities)


def models_of(
    track: Track, samples: Facts | Predictions, classes: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return weight and subtype (models,) of the motion models of test samples, by their names.

    The weight is the model's number of samples. For AUROC it is scaled so that the held-out class
    and the trained ones weigh the same.
    """
    _, first, count = np.unique(samples.motion, return_index=True, return_counts=True)
    if track.headline == "accuracy":
        return count.astype(float), samples.subtype[first]
    held_out = samples.label[first] == classes.index(UNKNOWN)
    totals = np.where(held_out, count[held_out].sum(), count[~held_out].sum())
    return len(samples) / 2 * count / totals, samples.subtype[first]


def values_of(track: Track, parts: list[Predictions], classes: tuple[str, ...]) -> Values:
    """Return the values of which the headline number is the weighted mean.

    parts: the predictions of each training seed.
    """
    if track.headline == "accuracy":
        shares = [part.correct for part in parts]
    else:
        label = classes.index(UNKNOWN)
        found = [ranked(part.probabilities[:, label], part.label == label) for part in parts]
        shares = [2 * share - area for area, share in found]
    _, _, values = model_shares(parts[0].motion, shares)
    weight, subtypes = models_of(track, parts[0], classes)
    return Values(values, weight, subtypes)


def difference(track: Track, first: Values, second: np.ndarray) -> Interval:
    """Return the mean of first - second in percent with its 95 % interval.

    second: values (seeds, models).
    """
    generator = stream(named_seed(MAIN), "benchmark", track.name)
    found = strict_difference(
        first.values, second, first.weight, first.subtypes, track.whole, generator
    )
    return Interval(*(100 * value for value in found))


def headline(track: Track, found: Values) -> Interval:
    """Return the headline number in percent with its 95 % interval.

    It is the difference to a method that gets nothing right, so both intervals are computed alike;
    this one ends at 0 and 100, which the headline number cannot pass.
    """
    value, low, high = difference(track, found, np.zeros((1, found.values.shape[1])))
    return Interval(value, max(low, 0.0), min(high, 100.0))


def rejected_share(part: Predictions, label: int) -> float:
    """Return the share of the held-out class that is rejected.

    The threshold accepts the share ACCEPTED of the samples of trained classes.
    label: that of the held-out class.
    """
    scores = part.probabilities[:, label]
    held_out = part.label == label
    return float(np.mean(scores[held_out] > np.quantile(scores[~held_out], ACCEPTED)))


def scores(track: Track, answers: list[np.ndarray], baselines: dict[str, np.ndarray]) -> dict:
    """Return all scores of a method.

    answers: probabilities (samples, classes) of each training seed.
    baselines: kept values (seeds, models) by the baseline's name.
    """
    facts, classes = track.samples()
    parts = [tested(track, facts, np.asarray(of_seed, float)) for of_seed in answers]
    found = values_of(track, parts, classes)
    generator = stream(named_seed(MAIN), "benchmark-f1", track.name)
    f1 = f1_by_snr(parts, len(classes), track.whole, generator)
    right = np.mean([part.correct for part in parts], axis=0)
    by_snr = {}
    for snr, (share, _) in accuracy_by(facts.snr_db, right).items():
        by_snr[f"{snr:g}"] = 100 * share
    by_name = {}
    for subtype, (share, _) in accuracy_by(facts.subtype, right).items():
        by_name[subtype] = 100 * share
    more: dict = {}
    if track.whole:
        more |= by_subtype(found.values, found.weight, found.subtypes)
    if track.headline == "AUROC":
        label = classes.index(UNKNOWN)
        rejected = [rejected_share(part, label) for part in parts]
        more["rejected_percent"] = 100 * float(np.mean(rejected))
    return {
        "track": track.name,
        "headline": track.headline,
        "samples": len(facts),
        "seeds": len(parts),
        "percent": headline(track, found),
        "accuracy_percent": 100 * float(right.mean()),
        "macro_f1_percent": Interval(*(100 * value for value in f1["avg"])),
        **more,
        "by_snr_percent": by_snr,
        "by_subtype_percent": by_name,
        "differences": {name: difference(track, found, kept) for name, kept in baselines.items()},
    }
