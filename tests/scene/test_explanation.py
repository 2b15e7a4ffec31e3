"""What a scene does to a sample, as `lowalt explain` says it.

Tested are whose samples they are, and laws of what is found.
"""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.scene import explanation
from lowalt.shards.dataset import Dataset
from scenes import A, scene, target
from small_configuration import configuration
from tables import rows


def found(effects, **changes):
    """The finding of the small target at station A."""
    cloud, row = target(np.random.default_rng(1), **changes)
    return explanation.finding(scene(effects), A, explanation.ExplainedSample(cloud, row, None), {})


def test_samples_are_those_of_the_data_set_looks_of_a_track_included():
    config = configuration()
    config["targets"]["select"] = ["DJI Mini 2"]
    config["motion"] |= {"looks": 2}
    dataset = Dataset(config)
    (sample,) = explanation.samples(config, None, [("DJI Mini 2", 3)])
    row = next(
        dataset.row(place) for place in map(dataset.place, range(len(dataset))) if place.model == 3
    )
    assert {name: sample.row[name] for name in row if row[name] == row[name]} == {
        name: value for name, value in row.items() if value == value
    }


def test_a_target_a_hundred_times_as_strong_stands_20_db_higher_over_the_land():
    cloud, row = target(np.random.default_rng(1))
    weak, strong = (
        explanation.finding(
            scene({"clutter": {}}),
            A,
            explanation.ExplainedSample(replace(cloud, rcs_m2=by * cloud.rcs_m2), row, None),
            {},
        ).over_db
        for by in (1, 100)
    )
    assert np.isfinite(weak) and strong == pytest.approx(weak + 20)


@pytest.mark.parametrize("ms, spread_ms, text", rows("explanations", "costs"))
def test_a_cost_below_its_spread_is_said_to_be_below_it(ms, spread_ms, text):
    change = explanation.Change("adc", "receiver", True, 0.1, 0.2, {}, ms, spread_ms)
    line = explanation.effects_table([change], False)[1]
    assert line.split() == ["adc", "named", "10.0%", "20.0%", text]


@pytest.mark.parametrize(
    "named, by_class, text",
    rows("explanations", "changes"),
)
def test_a_change_beyond_the_signal_is_a_range_over_the_classes_and_no_share(named, by_class, text):
    """A mean of amplitude ratios would be that of the class that is hidden most."""
    mean = float(np.mean(list(by_class.values())))
    change = explanation.Change("town", "channel", named, mean, 0.2, by_class=by_class)
    line = explanation.effects_table([change], False)[1]
    assert line.split("named" if named else "added")[1].split("20.0%")[0].strip() == text


def test_a_comb_changes_no_range_cell_of_a_near_target_and_its_ratio_is_that_of_each_class():
    """Its cells are those of the whole band modulo their number.

    There the target stands in one cell.
    """
    config = configuration()
    config["targets"]["select"] = ["DJI Mini 2", "Owl"]
    config["network"]["symbols"] = 64
    config["effects"] = {"comb_pilots": {"spacing": 4}}
    chosen = explanation.samples(config, None, [("DJI Mini 2", 0), ("Owl", 1)])
    found = explanation.changes(config, chosen, ["A", "B"], lambda signals: {})
    comb = next(change for change in found if change.effect == "comb_pilots")
    assert comb.cells < 0.1
    assert list(comb.by_class) == ["Bird", "UAV"]
    assert np.mean(list(comb.by_class.values())) == pytest.approx(comb.signal)
    canceller = next(change for change in found if change.effect == "cell_error")
    assert canceller.cells > 0.01


def test_parts_of_an_effect_are_no_effects_of_a_suggested_scene():
    whole = explanation.Change("clutter", "channel", True, 0.5)
    part = whole._replace(part="second order", signal=0.1)
    text = explanation.suggested({"effects": {"clutter": {"patches": 9}}}, [whole, part], 1e-3)
    assert text.count("clutter:") == 1 and "0.5" in text
    table = explanation.effects_table([whole, part], sources=True)
    assert sum("its second order left out" in line for line in table) == 1
    assert sum(line.startswith("clutter: ") for line in table) == 1


def test_a_finding_says_how_fast_the_range_grows():
    still = dict.fromkeys(("vx_mps", "vy_mps", "vz_mps"), 0.0)
    ahead = {"x_m": 300.0, "y_m": 0.0, "z_m": 25.0}
    for velocity, expected in (
        ({"vx_mps": 8.0}, 8.0),
        ({"vx_mps": -3.0}, -3.0),
        ({"vy_mps": 5.0}, 0.0),
    ):
        assert found({}, **ahead | still | velocity).radial_mps == pytest.approx(expected, abs=0.1)


def test_the_cell_beside_the_target_holds_it_at_the_end_of_ranges_too():
    """An error of one cell to either side is right at the end of ranges too.

    The target then stands in cell 0, 32 cells of 39 m farther.
    """
    always = {"cell_error": {"probability": 1.0, "spread_cells": 1}}
    assert (
        found(always).right
        == found(always, x_m=0.0, y_m=1249.0, z_m=10.0, vx_mps=0.0, vy_mps=0.0).right
        == 1.0
    )
    assert found({"cell_error": {"probability": 1.0, "spread_cells": 15}}).right < 0.5
