"""Motion effects: the added motion is read back from the poses, and the random processes obey their laws."""

import math
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from scipy.integrate import trapezoid

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.effects.motion import flight, gusts, rotor_spread
from lowalt.effects.motion.markov import steps
from lowalt.motion import Perturbation, poses
from lowalt.motion.rotations import attitude
from lowalt.motion.sample import draw, region_polygon
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import load_records

TIMES = np.arange(400) * 2.5e-3
QUAD, BIRD, CAR, WALKER = "DJI Mini 2", "Crow", "ZEEKR 001 2022", "Walking Pedestrian 2"


@lru_cache
def target(name: str) -> tuple[Cloud, dict]:
    """A built-in cloud and one motion model of it."""
    config = load_yaml("config/default.yaml")
    record = load_records(config["targets"]["table"], config["targets"]["records"])[name]
    cloud = make(record, None, config["seed"])
    masts = np.array([station["position_m"][:2] for station in config["network"]["stations"].values()])
    corners = region_polygon(masts, None)
    row = draw(stream(1, "motion", name, 0), cloud, record["published"], masts, corners, config["motion"])
    return cloud, {**row, "model": 0}


@pytest.mark.parametrize("name", [QUAD, BIRD, CAR, WALKER])
def test_nothing_added_leaves_every_bit_of_the_motion(name):
    plain = poses(*target(name), TIMES)
    for nothing in (None, Perturbation(), Perturbation({})):
        found = poses(*target(name), TIMES, nothing)
        assert found.rotation.tobytes() == plain.rotation.tobytes()
        assert found.translation.tobytes() == plain.translation.tobytes()


@pytest.mark.parametrize("name", [QUAD, BIRD, CAR, WALKER])
def test_offset_and_tilt_equal_the_row_changed_symbol_by_symbol(name):
    cloud, row = target(name)
    rng = np.random.default_rng(3)
    times = TIMES[::50]
    offset, tilt = rng.normal(size=(2, len(times), 3))
    found = poses(cloud, row, times, Perturbation(offset_m=offset, tilt_rad=tilt))
    for n, time in enumerate(times):
        changed = dict(row)
        for axis, more in zip("xyz", offset[n], strict=True):
            changed[f"{axis}_m"] += more
        for angle, more in zip(("yaw_rad", "pitch_rad", "roll_rad"), tilt[n], strict=True):
            changed[angle] += more
        slow = poses(cloud, changed, np.array([time]))
        np.testing.assert_allclose(found.rotation[n], slow.rotation[0], atol=1e-13)
        np.testing.assert_allclose(found.translation[n], slow.translation[0], atol=1e-10)


@pytest.mark.parametrize(("name", "kind"), [(QUAD, "rotor"), (CAR, "wheel")])
def test_an_added_angle_turns_its_own_part_and_no_other(name, kind):
    cloud, row = target(name)
    first, second = cloud.parts_of(kind)[:2]
    angle = np.linspace(0, 9, len(TIMES))
    found, plain = poses(cloud, row, TIMES, Perturbation({second: angle})), poses(cloud, row, TIMES)
    np.testing.assert_allclose(found.rotation[:, first], plain.rotation[:, first], atol=1e-13)
    for n in (0, 17, 399):
        slow = poses(cloud, {**row, "phase_1_rad": row["phase_1_rad"] + angle[n]}, TIMES[n : n + 1])
        np.testing.assert_allclose(found.rotation[n, second], slow.rotation[0, second], atol=1e-12)
        np.testing.assert_allclose(found.translation[n, second], slow.translation[0, second], atol=1e-10)


def test_an_added_angle_of_an_inner_wing_carries_the_outer_one():
    cloud, row = target(BIRD)
    inner = [part for part in cloud.parts_of("wing") if cloud.parents[part] < 0]
    found = poses(cloud, row, TIMES, Perturbation(dict.fromkeys(inner, np.full(len(TIMES), math.radians(7)))))
    flap = cloud.record["flap"]
    higher = replace(cloud, record={**cloud.record, "flap": {**flap, "mean_deg": flap["mean_deg"] + 7}})
    slow = poses(higher, row, TIMES)
    np.testing.assert_allclose(found.rotation, slow.rotation, atol=1e-12)
    np.testing.assert_allclose(found.translation, slow.translation, atol=1e-10)


@pytest.mark.parametrize("name", [QUAD, WALKER])
def test_turning_a_part_that_does_not_move_is_refused(name):
    with pytest.raises(InputError, match=r"angles added to parts \[0\]"):
        poses(*target(name), TIMES, Perturbation({0: TIMES}))


def craft(rotors: int = 4, category: str = "UAV") -> SimpleNamespace:
    """The attributes of a cloud that the motion effects use."""
    parts = list(range(rotors))
    record = {"published": {"size_m": 0.4}}
    return SimpleNamespace(
        category=category, like=category, record=record, parts_of=lambda kind: parts if kind == "rotor" else [],
        rate_factors=np.ones(rotors),
    )  # fmt: skip


ROW = {
    "subtype": "test", "model": 0, "x_m": 200.0, "y_m": 100.0, "z_m": 60.0, "vx_mps": 0.0, "vy_mps": 0.0,
    "vz_mps": 0.0, "yaw_rad": 0.3, "pitch_rad": 0.0, "roll_rad": 0.0, "rate_hz": 90.0, "phase_0_rad": 0.4,
}  # fmt: skip


