"""Absolute levels: mean cross sections by class and size, their fluctuation, and the power that SNRs refer to."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lowalt.common.config import load
from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network
from lowalt.effects.catalogue import called
from lowalt.effects.channel import fluctuation, mean_cross_section
from lowalt.effects.checks import CheckedScene
from lowalt.effects.explain import samples
from lowalt.effects.interface import SetsCrossSections, ShapesElements, WeighsPoints
from lowalt.effects.levels import levels
from lowalt.effects.received import Scene, observe, received_signal, with_cross_sections
from lowalt.motion.cross_section import mean_cross_section as over_aspects
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from test_effects import network, target

ROOT = Path(__file__).parent.parent
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
WAVE_M = SPEED_OF_LIGHT / 4.9e9
OWN = (SetsCrossSections, ShapesElements, WeighsPoints)
"""Protocols of the effects that act on the target's own echo on the direct path."""
CAR_ROW = {"x_m": 100.0, "y_m": 0.0, "z_m": 0.5, "vx_mps": 0.0, "vy_mps": 0.0, "vz_mps": 0.0, "yaw_rad": 0.0,
           "pitch_rad": 0.0, "roll_rad": 0.0}  # fmt: skip


@pytest.fixture(scope="module")
def builtin():
    """Clouds of a few built-in targets."""
    settings = load([ROOT / "config/default.yaml"], SCHEMA)["targets"]
    records = load_records(ROOT / settings["table"], [ROOT / path for path in settings["records"]])
    names = ["DJI Mini 2", "DJI Mavic 3 Pro", "EH 216 S", "Sparrow", "Pigeon", "Audi A6L 2019", "Walking Pedestrian 1"]
    return {name: make(records[name], None, 1) for name in names}


def section(cloud, settings=mean_cross_section.DEFAULTS):
    """The cross sections (m2) that the effect gives a target's points, and the mean of all together (dBsm)."""
    own = mean_cross_section.cross_sections(settings, cloud, WAVE_M)
    return own, 10 * np.log10(over_aspects(replace(cloud, rcs_m2=own), WAVE_M))


def scene(effects, radio=None):
    return Scene(radio or network(), 5, None, tuple(called(effects)))


def test_a_target_has_the_mean_cross_section_of_its_class_and_size(builtin):
    levels = {name: section(cloud)[1] for name, cloud in builtin.items()}
    assert levels["Audi A6L 2019"] == pytest.approx(11.25) and levels["Walking Pedestrian 1"] == pytest.approx(-1.37)
    assert levels["DJI Mavic 3 Pro"] == pytest.approx(-12.81, abs=3.0)
    assert levels["DJI Mini 2"] < levels["DJI Mavic 3 Pro"] < -5.85 < levels["EH 216 S"] < 3.0
    assert -35 < levels["Sparrow"] < levels["Pigeon"] - 3 < -22
    assert mean_cross_section.mean_dbsm("UAV", 0.4) == -12.81
    assert mean_cross_section.mean_dbsm("UAV", 1.6) == pytest.approx(-5.85)


