"""Configuration, plan and source lists: faults named by key and value, counts known before any job."""

import copy
import math
from pathlib import Path

import pytest

from lowalt.config.layers import canonical, check, load, load_yaml, merge
from lowalt.config.schema import faults
from lowalt.files import yaml_files
from lowalt.files.errors import InputError
from lowalt.motion import COLUMNS
from lowalt.report.stage_times import COLUMNS as STAGE_COLUMNS
from lowalt.shards.plan import Plan
from tables import rows

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
DEFAULT = load([ROOT / "config/default.yaml"], SCHEMA)


@pytest.mark.parametrize("overlay", sorted(path.name for path in (ROOT / "config").glob("*.yaml")))
def test_every_shipped_configuration_is_valid(overlay):
    assert load([ROOT / "config/default.yaml", ROOT / "config" / overlay], SCHEMA)["seed"] >= 0


@pytest.mark.parametrize(
    ("overlay", "words"),
    rows("configurations", "values"),
)
def test_a_wrong_value_is_refused_by_key_value_and_expectation(overlay, words):
    with pytest.raises(InputError, match=words):
        check(merge(DEFAULT, overlay), SCHEMA)


def test_a_null_takes_out_what_a_lower_layer_has_wherever_the_key_may_be_left_out():
    layers = {
        "effects": {"adc": {"bits": 8}},
        "recognition": {"gpu": True},
        "targets": {"own": {"x": "x.yaml"}},
    }
    nulls = {
        "effects": {"adc": None},
        "recognition": {"gpu": None},
        "targets": {"own": {"x": None}},
        "network": {"stations": {"C": None}},
        "spectra": {"vt": None},
        "echo": {"tolerance": None},
    }
    found = check(merge(merge(copy.deepcopy(DEFAULT), layers), nulls), SCHEMA)
    assert (
        found["effects"] == found["targets"].pop("own") == {} and "gpu" not in found["recognition"]
    )
    assert list(found["network"]["stations"]) == ["A", "B"] and list(found["spectra"]) == [
        "vrp",
        "trp",
    ]
    assert found["echo"] == DEFAULT["echo"]


def test_a_number_is_a_number_however_it_is_written(tmp_path):
    path = tmp_path / "overlay.yaml"
    path.write_text(
        "run: 1e5\nnetwork: {carrier_hz: 28e9, symbols: 4.0e+2, subcarriers: 256.0}\n"
        "noise: {snr_db: [1e1, .inf]}\nmotion: {height_m: {UAV: [3e1, 150]}}\neffects: "
        "{cell_noise: {snr_db: 2e1}}\n"
    )
    found = load([ROOT / "config/default.yaml", path], SCHEMA)
    network = found["network"]
    assert [repr(network[key]) for key in ("carrier_hz", "symbols", "subcarriers")] == [
        "28000000000.0",
        "400",
        "256",
    ]
    assert found["noise"]["snr_db"] == [10.0, math.inf] and found["motion"]["height_m"]["UAV"] == [
        30.0,
        150,
    ]
    assert found["effects"] == {"cell_noise": {"snr_db": 20.0}} and found["run"] == "1e5"


def test_text_that_a_pattern_describes_has_no_control_characters():
    signs = [chr(code) for code in range(1000)]
    refused = [ord(sign) for sign in signs if faults(sign, {"pattern": ""})]
    assert refused == [*range(32), 127]


@pytest.mark.parametrize(
    ("text", "words"),
    rows("configurations", "files"),
)
def test_a_broken_file_is_refused(tmp_path, text, words):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        load_yaml(path)


def test_both_parsers_read_the_same(monkeypatch):
    monkeypatch.setattr(yaml_files, "DEEPEST", -1)
    assert repr(load_yaml(ROOT / "config/default.yaml")) == repr(DEFAULT)


def test_canonical_text_is_one_per_meaning():
    assert canonical({"b": math.inf, "a": [1, 2.5]}) == canonical({"a": (1, 2.5), "b": math.inf})
    assert canonical({"snr": math.inf}) == '{"snr": "inf"}'


PUBLISHED = {
    f"t{index}": {"unseen_protocol": "seen" if index % 2 else "unseen"} for index in range(4)
}


def plan(**motion) -> Plan:
    """A plan of four subtypes with the given motion keys."""
    return Plan.of(merge(DEFAULT, {"motion": motion}), PUBLISHED)


def test_a_short_chunk_has_only_shards_with_samples():
    found = plan(models=1, models_per_chunk=10)
    assert 1 <= len(found.folds("seen-00000")) <= 2
    assert set(plan(models=10, models_per_chunk=10).folds("seen-00000")) == {"train", "val", "test"}


def test_a_chunk_that_breaks_blocks_and_an_unknown_subtype_are_refused():
    with pytest.raises(InputError, match="models_per_chunk: value 15, expected a multiple of 10"):
        plan(models_per_chunk=15)
    with pytest.raises(InputError, match=r"targets.select: \['Dodo'\]"):
        Plan.of(merge(DEFAULT, {"targets": {"select": ["Dodo"]}}), PUBLISHED)


def test_documented_columns_are_the_columns():
    tables = load_yaml(ROOT / "workflow/schemas/tables.yaml")
    header = (ROOT / "config/targets.csv").read_text().split("\n")[0].split(",")
    assert list(tables["targets"]) == header
    motion = [name for name in COLUMNS if not name.startswith("phase_")]
    assert [name for name in tables["motion"] if name != "phase_N_rad"] == motion
    assert list(tables["stages"]) == list(STAGE_COLUMNS)
    published = (ROOT / "config/published_accuracy.csv").read_text().split("\n")[0].split(",")
    assert list(tables["accuracy"])[:4] == published
