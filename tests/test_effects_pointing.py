"""Beams that miss: the two-way loss of the array's pattern, and beams that follow the target."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.common.errors import InputError
from lowalt.effects import steering
from lowalt.effects.catalogue import called
from lowalt.effects.channel import pointing_error
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.view import Beams
from test_effects import network, target

RADIO = network(transmit=(16, 4), receive=(8, 2), symbols=40)


@pytest.fixture
def point():
    """A cloud of one still point and its row, level with the station and square to its array."""
    cloud, row = target(np.random.default_rng(4), points=1)
    cloud = replace(cloud, points=np.zeros((1, 3)), rcs_m2=np.ones(1))
    place = 100.0 * np.array([np.cos(0.3), np.sin(0.3), 0.0]) + [0.0, 0.0, 10.0]
    row |= dict(zip(("x_m", "y_m", "z_m"), place, strict=True))
    return cloud, {**row, **{f"v{axis}_mps": 0.0 for axis in "xyz"}}


def scene(effects, radio=RADIO, tolerance=None):
    return Scene(radio, 5, tolerance, tuple(called(effects)))


def pattern(count, cosine):
    """Array sum of `count` elements half a wavelength apart over its value in mid-beam."""
    angle = 0.5 * np.pi * cosine
    return 1.0 if cosine == 0 else np.sin(count * angle) / (count * np.sin(angle))


@pytest.mark.parametrize("azimuth, elevation", [(1.0, 0.0), (0.0, 5.0), (-4.0, 3.0), (10.0, -8.0)])
def test_a_beam_off_its_target_loses_both_arrays_pattern(point, azimuth, elevation):
    station = RADIO.stations[0]
    off = {"pointing_error": {"sigma_deg": 0.0, "fixed_deg": [azimuth, elevation]}}
    best, missed = (abs(received_signal(scene(one), station, *point).signal) for one in ({}, off))
    a, e = np.radians([azimuth, elevation])
    across, up = np.cos(e) * np.sin(a), np.sin(e)
    loss = pattern(16, across) * pattern(8, across) * pattern(4, up) * pattern(2, up)
    np.testing.assert_allclose(missed / best, abs(loss), rtol=1e-10)


def test_errors_have_the_standard_deviation_asked_for(point):
    station, cloud, row = RADIO.stations[0], *point
    sigma = 0.2
    off = scene({"pointing_error": {"sigma_deg": sigma}})
    missed = []
    for model in range(300):
        view = observe(off, station, cloud, {**row, "model": model})
        a, e = pointing_angles(view, station)
        missed.append((a**2, e**2))
    assert np.sqrt(np.mean(missed, axis=0)) == pytest.approx(np.radians(sigma), rel=0.15)


def pointing_angles(view, station):
    """Azimuth and elevation (rad) of the beam against the point's place."""
    aim, place = (np.asarray(one) - station.position_m for one in (view.aim_m, view.places[0, 0]))
    return np.arctan2(aim[1], aim[0]) - np.arctan2(place[1], place[0]), np.arcsin(aim[2] / np.linalg.norm(aim))


def test_an_updated_beam_keeps_a_flying_target_in_its_middle(point):
    station, cloud, row = RADIO.stations[0], *point
    row = {**row, "vx_mps": -100.0 * np.sin(0.3), "vy_mps": 100.0 * np.cos(0.3)}
    still, followed = (
        abs(steering.echo(observe(scene(one), station, cloud, row))[:, 0])
        for one in ({}, exact(RADIO.symbol_interval_s))
    )
    ranges = np.hypot(100.0, 100.0 * RADIO.times_s)
    np.testing.assert_allclose(followed / followed[0], (100.0 / ranges) ** 2, rtol=1e-9)
    assert still[-1] < 0.6 * followed[-1]


def exact(update):
    """Beams without an error, updated."""
    return {"pointing_error": {"sigma_deg": 0.0, "update_s": update}}


def test_updates_do_not_turn_the_phase_of_the_arrays_middles(point):
    station, cloud, row = RADIO.stations[0], *point
    row = {**row, "vx_mps": -20.0 * np.sin(0.3), "vy_mps": 20.0 * np.cos(0.3)}
    still = received_signal(scene({}), station, cloud, row).signal
    followed = received_signal(scene(exact(0.02)), station, cloud, row).signal
    # A single point's phase is that of the arrays' middles, whichever way the beams point.
    assert abs(np.angle(followed * still.conj())).max() < 1e-9
    assert (abs(followed) >= abs(still) * (1 - 1e-12)).all() and abs(followed[-1]) > 1.04 * abs(still[-1])


def test_a_beam_turned_to_where_it_points_changes_no_bit():
    cloud, row = target(np.random.default_rng(4))
    station = RADIO.stations[0]
    called_for = {"ground_reflection": {}}
    view = observe(scene(called_for), station, cloud, row)
    aims = np.repeat(view.aim_m[None], 3, axis=0)
    again = replace(view, beams={station.name: Beams(np.array([0.0, 0.02, 0.06]), aims)})
    assert [len(rows) for _, _, rows in again.beam_rows()] == [8, 16, 16]
    paths = [one for effect in called(called_for) for one in effect.module.paths(effect.settings, view)]
    factor = np.random.default_rng(1).random((40, 9))
    # Fewer symbols at once may give another order of the interpolating polynomial.
    assert abs(steering.echo(view, paths, factor) - steering.echo(again, paths, factor)).max() < 1e-12 * abs(
        steering.echo(view, paths, factor)
    ).max()  # fmt: skip


def test_pointing_is_kept_while_physics_is_left_out_by_need(point):
    station, (cloud, row) = RADIO.stations[0], target(np.random.default_rng(4))
    given = {**exact(0.02), "pointing_error": {"sigma_deg": 1.0, "update_s": 0.02}, "squint": {}, "wavefront": {}}
    full = received_signal(scene(given), station, cloud, row)
    some = received_signal(scene(given, tolerance=0.05), station, cloud, row)
    assert abs(some.signal - full.signal).max() <= 0.05 * abs(full.signal).max()
    assert any(not decision.computed for decision in some.decisions)


def test_updates_faster_than_symbols_are_refused():
    with pytest.raises(InputError, match="update_s"):
        pointing_error.check({"update_s": 1e-3}, CheckedScene(RADIO, {}, ()))
