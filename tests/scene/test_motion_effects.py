"""Effects on motion: laws read back out of what they draw.

Their processes move rotors and flying targets.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from lowalt.config.layers import load
from lowalt.motion.rotations import attitude
from lowalt.numerics.streams import stream
from lowalt.scene.effects.motion import gusts, rotor_spread
from lowalt.scene.laws import flight, markov
from lowalt.targets.make import make
from lowalt.targets.records import records_of

TIMES_S = 2.5e-3 * np.arange(401)
ROW = {
    "x_m": 100.0,
    "y_m": 50.0,
    "z_m": 60.0,
    "vx_mps": 6.0,
    "vy_mps": 2.0,
    "vz_mps": 0.0,
    "yaw_rad": 0.4,
    "rate_hz": 80.0,
}


@pytest.fixture(scope="module")
def clouds():
    config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
    records = records_of(config["targets"], None)
    return {
        name: make(records[name], None, 1)
        for name in ("DJI Mini 2", "EH 216 S", "Crow", "Audi A6L 2019")
    }


@pytest.mark.parametrize("longitudinal", [True, False])
def test_a_process_is_discretised_as_its_matrix_exponential_and_lyapunov_equation_say(longitudinal):
    drift, noise, _ = gusts.process(300.0, longitudinal, 40.0, 12.0)
    over_step = markov.steps(drift, noise)
    np.testing.assert_allclose(over_step.transition, expm(drift), atol=1e-13)
    settled = solve_continuous_lyapunov(drift, -np.outer(noise, noise))
    size = np.sqrt(np.outer(np.diag(settled), np.diag(settled)))
    found = markov.stationary(over_step)
    np.testing.assert_allclose(found / size, settled / size, atol=1e-8)
    # What is settled stays so over a step.
    after = over_step.transition @ found @ over_step.transition.T + over_step.added
    np.testing.assert_allclose(after / size, found / size, atol=1e-12)
    root = markov.root_of(found)
    np.testing.assert_allclose(root @ root.T / size, found / size, atol=1e-13)


def test_rotors_turn_at_rates_of_their_own_that_wander_as_asked(clouds):
    cloud = clouds["DJI Mini 2"]
    settings = {"spread": 0.05, "wander": 0.0, "correlation_s": 1.5}
    turns = [
        rotor_spread.perturb(settings, cloud, ROW, TIMES_S, stream(1, "r", k)).angle_rad
        for k in range(300)
    ]
    rates = np.array([[angle[-1] for angle in turn.values()] for turn in turns]) / (
        2 * np.pi * 80.0 * TIMES_S[-1]
    )
    assert rates.shape == (300, 4)
    assert np.std(rates / cloud.rate_factors[cloud.parts_of("rotor")]) == pytest.approx(
        0.05, rel=0.1
    )
    settings = {"spread": 0.0, "wander": 0.02, "correlation_s": 0.1}
    turns = [
        rotor_spread.perturb(settings, cloud, ROW, TIMES_S, stream(1, "w", k)).angle_rad
        for k in range(300)
    ]
    ends = np.array([[angle[-1] for angle in turn.values()] for turn in turns]) / (2 * np.pi * 80.0)
    # The integral of an Ornstein-Uhlenbeck process over T: 2 s^2 c^2 (T / c - 1 + exp(-T / c)).
    truth = 0.02 * 0.1 * np.sqrt(2 * (10.0 - 1 + np.exp(-10.0)))
    assert np.std(ends / cloud.rate_factors[cloud.parts_of("rotor")]) == pytest.approx(
        truth, rel=0.1
    )


def blown(cloud, seed, **changes):
    return gusts.perturb(gusts.DEFAULTS | changes, cloud, ROW, TIMES_S, stream(1, "gusts", seed))


def test_a_small_drone_keeps_its_place_within_a_decimetre_and_leans_against_gusts(clouds):
    drawn = [blown(clouds["DJI Mini 2"], seed) for seed in range(40)]
    offset = np.stack([each.offset_m for each in drawn])
    tilt = np.stack([each.tilt_rad for each in drawn])
    assert not offset[:, 0].any() and 0.01 < np.std(offset[:, -1]) < 1.0
    assert not tilt[..., 0].any() and 0.1 < np.degrees(np.std(tilt[..., 1:])) < 15
    # Twice the wind at the same airspeed is turbulence of twice the intensity and no other law.
    doubled = [blown(clouds["DJI Mini 2"], seed, wind_mps=15.4) for seed in range(40)]
    assert np.std([each.tilt_rad for each in doubled]) > 1.7 * np.std(tilt)


def test_a_heavy_craft_is_moved_less_and_a_bird_does_not_pitch(clouds):
    light, heavy = (
        np.mean([np.std(blown(clouds[name], seed).tilt_rad) for seed in range(20)])
        for name in ("DJI Mini 2", "EH 216 S")
    )
    assert heavy < light
    bird = blown(clouds["Crow"], 0)
    assert not bird.tilt_rad[:, :2].any() and bird.tilt_rad[:, 2].any()


def test_what_stands_on_the_ground_is_not_moved(clouds):
    for effect in (rotor_spread, gusts):
        still = effect.perturb(
            effect.DEFAULTS, clouds["Audi A6L 2019"], ROW, TIMES_S, stream(1, "c")
        )
        assert not still.angle_rad and still.offset_m is None and still.tilt_rad is None


def test_turbulence_and_wind_are_those_of_the_standard():
    """Lengths and intensities of MIL-F-8785C, 3.7.

    At 1000 ft lengths are 1000 ft and intensities equal; at 20 ft the wind itself counts.
    """
    scales, intensities = gusts.turbulence(304.8, 10.0)
    np.testing.assert_allclose(scales, 304.8, rtol=1e-9)
    np.testing.assert_allclose(intensities, 1.0, rtol=1e-9)
    assert gusts.mean_wind_mps(20 * 0.3048, 7.7) == pytest.approx(7.7)
    scales, intensities = gusts.turbulence(30.48, 10.0)
    ratio = 0.177 + 0.000823 * 100
    np.testing.assert_allclose(scales, [30.48 / ratio**1.2] * 2 + [30.48], rtol=1e-9)
    np.testing.assert_allclose(intensities, [1 / ratio**0.4] * 2 + [1.0], rtol=1e-9)


def test_masses_are_the_makers_and_grow_with_size(clouds):
    assert flight.mass_kg(clouds["DJI Mini 2"]) == pytest.approx(0.249, rel=1e-9)
    assert flight.mass_kg(clouds["EH 216 S"]) == pytest.approx(620.0, rel=1e-9)
    # A wing span of 1.17 m M^0.39: Rayner 1988.
    span_m = clouds["Crow"].record.get("wing_span_m") or 2 * flight.length_m(clouds["Crow"])
    assert 1.17 * flight.mass_kg(clouds["Crow"]) ** 0.39 == pytest.approx(span_m)
    level, up = flight.response_s(clouds["Crow"], 10.0)
    assert level > 10 * up


def test_thrust_points_where_the_craft_accelerates_to():
    """The body's up axis, turned by pitch and roll, has the direction of (right, front, gravity)."""
    for right, front in ((1.5, 0.0), (0.0, 1.5), (-0.4, 0.3)):
        _, pitch, roll = gusts.tilt(np.array([[right, front, 0.0]]), pitches=True)[0]
        thrust = attitude(0.0, pitch, roll) @ [0.0, 0.0, 1.0]
        np.testing.assert_allclose(
            thrust[:2] / thrust[2], np.array([right, front]) / 9.80665, rtol=0.01
        )


