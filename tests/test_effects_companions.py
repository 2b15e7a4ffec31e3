"""Several targets in one beam: their echoes add, they keep their levels and their distance, records name them."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lowalt.common.config import load
from lowalt.common.errors import InputError
from lowalt.effects.catalogue import called
from lowalt.effects.channel import companions
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal, with_cross_sections
from lowalt.effects.response import response
from lowalt.shards.record import accompanied, record, row_of
from lowalt.targets.__main__ import make
from lowalt.targets.records import load_records
from test_effects import network

ROOT = Path(__file__).parent.parent
RADIO = network(symbols=24)
STATION = RADIO.stations[0]
TWO = {"count": [2, 2], "spread_m": 6.0}


@cache
def clouds():
    """A few built-in targets."""
    settings = load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")["targets"]
    records = load_records(ROOT / settings["table"], [ROOT / path for path in settings["records"]])
    names = ("DJI Mini 2", "Pigeon", "Audi A6L 2019", "Walking Pedestrian 1")
    return {name: make(records[name], None, 1) for name in names}


def row(subtype="DJI Mini 2", model=3):
    """A target 70 m away, its motion fixed."""
    cloud = clouds()[subtype]
    given = {"x_m": 60.0, "y_m": 25.0, "z_m": 30.0, "vx_mps": 5.0, "vy_mps": -3.0, "vz_mps": 1.0, "yaw_rad": 0.7,
             "pitch_rad": 0.1, "roll_rad": -0.1, "rate_hz": 60.0, "start_s": 0.2, "playback": 1.0}  # fmt: skip
    phases = {f"phase_{index}_rad": 0.4 * index for index in range(16)}
    return {**given, **phases, "subtype": subtype, "category": cloud.category, "group": "seen", "model": model}


def scene(effects, tolerance=None):
    return Scene(RADIO, 5, tolerance, tuple(called(effects)))


def beside(given, subtype="DJI Mini 2", model=3):
    """The companions that a scene draws."""
    one = scene({"companions": given})
    effect, at = one.effects[0], row(subtype, model)
    draws = one.stream("companions", at)
    return effect.module.companions(effect.settings, clouds()[subtype], at, clouds(), draws)


def test_echoes_add_before_the_strongest_cell_is_chosen():
    whole = scene({"mean_cross_section": {}, "companions": TWO})
    cloud, at = clouds()["DJI Mini 2"], row()
    found = received_signal(whole, STATION, cloud, at)
    total, alone = 0.0, scene({"mean_cross_section": {}})
    for given, where in [(cloud, at), *beside(TWO)]:
        own = with_cross_sections(alone, given)
        view = observe(alone, STATION, own, where)
        aim = [at["x_m"], at["y_m"], at["z_m"]]
        total = total + response(RADIO, STATION, view.places, own.rcs_m2, aim)
    cells = np.fft.ifft(total, axis=1)
    assert (found.cell == abs(cells).argmax(axis=1)).all()
    assert abs(found.signal - cells[np.arange(24), found.cell]).max() < 1e-12 * abs(cells).max()
    # Set SNRs refer to the labelled target alone.
    assert found.power == received_signal(alone, STATION, cloud, at).power


def test_a_stronger_companion_takes_the_cell():
    given = {"subtypes": ["Audi A6L 2019"], "count": [1, 1], "spread_m": 30.0}
    found = received_signal(scene({"mean_cross_section": {}, "companions": given}), STATION, clouds()["DJI Mini 2"],
                            row(), None, clouds())  # fmt: skip
    # A car has 11 dBsm, a Mini 2 some -17: 28 dB less two places' worth of range and beam.
    assert 10 * np.log10(np.mean(abs(found.signal) ** 2) / found.power) > 6


def test_all_stations_see_the_same_companions_and_other_models_others():
    first, again, other = beside(TWO), beside(TWO), beside(TWO, model=4)
    places = [[(one["x_m"], one["z_m"]) for _, one in found] for found in (first, again, other)]
    assert places[0] == places[1] != places[2]
    assert len({one["model"] for _, one in first}) == 2


@pytest.mark.parametrize("model", range(8))
def test_targets_keep_clear_of_each_other_and_above_the_ground(model):
    given = {"subtypes": ["Pigeon", "Audi A6L 2019"], "count": [4, 4], "spread_m": 15.0}
    found = [(clouds()["DJI Mini 2"], row(model=model)), *beside(given, model=model)]
    for number, (cloud, one) in enumerate(found):
        assert one["z_m"] > 0
        if cloud.category == "Vehicle":
            assert one["z_m"] == cloud.record["origin_height_m"] and one["vz_mps"] == 0
            assert np.hypot(one["vx_mps"], one["vy_mps"]) == pytest.approx(
                one["rate_hz"] * np.pi * cloud.record["wheel_diameter_m"]
            )
        for other, two in found[:number]:
            apart = np.linalg.norm([one[f"{axis}_m"] - two[f"{axis}_m"] for axis in "xyz"])
            assert apart > np.linalg.norm(cloud.points, axis=1).max() + np.linalg.norm(other.points, axis=1).max()


def test_a_flock_flies_with_its_target_and_others_on_their_own():
    speeds = lambda found: np.array([[one[f"v{axis}_mps"] for axis in "xyz"] for _, one in found])  # noqa: E731
    flock = speeds([pair for model in range(40) for pair in beside({**TWO, "speed_mps": 0.5}, model=model)])
    assert flock.mean(axis=0) == pytest.approx([5.0, -3.0, 1.0], abs=0.25)
    assert flock.std() < 6 and flock.std(axis=0) == pytest.approx([0.5] * 3, rel=0.3)
    pigeons = speeds([pair for m in range(40) for pair in beside({**TWO, "subtypes": ["Pigeon"]}, model=m)])
    assert abs(pigeons.mean(axis=0)).max() < 3 and pigeons.std(axis=0).min() > 2
    cars = {**TWO, "count": [1, 1], "subtypes": ["Audi A6L 2019"]}
    ground = np.linalg.norm(speeds([pair for m in range(40) for pair in beside(cars, model=m)]), axis=1)
    # Uniform over the published 1 to 20 m/s, whatever the drone's 5.9 m/s.
    assert ground.min() >= 1 and ground.max() <= 20 and ground.std() > 3.5


def test_counts_are_drawn_over_their_whole_range():
    counts = [len(companions.named({**companions.DEFAULTS, "count": [0, 3]}, "Crow", np.random.default_rng(seed)))
              for seed in range(200)]  # fmt: skip
    assert sorted(set(counts)) == [0, 1, 2, 3] and min(np.bincount(counts)) > 25


@pytest.mark.parametrize("physics", [{"cyclic_prefix": {}}, {"squint": {}}, {"symbol_motion": {}}])
def test_physics_by_need_holds_for_companions_too(physics):
    given = {"mean_cross_section": {}, "companions": {"count": [1, 1]}, **physics}
    cloud, at = clouds()["DJI Mini 2"], row()
    full = received_signal(scene(given), STATION, cloud, at)
    some = received_signal(scene(given, 0.3), STATION, cloud, at)
    assert abs(some.signal - full.signal).max() <= 0.3 * abs(full.signal).max()
    plain = received_signal(scene({"mean_cross_section": {}, "companions": {"count": [1, 1]}}), STATION, cloud, at)
    assert abs(plain.signal - full.signal).max() > 0


def test_records_name_the_companions_and_keep_the_label():
    effects = {"companions": {"subtypes": ["Pigeon"], "count": [2, 2]}}
    at = row()
    plain, told = (
        json.loads(record(accompanied(at, one, 5), 3.0, "train", 5, RADIO)) for one in ({}, effects)
    )  # fmt: skip
    assert told.pop("companions") == ["Pigeon", "Pigeon"] and told == plain and "companions" not in plain
    drawn = [cloud.subtype for cloud, _ in beside(effects["companions"])]
    assert accompanied(at, effects, 5)["companions"] == drawn
    again, _ = row_of(json.loads(record(accompanied(at, effects, 5), 3.0, "train", 5, RADIO)))
    assert accompanied(again, effects, 5)["companions"] == drawn


def test_impossible_company_is_refused_by_name():
    with pytest.raises(InputError, match="no cloud of 'Dodo'"):
        beside({"subtypes": ["Dodo"]})
    with pytest.raises(InputError, match="spread_m"):
        beside({"subtypes": ["Audi A6L 2019"], "count": [6, 6], "spread_m": 0.5})
    with pytest.raises(InputError, match="smaller number first"):
        companions.check({"count": [3, 1], "subtypes": []}, CheckedScene(RADIO, {}, ()))
    with pytest.raises(InputError, match="surfaces"):
        companions.check({"count": [1, 3], "subtypes": ["Crow"]}, CheckedScene(RADIO, {"occlusion": {}}, ()))


def test_a_companion_of_no_cross_section_changes_nothing():
    cloud, at = clouds()["DJI Mini 2"], row()
    faint = replace(clouds()["Pigeon"], rcs_m2=np.zeros(len(clouds()["Pigeon"].rcs_m2)))
    given = {"companions": {"subtypes": ["Pigeon"], "count": [1, 1]}}
    found = received_signal(scene(given), STATION, cloud, at, None, {"Pigeon": faint})
    plain = received_signal(scene({}), STATION, cloud, at)
    assert abs(found.signal - plain.signal).max() < 1e-11 * abs(plain.signal).max()


class Fixed:
    """A generator whose normals are all this number, and whose uniforms are the lower end."""

    def __init__(self, normal: float):
        self.normal = normal

    def standard_normal(self) -> float:
        return self.normal

    def uniform(self, low: float, high: float) -> float:
        return low


@pytest.mark.parametrize("normal, speed", [(0.0, 5.0), (-9.0, 0.5), (-20.0, 0.0)])
def test_a_companion_on_the_ground_drives_slowly_or_stands_but_never_backwards(normal, speed):
    """A car at 5 m/s, and a spread of half a metre a second."""
    at = row("Audi A6L 2019") | {"vx_mps": 3.0, "vy_mps": 4.0, "yaw_rad": 0.7}
    given = {**companions.DEFAULTS, "speed_mps": 0.5}
    found = companions._moving(given, clouds()["Audi A6L 2019"], at, Fixed(normal))
    assert np.hypot(found["vx_mps"], found["vy_mps"]) == pytest.approx(speed, abs=1e-12)
