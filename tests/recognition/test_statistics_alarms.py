"""Thresholds, false alarms and their intervals: exact small cases, laws, draws that decide."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.numerics.streams import stream
from lowalt.recognition import statistics


@settings(deadline=None)
@given(st.floats(0.05, 1.0), st.integers(1, 60))
def test_threshold_is_the_largest_that_detects_enough(detection, uavs):
    rng = stream(uavs, "threshold")
    scores = rng.integers(0, 8, uavs + 30) / 8
    labels = np.r_[np.zeros(uavs, int), rng.integers(1, 4, 30)]
    level = statistics.threshold(scores, labels, detection)
    assert (scores[labels == 0] >= level).mean() >= detection - 1e-12
    higher = np.unique(scores[scores > level])
    if len(higher):
        assert (scores[labels == 0] >= higher[0]).mean() < detection


def test_alarm_rates_are_shares_of_each_class():
    scores = np.array([0.9, 0.2, 0.8, 0.1, 0.7, 0.7, 0.0])
    labels = np.array([0, 0, 1, 1, 2, 2, 3])
    detected, alarms = statistics.alarm_rates(scores, labels, 0.7, 4)
    assert detected == 0.5
    assert alarms.tolist() == [0.5, 1.0, 0.0]
    # No sample of the fifth class.
    assert np.isnan(statistics.alarm_rates(scores, labels, 0.7, 5)[1]).tolist() == [
        False,
        False,
        False,
        True,
    ]


def alarm_part(rng, models, name, samples=3):
    """UAVs of score 0.5 to 1, birds of 0 to 0.6, in turn; vehicles and pedestrians of 0."""
    label = np.repeat(np.arange(models) % 4, samples)
    score = np.select(
        [label == 0, label == 1], [rng.uniform(0.5, 1, len(label)), rng.uniform(0, 0.6, len(label))]
    )
    motion = np.repeat([f"{name}{number}" for number in range(models)], samples)
    return statistics.AlarmPart(score, label, motion, label)


def test_alarm_intervals_hold_the_rates_and_narrow_with_the_samples():
    widths = []
    for models in (80, 800):
        parts = [
            [alarm_part(stream(seed, name), models, name)] for seed, name in ((1, "v"), (2, "t"))
        ]
        level = statistics.threshold(parts[0][0].scores, parts[0][0].labels, 0.9)
        detected, alarms = statistics.alarm_rates(parts[1][0].scores, parts[1][0].labels, level, 4)
        bounds = statistics.alarm_intervals(*parts, 0.9, False, stream(3, "a"), 4, 200)
        for rate, (low, high) in zip([detected, *alarms], bounds, strict=True):
            assert low <= rate <= high
        assert bounds[2:].tolist() == [[0, 0], [0, 0]]
        widths.append(bounds[1, 1] - bounds[1, 0])
    assert 2 < widths[0] / widths[1] < 5


def test_the_95_percent_interval_of_a_false_alarm_rate_is_196_standard_errors_wide_on_either_side():
    """The threshold is certain and every second of 400 birds exceeds it, so the rate errs by sqrt(1
    / 4 / 400).
    """
    label = np.repeat([0, 1], 400)
    names = np.array([f"m{number}" for number in range(800)])
    validation = statistics.AlarmPart(np.full(800, 0.5), label, names, label)
    test = statistics.AlarmPart(np.where(np.arange(800) % 2, 0.9, 0.1), label, names, label)
    _, (low, high) = statistics.alarm_intervals(
        [validation], [test], 0.9, False, stream(3, "a"), 2, 2000
    )
    assert (high - low) / 2 == pytest.approx(1.96 * np.sqrt(0.25 / 400), rel=0.08)


def two_subtypes(first, second):
    """Forty UAVs of two subtypes with these scores and a bird of score 0, each a motion model of
    its own.
    """
    score = np.repeat([first, second, 0.0], [20, 20, 1])
    names = np.array([f"m{number}" for number in range(41)])
    return statistics.AlarmPart(
        score, np.repeat([0, 1], [40, 1]), names, np.repeat([0, 1, 2], [20, 20, 1])
    )


def test_alarm_intervals_draw_seeds_and_where_asked_subtypes_of_the_test_part():
    good = two_subtypes(0.9, 0.9)
    bad = two_subtypes(0.3, 0.3)
    halves = two_subtypes(0.9, 0.3)

    def bounds(validation, test, whole, classes=1, detection=0.9):
        return statistics.alarm_intervals(
            validation, test, detection, whole, stream(1, "a"), classes, 300
        ).tolist()

    # Scores of 0.9 are set on, so those of 0.3 are missed. Half the models are found, and which
    # half is up to chance.
    ((low, high),) = bounds([good], [halves], False)
    assert 0.3 < low < 0.5 < high < 0.7
    # Whole subtypes are found or missed; so are whole seeds.
    assert bounds([good], [halves], True) == [[0.0, 1.0]]
    assert bounds([good, good], [good, bad], False) == [[0.0, 1.0]]
    # Subtypes of the validation part are never drawn: a tenth of it stays below the threshold, so
    # 0.5 is found.
    assert bounds([two_subtypes(0.9, 0.3)], [two_subtypes(0.5, 0.5)], True) == [[1.0, 1.0]]
    # Whether more than half of the drawn validation samples have the higher score is up to chance.
    assert bounds([halves], [two_subtypes(0.5, 0.5)], False, detection=0.5) == [[0.0, 1.0]]
    # A class without samples has no rates.
    assert np.isnan(bounds([good], [halves], False, 3)).all()


@pytest.mark.parametrize(
    ("uavs", "detection", "expected"), [(100, 0.9, True), (99, 0.9, False), (300, 0.99, False)]
)
def test_a_detection_is_measurable_only_where_ten_uavs_may_lie_below_the_threshold(
    uavs, detection, expected
):
    assert (
        statistics.measurable(np.r_[np.zeros(uavs, int), np.ones(500, int)], detection) == expected
    )