def test_a_rotor_s_spread_is_a_share_of_its_own_rate(clouds):
    cloud = clouds["DJI Mini 2"]
    first, second = cloud.parts_of("rotor")[:2]
    faster = replace(cloud, record=cloud.record | {"rate_factors": {cloud.names[second]: 5.4}})
    plain, own = (
        rotor_spread.perturb(rotor_spread.DEFAULTS, it, ROW, TIMES_S, stream(2, "f")).angle_rad
        for it in (cloud, faster)
    )
    assert (plain[first] == own[first]).all()
    np.testing.assert_allclose(own[second], 5.4 * plain[second], rtol=1e-12)


def test_targets_answer_the_air_as_their_masses_drag_and_lift_say(clouds):
    mini, crow, taxi = (clouds[name] for name in ("DJI Mini 2", "Crow", "EH 216 S"))
    # A plate of 0.15 L^2 and a rotor drag of 0.465 / s at 0.3 m, that falls with the root of the
    # length.
    rate = 1.225 * 0.15 * 0.2192**2 * 10 / 0.249 + 0.465 * np.sqrt(0.3 / 0.2192)
    assert flight.response_s(mini, 10.0) == pytest.approx([1 / rate] * 2)
    # A lift to drag of 6, drag with the square of the speed: 6 V / (2 g).
    assert flight.response_s(crow, 10.0)[0] == pytest.approx(60 / (2 * 9.80665))
    assert [flight.attitude_s(cloud) for cloud in (mini, taxi)] == pytest.approx(
        [0.1 * np.sqrt(0.2192 / 0.4), 0.1 * np.sqrt(5.2704 / 0.4)]
    )


