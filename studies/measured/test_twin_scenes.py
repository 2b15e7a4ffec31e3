"""The radar's twin: what was set is read back out of its signals, and its courses keep their laws."""

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_courses import drive, hover, straight, to_and_fro
from lowalt.extensions.recordings.twin_echo import (
    beam_gain,
    blade_points,
    echo,
    still_row,
    strengthened,
    textured,
)
from lowalt.extensions.recordings.twin_others import KINDS, other_echo
from lowalt.extensions.recordings.twin_receiver import Receiver, received
from lowalt.extensions.recordings.twin_scenes import (
    MARGIN,
    Library,
    clouds_of,
    heard,
    samples,
    stretch,
)
from lowalt.files.errors import InputError
from lowalt.targets.records import load_records

QUIET = {
    "snr_db": 60.0,
    "flicker_db": -60.0,
    "flicker_hz": 5.0,
    "wander_db": 0.0,
    "leak_db": -80.0,
    "hum_db": -80.0,
    "hum_hz": 50.0,
}
TWIN = Twin(3.3e9, "complex", 5000.0, 2e-4, 400, "bare", 0.0, 0.0)


@pytest.fixture(scope="module")
def records():
    return load_records(
        "config/targets.csv",
        [f"config/targets/{name}.yaml" for name in ("uav", "bird", "vehicle", "pedestrian")],
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
    "subtypes": ["DJI Mini 2"],
    "course": "hover",
    "distance_m": 3.0,
    "height_m": 0.5,
    "sway_m": 0.0,
    "sway_hz": 0.5,
    "rock_deg": 0.0,
    "rate_hz": 161.0,
    "receiver": QUIET,
}