def test_a_body_of_one_point_has_no_size_and_is_refused():
    cloud, _ = target(np.random.default_rng(3), points=2)
    with pytest.raises(InputError, match="one point, which has no size"):
        section(cloud)
    assert section(cloud, {"dbsm": {"Thing": 0.0}, "blades_db": -3.0})[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("blades_db", [-10.0, -20.0])
def test_blades_lie_below_the_body_and_points_keep_their_ratios(builtin, blades_db):
    cloud = builtin["DJI Mini 2"]
    cloud = replace(cloud, rcs_m2=np.linspace(1.0, 2.0, len(cloud.points)))
    own, mean = section(cloud, {"dbsm": {"DJI Mini 2": -10.0}, "blades_db": blades_db})
    blades = np.isin(cloud.part, cloud.parts_of("rotor"))
    assert mean == pytest.approx(-10.0)
    assert own[blades].sum() / own[~blades].sum() == pytest.approx(10 ** (blades_db / 10))
    for group in (blades, ~blades):
        ratio = own[group] / cloud.rcs_m2[group]
        assert ratio == pytest.approx(np.full(len(ratio), ratio[0]))


@pytest.mark.parametrize("faces, mean", [(fluctuation.VEHICLE, 11.25), (fluctuation.LARGE_UAV, -5.85)])
def test_a_pattern_averages_to_the_tables_mean_cross_section(faces, mean):
    zenith = (np.arange(720) + 0.5) / 4
    level, _ = fluctuation.pattern_dbsm(faces, *np.meshgrid(np.arange(0, 360, 0.5), zenith))
    around = (10 ** (level / 10)).mean(axis=1)
    weight = np.sin(np.radians(zenith))
    assert 10 * np.log10(around @ weight / weight.sum()) == pytest.approx(mean, abs=0.02)


@pytest.mark.parametrize("azimuth", [0.0, 90.0, 200.0])
def test_a_vehicle_without_a_floor_of_its_own_shows_its_side_from_straight_below(azimuth):
    below, nearly = (fluctuation.pattern_dbsm(fluctuation.VEHICLE, np.array([azimuth]), np.array([zenith]))
                     for zenith in (180.0, 180.0 - 1e-9))  # fmt: skip
    assert below[0] == pytest.approx(nearly[0], abs=1e-6) and below[1] == nearly[1]
    above = fluctuation.pattern_dbsm(fluctuation.VEHICLE, np.array([azimuth]), np.array([10.0]))
    assert above[0] != pytest.approx(below[0], abs=1.0)


@pytest.mark.parametrize("yaw, azimuth", [(0.0, 90.0), (np.pi / 2, 0.0), (np.pi, 270.0), (-np.pi / 2, 180.0)])
def test_a_pattern_follows_the_body(builtin, yaw, azimuth):
    row = {**CAR_ROW, "yaw_rad": yaw, "subtype": "Audi A6L 2019", "category": "Vehicle", "model": 0, "rate_hz": 0.0}
    row |= {f"phase_{order}_rad": 0.0 for order in range(4)}
    radio = network(place=(0.0, 0.0, 10.0))
    view = observe(scene({}, radio), radio.stations[0], builtin["Audi A6L 2019"], row)
    zenith = np.degrees(np.arctan2(100.0, 9.5))
    expected = fluctuation.pattern_dbsm(fluctuation.VEHICLE, np.array([azimuth]), np.array([zenith]))[0] - 11.25
    assert 10 * np.log10(fluctuation.pattern(view)[0, 0]) == pytest.approx(expected[0], abs=0.02)


def test_the_log_normal_factor_has_mean_one_and_the_tables_spread(builtin):
    view = observe(scene({}), network().stations[0], *target(np.random.default_rng(1)))
    rng = np.random.default_rng(2)
    drawn = np.array([
        fluctuation.visible({"pattern": False, "spread_db": None}, view, rng)[0, 0] ** 2 for _ in range(4000)
    ])  # fmt: skip
    assert drawn.mean() == pytest.approx(1.0, abs=0.08)
    assert np.std(10 * np.log10(drawn)) == pytest.approx(2.50 if fluctuation.large(view.cloud) else 3.74, rel=0.04)


def test_two_patterns_are_refused():
    both = {"cross_sections": {"strength": 1.0}, "fluctuation": fluctuation.DEFAULTS}
    with pytest.raises(InputError, match="pattern: false"):
        fluctuation.check(fluctuation.DEFAULTS, CheckedScene(network(), both, ()))


def test_set_snrs_refer_to_the_echo_as_it_arrives():
    cloud, row = target(np.random.default_rng(3))
    station = network().stations[0]
    plain = received_signal(scene({}), station, cloud, row)
    varied = received_signal(scene({"fluctuation": {"pattern": False, "spread_db": 6.0}}), station, cloud, row)
    assert varied.power == pytest.approx(np.mean(abs(varied.signal) ** 2), rel=1e-6)
    assert abs(10 * np.log10(varied.power / plain.power)) > 1.0


def documented():
    """The table of levels in the design note: name -> (value, unit)."""
    rows = {}
    section = (ROOT / "design/effects.md").read_text().split("## Absolute levels")[1]
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.replace(r"\|", "!").strip("|").split("|")]
        if len(cells) == 3 and cells[1].split()[-1] in ("dBm", "dB", "dBi", "dBsm"):
            rows[cells[0].replace("!", "|")] = (float(cells[1].split()[0]), cells[1].split()[1])
    return rows


def test_the_levels_worked_by_hand_are_the_codes():
    config = load([ROOT / "config/default.yaml", ROOT / "config/scenes/worst.yaml"], SCHEMA)
    config["targets"]["table"] = str(ROOT / config["targets"]["table"])
    config["targets"]["records"] = [str(ROOT / path) for path in config["targets"]["records"]]
    every = tuple(called(config["effects"]))
    alone = tuple(one for one in every if one.place == "motion" or isinstance(one.module, OWN))
    sample = samples(config, None, [("DJI Mavic 3 Pro", 0)])[0]
    given = Network.from_settings(config["network"])
    whole = Scene(given, config["seed"], None, alone)
    view = observe(whole, given.stations[0], with_cross_sections(whole, sample.cloud), sample.row, sample.occluders)
    power = received_signal(whole, given.stations[0], sample.cloud, sample.row, sample.occluders).power
    found = {level.name: level for level in levels(view, {one.name: one for one in every}, power)}
    table = documented()
    assert len(table) == len(found) - 1
    for name, (value, unit) in table.items():
        assert (found[name].value, found[name].unit) == (pytest.approx(value, abs=0.051), unit)
    by_hand = {
        "path out and back, 415.6 m, 1 m2": 20 * np.log10(0.0611821) - 30 * np.log10(4 * np.pi) - 40 * np.log10(415.6),
        "noise, one subcarrier": -228.6 + 10 * np.log10(290) + 30 + 10 * np.log10(120e3) + 9,
        "transmit array": 10 * np.log10(64), "expected echo": 30 + 2 * 18.06 + 2 * 5.6 - 162.0 - 14.1,
    }  # fmt: skip
    for name, value in by_hand.items():
        assert found[name].value == pytest.approx(value, abs=0.15)
