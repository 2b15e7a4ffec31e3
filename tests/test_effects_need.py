"""Physics by need: bounds that switch effects on and off, and the tolerance that leaving them out keeps."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.effects import need
from lowalt.effects.catalogue import BY_NEED
from lowalt.effects.received import received_signal
from test_effects import network, scene, target


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def whole(effects, radio, station, cloud, row):
    """Signals with everything the scene asks for computed."""
    return received_signal(scene(effects, None, radio), station, cloud, row)


def random_case(rng):
    """A scene over the configuration space: range, size, points, arrays, carrier, speed, tolerance, effects asked."""
    carrier = 10 ** rng.uniform(9, 10.5)
    shape = tuple(int(v) for v in rng.integers(1, 9, 2))
    radio = network(
        carrier_hz=carrier, subcarriers=int(rng.integers(1, 65)), symbols=12, transmit=shape,
        receive=shape if rng.random() < 0.5 else tuple(int(v) for v in rng.integers(1, 9, 2)),
    )  # fmt: skip
    points = int(rng.choice([2, 3, 6, 20]))
    cloud, row = target(rng, points, 10 ** rng.uniform(-3, 0.3), wheel_hz=10 ** rng.uniform(-1, 2.3))
    if rng.random() < 0.15:
        cloud, row = recording_of(rng, cloud), row | {"start_s": rng.random(), "playback": 1.0}
    range_m, angle = 10 ** rng.uniform(0.9, 4), rng.uniform(-1.4, 1.4)
    row |= {
        "x_m": range_m * np.cos(angle),
        "y_m": range_m * np.sin(angle),
        "z_m": 10.0 + range_m * rng.uniform(-0.3, 1),
    }
    speed = 10 ** rng.uniform(-2, 1.5)
    row |= {"vx_mps": speed * rng.normal(), "vy_mps": speed * rng.normal(), "vz_mps": 0.0}
    asked = [name for name in BY_NEED if rng.random() < 0.6] or [str(rng.choice(BY_NEED))]
    effects = {name: {} for name in asked} | (random_company(rng) if rng.random() < 0.6 else {})
    if "ground_reflection" in effects:
        row["z_m"] = max(row["z_m"], 4.0)
    return radio, cloud, row, effects, 10 ** rng.uniform(-4, -0.5)


def recording_of(rng, cloud):
    """The cloud's points as nodes of a recording of three frames, which may begin inside a symbol."""
    count = len(cloud.points)
    empty, names = np.full((count, 3), np.nan), tuple(f"node {index}" for index in range(count))
    track = cloud.points + 10 ** rng.uniform(-4, -1) * rng.normal(size=(3, count, 3))
    return replace(
        cloud, part=np.arange(count), kinds=("node",) * count, names=names, parents=np.full(count, -1), hinges=empty,
        axes=empty, track=track, record=cloud.record | {"track_rate_hz": 10 ** rng.uniform(0, 4)},
    )  # fmt: skip


def random_company(rng):
    """Further effects for a random scene: a ground path, clutter, a linear receiver, noise in all cells, detection."""
    static = {"kind": str(rng.choice(["mean", "pulse", "exponential"])), "order": int(rng.integers(1, 4)),
              "memory": rng.uniform(0.1, 0.99)}  # fmt: skip
    company = {
        "ground_reflection": {
            "permittivity": rng.uniform(2.0, 80.0), "conductivity_s_m": 10 ** rng.uniform(-3, 1),
            "roughness_m": rng.choice([0.0, 0.02]), "polarisation": str(rng.choice(["vertical", "horizontal"])),
        },
        "clutter": {"clutter_to_signal_db": rng.uniform(-30.0, 20.0), "wind_mps": rng.choice([0.0, 5.0])},
        "iq_imbalance": {"gain_db": rng.uniform(0.0, 3.0), "phase_deg": rng.uniform(-10.0, 10.0)},
        "timing_offset": {"sigma_s": 1e-8}, "clock_offset": {"sigma_ppm": 10 ** rng.uniform(-3, 1)},
        "carrier_offset": {"sigma_ppm": 0.02}, "receiver_noise": {"noise_figure_db": rng.uniform(0.0, 9.0)},
        "cell_noise": {"snr_db": rng.uniform(-10.0, 40.0)},
    }  # fmt: skip
    if rng.random() < 0.2:
        kind = str(rng.choice(["ca", "os", "none"]))
        company["detector"] = {"cfar": kind, "training": 1, "guard": 0, "false_alarm": 0.1, "gate_cells": 1}
    kept = {name: values for name, values in company.items() if rng.random() < 0.4}
    return kept | ({"canceller": static} if "clutter" in kept and rng.random() < 0.7 else {})


