"""Rows of the tables on thresholds and confidence of a scheme: false alarms and calibration."""

from collections.abc import Iterable

import numpy as np

from lowalt.numerics.streams import stream
from lowalt.recognition.evaluated import Evaluated, whole_subtypes
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.statistics import (
    LOOKED_FOR,
    AlarmPart,
    alarm_intervals,
    alarm_rates,
    calibration,
    measurable,
    threshold,
)

DETECTIONS = (0.9, 0.95, 0.99)
"""Shares of detected samples of the first class for which a threshold is set."""


def percent(share: float) -> str:
    """Return a share in percent, with four digits."""
    return f"{100 * share:.4f}"


def _alarm_part(predictions: Predictions) -> AlarmPart:
    """The data of predictions from which false alarms are counted."""
    return AlarmPart(
        predictions.probabilities[:, LOOKED_FOR], predictions.label, predictions.motion, predictions.subtype
    )


def alarm_rows(runs: list[Evaluated], seed: int) -> Iterable[list]:
    """Yield rows [asked, threshold, rate, low, high, ...]: detection of the first class, then false alarms of others.

    In percent, with 95 % intervals; thresholds come from validation samples. A detection that too few validation
    samples can set a threshold for is "not measurable".
    """
    classes = len(runs[0].classes)
    validations = [_alarm_part(run.part("validation")) for run in runs]
    tests = [_alarm_part(run.test) for run in runs]
    for asked in DETECTIONS if all((part.labels == LOOKED_FOR).any() for part in validations) else ():
        if not measurable(validations[0].labels, asked):
            yield [percent(asked), *["not measurable"] * (1 + 3 * classes)]
            continue
        levels = [threshold(part.scores, part.labels, asked) for part in validations]
        rates = []
        for part, level in zip(tests, levels, strict=True):
            detected, alarms = alarm_rates(part.scores, part.labels, level, classes)
            rates.append([detected, *alarms])
        generator = stream(seed, "alarms", runs[0].protocol, runs[0].scheme, asked)
        bounds = alarm_intervals(validations, tests, asked, whole_subtypes(runs), generator, classes)
        cells = [[percent(rate), *map(percent, pair)] for rate, pair in zip(np.mean(rates, 0), bounds, strict=True)]
        yield [percent(asked), repr(float(np.mean(levels))), *(cell for three in cells for cell in three)]


def calibration_rows(runs: list[Evaluated]) -> Iterable[list]:
    """Yield rows [calibration_error, brier, cross_entropy] on the test part."""
    of_runs = [list(calibration(run.test.probabilities, run.test.label).values()) for run in runs]
    yield [f"{value:.6f}" for value in np.mean(of_runs, axis=0)]
