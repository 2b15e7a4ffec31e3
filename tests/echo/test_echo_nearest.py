"""Which values are computed again, and when their nearest single is known, by the interpreter."""

from types import SimpleNamespace

import numpy as np
import pytest

from driven_echo import weights
from interpreted import interpreted
from lowalt.echo.fast.workspace import Found
from lowalt.echo.rounding import nearest
from small_echo import pieces, places, prepared

MOTIONS = {"parts": pieces((5, 3, 6), symbols=2), "points": places(pieces((5, 3, 6), symbols=2)).astype(float)}


def test_numbers_within_an_error_have_one_nearest_single_or_two():
    """The error is taken a few units of a double wider than it is told."""
    tie = 1.0 + 2.0**-24
    cases = (
        (1.0, 1e-9, True), (tie, 1e-12, False), (tie + 1e-9, 0.9e-9, True), (tie + 1e-9, 1.1e-9, False),
        (tie - 1e-9, 0.9e-9, True), (-tie - 1e-9, 0.9e-9, True), (-tie - 1e-9, 1.1e-9, False),
        (tie + 0.5e-15, 0.0, False), (tie + 4e-15, 0.0, True), (-tie - 0.5e-15, 0.0, False),
    )  # fmt: skip
    for x, error, same in cases:
        assert interpreted(nearest.same_single)(x, error) == same


def test_a_tie_between_two_singles_is_seen_in_the_low_half_of_a_double_double():
    """Both ends of the error round to the tie itself as doubles, and to two singles as numbers."""
    tie, bits = 1.0 + 2.0**-24, np.empty(1, np.int64)
    same = interpreted(nearest.same_double)
    for low, error, decided in (
        (0.0, 1e-20, False), (1e-20, 0.9e-20, True), (1e-20, 1.1e-20, False), (-1e-20, 0.9e-20, True),
        (-1e-20, 1.1e-20, False), (-1e-16, 1.1e-16, False), (3e-17, 1e-17, True), (0.0, 0.0, True),
    ):  # fmt: skip
        assert same((tie, low), error, bits) == decided == same((-tie, low), error, bits)
    assert same((0.3, 0.0), 1e-20, bits) and not same((0.0, 0.0), 1e-30, bits)


@pytest.mark.parametrize("kind", MOTIONS)
def test_values_are_computed_again_until_their_nearest_single_is_known(kind):
    """First in double; where its error leaves the single open, in double-double; what that leaves open is counted."""
    there = prepared(MOTIONS[kind], weights(14))
    tie = 1.0 + 2.0**-24
    quick = {0: (0.3, 0.4), 1: (tie, 0.4), 2: (0.3, tie), 3: (tie, tie)}
    slow = {1: ((tie, 1e-18), (0.4, 0.0)), 2: ((0.3, 0.0), (tie, -1e-18)), 3: ((tie, 1e-26), (0.3, 0.0))}
    asked = []

    def closer(scene, lay, radar, n, cell, work):
        asked.append((n, cell))
        return slow[n]

    again = interpreted(nearest.compute_again, cell_value=closer, double=SimpleNamespace(
        share=lambda points: 1e-14 if points == 16 else np.nan, cell_value=lambda *given: quick[given[3]]))  # fmt: skip
    found = Found.empty(5)
    found.cells[:], found.totals[:], found.values[:] = [5, 6, 7, 8, 9], 2.0, 77.0
    order = np.array([3, 0, 1, 2])
    assert again(there.scene, there.lay, there.radio, order, found, None, np.empty(1, np.int64)) == (3, 1)
    assert asked == [(3, 8), (1, 6), (2, 7)] and found.values[0] == 0.3 + 0.4j and found.values[4] == 77.0
    singles = found.values.astype(np.complex64)
    assert singles[1].real == np.float32(1 + 2.0**-23) and singles[2].imag == np.float32(1.0)