def scenes_within_tolerance(count, seed):
    """(decisions to leave out, decisions to compute) over random scenes, each held to its tolerance."""
    out = computed = 0
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        radio, cloud, row, effects, tolerance = random_case(rng)
        station = radio.stations[0]
        received = received_signal(scene(effects, tolerance, radio), station, cloud, row)
        truth = whole(effects, radio, station, cloud, row)
        error, largest = abs(received.signal - truth.signal).max(), abs(truth.signal).max()
        assert error <= tolerance * largest, (index, effects, tolerance, error / largest, received.decisions)
        out += sum(not decision.computed for decision in received.decisions)
        computed += sum(decision.computed for decision in received.decisions)
    return out, computed


def test_whatever_is_left_out_changes_less_than_the_tolerance():
    out, computed = scenes_within_tolerance(60, 1)
    assert out > 10 and computed > 10


@pytest.mark.slow
def test_whatever_is_left_out_changes_less_than_the_tolerance_in_1000_scenes():
    out, computed = scenes_within_tolerance(1000, 2)
    print(f"1000 scenes: {out} decisions to leave out, {computed} to compute")
    assert out > 200 and computed > 200


AHEAD = {"x_m": 300.0 * np.cos(0.3), "y_m": 300.0 * np.sin(0.3), "z_m": 10.0}
SWITCHES = {
    "squint": (1e-3, {"x_m": 10.0, "y_m": 300.0, "z_m": 10.0}, AHEAD),
    "wavefront": (2e-2, {"x_m": 12.0, "y_m": 4.0, "z_m": 12.0}, {"x_m": 9000.0, "y_m": 3000.0, "z_m": 400.0}),
    "symbol_motion": (2e-2, {"vx_mps": 60.0}, {"vx_mps": 1e-3, "vy_mps": 0.0, "vz_mps": 0.0, "rate_hz": 0.01}),
}


@pytest.mark.parametrize("name", SWITCHES)
def test_every_bound_switches_its_effect_on_and_off(rng, name):
    cloud, row = target(rng, points=2, size_m=0.01)
    row |= {"vx_mps": 0.0, "vy_mps": 0.0, "vz_mps": 0.0}
    tolerance, near, far = SWITCHES[name]
    station = network().stations[0]
    on, off = (
        received_signal(scene({name: {}}, tolerance), station, cloud, row | change).decisions[0]
        for change in (near, far)
    )
    assert on.computed and not off.computed
    assert on.bound > tolerance > off.bound > 0


def test_with_no_tolerance_everything_asked_for_is_computed(rng):
    cloud, row = target(rng)
    received = received_signal(scene({name: {} for name in BY_NEED}), network().stations[0], cloud, row)
    assert [decision.computed for decision in received.decisions] == [True] * len(BY_NEED)


def test_a_discontinuous_receiver_lets_nothing_be_left_out(rng):
    cloud, row = target(rng)
    row |= {"x_m": 9000.0}
    station = network().stations[0]
    assert not received_signal(scene({"wavefront": {}}, 0.1), station, cloud, row).decisions[0].computed
    assert received_signal(scene({"wavefront": {}, "adc": {}}, 0.1), station, cloud, row).decisions[0].computed


def test_smallest_bounds_are_left_out_first_and_together_keep_the_tolerance():
    assert need.leave_out({"a": 0.5, "b": 0.01, "c": 0.02}, 0.1, 1.0) == (["b", "c"], 0.03)
    assert need.leave_out({"a": 0.5, "b": 0.03, "c": 0.04}, 0.1, 1.0) == (["b"], 0.03)
    assert need.leave_out({"a": 0.5}, None, 1.0) == ([], 0.0)
