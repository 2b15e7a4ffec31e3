"""Macro F1: the mean over the classes of the harmonic mean of precision and recall, with its interval. NumPy only.

Accuracy counts samples, so a class of many samples decides it; macro F1 counts every class alike.
"""

import numpy as np

from lowalt.recognition.intervals import Interval, model_weights
from lowalt.recognition.predictions import Predictions


def macro_f1(counts: np.ndarray) -> np.ndarray:
    """Return the macro F1 (...,) of confusion counts (..., classes, classes), true class by row.

    Classes without samples are left out of the mean. F1 of a class is 2 TP / (2 TP + FP + FN).
    Source: van Rijsbergen, Information Retrieval, 1979, ch. 7; Sokolova and Lapalme, Inf. Process. Manag. 45, 2009.
    """
    counts = np.asarray(counts, dtype=float)
    hits, true, guessed = np.diagonal(counts, axis1=-2, axis2=-1), counts.sum(-1), counts.sum(-2)
    present = true > 0
    f1 = np.where(present, 2 * hits / np.where(present, true + guessed, 1), 0)
    return f1.sum(-1) / np.maximum(present.sum(-1), 1)


def _counts(predictions: Predictions, chosen: np.ndarray, place: np.ndarray, models: int, classes: int) -> np.ndarray:
    """Confusion counts (models, classes, classes) of the samples `chosen`; place (samples,): their motion models."""
    cell = (place * classes + predictions.label) * classes + predictions.guesses
    return np.bincount(cell[chosen], minlength=models * classes**2).reshape(models, classes, classes)


def f1_by_snr(
    parts: list[Predictions], classes: int, whole_subtypes: bool, generator: np.random.Generator, repeats: int = 400
) -> dict[float | str, Interval]:
    """Return macro F1 with its 95 % interval at each SNR, and as "avg" the mean over the SNRs.

    parts: the same samples as every training seed predicted them; F1 is the mean over the seeds. Every repeat draws
    seeds, subtypes where `whole_subtypes`, and motion models, the same for all SNRs.
    Source: `lowalt.recognition.statistics.alarm_intervals`, which draws likewise.
    """
    test = parts[0]
    _, first, place = np.unique(test.motion, return_index=True, return_inverse=True)
    weights = model_weights(test.subtype[first], whole_subtypes, repeats, generator)
    drawn = generator.integers(0, len(parts), (repeats, len(parts)))
    values, resampled = {}, {}
    for snr in np.unique(test.snr_db).tolist():
        counts = [_counts(predictions, test.snr_db == snr, place, len(first), classes) for predictions in parts]
        values[snr] = float(np.mean([macro_f1(seed.sum(0)) for seed in counts]))
        of_seed = np.stack([macro_f1(np.tensordot(weights, seed, 1)) for seed in counts], axis=1)
        resampled[snr] = np.take_along_axis(of_seed, drawn, axis=1).mean(1)
    values["avg"], resampled["avg"] = np.mean(list(values.values())), np.mean(list(resampled.values()), axis=0)
    bounds = {snr: np.quantile(means, [0.025, 0.975]) for snr, means in resampled.items()}
    return {snr: Interval(float(value), *map(float, bounds[snr])) for snr, value in values.items()}
