"""Statistics of predictions: exact small cases, laws, coverage of the intervals, an independent
slow reference.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from lowalt.numerics.streams import stream
from lowalt.recognition import intervals, statistics

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import interval_coverage


def test_bootstrap_depends_on_the_generator_alone_and_not_on_names_of_clusters():
    values = stream(2, "values").random(60)
    numbers = np.repeat(np.arange(20), 3)
    names = np.array([f"model {number:03d}" for number in numbers])
    one = intervals.bootstrap(numbers, values, stream(3, "b"), 300)
    assert one == intervals.bootstrap(names, values, stream(3, "b"), 300)
    assert one != intervals.bootstrap(names, values, stream(4, "b"), 300)
    assert one.low <= one.value <= one.high


@pytest.mark.parametrize("level", ["seeds", "subtypes", "models of known subtypes", "all three"])
def test_a_95_percent_interval_holds_the_truth_about_that_often(level):
    """93 to 97 % should hold it, give or take two standard errors of 400 trials, 1.1 % each."""
    share = interval_coverage.held(
        interval_coverage.CASES[level], 400, 200, stream(11, "coverage", level)
    )
    assert 0.93 - 0.022 <= share <= 0.97 + 0.022


def test_a_difference_that_only_the_subtypes_decide_is_not_called_certain():
    """One subtype of five gains a whole point in every model and seed, the others lose a fifth of
    one.
    """
    names = np.repeat(np.arange(5), 40)
    one = np.tile(np.where(names == 0, 1.0, -0.2), (3, 1))
    given = (one, np.zeros_like(one), np.full(200, 6), names)
    plain = intervals.strict_difference(*given, False, stream(1, "draw"))
    strict = intervals.strict_difference(*given, True, stream(1, "draw"))
    assert -0.06 < plain.low < plain.value < plain.high < 0.14
    assert strict.value == plain.value == pytest.approx(0.04)
    assert strict.low < -0.15 and strict.high > 0.4


def test_a_motion_model_brings_one_value_however_many_snrs_it_has():
    motion = np.array(["b", "a", "b", "a", "b"])
    first, count, shares = intervals.model_shares(motion, [np.array([1, 0, 0, 1, 1]), np.ones(5)])
    assert motion[first].tolist() == ["a", "b"] and count.tolist() == [2, 3]
    np.testing.assert_allclose(shares, [[1 / 2, 2 / 3], [1, 1]])


def test_bands_of_confidence_are_fifteen_of_equal_width():
    """0.66 and 0.67 lie on two sides of 10/15, 0.93 and 0.94 of 14/15; a certain guess belongs to
    the last band, with one of 0.95. Too little confidence in one band does not make up for too much
    in the next."""
    top = np.array([0.66, 0.67, 1.0, 0.95])
    probabilities = np.stack([top, 1 - top], 1)
    labels = np.array([1, 0, 1, 0])
    found = statistics.calibration(probabilities, labels)
    assert found["calibration_error"] == pytest.approx((0.66 + 0.33 + 0.95) / 4)
    near = np.array([0.93, 0.94])
    apart = statistics.calibration(np.stack([near, 1 - near], 1), np.array([0, 1]))
    assert apart["calibration_error"] == pytest.approx((0.07 + 0.94) / 2)
    assert found["brier"] == pytest.approx(2 * (0.66**2 + 0.33**2 + 1 + 0.05**2) / 4)


def test_one_seed_and_one_subtype_leave_nothing_to_draw():
    one = stream(1, "one").random((1, 30))
    given = np.zeros_like(one), np.ones(30), np.zeros(30)
    found = intervals.strict_difference(one, *given, True, stream(1, "d"), 50)
    assert found == pytest.approx((one.mean(),) * 3)


def test_a_difference_is_the_first_less_the_second_whatever_their_numbers_of_seeds():
    """All samples alike, so that nothing is left to chance."""
    high = np.full(12, 0.75)
    low = np.full(12, 0.5)
    names = np.repeat(np.arange(4), 3)
    for seeds, others in ((1, 3), (3, 1), (2, 4)):
        given = np.tile(high, (seeds, 1)), np.tile(low, (others, 1)), np.ones(12), names
        for whole in (False, True):
            found = intervals.strict_difference(*given, whole, stream(1, "d"), 50)
            assert found == pytest.approx((0.25, 0.25, 0.25))


@pytest.mark.parametrize("place", [0, 4, 9])
def test_every_cluster_is_drawn_as_often_as_any_other(place):
    """Of ten clusters one is right, so a draw of ten has a binomial number of them: 0 to 3 in 95 %."""
    low, high = stats.binom(10, 0.1).ppf([0.025, 0.975]) / 10
    found = intervals.bootstrap(np.arange(10), np.eye(10)[place], stream(6, "b"))
    assert found == pytest.approx((0.1, low, high)) and (low, high) == (0.0, 0.3)


def test_a_difference_and_a_mean_count_each_motion_model_by_its_samples():
    """Fifty models of nine samples are right and fifty of one are wrong, each a subtype of its own."""
    count = np.repeat([9, 1], 50)
    one = np.repeat([1.0, 0.0], 50)
    given = one[None], np.zeros((1, 100)), count, np.arange(100)
    found = [
        intervals.strict_difference(*given, whole, stream(1, "d"), 400) for whole in (False, True)
    ]
    found.append(
        intervals.bootstrap(
            np.repeat(np.arange(100), count), np.repeat(one, count), stream(1, "c"), 400
        )
    )
    for value, low, high in found:
        assert value == pytest.approx(0.9) and 0.8 < low < 0.9 < high < 0.95


def test_counts_have_rows_of_classes_without_samples_and_an_impossible_label_is_finite():
    assert statistics.confusion(np.array([1]), np.array([0]), 3).tolist() == [
        [0, 0, 0],
        [1, 0, 0],
        [0, 0, 0],
    ]
    assert statistics.cross_entropy(np.array([[1.0, 0.0]]), np.array([1])) == pytest.approx(
        1022 * math.log(2)
    )