def powers(signal, rate_hz):
    """Frequencies (Hz) and powers of a signal without its mean, Hann window."""
    power = np.abs(np.fft.fft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
    return np.fft.fftfreq(len(signal), 1 / rate_hz), power


@pytest.mark.parametrize(
    "foil, all_lines", [("10000000", True), ("11000000", False), ("11111111", False)]
)
def test_foil_on_one_blade_of_two_halves_the_spacing_of_the_lines(records, foil, all_lines):
    scene = {**HOVER, "strength_db": {"rotor": -20.0, "foil": 40.0}, "foils": [foil]}
    frequency, power = powers(signal(records, TWIN, scene, 1.2), 5000.0)
    turns = frequency / 161.0
    line = np.abs(turns - np.rint(turns)) < 0.02
    odd, even = (
        power[line & (np.rint(turns) % 2 == rest) & (turns > 0.5)].sum() for rest in (1, 0)
    )
    assert (odd > 0.1 * even) == all_lines and (odd < 1e-3 * even) != all_lines


def test_the_doppler_edge_is_the_blade_tip_speed(records, quadrotor):
    scene = {**HOVER, "strength_db": {"body": -40.0}, "tip": 6.0}
    frequency, power = powers(signal(records, TWIN, scene, 0.5), 5000.0)
    order = np.argsort(abs(frequency))
    share = np.cumsum(power[order]) / power.sum()
    edge = abs(frequency[order])[np.searchsorted(share, 0.95)] * SPEED_OF_LIGHT / 3.3e9 / 2
    blade = blade_points(quadrotor)[0]
    reach = np.hypot(
        *(quadrotor.points[blade] - quadrotor.hinges[quadrotor.part[blade[0]]])[:, :2].T
    ).max()
    assert edge == pytest.approx(2 * np.pi * 161.0 * reach, rel=0.12)


def test_a_car_that_drives_past_shows_the_cosine_of_its_aspect(records):
    twin = Twin(24.0e9, "real", 12000.0, 2.5e-4, 400, "anti_aliased", 0.3, 15.0)
    scene = {
        "subtypes": ["Audi A6L 2019"],
        "course": "pass",
        "lateral_m": 4.0,
        "ahead_m": 10.0,
        "height_m": 0.0,
        "speed_mps": 8.0,
        "receiver": QUIET,
        "strength_db": {"wheel": -40.0},
    }
    received_signal = signal(records, twin, scene, 1.5)
    starts = np.arange(0, len(received_signal) - 512, 128)
    spectra = [powers(received_signal[start : start + 512], 4000.0) for start in starts]
    line = (
        np.array([frequency[power.argmax()] for frequency, power in spectra])
        * SPEED_OF_LIGHT
        / 24.0e9
        / 2
    )
    along = 10.0 + 8.0 * (starts + 256 + MARGIN) * 2.5e-4
    wanted = 8.0 * along / np.hypot(along, 4.0)
    # The car is 5 m long, and its near end is the strong one: half its length shifts the aspect.
    nearer = 8.0 * (along - 2.5) / np.hypot(along - 2.5, 3.0)
    assert (np.abs(line - (wanted + nearer) / 2) < 0.6).all()


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


def test_a_walker_s_gait_begins_where_its_row_says(records):
    cloud = clouds_of(records, ["Walking Pedestrian 1"], 1)["Walking Pedestrian 1"]
    times = np.arange(16) / 5000.0
    course = straight(times, np.array([0.5, 4.0, 1.0]), 1.0, 0.7)
    row = still_row(cloud, 0.0, np.random.default_rng(1))
    later, moved, first = (
        echo(
            TWIN,
            cloud,
            row | {"start_s": start_s},
            course._replace(clock_s=times + clock_s),
            times,
            0.0,
            0.0,
            None,
        )
        for start_s, clock_s in ((0.4, 0.0), (0.0, 0.4), (0.0, 0.0))
    )
    np.testing.assert_allclose(later, moved, atol=1e-9 * abs(moved).max())
    assert abs(later - first).max() > 0.1 * abs(first).max()


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
    assert textured(quadrotor, 0.0, 0.0, np.random.default_rng(0)).rcs_m2 == pytest.approx(
        quadrotor.rcs_m2
    )


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


def test_wander_has_its_rms_in_decibels_and_flicker_its_corner():
    rng = np.random.default_rng(0)
    steady = np.exp(2j * np.pi * 700 / 5000 * np.arange(200_000))
    wandering = received(
        steady, 5000.0, Receiver.from_settings({**QUIET, "wander_db": 3.0}), False, rng
    )
    assert np.std(20 * np.log10(abs(wandering))) == pytest.approx(3.0, rel=0.02)
    # Flicker has half of its density at the corner, and a hundredth at ten times that.
    settings = Receiver.from_settings(
        {**QUIET, "snr_db": 0.0, "flicker_db": 30.0, "flicker_hz": 50.0}
    )
    noise = received(steady, 5000.0, settings, False, rng, target=False).reshape(100, 2000)
    density = np.mean(abs(np.fft.fft(noise, axis=1)) ** 2, axis=0) / 2000
    low, corner, high = (
        density[np.arange(2000) * 2.5 // width == place].mean()
        for width, place in ((5.0, 0), (5.0, 10), (50.0, 10))
    )
    assert (corner / low, high / low) == pytest.approx((0.5, 0.0106), rel=0.15)


def test_the_craft_at_3_ghz_has_propellers_of_its_maker_s_length():
    library = Library.read()
    scene, *_ = library.scenes["uav_3ghz"]["UAV"]
    cloud = clouds_of(library.records, scene["subtypes"], 1)[scene["subtypes"][0]]
    for blades in range(1, 5):
        tips = cloud.points[cloud.part == blades]
        # 4.7 inches from tip to tip.
        assert np.linalg.norm(tips[:, None] - tips, axis=2).max() == pytest.approx(
            4.7 * 0.0254, abs=5e-4
        )


def test_a_car_leaves_from_rest_stops_and_turns_and_its_clock_is_the_way():
    times = np.linspace(0, 4, 4001)
    leaves = drive(times, np.array([1.0, 2.0, 0.0]), 0.0, 0.0, 3.0, 0.0, 1.0)
    np.testing.assert_allclose(leaves.place_m[:, 1] - 2.0, 1.5 * times**2, atol=1e-9)
    np.testing.assert_allclose(leaves.clock_s, 1.5 * times**2, atol=1e-9)
    stops = drive(times, np.zeros(3), 6.0, np.pi, -3.0, 0.0, 2.0)
    np.testing.assert_allclose(stops.place_m[times > 2, 1], -6.0, atol=1e-9)
    np.testing.assert_allclose(stops.clock_s[-1], 3.0)
    # A bend of 10 m: after a quarter of the circle it stands 10 m ahead and 10 m to the left, and
    # looks there.
    bend = drive(times, np.zeros(3), 5 * np.pi / 4, 0.0, 0.0, 0.1, 1.0)
    np.testing.assert_allclose(bend.place_m[-1], [-10.0, 10.0, 0.0], atol=1e-6)
    assert bend.tilt_rad[-1, 0] == pytest.approx(np.pi / 2)
    speed = np.linalg.norm(np.gradient(bend.place_m, times, axis=0), axis=1)
    np.testing.assert_allclose(speed[1:-1], 5 * np.pi / 4, rtol=1e-5)


@pytest.mark.parametrize("kind", list(KINDS))
def test_what_belongs_to_no_class_has_unit_power_and_moves_no_faster_than_it_can(kind):
    twin = Twin(24.0e9, "real", 6000.0, 1 / 3000.0, 400, "one_sided", 0.4, 15.0)
    for seed in range(3):
        echo = other_echo(kind, twin, 2400, np.random.default_rng(seed))
        assert np.mean(np.abs(echo) ** 2) == pytest.approx(1.0)
        assert len(echo) == 2400 and np.ptp(np.abs(echo - echo.mean())) > 0
