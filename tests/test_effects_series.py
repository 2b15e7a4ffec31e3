"""Smooth functions as short series: against the functions themselves, and where no series is short enough."""

import numpy as np
import pytest

from lowalt.effects import series, waves
from lowalt.effects.channel.ground_reflection import roughness
from lowalt.effects.fresnel import fresnel


@pytest.mark.parametrize("low, high", [(0.0, 0.1), (0.2, 0.5), (0.3, 0.3), (0.0, 1.0)])
@pytest.mark.parametrize("ground", [(5.24, 0.16), (15.0, 0.5), (80.0, 5.0)])
@pytest.mark.parametrize("polarisation", ["vertical", "horizontal"])
def test_reflection_coefficients_are_those_of_every_place(low, high, ground, polarisation):
    def function(sine):
        return fresnel(sine, *ground, 4.9e9, polarisation) * roughness(sine, 0.005, 4.9e9)

    places = np.random.default_rng(1).uniform(low, high, (3, 400))
    places[0, :2] = low, high
    assert abs(series.at(function, places) - function(places)).max() < 3e-14


def test_a_function_is_asked_at_few_places_where_it_is_smooth_and_at_all_where_it_is_not():
    asked = []

    def counted(function):
        def ask(x):
            asked.append(np.size(x))
            return function(x)

        return ask

    places = np.random.default_rng(2).uniform(-1, 1, 5000)
    assert abs(series.at(counted(np.exp), places) - np.exp(places)).max() < 1e-13
    assert sum(asked) < 100
    asked.clear()
    assert (series.at(counted(abs), places) == abs(places)).all()
    assert asked[-1] == 5000


@pytest.mark.parametrize("turns", [1e-9, 1e-3, 0.02, 0.3, 0.5, 3.0])
def test_waves_within_few_turns_keep_the_orders_that_change_a_bit_and_no_others(turns):
    found, reach = waves.waves_within(turns), min(turns, 0.5)
    left, most = waves.WAVE[:, found.shape[1] :], 2.0**-60
    np.testing.assert_array_equal(found, waves.WAVE[:, : found.shape[1]])
    sizes = [max(abs(pair)) * reach ** (2 * order) for order, pair in enumerate(waves.WAVE.T)]
    assert all(size <= most for size in sizes[found.shape[1] :]) and len(sizes) == found.shape[1] + left.shape[1]
    assert found.shape[1] == 2 or sizes[found.shape[1] - 1] > most
