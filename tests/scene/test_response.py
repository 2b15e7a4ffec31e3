"""The frequency response against sums over every element, path and subcarrier.

It is also tested by laws of reciprocity.
"""

from dataclasses import replace

import numpy as np
import pytest

import pointwise_echo
import reference_effects
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.scene.response import ImagePath, response
from scenes import A, B, drifting, link, linked, network, view_of

PHYSICS = pytest.mark.parametrize(
    "squint, wavefront", [(False, False), (True, False), (False, True), (True, True)]
)


def relative(value, truth):
    return abs(value - truth).max() / abs(truth).max()


@PHYSICS
@pytest.mark.parametrize("shape", [(16, 4), (1, 1), (3, 5)])
@pytest.mark.parametrize("away_m", [(60.0, 20.0, 25.0), (5.0, 70.0, 7.0), (6.0, 2.0, 11.0)])
def test_it_is_the_sum_over_every_element_path_and_subcarrier(squint, wavefront, shape, away_m):
    radio = network(subcarriers=16, subcarrier_spacing_hz=2e6, transmit=shape, receive=shape)
    rng = np.random.default_rng(2)
    places = drifting(rng, away_m)
    rcs = rng.uniform(0.1, 2, 11)
    aim = np.array([62.0, 25.0, 20.0])
    # Below the ground as a mirror shows them, each point with a coefficient of its own.
    images = places * [1, 1, -1]
    coefficient = rng.uniform(-1, 1, (5, 11)) + 0.3j
    factor = rng.uniform(0, 1, (5, 11))
    truth = reference_effects.subcarriers(
        radio, A, places, rcs * factor**2, aim, [(images, coefficient)], squint, wavefront
    )
    found = response(
        view_of(radio, places, rcs, aim),
        [ImagePath(images, coefficient)],
        factor,
        squint=squint,
        wavefront=wavefront,
    )
    assert relative(found, truth) < 5e-11


@PHYSICS
def test_a_link_goes_out_by_one_array_and_comes_back_by_the_other(squint, wavefront):
    radio = linked(subcarriers=17, transmit=(3, 2), receive=(5, 1))
    rng = np.random.default_rng(1)
    aim = np.array([50.0, 40.0, 20.0])
    places = drifting(rng, aim, 3, 5)
    rcs = rng.uniform(0.1, 2, 5)
    scale = np.sqrt(radio.power / 30) * SPEED_OF_LIGHT / radio.carrier_hz / (4 * np.pi) ** 1.5
    ends = (A, radio.transmit), (replace(B, frequency_hz=A.frequency_hz), radio.receive)
    truth = np.zeros((3, 17), complex)
    for n, m in np.ndindex(truth.shape):
        f = A.frequency_hz + m * radio.subcarrier_spacing_hz
        out, back = (
            reference_effects.one_way(radio, end, shape, places[n], aim, f, squint, wavefront)
            for end, shape in ends
        )
        truth[n, m] = (scale * np.sqrt(rcs) * out * back).sum()
    found = response(view_of(radio, places, rcs, aim, link()), squint=squint, wavefront=wavefront)
    assert relative(found, truth) < 5e-11


def test_routes_have_factors_of_their_own():
    radio = network(subcarriers=16, symbols=3)
    rng = np.random.default_rng(3)
    places = drifting(rng, (60, 20, 25), 3, 4)
    rcs = np.ones(4)
    aim = (60, 20, 25)
    images = places * [1, 1, -1]
    mirrored = -0.4 + 0.1j
    strong = rng.uniform(0, 1, (2, 2, 3, 4))
    strong[1, 0] = strong[0, 1]
    found = response(view_of(radio, places, rcs, aim), [ImagePath(images, mirrored)], strong)
    # Of factors that are products of both ways', each way's is the path's coefficient.
    truth = sum(
        response(
            view_of(radio, places, rcs, aim),
            [ImagePath(images, mirrored)],
            strong * np.reshape(only, (2, 2, 1, 1)),
        )
        for only in ([1, 0, 0, 0], [0, 1, 1, 0], [0, 0, 0, 1])
    )
    assert relative(found, truth) < 1e-12
    direct = strong * np.reshape([1, 0, 0, 0], (2, 2, 1, 1))
    alone = response(view_of(radio, places, rcs, aim), [ImagePath(images, mirrored)], direct)
    assert relative(alone, response(view_of(radio, places, rcs, aim), [], strong[0, 0])) < 1e-10
    both = strong * np.reshape([0, 0, 0, 1], (2, 2, 1, 1))
    alone = response(view_of(radio, places, rcs, aim), [ImagePath(images, mirrored)], both)
    seen = response(view_of(radio, images, rcs, aim), [], strong[1, 1]) * mirrored**2
    assert relative(alone, seen) < 1e-10


@PHYSICS
def test_turned_beams_keep_the_phase_of_the_arrays_middles(squint, wavefront):
    radio = network(subcarriers=16, symbols=4)
    rng = np.random.default_rng(4)
    places = drifting(rng, (60, 20, 25), 4)
    rcs = np.ones(11)
    aims = np.array([[60, 20, 25], [60, 30, 25], [55, 20, 28], [60, 20, 25]], float)
    found = response(view_of(radio, places, rcs, aims), squint=squint, wavefront=wavefront)
    for n, aim in enumerate(aims):
        truth = reference_effects.subcarriers(
            radio, A, places[n : n + 1], rcs, aim, (), squint, wavefront
        )[0]
        toward = (aim - A.position_m) / np.linalg.norm(aim - np.array(A.position_m))
        first = (aims[0] - A.position_m) / np.linalg.norm(aims[0] - np.array(A.position_m))
        # Both arrays of 4 x 2 elements half a wavelength apart, their middles 1.5 and 0.5 elements
        # from the corner.
        turns = 2 * 0.5 * (1.5 * A.horizontal + 0.5 * np.array([0, 0, 1])) @ (toward - first)
        assert relative(found[n], truth * np.exp(2j * np.pi * turns)) < 5e-11


def test_it_agrees_with_the_echo_engine_at_any_range():
    radio = network(transmit=(8, 4), receive=(8, 4), subcarriers=64)
    rng = np.random.default_rng(5)
    for range_m in (1.0, 30.0, 500.0, 3000.0):
        aim = np.array([range_m, 0.3 * range_m, 10.0 + 0.2 * range_m])
        places = drifting(rng, aim, 3, 6, min(1.5, range_m / 4))
        found = response(view_of(radio, places, np.ones(6), aim))
        assert relative(found, pointwise_echo.subcarriers(radio, A, places, 1.0, aim)) < 1e-10


def test_a_point_in_the_station_is_refused_by_its_symbol():
    radio = network()
    places = np.ones((3, 2, 3)) * [60.0, 20.0, 25.0]
    places[2, 1] = A.position_m
    with pytest.raises(InputError, match="symbol 2 is that of station A"):
        response(view_of(radio, places, np.ones(2), (60, 20, 25)))
