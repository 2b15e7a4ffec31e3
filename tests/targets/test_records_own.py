"""Targets of one's own: single records laid over the others, rows of their own, and files that are not there."""

from pathlib import Path

import pytest
import yaml

from lowalt.config.layers import load
from lowalt.files.errors import InputError
from lowalt.targets.records import records_of, with_row
from lowalt.workflow.run import Run

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
BUS = yaml.safe_load((ROOT / "config/targets/more.yaml").read_text())["City bus"]


def run_of(tmp_path, overlay, inputs=None, base="default"):
    path = tmp_path / "overlay.yaml"
    path.write_text(yaml.safe_dump(overlay))
    files = [ROOT / "config/default.yaml", ROOT / f"config/{base}.yaml", path]
    return Run.of(load(dict.fromkeys(files), SCHEMA), SCHEMA, inputs)


def records(tmp_path, content, name="mine"):
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content))
    return str(path)


def test_one_record_with_its_row_adds_one_target(tmp_path):
    own = records(tmp_path, {"My bus": BUS})
    run = run_of(tmp_path, {"targets": {"own": {"bus": own}}})
    assert [group for group, names in run.plan.groups.items() if "My bus" in names] == ["seen"]
    assert len(run.records) == 41 and run.records["My bus"]["published"]["len_m"] == 11.95
    assert run.classes == ("UAV", "Bird", "Vehicle", "Pedestrian") and run.sources == "targets: 41 built-in"
    bus = records(tmp_path, {"My bus": {**BUS, "like": "Vehicle", "row": BUS["row"] | {"category": "Bus"}}}, "class")
    assert run_of(tmp_path, {"targets": {"own": {"bus": bus}}}).classes[-1] == "Bus"
    # A null in a later layer takes the file out again.
    (tmp_path / "one.yaml").write_text(yaml.safe_dump({"targets": {"own": {"bus": own}}}))
    (tmp_path / "two.yaml").write_text(yaml.safe_dump({"targets": {"own": {"bus": None}}}))
    config = load([ROOT / "config/default.yaml", tmp_path / "one.yaml", tmp_path / "two.yaml"], SCHEMA)
    assert len(records_of(config["targets"])) == 40


def test_a_single_record_replaces_that_of_its_subtype_alone_and_cells_of_its_row(tmp_path):
    crow = yaml.safe_load((ROOT / "config/targets/bird.yaml").read_text())["Crow"]
    own = records(tmp_path, {"Crow": {**crow, "points": 77, "row": {"freq_hi_hz": 6}}})
    found = run_of(tmp_path, {"targets": {"own": {"crow": own}}}).records
    plain = run_of(tmp_path, {}).records
    assert {name for name in plain if found[name] != plain[name]} == {"Crow"} and list(found) == list(plain)
    assert found["Crow"]["points"] == 77
    assert found["Crow"]["published"] == plain["Crow"]["published"] | {"freq_hi_hz": 6.0}


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"colour": "red"}, "expected cells of the columns"),
        ([1], "expected cells of the columns"),
        ({"len_m": -1}, r"here: row: len_m is '-1', expected a positive number"),
        ({"speed_lo": -1}, r"here: row: speed_lo is '-1', expected a number of at least 0"),
        ({"category": "Vehicle", "unseen_protocol": "both"}, "seen or unseen"),
        ({"len_m": 4}, "expected a category"),
    ],
)
def test_wrong_rows_are_refused_and_a_target_may_stand_still(row, message):
    with pytest.raises(InputError, match=message):
        with_row(None, "Tram", row, "here")
    still = dict.fromkeys(("vx_abs_max", "vy_abs_max", "vz_abs_max", "speed_lo", "speed_hi"), 0)
    assert with_row(None, "Tram", {"category": "UAV", **still}, "here").items() >= still.items()


def test_one_file_is_enough_for_real_inputs_and_none_is_refused(tmp_path):
    inputs = tmp_path / "inputs"
    real = yaml.safe_load((ROOT / "config/targets/real.yaml").read_text())
    names = [part["file"] for item in real["DJI Mini 2"]["parts"].values() for part in item["meshes"]]
    with pytest.raises(InputError, match="expected a folder with the files of at least one of"):
        run_of(tmp_path, {}, str(inputs), "real")
    for name in names:
        (inputs / name).parent.mkdir(parents=True, exist_ok=True)
        (inputs / name).write_text("")
    run = run_of(tmp_path, {}, str(inputs), "real")
    assert run.sources == "targets: 39 built-in; from files: DJI Mini 2"
    plain = run_of(tmp_path, {}).records
    assert {name for name in plain if run.records[name] != plain[name]} == {"DJI Mini 2"}
    # One of its files missing, and with it the whole record.
    (inputs / names[0]).unlink()
    with pytest.raises(InputError, match="at least one of"):
        run_of(tmp_path, {}, str(inputs), "real")
    with pytest.raises(InputError, match="missing inputs"):
        run_of(tmp_path, {"targets": {"where_missing": "refuse"}}, str(inputs), "real")


def test_the_command_makes_a_record_with_its_row(tmp_path, monkeypatch):
    from lowalt.__main__ import main
    from lowalt.commands import target
    from lowalt.targets.cloud import read

    monkeypatch.setattr(target, "_picture", lambda cloud, out: str(out))
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "bus.npz"
    own = records(tmp_path, {"My bus": BUS})
    assert main(["target", "make", own, "--out", str(out)]) == 0
    assert read(out).record["published"]["len_m"] == 11.95
    bare = records(tmp_path, {"My bus": {key: value for key, value in BUS.items() if key != "row"}}, "bare")
    assert main(["target", "make", bare, "--out", str(out)]) != 0


def test_heights_of_unknown_names_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"motion.height_m: \['Brid'\]"):
        run_of(tmp_path, {"motion": {"height_m": {"Brid": [1, 2]}}})
    assert run_of(tmp_path, {"motion": {"height_m": {"Crow": [1, 2]}}})
