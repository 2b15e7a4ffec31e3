"""Motion effects: the added motion is read back from the poses, and the random processes obey their laws."""

import math
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.effects.motion import gusts, rotor_spread
from lowalt.effects.motion.markov import steps
from lowalt.effects.view import summed
from lowalt.motion import Perturbation, poses
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


def test_perturbations_add_up_part_by_part_and_what_none_of_them_moves_is_none():
    angle, offset, tilt = TIMES, np.outer(TIMES, [1.0, 2.0, 3.0]), np.outer(TIMES, [4.0, 5.0, 6.0])
    assert summed([]) is None
    turned, moved = Perturbation({1: angle}), Perturbation({1: angle, 2: 3 * angle}, offset_m=offset)
    found = summed([turned, moved, moved])
    assert (found.angle_rad[1] == 3 * angle).all() and (found.angle_rad[2] == 6 * angle).all()
    assert (found.offset_m == 2 * offset).all() and found.tilt_rad is None
    found = summed([turned, Perturbation(tilt_rad=tilt)])
    assert found.offset_m is None and (found.tilt_rad == tilt).all()


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


@pytest.mark.parametrize("effect", [rotor_spread, gusts])
def test_one_symbol_is_enough_and_draws_repeat(effect):
    alone = effect.perturb(effect.DEFAULTS, craft(), ROW, TIMES[:1], np.random.default_rng(2))
    assert all(abs(angle).max() == 0 for angle in alone.angle_rad.values())
    first, second = (effect.perturb(effect.DEFAULTS, craft(), ROW, TIMES, np.random.default_rng(3)) for _ in range(2))
    assert str(first) == str(second)
