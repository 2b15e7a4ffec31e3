"""Every number that the functions of the echo and of the effects return in small scenes, against kept ones.

Laws and slow references say what is right; these rows say that nothing has changed, also bounds and choices of which
no result tells. Where a change is wanted, `make kept-numbers` keeps the new numbers; its difference shows which
functions have changed.
"""

import numpy as np
import pytest

import kept_numbers
from kept_scenes import RANDOM, SCENES

KEPT = kept_numbers.by_name(kept_numbers.read())


def changed(title: str) -> list[str]:
    """Functions that return other numbers than the kept ones in a group of scenes."""
    found = kept_numbers.by_name(kept_numbers.rows({title: SCENES[title]}))
    kept = {name: row for name, row in KEPT.items() if name[0] == title}
    # A function that is new or has another name is not held until the table is made again.
    assert len(kept.keys() & found.keys()) > 0.9 * len(kept) > 0
    return [name[1] for name, row in kept.items() if name in found and kept_numbers.differs(row, found[name])]


@pytest.mark.parametrize("title", ["near and far", "many points", "interpreted"])
def test_functions_of_the_echo_return_the_kept_numbers(title):
    assert not changed(title)


def test_functions_return_the_kept_numbers_in_the_shipped_scenes():
    assert not changed("scenes")


@pytest.mark.parametrize("title", ["rare effects", "near field"])
def test_functions_return_the_kept_numbers_in_scenes_that_run_the_others(title):
    assert not changed(title)


@pytest.mark.parametrize("group", range(RANDOM))
def test_functions_return_the_kept_numbers_in_random_scenes(group):
    assert not changed(f"effects {group}")


def row(*given: object) -> dict[str, str]:
    """The row of a function that returned these."""
    sums = kept_numbers.Sums()
    for value in given:
        sums.add(value)
    told = (sums.calls, sums.numbers, sums.sizes, sums.values, "")
    return dict(zip(("calls", "numbers", "sizes", "values", "rounding"), map(str, told), strict=True))


def test_a_number_that_changes_by_more_than_rounding_changes_its_row():
    values = np.random.default_rng(1).normal(size=900) * 10.0 ** np.random.default_rng(2).integers(-8, 3, 900)
    good = row(values)
    assert not kept_numbers.differs(good, row(values * (1 + 1e-13)))
    for place in (0, 500, 899):
        for factor in (1.00001, -1.0):
            other = values.copy()
            other[place] *= factor
            assert kept_numbers.differs(good, row(other))
            assert not kept_numbers.differs(good | {"rounding": "10"}, row(other))
    assert kept_numbers.differs(good, row(values * 1.0000001)) and kept_numbers.differs(good, row(values[:-1]))
    assert kept_numbers.differs(good, row(values[::-1].copy()))


def test_a_call_more_and_a_number_that_is_none_change_a_row():
    numbers = [np.array([1.0, 2.0]), 3 + 4j, True]
    assert not kept_numbers.differs(row(numbers), row(numbers))
    assert kept_numbers.differs(row(numbers), row(numbers, None))
    assert kept_numbers.differs(row(numbers), row([np.array([1.0, np.nan]), 3 + 4j, True]))
    assert kept_numbers.differs(row(numbers), row([np.array([1.0, 2.0]), 3 - 4j, True]))
    assert kept_numbers.differs(row(numbers), row([np.array([1.0, 2.0]), 3 + 4j, False]))
