"""Every shipped scene's levels: the kept table is the code's and follows by hand."""

import csv
import functools
import sys
from math import log10, pi
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import scene_levels  # noqa: E402

from lowalt.scene import land  # noqa: E402
from lowalt.scene.chain import received_signal  # noqa: E402
from lowalt.scene.effects.channel import clutter, cyclic_prefix  # noqa: E402
from lowalt.scene.levels import levels  # noqa: E402
from lowalt.scene.observe import observe  # noqa: E402
from scenes import A, network, sample_of, scene, target  # noqa: E402

SCENES = sorted(path.stem for path in (ROOT / "config/scenes").glob("*.yaml"))

LINKED = "links", "triangle"
"""Scenes with links between stations."""


@functools.cache
def levels_of(name: str) -> dict[str, float]:
    """The levels of a scene."""
    return {level.name: level.value for level in scene_levels.scene_levels(ROOT, name)[1]}


@pytest.mark.parametrize("name", SCENES)
def test_the_kept_levels_of_a_scene_are_the_codes(name):
    with (ROOT / "results/benchmarks/scene_levels.csv").open() as file:
        table = {
            row["level"]: float(row["value"])
            for row in csv.DictReader(file)
            if row["scene"] == name
        }
    assert table == pytest.approx(levels_of(name), abs=0.051) and list(table) == list(
        levels_of(name)
    )


@pytest.mark.parametrize("name", [name for name in SCENES if name != "fmcw"])
def test_the_levels_of_a_scene_follow_by_hand(name):
    table = levels_of(name)
    link = name in LINKED
    out, back = (415.6, 407.1) if link else (415.6, 415.6)
    noise_figure = 9.0 if name == "worst" else 7.0
    spacing_hz = 60e3 if name == "worst" else 120e3
    path = next(value for level, value in table.items() if level.startswith("path"))
    element = sum(value for level, value in table.items() if level.startswith("element")) * (
        1 if link else 2
    )
    # The wave is 299792458 / 4.9e9 = 0.0611821 m long; arrays are of 16 x 4 elements; 1 W a
    # subcarrier.
    assert path == pytest.approx(
        20 * log10(0.0611821) - 30 * log10(4 * pi) - 20 * log10(out * back), abs=0.06
    )
    assert table["transmit power, 256 subcarriers"] == pytest.approx(30.0 + 24.08, abs=0.06)
    assert (
        table["transmit array"] == table["receive array"] == pytest.approx(10 * log10(64), abs=0.06)
    )
    # 397 points of 1 m2; what their phases make of that is held by the law below.
    section = 10 * log10(397) - 3.9 if name == "paper" else -12.81 + 11.56 * log10(0.32 / 0.4)
    assert table["mean cross section"] == pytest.approx(section, abs=0.06)
    assert table["expected echo"] == pytest.approx(
        30.0 + 2 * 18.06 + element + path + section, abs=0.2
    )
    if "noise, one subcarrier" in table:
        noise = -228.6 + 10 * log10(290) + 30 + 10 * log10(spacing_hz) + noise_figure
        assert table["noise, one subcarrier"] == pytest.approx(noise, abs=0.06)
        assert table["noise, one range cell"] == pytest.approx(noise - 24.08, abs=0.06)
    if "transmit leakage, one subcarrier" in table:
        assert table["transmit leakage, one subcarrier"] == 30.0 - 100.0
    if "loss beyond the cyclic prefix" in table:
        # The extended prefix of 4.17 us covers 625 m, and the target is 416 m away.
        assert table["loss beyond the cyclic prefix"] == 0.0


def test_the_levels_of_a_sweep_follow_by_hand():
    table = levels_of("fmcw")
    out = 25.1
    path = table[f"path out and back, {out} m, 1 m2"]
    element = table["element toward the target, each way"]
    # 12 dBm from each of 3 transmitters; the wave is 3.9446 mm long.
    assert path == pytest.approx(
        20 * log10(3.9446e-3) - 30 * log10(4 * pi) - 40 * log10(out), abs=0.06
    )
    assert table["transmit power, one sample"] == pytest.approx(12 + 10 * log10(3), abs=0.06)
    section = -12.81 + 11.56 * log10(0.32 / 0.4)
    budget = 12 + 20 * log10(3) + 10 * log10(4) + 2 * element + path + section
    assert table["expected echo"] == pytest.approx(budget, abs=0.2)
    # 256 samples at 12.5 MHz with a noise figure of 14 dB.
    noise = -228.6 + 10 * log10(290) + 30 + 10 * log10(12.5e6) + 14
    assert table["noise, one sample"] == pytest.approx(noise, abs=0.06)
    assert table["noise, one range cell"] == pytest.approx(noise - 24.08, abs=0.06)


@pytest.mark.parametrize("name", ["DJI Mavic 3 Pro", "Walking Pedestrian 1"])
def test_the_mean_power_of_an_echo_is_that_of_the_stated_cross_section(name):
    config, records = scene_levels.target_records(ROOT)
    level = scene_levels.target_level(config, records[name], 150)
    found = dict(zip(scene_levels.TARGET_COLUMNS[1:], level, strict=True))
    assert abs(found["simulated_less_stated_db"]) < 0.5 + found["standard_error_db"]
    # The strongest cell's loss is 1.1 dB on average over all places in a cell, more where a target
    # is longer than one.
    assert -1.9 < found["range_cells_db"] < -0.7


def test_every_target_s_kept_level_is_the_stated_one():
    with (ROOT / "results/benchmarks/target_levels.csv").open() as file:
        rows = {
            row["subtype"]: float(row["simulated_less_stated_db"]) for row in csv.DictReader(file)
        }
    assert list(rows) == list(scene_levels.target_records(ROOT)[1])
    assert max(map(abs, rows.values())) < 0.5


def test_what_comes_within_the_prefix_loses_nothing_and_later_echoes_their_share_of_a_symbol():
    radio = network()
    prefix_s = 5e-7
    delays_s = [prefix_s + later / radio.subcarrier_spacing_hz for later in (-0.02, 0, 0.1, 2)]
    shares = [cyclic_prefix.lost(delay_s, prefix_s, radio) for delay_s in delays_s]
    assert shares == pytest.approx([0.0, 0.0, 0.1, 1.0])


def test_the_loss_beyond_the_prefix_is_what_a_late_echo_loses():
    (cloud, row), radio = target(np.random.default_rng(1), x_m=330.0), network(subcarriers=256)
    late = scene({"cyclic_prefix": {}}, radio)
    whole = scene({}, radio)
    power = [
        np.mean(abs(received_signal(each, A, cloud, row).signal) ** 2) for each in (late, whole)
    ]
    table = {
        level.name: level.value
        for level in levels(observe(late, A, cloud, row), late.effects, power[1])
    }
    assert (
        table["loss beyond the cyclic prefix"]
        == pytest.approx(10 * log10(power[0] / power[1]), abs=0.3)
        != 0
    )


def test_the_land_in_the_target_s_range_cell_is_that_of_the_cell_which_holds_the_target():
    sample = sample_of({"clutter": {}})
    (cell,) = set(sample.true_cell(sample.view).tolist())
    power_w = land.with_side_lobes(
        clutter.mean_power(sample.scene.effects[0].settings, sample.view)[0], 32
    )
    table = {
        level.name: level.value for level in levels(sample.view, sample.scene.effects, sample.power)
    }
    assert table["land, the target's range cell"] == pytest.approx(10 * log10(power_w[cell]) + 30)
