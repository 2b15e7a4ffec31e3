"""Searches over scenes with any of all effects: nothing that is left out changes more than its tolerance."""

from collections import Counter

import numpy as np
import pytest
from scipy.optimize import differential_evolution

import every_effect
from every_effect import NUMBERS_OF_A_SCENE, case, change


def drawn(count: int, seed: int) -> tuple[Counter, float, list[tuple]]:
    """How many of `count` random scenes name each effect, the largest change over its tolerance, and the scenes that
    change more than that: (index, change over tolerance, tolerance, effects)."""
    named, most, broken = Counter(), 0.0, []
    for index in range(count):
        one = case(np.random.default_rng([seed, index]).random(NUMBERS_OF_A_SCENE))
        share = change(one)
        if not share <= 1:
            broken.append((index, share, one.tolerance, one.effects))
        named.update(list(one.effects))
        most = max(most, share)
    return named, most, broken


def test_every_effect_of_the_catalogue_can_be_in_a_random_scene():
    assert every_effect.unknown() == set()


def test_random_scenes_of_all_effects_keep_their_tolerance():
    named, most, broken = drawn(25, 3)
    assert not broken
    assert len(named) > 20 and most > 1e-6


def test_a_target_that_reflects_nothing_leaves_the_prefix_to_the_land_around_it():
    one = case(np.random.default_rng([4, 462]).random(NUMBERS_OF_A_SCENE))
    found = one.received(one.tolerance)
    assert found.power == 0 and {"clutter", "cyclic_prefix"} <= set(one.effects)
    assert [note.computed for note in found.decisions if note.name == "cyclic_prefix"] == [True]
    assert change(one) <= 1


@pytest.mark.slow
def test_1000_random_scenes_of_all_effects_keep_their_tolerance():
    named, most, broken = drawn(1000, 4)
    assert not broken
    print(f"1000 scenes, largest change {most:.3f} of the tolerance; scenes that name each effect: {dict(named)}")
    assert set(named) == set(every_effect.NAMES) and min(named.values()) >= 20
    assert most > 1e-3


@pytest.mark.slow
def test_an_optimiser_finds_no_scene_of_all_effects_that_breaks_its_tolerance():
    found = differential_evolution(
        lambda numbers: -np.log10(max(change(case(numbers)), 1e-15)), [(0.0, 1.0)] * NUMBERS_OF_A_SCENE, maxiter=9,
        popsize=1, seed=1, polish=False, tol=0,
    )  # fmt: skip
    share = change(case(found.x))
    print(f"{found.nfev} scenes, largest change {share:.3f} of the tolerance, with {sorted(case(found.x).effects)}")
    assert 1e-3 < share <= 1
