"""Scores and measures of unknown windows: the area against a direct count, alarms exact by construction."""

import numpy as np
import pytest
import rejection

from lowalt.numerics.streams import stream

GENERATOR = stream(5, "unknown", "test")


def test_the_area_counts_pairs_and_ties_as_half():
    known, unknown = (GENERATOR.integers(low, low + 12, count).astype(float) for low, count in ((3, 60), (0, 45)))
    weights = GENERATOR.integers(0, 4, 60), GENERATOR.integers(0, 4, 45)
    pairs = (known[:, None] > unknown) + 0.5 * (known[:, None] == unknown)
    every = np.ones(60), np.ones(45)
    assert rejection.auroc(known, unknown, *every) == pytest.approx(pairs.mean(), abs=1e-14)
    direct = np.average(np.average(pairs, axis=1, weights=weights[1]), weights=weights[0])
    assert rejection.auroc(known, unknown, *weights) == pytest.approx(direct, abs=1e-14)


def test_alarms_are_those_at_the_threshold_that_keeps_the_share():
    known, unknown = GENERATOR.permutation(100.0 + np.arange(200)), np.arange(220.0)
    every = np.ones(200), np.ones(220)
    # 190 of 200 known scores are 110 or more, and so are 110 of 220 unknown ones.
    assert rejection.level(known, every[0]) == 110
    assert rejection.alarms(known, unknown, *every) == 0.5
    assert rejection.alarms(known, unknown, *every, kept=1.0) == 120 / 220
    # A known window that counts as ten: 199 of 209 must be kept, and the lowest that counts as ten is not among them.
    heavy = np.where(known == 100, 10, 1)
    assert rejection.level(known, heavy) == 101


def test_scores_know_the_extra_class_and_energy_is_a_smooth_largest_logit():
    logits = np.log([[8.0, 1.0, 1.0], [1.0, 1.0, 8.0]])
    np.testing.assert_allclose(rejection.probability(logits, 2), [0.8, 0.1])
    np.testing.assert_allclose(rejection.no_extra(logits, 2), np.log([9.0, 0.25]))
    np.testing.assert_allclose(rejection.energy(logits, 2), np.log([9.0, 2.0]))


def test_intervals_hold_the_value_and_shrink_to_it_where_nothing_varies():
    known = np.arange(80) < 40
    names = np.array([f"{number // 4}" for number in range(80)])
    value, repeats = rejection.measured(np.tile(np.where(known, 2.0, 1.0), (3, 1)), known, names, names, GENERATOR, 50)
    assert value.tolist() == [1, 0] and np.ptp(repeats, axis=0).tolist() == [0, 0]
    noisy = GENERATOR.standard_normal((3, 80)) + known
    value, repeats = rejection.measured(noisy, known, names, names, GENERATOR, 200)
    told = rejection.interval(value[0], repeats[:, 0])
    assert told.low < told.value < told.high