def wind_of(seed):
    """Where the wind of `blown` goes, (2,): the first draw of its stream."""
    heading = stream(1, "gusts", seed).uniform(0, 2 * np.pi)
    return np.array([np.cos(heading), np.sin(heading)])


def test_who_drifts_with_the_wind_meets_turbulence_that_hardly_changes(clouds):
    ahead = gusts.mean_wind_mps(ROW["z_m"], 7.7) * wind_of(0)
    changed = []
    for sign in (1, -1):
        row = ROW | {"vx_mps": sign * ahead[0], "vy_mps": sign * ahead[1]}
        tilt = gusts.perturb(
            gusts.DEFAULTS, clouds["DJI Mini 2"], row, TIMES_S, stream(1, "gusts", 0)
        ).tilt_rad
        changed.append(np.std(np.diff(tilt[:, 1:], axis=0)))
    assert changed[0] < 0.2 * changed[1]


def test_gusts_along_and_across_the_wind_have_nothing_to_do_with_each_other(clouds):
    row = ROW | {"vx_mps": 0.0, "vy_mps": 0.0}
    products = []
    for seed in range(200):
        drawn = gusts.perturb(
            gusts.DEFAULTS, clouds["DJI Mini 2"], row, TIMES_S[::40], stream(1, "gusts", seed)
        )
        (x, y), moved = wind_of(seed), drawn.offset_m[-1, :2]
        along = moved @ [x, y]
        across = moved @ [-y, x]
        # What a mistaken axis across has in common with the one along changes sign eight times in a
        # circle.
        products.append([np.sign(x * y * (x * x - y * y)) * along * across, along**2, across**2])
    both, first, second = np.mean(products, axis=0)
    assert abs(both) < 0.15 * np.sqrt(first * second)


def test_where_the_nose_points_changes_no_thrust(clouds):
    pushes = []
    for yaw_rad in (0.4, 2.0, -1.0):
        drawn = gusts.perturb(
            gusts.DEFAULTS,
            clouds["DJI Mini 2"],
            ROW | {"yaw_rad": yaw_rad},
            TIMES_S,
            stream(1, "n"),
        )
        front = -np.tan(drawn.tilt_rad[:, 1])
        right = np.tan(drawn.tilt_rad[:, 2])
        pushes.append(np.stack([right, front, 0 * front], axis=1) @ attitude(yaw_rad, 0.0, 0.0).T)
    np.testing.assert_allclose(pushes[1:], [pushes[0]] * 2, atol=1e-12)
