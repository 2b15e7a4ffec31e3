"""Filters and choices of detection effects, one after the other, and what need not be worked out for them."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.effects import detecting
from lowalt.effects.catalogue import called
from lowalt.effects.detection import _threshold, canceller


def draws(name):
    return stream(3, name)


def cells(symbols=40, count=64):
    rng = np.random.default_rng(2)
    return rng.normal(size=(symbols, count)) + 1j * rng.normal(size=(symbols, count))


@pytest.mark.parametrize("symbols", [1, 2, 40])
def test_the_mean_is_taken_off_as_numpy_does(symbols):
    given = cells(symbols)
    moved = given - given[:1]
    found = canceller.process(canceller.DEFAULTS, given, None, None)
    np.testing.assert_array_equal(found, moved - moved.mean(axis=0))
    np.testing.assert_array_equal(given, cells(symbols))


def test_powers_are_those_of_both_parts():
    given = cells()
    found = np.empty(given.shape)
    _threshold.powers(given, found)
    np.testing.assert_array_equal(found, given.real**2 + given.imag**2)


def test_filters_act_one_after_the_other():
    effects = called({"canceller": {}, "detector": {}})
    np.testing.assert_array_equal(
        detecting.filtered(effects, cells(), None, draws), canceller.process(canceller.DEFAULTS, cells(), None, None)
    )


@pytest.mark.parametrize("names", [[], ["detector"], ["cell_error"], ["detector", "cell_error"]])
@pytest.mark.parametrize("leads", [False, True])
def test_the_strongest_cell_is_worked_out_only_where_it_matters(names, leads, monkeypatch):
    effects, given = called({name: {} for name in names}), cells()
    best = abs(given).argmax(axis=1)
    for effect in effects:
        best = effect.module.choose(effect.settings, best, given, draws(effect.name))
    found, lead = detecting.chosen(effects, given, draws, leads)
    np.testing.assert_array_equal(found, best)
    two = np.sort(abs(given), axis=1)[:, -2:]
    np.testing.assert_array_equal(lead, two[:, 1] - two[:, 0] if leads else np.full(len(given), np.nan))
    told, first = [], called({"detector": {}})[0].module
    monkeypatch.setattr(first, "choose", lambda settings, chosen, *_: told.append(chosen) or chosen)
    detecting.chosen(effects, given, draws, leads)
    assert not told or told[0].any() == leads