def test_unsteady_rotors_have_the_moments_of_the_integrated_process():
    settings = {"spread": 0.05, "wander": 0.02, "correlation_s": 0.4}
    rng = np.random.default_rng(11)
    found = rotor_spread.perturb(settings, craft(20_000), ROW, TIMES, rng)
    seconds = np.stack([found.angle_rad[part] for part in range(20_000)]) / (2 * np.pi * ROW["rate_hz"])
    ratio = TIMES / settings["correlation_s"]
    walked = 2 * (settings["wander"] * settings["correlation_s"]) ** 2 * (ratio - 1 + np.exp(-ratio))
    expected = (settings["spread"] * TIMES) ** 2 + walked
    # A variance of 20 000 normals has a relative standard error of 1 %.
    np.testing.assert_allclose(seconds.var(axis=0)[1:], expected[1:], rtol=0.05)
    assert (abs(seconds.mean(axis=0)[1:]) < 5 * np.sqrt(expected[1:] / 20_000)).all()
    assert (seconds[:, 0] == 0).all()


def test_the_wander_is_exact_at_any_step():
    # Gillespie 1996: the closed forms of one step, held against the general discretisation.
    for decay in (1e-4, 0.3, 40.0):
        mean = math.exp(-decay)
        found = steps(np.array([[-decay, 0.0], [1.0, 0.0]]), np.array([math.sqrt(2 * decay), 0.0]))
        np.testing.assert_allclose(found.transition, [[mean, 0], [(1 - mean) / decay, 1]], rtol=1e-12, atol=1e-17)
        with mpmath.workdps(40):
            d, m = mpmath.mpf(decay), mpmath.exp(-mpmath.mpf(decay))
            cross = (1 - m) ** 2 / d
            place = 2 / d**2 * (d - 2 * (1 - m) + (1 - m**2) / 2)
            exact = np.array([[1 - m**2, cross], [cross, place]], float)
        np.testing.assert_allclose(found.root @ found.root.T, exact, rtol=1e-9)


def test_a_set_rate_is_read_back_from_each_rotor_and_from_the_signal():
    cloud, row = target(QUAD)
    settings = {"spread": 0.05, "wander": 0.0, "correlation_s": 1.5}
    rates = []
    for seed in range(150):
        moved = rotor_spread.perturb(settings, cloud, row, TIMES, np.random.default_rng(seed))
        turned = poses(cloud, {**row, "pitch_rad": 0.0, "roll_rad": 0.0}, TIMES, moved).rotation
        for part in cloud.parts_of("rotor"):
            angle = np.arctan2(turned[:, part, 1, 0], turned[:, part, 0, 0]) * cloud.axes[part, 2]
            step = np.diff(angle) - 2 * np.pi * row["rate_hz"] * 2.5e-3
            step -= 2 * np.pi * np.rint(step / (2 * np.pi))
            assert np.ptp(step) < 1e-9
            rates.append(step.mean() / (2 * np.pi * 2.5e-3 * row["rate_hz"]))
    assert np.std(rates) == pytest.approx(0.05, rel=0.15)
    assert abs(np.mean(rates)) < 5 * 0.05 / math.sqrt(len(rates))
    one = moved.angle_rad[cloud.parts_of("rotor")[0]]
    rate = row["rate_hz"] + one[-1] / (2 * np.pi * TIMES[-1])
    # One point on the blade, its small path a pure phase: the line stands at the rotor's own rate.
    line = np.exp(1j * (2 * np.pi * row["rate_hz"] * TIMES + one))
    frequency = np.fft.fftfreq(16 * len(TIMES), 2.5e-3)[np.abs(np.fft.fft(line, 16 * len(TIMES))).argmax()]
    assert abs((frequency - rate + 200) % 400 - 200) < 0.1


def test_a_rotor_s_spread_is_a_share_of_its_own_rate():
    settings = {"spread": 0.05, "wander": 0.02, "correlation_s": 1.5}
    one, other = craft(2), craft(2)
    other.rate_factors = np.array([1.0, 5.4])
    plain, own = (
        rotor_spread.perturb(settings, it, ROW, TIMES, np.random.default_rng(2)).angle_rad for it in (one, other)
    )
    assert plain[0].tobytes() == own[0].tobytes()
    np.testing.assert_allclose(own[1], 5.4 * plain[1], rtol=1e-12)


def test_steady_rotors_are_idle_and_the_limit_is_continuous():
    assert rotor_spread.idle({**rotor_spread.DEFAULTS, "spread": 0.0, "wander": 0.0})
    assert not rotor_spread.idle(rotor_spread.DEFAULTS)

    def size(strength: float) -> float:
        settings = {**rotor_spread.DEFAULTS, "spread": strength, "wander": strength}
        found = rotor_spread.perturb(settings, craft(), ROW, TIMES, np.random.default_rng(5))
        return max(abs(angle).max() for angle in found.angle_rad.values())

    assert size(1e-9) < 1e-5
    assert size(1e-9) == pytest.approx(1e-6 * size(1e-3), rel=1e-9)
    assert rotor_spread.perturb(rotor_spread.DEFAULTS, craft(0), ROW, TIMES, np.random.default_rng(0)).angle_rad == {}


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


@pytest.mark.parametrize("effect", [rotor_spread, gusts])
def test_one_symbol_is_enough_and_draws_repeat(effect):
    alone = effect.perturb(effect.DEFAULTS, craft(), ROW, TIMES[:1], np.random.default_rng(2))
    assert all(abs(angle).max() == 0 for angle in alone.angle_rad.values())
    first, second = (effect.perturb(effect.DEFAULTS, craft(), ROW, TIMES, np.random.default_rng(3)) for _ in range(2))
    assert str(first) == str(second)


def test_the_wind_asks_for_a_size():
    cloud, row = target(QUAD)
    point = replace(cloud, points=np.zeros_like(cloud.points), record=cloud.record | {"published": {}})
    with pytest.raises(InputError, match="expected size_m"):
        gusts.perturb(gusts.DEFAULTS, point, row, TIMES, np.random.default_rng(1))
