"""Array sums of a symbol's other instants, from those of a few: held against the sum over every element."""

from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.network import SPEED_OF_LIGHT, Network
from lowalt.effects import gain_times
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import symbol_motion
from lowalt.effects.elements import farthest_m
from lowalt.effects.received import Scene, observe
from test_effects_bounds import network, target
from test_effects_near_field import direct
from test_effects_near_field import given as array_of


def scene(**motion):
    """A scene with motion inside long symbols and spherical waves, its view of a fast rotor, and the motion's row."""
    radio = network(subcarrier_spacing_hz=15e3, subcarriers=64)
    cloud, row = target([[0.9, 0, 0], [-0.7, 0.02, 0], [0, 0.8, 0.05], [0.3, 0.5, 0.01]], rotor=True, **motion)
    effects = called({"symbol_motion": {}, "wavefront": {}, "squint": {}, "cyclic_prefix": {"prefix_s": 3e-7}})
    whole = Scene(radio, 3, None, tuple(effects))
    return whole, observe(whole, radio.stations[0], cloud, row), row


@pytest.mark.parametrize("range_m", [15.0, 60.0, 300.0])
@pytest.mark.parametrize("error", [1e-3, 1e-5, 1e-7, 1e-9])
def test_sums_of_other_instants_keep_their_error(range_m, error):
    _, view, _ = scene(x_m=range_m, vx_mps=5.0, vy_mps=60.0, rate_hz=40.0)
    array = array_of((16, 4))._replace(station=np.asarray(view.station.position_m))
    order, kept, most = gain_times.order(view, symbol_motion.complex_motion(view), 9, error), gain_times.Kept(), 0.0
    delays = symbol_motion.nodes_s(view, 9)
    for number, instant in order:
        places = view.at(view.times_s + delays[number]).places
        gains, weights = kept.sums(places, array, 1e-14, 1, instant)
        most = max(most, abs(np.tensordot(weights, gains, 1)[0] - direct(places, array)).max() / 64)
    counted = [instant.slot for _, instant in order if instant is not None]
    assert {number for number, _ in order} == set(range(9))
    assert 2 <= len(counted) - counted.count(None) < 9
    assert most <= error
    # Sums that stayed as they were would err by more than the smaller errors.
    first, last = (direct(view.at(view.times_s + delays[at]).places, array) for at in (0, -1))
    assert abs(first - last).max() / 64 > 1e-6


def test_the_bound_is_the_sum_of_all_coefficients_that_are_left_out_on_its_best_ellipse():
    _, view, _ = scene(x_m=60.0)
    radio = view.network
    near, moves = 50.0, {2.0: 0.3, 5.0: 0.7, 9.0: 6.0}
    diagonal = np.hypot(15, 3) * SPEED_OF_LIGHT / radio.carrier_hz / 2
    top_hz = radio.carrier_hz + radio.subcarriers * radio.subcarrier_spacing_hz
    motion = np.array(list(moves)), np.array([near]), np.array(list(moves.values()))[:, None], None
    for points in (2, 3, 5):
        found = []
        for rho, moved in moves.items():
            direction = 2.5 * (diagonal / 2) / (near - moved)
            rate = 2 * np.pi * top_hz / SPEED_OF_LIGHT * direction + 3.5 * direction / (near - moved)
            most = 1.5 * (np.exp(rate * (moved - diagonal)) - 1)
            found.append(sum(2 * most * rho**-order for order in range(points, 400)))
        assert gain_times.best(view, motion, points) == pytest.approx(min(found), rel=1e-3)


def test_as_few_instants_have_sums_of_their_own_as_the_bound_allows(monkeypatch):
    _, view, _ = scene(x_m=60.0)
    monkeypatch.setattr(gain_times, "best", lambda view, motion, points: 10.0**-points)
    for error, points in ((0.05, 2), (0.005, 3), (0.0005, 4), (1e-12, 6)):
        order = gain_times.order(view, None, 6, error)
        assert sum(instant is None or instant.slot is not None for _, instant in order) == points


def test_a_symbol_next_to_the_station_has_sums_of_its_own_at_every_instant():
    _, view, _ = scene(x_m=1.5, rate_hz=40.0)
    assert gain_times.order(view, symbol_motion.complex_motion(view), 5, 1e-3) == [
        (number, None) for number in range(5)
    ]


@pytest.mark.parametrize("error", [1e-3, 1e-6])
def test_range_cells_are_those_with_sums_of_every_instant(error, monkeypatch):
    whole, view, row = scene(x_m=80.0, vy_mps=30.0, rate_hz=60.0)
    chain = Chain(list(whole.effects), view, lambda name: whole.stream(name, row, "A"), 1.0)
    on, used, order = frozenset(("symbol_motion", "wavefront", "squint", "cyclic_prefix")), [], gain_times.order
    monkeypatch.setattr(gain_times, "order", lambda *given: (used.append(order(*given)), used[-1])[1])
    truth = chain.cells(on)
    chain.error = error
    found = chain.cells(on)
    assert any(instant is not None and instant.slot is None for _, instant in used[-1])
    assert 0 < abs(found - truth).max() <= error * chain.peaks.sum(axis=1).max()


@pytest.mark.parametrize("kept", [0, 1, 3])
def test_motion_is_bounded_in_complex_time_while_it_stays_below_a_quarter_of_the_range(kept):
    """A part of 3 km/s; complex times reach (rho + 1 / rho) / 2 half-symbols, and elements stand off the middle."""
    network = Network.from_settings(load_yaml("config/default.yaml")["network"])
    rho, half = symbol_motion.ELLIPSES, 0.5 / network.subcarrier_spacing_hz
    moved = 3e3 * (1 + 0.5 * (rho + 1 / rho)) * half + farthest_m(network)
    for share, holds in ((1 - 1e-9, kept), (1 + 1e-9, kept + 1)):
        speeds = SimpleNamespace(travel_m=lambda s: np.array([3e3 * s]), imaginary_m=lambda s: np.zeros((len(s), 1)))
        near = np.array([[4 * share * moved[kept]], [9 * moved[-1]]])
        view = SimpleNamespace(speeds=speeds, nearest_m=lambda near=near: near, network=network)
        found = symbol_motion.complex_motion(view)
        assert (0 if found is None else len(found[0])) == holds
        if found is not None:
            np.testing.assert_allclose(found[2][:, 0], moved[:holds])
