"""Scores of windows, and the threshold that keeps a share of the known."""

import numpy as np
import rejection

from lowalt.numerics.streams import stream

GENERATOR = stream(5, "unknown", "test")


def test_the_threshold_keeps_the_share_of_the_known():
    known = GENERATOR.permutation(100.0 + np.arange(200))
    # 190 of 200 known scores are 110 or more.
    assert rejection.level(known, np.ones(200)) == 110
    # A known window that counts as ten: 199 of 209 must be kept, and the lowest that counts as ten is not among them.
    heavy = np.where(known == 100, 10, 1)
    assert rejection.level(known, heavy) == 101


def test_scores_know_the_extra_class_and_energy_is_a_smooth_largest_logit():
    logits = np.log([[8.0, 1.0, 1.0], [1.0, 1.0, 8.0]])
    np.testing.assert_allclose(rejection.probability(logits, 2), [0.8, 0.1])
    np.testing.assert_allclose(rejection.no_extra(logits, 2), np.log([9.0, 0.25]))
    np.testing.assert_allclose(rejection.energy(logits, 2), np.log([9.0, 2.0]))
