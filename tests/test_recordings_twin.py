"""The radar's twin: what was set is read back out of its signals, and its courses keep their laws."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recordings import figures, kinds
from lowalt.recordings.courses import hover, straight, to_and_fro
from lowalt.recordings.library import Library
from lowalt.recordings.presence import present
from lowalt.recordings.receiver import Receiver, received
from lowalt.recordings.scenes import clouds_of, heard, samples, stretch
from lowalt.recordings.sets import halves, recordings
from lowalt.recordings.twin import Twin, beam_gain, blade_points, echo, still_row, strengthened, textured
from lowalt.targets.records import load_records

QUIET = {
    "snr_db": 60.0, "flicker_db": -60.0, "flicker_hz": 5.0, "wander_db": 0.0, "leak_db": -80.0, "hum_db": -80.0,
    "hum_hz": 50.0,
}  # fmt: skip
TWIN = Twin(3.3e9, "complex", 5000.0, 2e-4, 400, "bare", 0.0, 0.0)


@pytest.fixture(scope="module")
def records():
    return load_records(
        "config/targets.csv", [f"config/targets/{name}.yaml" for name in ("uav", "bird", "vehicle", "pedestrian")]
    )


@pytest.fixture(scope="module")
def quadrotor(records):
    return clouds_of(records, ["DJI Mini 2"], 1)["DJI Mini 2"]


def signal(records, twin, scene, seconds, seed=0):
    """Signal at the symbol rate of one scene without noise to speak of."""
    rng = np.random.default_rng(seed)
    echoes, _ = heard(twin, scene, clouds_of(records, scene["subtypes"], 1), rng, seconds)
    return stretch(samples(twin, scene["receiver"], echoes, rng), twin, seconds)


HOVER = {
    "subtypes": ["DJI Mini 2"], "course": "hover", "distance_m": 3.0, "height_m": 0.5, "sway_m": 0.0, "sway_hz": 0.5,
    "rock_deg": 0.0, "rate_hz": 161.0, "receiver": QUIET,
}  # fmt: skip


@pytest.mark.parametrize("foil, times", [("10000000", 1), ("11000000", 2), ("11111111", 2)])
def test_foil_on_one_blade_of_two_halves_the_spacing_of_the_lines(records, foil, times):
    scene = {**HOVER, "strength_db": {"rotor": -20.0, "foil": 40.0}, "foils": [foil]}
    found = signal(records, TWIN, scene, 1.2)
    assert figures.line_spacing_hz(found - found.mean(), 5000.0, 60.0, 500.0) == pytest.approx(times * 161.0, abs=3)


def test_the_doppler_edge_is_the_blade_tip_speed(records, quadrotor):
    scene = {**HOVER, "strength_db": {"body": -40.0}, "tip": 6.0}
    spec = {"window": 256, "hop": 16, "slowest_mps": 2.0, "spacing_hz": [60.0, 500.0]}
    edge = kinds.rotor_figures(signal(records, TWIN, scene, 0.5), 5000.0, SPEED_OF_LIGHT / 3.3e9, spec)["edge_mps"]
    blade = blade_points(quadrotor)[0]
    reach = np.hypot(*(quadrotor.points[blade] - quadrotor.hinges[quadrotor.part[blade[0]]])[:, :2].T).max()
    assert edge == pytest.approx(2 * np.pi * 161.0 * reach, rel=0.12)


def test_a_car_that_drives_past_shows_the_cosine_of_its_aspect(records):
    twin = Twin(24.0e9, "real", 12000.0, 2.5e-4, 400, "anti_aliased", 0.3, 15.0)
    scene = {
        "subtypes": ["Audi A6L 2019"], "course": "pass", "lateral_m": 4.0, "ahead_m": 10.0, "height_m": 0.0,
        "speed_mps": 8.0, "receiver": QUIET, "strength_db": {"wheel": -40.0},
    }  # fmt: skip
    found = signal(records, twin, scene, 1.5)
    times, frequency, shown = figures.spectrogram(found, 4000.0, 512, 128)
    keep = frequency > 0
    speeds = frequency[keep] * SPEED_OF_LIGHT / 24.0e9 / 2
    line = figures.tracks(shown[keep], speeds, 0.5)["line"]
    along = 10.0 + 8.0 * (times + 40 * 2.5e-4)
    wanted = 8.0 * along / np.hypot(along, 4.0)
    # The car is 5 m long, and its near end is the strong one: half its length shifts the aspect.
    nearer = 8.0 * (along - 2.5) / np.hypot(along - 2.5, 3.0)
    assert (np.abs(line - (wanted + nearer) / 2) < 0.6).all()
    spec = {"window": 512, "hop": 128, "slowest_mps": 2.0}
    assert kinds.drive_figures(found, 4000.0, SPEED_OF_LIGHT / 24.0e9, spec)["speed_mps"] == pytest.approx(7.9, abs=0.3)


def test_a_walker_turns_back_and_the_steps_keep_to_the_ground_covered():
    times = np.linspace(0, 20, 20001)
    course = to_and_fro(times, 1.0, 6.0, 1.25, 1.0, 1.4, 0.3, 0.0)
    along = np.array([-np.sin(0.3), np.cos(0.3)])
    distance = course.place_m[:, :2] @ along
    np.testing.assert_allclose(course.place_m[:, :2], distance[:, None] * along, atol=1e-12)
    assert distance.min() == pytest.approx(1.0 + 0.0, abs=1e-3)
    assert distance.max() == pytest.approx(6.0, abs=1e-3)
    speed = np.gradient(distance, times)
    assert abs(speed).max() == pytest.approx(1.25, rel=1e-3)
    # The clock of the limbs runs with the speed's size, and the body looks where it goes.
    np.testing.assert_allclose(np.gradient(course.clock_s, times), abs(speed) / 1.4, atol=2e-3)
    fast = abs(speed) > 1.24
    heading = np.cos(course.tilt_rad[fast, 0] - 0.3)
    np.testing.assert_allclose(heading, np.sign(speed[fast]), atol=0.1)
    assert abs(np.diff(course.tilt_rad[:, 0])).max() < 0.01 or np.isclose(
        abs(np.diff(course.tilt_rad[:, 0])).max(), 2 * np.pi
    )
    with pytest.raises(InputError, match="no room to turn"):
        to_and_fro(times, 1.0, 1.2, 1.25, 1.0, 1.4, 0.0, 0.0)


def test_a_hovering_craft_sways_as_much_as_set_and_stays():
    times = np.linspace(0, 2000, 200001)
    course = hover(times, np.array([0, 3.0, 1.0]), 0.5, 0.02, 0.5, 0.01, np.random.default_rng(0))
    moved = course.place_m - [0, 3.0, 1.0]
    np.testing.assert_allclose(moved.std(axis=0), 0.02, rtol=0.05)
    np.testing.assert_allclose(course.tilt_rad[:, 1:].std(axis=0), 0.01, rtol=0.05)
    np.testing.assert_allclose(moved.mean(axis=0), 0, atol=1e-3)


def test_the_twins_echo_is_a_direct_sum_over_the_points(quadrotor):
    times = np.arange(64) / 5000.0
    course = straight(times, np.array([0.5, 4.0, 1.0]), 5.0, 0.7)
    row = still_row(quadrotor, 161.0, np.random.default_rng(1))
    found = echo(TWIN, quadrotor, row, course, times, 0.0, 0.0, np.random.default_rng(2))
    from lowalt.motion import positions

    moving = row | {"x_m": 0.5, "y_m": 4.0, "z_m": 1.0, "yaw_rad": 0.7}
    moving |= {"vx_mps": -5.0 * np.sin(0.7), "vy_mps": 5.0 * np.cos(0.7)}
    distance = np.linalg.norm(positions(quadrotor, moving, times), axis=2)
    wavelength = SPEED_OF_LIGHT / 3.3e9
    amplitude = wavelength * np.sqrt(quadrotor.rcs_m2) / ((4 * np.pi) ** 1.5 * distance**2)
    wanted = (amplitude * np.exp(-4j * np.pi * distance / wavelength)).sum(axis=1)
    np.testing.assert_allclose(found, wanted, atol=1.1e-4 * abs(wanted).max())


def test_strengths_and_textures_touch_what_they_name(quadrotor):
    stronger = strengthened(quadrotor, {"rotor": 10.0})
    ratio = stronger.rcs_m2 / quadrotor.rcs_m2
    turning = np.isin(quadrotor.part, quadrotor.parts_of("rotor"))
    np.testing.assert_allclose(ratio[turning], 10.0)
    np.testing.assert_array_equal(ratio[~turning], 1.0)
    with pytest.raises(InputError, match="strength of 'leg'"):
        strengthened(quadrotor, {"leg": 1.0})
    with pytest.raises(InputError, match="expected one digit 0 or 1 for each of 8 blades"):
        strengthened(quadrotor, {"foil": 1.0}, "101")
    uneven = textured(quadrotor, 8.0, 3.0, np.random.default_rng(0))
    for part in range(len(quadrotor.kinds)):
        mine = quadrotor.part == part
        assert uneven.rcs_m2[mine].mean() == pytest.approx(quadrotor.rcs_m2[mine].mean())
        assert uneven.rcs_m2[mine].std() > 0
    assert textured(quadrotor, 0.0, 0.0, np.random.default_rng(0)).rcs_m2 == pytest.approx(quadrotor.rcs_m2)


def test_the_beam_is_half_the_power_one_way_at_half_its_width():
    angle = np.radians([0.0, 20.0, 90.0, 180.0])
    places = 5 * np.stack([np.sin(angle), np.cos(angle), 0 * angle], 1)
    gain = beam_gain(places, 40.0, -20.0)
    np.testing.assert_allclose(20 * np.log10(gain), [0.0, -6.0, -40.0, -40.0], atol=1e-6)
    np.testing.assert_array_equal(beam_gain(places, 0.0, -20.0), 1.0)


def test_the_receiver_adds_as_much_as_set():
    rng = np.random.default_rng(0)
    echoes = np.exp(2j * np.pi * 0.1 * np.arange(200_000))
    settings = {**QUIET, "snr_db": 10.0, "leak_db": 20.0}
    added = received(echoes, 5000.0, Receiver.from_settings(settings), False, rng) - echoes
    assert abs(added.mean()) == pytest.approx(10.0, rel=1e-2)
    assert np.mean(abs(added - added.mean()) ** 2) == pytest.approx(0.1, rel=0.02)
    assert np.isrealobj(received(echoes, 5000.0, Receiver.from_settings(settings), True, rng))


def test_figures_of_known_signals():
    time = np.arange(400)
    tone = np.exp(2j * np.pi * 0.125 * time)
    found = figures.interval_figures(tone, 10.0, "both")
    assert found["line_mps"] == pytest.approx(2.5)
    assert found["edge_mps"] == pytest.approx(2.5, abs=0.15)
    noise = np.random.default_rng(0).standard_normal((2, 400))
    white = figures.interval_figures(noise[0] + 1j * noise[1], 10.0, "both")
    assert found["entropy"] < 0.3 < 0.85 < white["entropy"]
    assert found["kurtosis"] > 30 > 5 > white["kurtosis"]
    # Above half the symbol rate a one-sided real channel means speeds beyond the edge.
    assert figures.interval_figures(tone.conj(), 10.0, "wrapped")["line_mps"] == pytest.approx(17.5)
    beats = (1 + np.cos(2 * np.pi * np.arange(2000) / 50)) * np.ones((3, 1))
    assert figures.cycle_s(beats, 0.01, 0.2, 1.8) == pytest.approx(0.5, abs=0.011)


def test_intervals_without_a_target_are_left_out():
    rng = np.random.default_rng(0)
    intervals = 0.01 * (rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400)))
    assert present(intervals, TWIN).all()
    looking = replace(TWIN, detect_db=15.0)
    assert not present(intervals, looking).any()
    intervals[10:20] += 0.01 * np.exp(2j * np.pi * 0.1 * np.arange(400))
    assert present(intervals, looking).nonzero()[0].tolist() == list(range(10, 20))
    # A drift slower than any target does not count as one.
    slow = replace(looking, slowest_mps=10.0)
    intervals[25:35] += np.exp(2j * np.pi * 0.001 * np.arange(400))
    assert present(intervals, slow).nonzero()[0].tolist() == list(range(10, 20))


def test_the_committed_configuration_is_whole_and_its_halves_share_no_file():
    library = Library.read("config/measured/twins.yaml")
    sets = load_yaml("config/measured/sets.yaml")
    assert sorted(name for names in library.sets.values() for name in names) == sorted(sets)
    split = halves("config/measured/split.yaml")
    assert set(split) == set(sets)
    for block in split.values():
        assert block["tuning"] and block["test"] and not set(block["tuning"]) & set(block["test"])
    for pair in load_yaml("config/measured/pictures.yaml")["pairs"].values():
        assert pair["file"] in split[pair["set"]]["tuning"]
        Twin.from_settings(pair["radar"])


def test_files_of_a_set_that_came_later_are_test_files(tmp_path):
    (tmp_path / "walker_24ghz").mkdir()
    for name in ("PCM2900_Best_Walking_Data.wav", "tomorrow.wav"):
        (tmp_path / "walker_24ghz" / name).write_bytes(b"")
    found = recordings(tmp_path, "config/measured/sets.yaml", "config/measured/split.yaml")
    assert {one.name: one.half for one in found} == {"PCM2900_Best_Walking_Data.wav": "tuning", "tomorrow.wav": "test"}
    with pytest.raises(InputError, match="no recordings of"):
        recordings(tmp_path / "walker_24ghz", "config/measured/sets.yaml", "config/measured/split.yaml")
