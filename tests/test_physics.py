"""Physics read back out of the signal: a rate that was set is found again, folded where it folds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from lowalt.config.layers import load_yaml
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.echo import Rigid, echo_signal
from lowalt.motion import poses, positions
from lowalt.motion.drawing import draw, region_polygon
from lowalt.motion.table import NUMBERS
from lowalt.numerics.streams import stream
from lowalt.spectra import Spectra, trp, vrp
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from lowalt.targets.skeleton import FEET

NETWORK = Network.from_settings(load_yaml("config/default.yaml")["network"])
NOTHING = np.full(3, np.nan)
KINDS = "uav", "bird", "vehicle", "pedestrian"
RECORDS = load_records("config/targets.csv", [f"config/targets/{name}.yaml" for name in KINDS])


def spinning(kind: str, category: str, radius_m: float, blades: int, **record) -> Cloud:
    """A strong body point and `blades` points on a circle about z (a rotor) or about -x (a wheel)."""
    axis = np.array([0.0, 0.0, 1.0]) if kind == "rotor" else np.array([-1.0, 0.0, 0.0])
    angle = 2 * math.pi * np.arange(blades) / blades
    ring = {
        "rotor": [np.cos(angle), np.sin(angle), 0 * angle],
        "wheel": [0 * angle, np.cos(angle), np.sin(angle)],
    }[kind]
    return Cloud(
        points=np.vstack([np.zeros(3), radius_m * np.stack(ring, axis=1)]),
        part=np.array([0] + [1] * blades),
        kinds=("body", kind),
        names=("body", kind),
        parents=np.array([-1, -1]),
        hinges=np.array([NOTHING, np.zeros(3)]),
        axes=np.array([NOTHING, axis]),
        normals=np.full((blades + 1, 3), np.nan),
        rcs_m2=np.ones(blades + 1),
        record={
            "subtype": "test",
            "category": category,
            "source": "test",
            "checksum": "",
            **record,
        },
    )


def signal(
    cloud: Cloud, network: Network = NETWORK, station: str = "A", **values: float
) -> np.ndarray:
    """The clean signal of a cloud; motion values not given are zero, phases too."""
    row = {"subtype": "test", "model": 0, **dict.fromkeys(NUMBERS, 0.0), "playback": 1.0, **values}
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
    return echo_signal(network, network.station(station), motion, cloud.rcs_m2, aim).signal


def test_arrays_of_the_default_look_at_the_middle_and_sub_bands_follow_each_other():
    middle = np.mean([station.position_m for station in NETWORK.stations], axis=0)
    for number, station in enumerate(NETWORK.stations):
        assert station.frequency_hz == 4.9e9 + number * (255 + 10) * 120e3
        ahead = (middle - station.position_m) / np.linalg.norm(middle - station.position_m)
        # The horizontal axis points to the left of where the array looks.
        np.testing.assert_allclose(station.horizontal, np.cross([0, 0, 1], ahead), atol=1e-9)


def fold(frequency_hz: float, rate_hz: float = 400.0) -> float:
    """The frequency a line of `frequency_hz` shows at when sampled at `rate_hz`."""
    return (frequency_hz + rate_hz / 2) % rate_hz - rate_hz / 2


@pytest.mark.parametrize(
    ("rate_hz", "seen_hz"), [(40, 80), (60, 120), (160, -80), (256, 112), (660, 120)]
)
def test_a_two_blade_rotor_shows_twice_its_rate_folded(rate_hz, seen_hz):
    assert fold(2 * rate_hz) == seen_hz
    # 4 mm keeps the modulation index under one, so the first pair of lines is the strongest after
    # the body's.
    found = signal(
        spinning("rotor", "UAV", 0.004, 2), x_m=200.0, y_m=120.0, z_m=60.0, rate_hz=float(rate_hz)
    )
    spectrum = vrp(found[None])[0].mean(axis=1)
    axis = (np.arange(256) - 128) * 400 / 256
    lines = axis[np.argsort(np.where(np.abs(axis) < 5, 0, spectrum))[-2:]]
    np.testing.assert_allclose(
        sorted(lines), sorted([seen_hz, -seen_hz]), atol=400 / 256 / 2 + 1e-9
    )


def test_a_wing_beat_is_the_period_of_the_spectrum():
    flap = {"mean_deg": 15, "amplitude_deg": 40, "fold_amplitude_deg": 30, "fold_lag_deg": 90}
    wing = np.linspace(0.05, 0.4, 8)[:, None] * [1.0, 0, 0]
    cloud = Cloud(
        points=np.vstack([np.zeros(3), wing]),
        part=np.array([0] + [1] * 8),
        kinds=("body", "wing"),
        names=("body", "wing"),
        parents=np.array([-1, -1]),
        hinges=np.array([NOTHING, np.zeros(3)]),
        axes=np.array([NOTHING, [0, -1.0, 0]]),
        normals=np.full((9, 3), np.nan),
        rcs_m2=np.ones(9),
        record={
            "subtype": "test",
            "category": "Bird",
            "source": "test",
            "checksum": "",
            "flap": flap,
        },
    )
    beat_hz = 5.0
    found = trp(signal(cloud, x_m=150.0, y_m=90.0, z_m=40.0, rate_hz=beat_hz)[None])[0]
    columns = found - found.mean(axis=1, keepdims=True)
    likeness = [
        np.vdot(columns[:, lag:], columns[:, :-lag])
        / (np.linalg.norm(columns[:, lag:]) * np.linalg.norm(columns[:, :-lag]))
        for lag in range(20, 200)
    ]
    period = 20 + int(np.argmax(likeness)) if max(likeness) > 0.999 else 0
    assert period in (80, 160)
    assert likeness[80 - 20] > 0.999 > likeness[40 - 20]


def test_a_wheel_turns_at_the_rate_its_diameter_sets():
    speed = 5.0
    diameter = 0.5588
    rate_hz = speed / (math.pi * diameter)
    # One subcarrier has one range cell: no cell crossing disturbs the phase over ten seconds.
    network = replace(NETWORK, subcarriers=1, symbols=4000, transmit=(1, 1), receive=(1, 1))
    motion = {"x_m": 250.0, "y_m": 100.0, "z_m": 0.3, "vy_mps": speed, "rate_hz": rate_hz}
    found = signal(
        spinning("wheel", "Vehicle", 0.004, 1, wheel_diameter_m=diameter), network, **motion
    )
    path = np.array([250.0, 100.0, 0.3]) + network.times_s[:, None] * [0, speed, 0]
    range_m = np.linalg.norm(path - network.station("A").position_m, axis=1)
    still = found * np.exp(4j * np.pi * network.carrier_hz * range_m / SPEED_OF_LIGHT)
    spectrum = np.abs(np.fft.fft((still - still.mean()) * np.hanning(4000)))
    axis = np.fft.fftfreq(4000, 2.5e-3)
    spectrum[np.abs(axis) < 1] = 0
    assert abs(axis[np.argmax(spectrum)]) == pytest.approx(rate_hz, abs=0.1)


@pytest.mark.parametrize("speed", [-3.0, 2.0, 5.9])
def test_a_receding_target_has_negative_doppler_at_the_effective_carrier(speed):
    station = NETWORK.station("A")
    direction = np.array([math.cos(station.normal_rad), math.sin(station.normal_rad), 0.0])
    body = spinning("rotor", "UAV", 0.0, 1)
    start = np.array(station.position_m) + 200.3 * direction
    values = {f"{axis}_m": start[i] for i, axis in enumerate("xyz")}
    values |= {f"v{axis}_mps": speed * direction[i] for i, axis in enumerate("xyz")}
    found = signal(body, **values)
    # The phase advances by the effective carrier inside a range cell, f_k + (M - 1) df / 2.
    carrier = station.frequency_hz + 255 * 120e3 / 2
    step = np.angle(found[1:] * found[:-1].conj())
    doppler_hz = np.median(step) / (2 * math.pi * 2.5e-3)
    assert doppler_hz == pytest.approx(-2 * speed * carrier / SPEED_OF_LIGHT, abs=1e-6)


def doppler_hz(cloud: Cloud, row: dict, point: int, symbols: int) -> float:
    """The mean Doppler of one point of a target, for a station 300 m ahead of it."""
    front = np.array([-math.sin(row["yaw_rad"]), math.cos(row["yaw_rad"]), 0.0])
    place = np.array([row["x_m"], row["y_m"], row["z_m"]]) + 300.0 * front
    station = replace(NETWORK.station("A"), position_m=tuple(place))
    network = replace(
        NETWORK,
        subcarriers=1,
        symbols=symbols,
        symbol_interval_s=1e-4,
        transmit=(1, 1),
        receive=(1, 1),
    )
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    own = (np.arange(len(cloud.points)) == point).astype(float)
    found = echo_signal(
        replace(network, stations=(station,)), station, motion, own, place - 300.0 * front
    ).signal
    return float(np.angle(found[1:] * found[:-1].conj()).mean() / (2 * math.pi * 1e-4))


@pytest.mark.parametrize("name", ["Audi A6L 2019", "Walking Pedestrian 1"])
def test_a_ground_target_that_faces_the_station_approaches_and_the_top_of_its_wheels_is_faster(
    name,
):
    cloud = make(RECORDS[name], None, 1)
    corners = region_polygon(np.array([[0.0, 0.0], [500.0, 0.0], [250.0, 433.0]]), None)
    settings = load_yaml("config/default.yaml")["motion"]
    row = draw(
        stream(1, name), cloud, RECORDS[name]["published"], np.full((1, 2), -1e4), corners, settings
    )
    row["model"] = 0
    speed = math.hypot(row["vx_mps"], row["vy_mps"])
    one_mps = 2 * NETWORK.station("A").frequency_hz / SPEED_OF_LIGHT
    # Ten seconds of one point in the middle: a walker's root sways, but gets no farther.
    assert doppler_hz(cloud, row, 0, 100_000) == pytest.approx(speed * one_mps, rel=0.02)
    for wheel in cloud.parts_of("wheel"):
        mine = np.flatnonzero(cloud.part == wheel)
        height = positions(cloud, row, np.zeros(1))[0, mine, 2] / cloud.record["wheel_diameter_m"]
        top, bottom = (
            doppler_hz(cloud, row, mine[at], 3) for at in (height.argmax(), height.argmin())
        )
        assert top == pytest.approx(2 * speed * one_mps * height.max(), rel=0.05)
        assert bottom < 0.5 * speed * one_mps < speed * one_mps < top


def test_a_walkers_foot_on_the_ground_stays_there():
    cloud = make(RECORDS["Walking Pedestrian 1"], None, 1)
    speed = cloud.record["track_speed_mps"]
    times = np.arange(400) * 2.5e-3
    row = {
        "subtype": "test",
        "model": 0,
        **dict.fromkeys(NUMBERS, 0.0),
        "playback": 1.0,
        "vy_mps": speed,
    }
    feet = positions(cloud, row, times)[:, FEET]
    lowest = feet[:-1, :, 2].argmin(axis=1)
    along = (
        np.take_along_axis(np.diff(feet[..., 1], axis=0), lowest[:, None], axis=1)[:, 0] / 2.5e-3
    )
    assert abs(np.median(along)) < 0.3 * speed


def test_doppler_of_200_hz_sits_on_the_fold():
    # One subcarrier: at 6 m/s a range cell is crossed within the window, which would split the
    # line.
    network = replace(NETWORK, subcarriers=1)
    station = network.station("A")
    speed = 200.0 * SPEED_OF_LIGHT / (2 * station.frequency_hz)
    direction = np.array([math.cos(station.normal_rad), math.sin(station.normal_rad), 0.0])
    start = np.array(station.position_m) + 200.3 * direction
    values = {f"{axis}_m": start[i] for i, axis in enumerate("xyz")}
    values |= {f"v{axis}_mps": speed * direction[i] for i, axis in enumerate("xyz")}
    spectrum = vrp(signal(spinning("rotor", "UAV", 0.0, 1), network, **values)[None], Spectra())[0]
    # Row 0 of a centred transform is -200 Hz, and +200 Hz folds onto it.
    assert (np.argmax(spectrum, axis=0) == 0).all()
