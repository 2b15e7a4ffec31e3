"""Statistics of predictions: exact small cases, laws, coverage of the intervals, an independent slow reference."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.common.streams import stream
from lowalt.recognition import statistics


def test_accuracy_and_confusion_count_what_a_loop_counts():
    rng = stream(1, "test")
    labels, guesses, groups = (rng.integers(0, n, 200) for n in (4, 4, 7))
    counts = np.zeros((4, 4), dtype=int)
    for true, guess in zip(labels, guesses, strict=True):
        counts[true, guess] += 1
    assert (statistics.confusion(labels, guesses) == counts).all()
    for group, (share, number) in statistics.accuracy_by(groups, labels == guesses).items():
        chosen = [a == b for a, b, g in zip(labels, guesses, groups, strict=True) if g == group]
        assert number == len(chosen)
        assert share == pytest.approx(sum(chosen) / len(chosen), abs=1e-15)


def test_bootstrap_interval_covers_the_truth_of_clustered_samples_and_a_naive_one_would_not():
    # Each cluster of 6 samples is right or wrong as a whole: the extreme of SNRs sharing one echo.
    inside, naive = 0, 0
    for trial in range(200):
        rng = stream(trial, "coverage")
        values = np.repeat(rng.random(80) < 0.8, 6).astype(float)
        clusters = np.repeat(np.arange(80), 6)
        _, low, high = statistics.bootstrap(clusters, values, rng, repeats=400)
        inside += low <= 0.8 <= high
        half = 1.96 * values.std() / math.sqrt(len(values))
        naive += abs(values.mean() - 0.8) <= half
    assert 0.88 <= inside / 200 <= 1
    assert naive / 200 < 0.75


def test_bootstrap_depends_on_the_generator_alone_and_not_on_names_of_clusters():
    values = stream(2, "values").random(60)
    numbers = np.repeat(np.arange(20), 3)
    names = np.array([f"model {number:03d}" for number in numbers])
    one = statistics.bootstrap(numbers, values, stream(3, "b"), 300)
    assert one == statistics.bootstrap(names, values, stream(3, "b"), 300)
    assert one != statistics.bootstrap(names, values, stream(4, "b"), 300)
    assert one.low <= one.value <= one.high


def test_a_constant_difference_has_an_interval_of_no_width():
    interval = statistics.bootstrap(np.arange(10), np.full(10, 0.25), stream(5, "b"), 50)
    assert interval == (0.25, 0.25, 0.25)


@settings(deadline=None)
@given(st.integers(0, 12), st.integers(0, 12))
def test_mcnemar_is_the_two_sided_sign_test_on_discordant_samples(only_first, only_second):
    first = np.array([True] * only_first + [False] * only_second + [True, False])
    second = np.array([False] * only_first + [True] * only_second + [True, False])
    found = statistics.mcnemar(first, second)
    total = only_first + only_second
    tail = sum(math.comb(total, k) for k in range(min(only_first, only_second) + 1)) / 2**total
    assert found[:2] == (only_first, only_second)
    assert found[2] == pytest.approx(min(1.0, 2 * tail) if only_first != only_second else 1.0, rel=1e-9)


def test_calibration_of_a_perfectly_calibrated_and_of_an_overconfident_model():
    rng = stream(6, "calibration")
    confidence = rng.uniform(0.4, 1.0, 200_000)
    probabilities = np.stack([confidence, *[(1 - confidence) / 3] * 3], axis=1)
    right = rng.random(len(confidence)) < confidence
    labels = np.where(right, 0, 1)
    assert statistics.calibration(probabilities, labels)["calibration_error"] < 0.01
    sure = np.zeros_like(probabilities)
    sure[:, 0] = 1
    found = statistics.calibration(sure, labels)
    assert found["calibration_error"] == pytest.approx(1 - right.mean(), abs=1e-12)
    assert found["brier"] == pytest.approx(2 * (1 - right.mean()), abs=1e-12)


def test_cross_entropy_of_a_uniform_guess_is_log_four():
    assert statistics.cross_entropy(np.full((7, 4), 0.25), np.arange(7) % 4) == pytest.approx(math.log(4))


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
    detected, alarms = statistics.alarm_rates(scores, labels, 0.7)
    assert detected == 0.5
    assert alarms.tolist() == [0.5, 1.0, 0.0]
