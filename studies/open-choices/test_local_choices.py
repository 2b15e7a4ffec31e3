"""The choices that no key expresses do to rotors, courses and range cells what they say."""

import numpy as np
import pytest
from local_choices import (
    changed_cloud,
    changed_row,
    continuous,
    local_effects,
    sample_of,
    signals_by_cell,
)

from lowalt.config.layers import overlaid
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.motion.rotations import attitude
from lowalt.scene.observe import Scene
from lowalt.shards.dataset import Dataset, Place
from lowalt.targets.cloud import Cloud

CRAFT = "EH 216 S"


@pytest.fixture(scope="module")
def dataset():
    config = overlaid([])
    config["targets"]["select"] = [CRAFT]
    return Dataset(config)


@pytest.fixture
def row(dataset):
    return dataset.row(Place("unseen", CRAFT, 3, 13.0))


def test_rotors_start_together_turn_in_one_sense_or_at_rates_of_their_own(dataset, row):
    cloud = dataset.clouds[CRAFT]
    rotors = cloud.parts_of("rotor")
    phases = [f"phase_{order}_rad" for order in range(8)]
    assert len(rotors) == 8 and len({row[name] for name in phases}) == 8
    assert {changed_row(row, cloud, {"rotors": "aligned"})[name] for name in phases} == {0.0}
    assert {changed_row(row, cloud, {"rotors": "step"})[name] for name in phases} == {
        row[phases[0]]
    }
    assert {-1.0, 1.0} == set(cloud.axes[rotors, 2]) and set(
        changed_cloud(cloud, {"rotors": "alike"}, {}).axes[rotors, 2]
    ) == {1.0}
    (effect,) = local_effects({"rotors": "rates"}, dataset.published[CRAFT], 1)
    turns = effect.module.perturb({}, cloud, row, np.array([0.0, 1.0]), None).angle_rad
    rates = [row["rate_hz"] + angle[1] / (2 * np.pi) for angle in turns.values()]
    assert (
        list(turns) == list(rotors) and len(set(rates)) == 8 and 30 <= min(rates) < max(rates) <= 60
    )


def test_a_craft_flies_along_its_nose_as_fast_as_drawn(dataset, row):
    turned = changed_row(row, dataset.clouds[CRAFT], {"course": "nose"})
    drawn, flown = (np.array([one[f"v{axis}_mps"] for axis in "xyz"]) for one in (row, turned))
    front = attitude(row["yaw_rad"], row["pitch_rad"], row["roll_rad"])[:, 1]
    np.testing.assert_allclose(flown, np.linalg.norm(drawn) * front, atol=1e-12)
    assert abs(drawn - flown).max() > 1


def moving_point(speed: float) -> tuple[Cloud, dict]:
    """One point that leaves station A along its normal, 30 degrees from +x, from 200 m on."""
    away = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    nothing = np.zeros((1, 3))
    one = np.zeros(1, np.int64)
    names = {
        "kinds": ("body",),
        "names": ("body",),
        "record": {"subtype": "point", "category": "UAV"},
    }
    arrays = {
        "hinges": nothing,
        "axes": nothing,
        "track": np.zeros((0, 0, 3)),
        "parents": one - 1,
        "part": one,
    }
    cloud = Cloud(points=nothing, normals=nothing, rcs_m2=np.ones(1), **arrays, **names)
    places = dict(zip(("x_m", "y_m", "z_m"), 200 * away + (0, 0, 25), strict=True))
    speeds = dict(zip(("vx_mps", "vy_mps", "vz_mps"), speed * away, strict=True))
    still = dict.fromkeys(("yaw_rad", "pitch_rad", "roll_rad"), 0.0)
    return cloud, {"subtype": "point", "model": 0, "rate_hz": np.nan, **places, **speeds, **still}


def test_a_continuous_phase_turns_evenly_where_the_point_crosses_into_other_cells(dataset):
    network, (cloud, row) = dataset.maker.network, moving_point(20.0)
    signal = continuous(network, network.stations[0], cloud, row)
    steps = np.angle(signal[1:] * signal[:-1].conj())
    middle = (
        network.stations[0].frequency_hz
        + (network.subcarriers - 1) * network.subcarrier_spacing_hz / 2
    )
    expected = -4 * np.pi * middle * 20.0 * network.symbol_interval_s / SPEED_OF_LIGHT
    np.testing.assert_allclose(np.angle(np.exp(1j * (steps - expected))), 0, atol=1e-6)


def test_cells_of_a_look_are_one_cell_and_the_middle_s_cell_is_a_point_s_strongest(dataset):
    network, (cloud, row) = dataset.maker.network, moving_point(4.0)
    sample = sample_of(Scene(network, 1, None, ()), "A", cloud, row)
    found = signals_by_cell(sample)
    np.testing.assert_array_equal(abs(found["centre"]), abs(sample.cells).max(axis=1))
    start, end = (round(range_m / network.cell_m) for range_m in (200.0, 204.0))
    assert start != end
    np.testing.assert_array_equal(found["first"], sample.cells[:, start])
    assert any(np.array_equal(found["look"], sample.cells[:, cell]) for cell in (start, end))
