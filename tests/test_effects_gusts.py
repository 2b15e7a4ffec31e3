"""Gusts: turbulence, the target's response to it, and the thrust that leans against it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from lowalt.common.errors import InputError
from lowalt.effects.motion import flight, gusts
from lowalt.motion.rotations import attitude
from test_effects_motion import QUAD, ROW, TIMES, craft, target


def _spectrum(longitudinal: bool, scale: float, frequency: np.ndarray) -> np.ndarray:
    """Unit Dryden spectrum, two-sided over angular frequency, its integral 2 pi (MIL-F-8785C)."""
    square = (scale * frequency) ** 2
    return 2 * scale / (1 + square) if longitudinal else scale * (1 + 3 * square) / (1 + square) ** 2


@pytest.mark.parametrize("longitudinal", [True, False])
@pytest.mark.parametrize(("scale", "response", "lag"), [(20.0, 1.0, 0.1), (0.5, 0.3, 2.0), (400.0, 5.0, 0.02)])
def test_gusts_and_what_they_do_have_the_variances_of_their_spectra(longitudinal, scale, response, lag):
    step = 2.5e-3
    each, start, outputs = gusts.axis(scale / step, longitudinal, response / step, lag / step)
    covariance = start @ start.T
    moved = each.transition @ covariance @ each.transition.T + each.root @ each.root.T
    # A step leaves the stationary covariance where it was.
    size = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(moved / np.outer(size, size), covariance / np.outer(size, size), atol=1e-9)
    found = np.diag(outputs @ covariance @ outputs.T)
    frequency = np.concatenate([[0.0], np.geomspace(1e-5, 1e6 / min(scale, response, lag), 400_001)])
    gust = _spectrum(longitudinal, scale, frequency)
    velocity, place, thrust = followed(frequency, response, lag)
    exact = [trapezoid(gust * abs(shape) ** 2, frequency) / np.pi for shape in (1.0, velocity, place, thrust)]
    assert exact[0] == pytest.approx(1, rel=1e-4)
    np.testing.assert_allclose(found, np.array(exact) * [1, 1, step**-2, step**2], rtol=1e-3)


def followed(frequency, response, lag):
    """Velocity, displacement and thrust of a target by the air's velocity, by the loop's Laplace transform."""
    s = 1j * frequency
    asked = gusts.SPEED_GAIN / lag * s + gusts.PLACE_GAIN / lag**2
    place = 1 / response / (s * (s + 1 / response) + asked / (1 + lag * s))
    return s * place, place, -asked / (1 + lag * s) * place


@pytest.mark.parametrize("response", [0.3, 5.0])
def test_a_craft_that_holds_its_place_leans_into_a_lasting_gust(response):
    drift, _, outputs = gusts.process(1e9, True, response, 0.2)
    # Turbulence of endless scale is a constant wind: the first state stays, the others settle.
    settled = np.linalg.solve(drift[2:, 2:], -drift[2:, 0])
    gust, velocity, _, thrust = outputs @ np.array([1.0, 0.0, *settled])
    assert velocity == pytest.approx(0, abs=1e-12) and thrust == pytest.approx(-gust / response)
    front = gusts.tilt(np.array([[0.0, thrust / gust * 4.0, 0.0]]), True)[0]
    assert np.arctan2(*attitude(*front)[1:, 2]) == pytest.approx(-np.arctan(4.0 / response / 9.80665))


def test_in_drawn_gusts_the_thrust_acts_against_the_wind():
    _, start, outputs = gusts.axis(4000.0, True, 400.0, 40.0)
    covariance = outputs @ start @ start.T @ outputs.T
    assert covariance[0, 3] < -0.3 * np.sqrt(covariance[0, 0] * covariance[3, 3])


def test_response_times_follow_size_and_mass():
    names = ["Sparrow", "Pigeon", "DJI Mini 2", "DJI Matrice 600 Pro", "EH 216 S"]
    mass = {name: flight.mass_kg(target(name)[0]) for name in names}
    # Published masses, up to a factor of two.
    for name, true in {"Sparrow": 0.03, "DJI Mini 2": 0.249, "DJI Matrice 600 Pro": 10.0}.items():
        assert true / 2 < mass[name] < true * 2
    level, up = np.array([flight.response_s(target(name)[0], 8.0) for name in names]).T
    assert up[0] < 0.15 < 3 < up[-1] and level[2] < level[3] < level[4]
    lags = [flight.attitude_s(target(name)[0]) for name in names]
    assert lags[0] < 0.1 < 0.3 < lags[-1] < 0.5
    # Twice the airspeed doubles a body's drag and a wing's lift.
    sparrow = target("Sparrow")[0]
    assert flight.response_s(sparrow, 16.0)[1] == pytest.approx(0.5 * flight.response_s(sparrow, 8.0)[1])


def test_low_altitude_turbulence_has_the_tabled_values():
    # MIL-F-8785C at 1000 ft: all scale lengths 1000 ft, all intensities a tenth of the wind at 20 ft.
    scales, intensities = gusts.turbulence(304.8, 10.0)
    np.testing.assert_allclose(scales, 304.8, rtol=1e-9)
    np.testing.assert_allclose(intensities, 1.0, rtol=1e-9)
    scales, intensities = gusts.turbulence(100 * 0.3048, 10.0)
    np.testing.assert_allclose(scales / 0.3048, [100 / 0.2593**1.2, 100 / 0.2593**1.2, 100], rtol=1e-9)
    np.testing.assert_allclose(intensities, [1 / 0.2593**0.4, 1 / 0.2593**0.4, 1], rtol=1e-9)
    assert gusts.mean_wind_mps(20 * 0.3048, 7.0) == pytest.approx(7.0)


def test_the_drift_of_many_targets_spreads_as_the_spectrum_says():
    row = {**ROW, "yaw_rad": 0.0}
    drawn = [gusts.perturb(gusts.DEFAULTS, craft(), row, TIMES, np.random.default_rng(seed)) for seed in range(400)]
    offset = np.stack([item.offset_m for item in drawn])
    assert (offset[:, 0] == 0).all()
    wind = gusts.DEFAULTS["wind_mps"]
    scales, intensities = gusts.turbulence(row["z_m"], wind)
    airspeed = gusts.mean_wind_mps(row["z_m"], wind)
    time = TIMES[-1]
    frequency = np.concatenate([[0.0], np.geomspace(1e-6, 1e5, 400_001)])
    rate = flight.response_s(craft(), airspeed)[0]
    place = followed(frequency, rate, flight.attitude_s(craft()))[1]
    # The offset is a difference of two places, so its spectrum has the factor 4 sin^2(w T / 2).
    window = abs(place) ** 2 * 4 * np.sin(0.5 * frequency * time) ** 2
    along, across, up = (
        trapezoid(_spectrum(axis == 0, scales[axis] / airspeed, frequency) * window, frequency) / np.pi
        for axis in range(3)
    )
    horizontal = 0.5 * intensities[0] ** 2 * (along + across)
    spread = offset[:, -1].var(axis=0)
    np.testing.assert_allclose(
        spread, [horizontal, horizontal, intensities[2] ** 2 * up], rtol=0.35
    )  # five standard errors of 400 draws


def test_thrust_tilts_towards_the_acceleration():
    acceleration = np.array([[3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [-2.0, 0.0, 0.0]])
    for (right, front, _), angles in zip(acceleration, gusts.tilt(acceleration, True), strict=True):
        thrust = attitude(*angles)[:, 2]
        np.testing.assert_allclose(thrust[:2] / thrust[2], np.array([right, front]) / 9.80665, atol=1e-12)
    assert gusts.tilt(acceleration, False)[1].tolist() == [0, 0, 0]


def test_gusts_leave_the_ground_alone_and_vanish_with_the_wind():
    assert gusts.idle({**gusts.DEFAULTS, "wind_mps": 0.0})
    assert not gusts.idle(gusts.DEFAULTS)
    still = gusts.perturb(gusts.DEFAULTS, craft(category="Vehicle"), ROW, TIMES, np.random.default_rng(0))
    assert still == ({}, None, None)
    row = {**ROW, "vx_mps": 5.0}
    weak = gusts.perturb({**gusts.DEFAULTS, "wind_mps": 1e-9}, craft(), row, TIMES, np.random.default_rng(1))
    assert abs(weak.offset_m).max() < 1e-8
    assert abs(weak.tilt_rad).max() < 1e-8


def test_the_wind_asks_for_a_size():
    cloud, row = target(QUAD)
    point = replace(cloud, points=np.zeros_like(cloud.points), record=cloud.record | {"published": {}})
    with pytest.raises(InputError, match="expected size_m"):
        gusts.perturb(gusts.DEFAULTS, point, row, TIMES, np.random.default_rng(1))
