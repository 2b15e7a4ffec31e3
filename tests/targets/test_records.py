"""Records: what is merged and overrides what, rows of one's own, and faults refused.

A fault is refused by file, subtype, key and value.
"""

import copy
from pathlib import Path

import pytest
import yaml

from lowalt.config import layers
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.targets.records import (
    load_records,
    load_table,
    merge,
    missing_inputs,
    read_records,
    records_of,
    source_files,
    with_row,
)
from lowalt.workflow.run import Run
from tables import rows

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "config/targets.csv"
FILES = [ROOT / f"config/targets/{name}.yaml" for name in ("uav", "bird", "vehicle", "pedestrian")]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
BUS = yaml.safe_load((ROOT / "config/targets/more.yaml").read_text())["City bus"]


@pytest.fixture(scope="module")
def written():
    """The records of all files as written."""
    return {name: record for file in FILES for name, record in read_records(file).items()}


def load(tmp_path, records):
    """The merged records of one overriding file after the embedded ones."""
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(records, sort_keys=False))
    return load_records(TABLE, [*FILES, tmp_path / "mine.yaml"])


def test_all_forty_in_the_tables_order_with_their_published_values():
    records = load_records(TABLE, FILES)
    assert list(records) == list(load_table(TABLE)) and len(records) == 40
    mini = records["DJI Mini 2"]
    assert mini["published"]["size_m"] == 0.2192 and mini["published"]["n_rotors_or_wings"] == 4
    assert mini["published"]["len_m"] is None and mini["published"]["freq_hi_hz"] == 256.0
    assert (mini["category"], mini["group"], mini["points"], mini["rcs_m2_per_point"]) == (
        "UAV",
        "seen",
        171,
        1.0,
    )
    assert mini["figures"]["propeller_diameter"]["si"] == 0.109
    assert records["EH 216 S"]["group"] == "unseen"
    assert missing_inputs(records, None) == [] and source_files(mini, None) == []
    assert len({slug(name) for name in records}) == 40


def test_a_record_takes_numbers_in_any_writing(tmp_path, written):
    mine = copy.deepcopy(written["Crow"]) | {"points": "5e1", "rcs_m2_per_point": "1e-2"}
    mine["figures"]["length"] = ["46e0", "cm", "reference"]
    found = load(tmp_path, {"Crow": mine})["Crow"]
    assert (found["points"], found["rcs_m2_per_point"], found["figures"]["length"]["value"]) == (
        50,
        0.01,
        46.0,
    )


def test_a_later_file_replaces_whole_records(tmp_path, written):
    mine = copy.deepcopy(written["Crow"]) | {"points": 50}
    del mine["sources"]
    mine["figures"]["length"][2] = mine["figures"]["span"][2] = "estimate"
    records = load(tmp_path, {"Crow": mine})
    assert records["Crow"]["points"] == 50 and "sources" not in records["Crow"]
    assert records["Eagle"]["points"] == 134


@pytest.mark.parametrize(
    ("change", "message"),
    rows("records", "records"),
)
def test_wrong_records_are_refused_by_key_and_value(tmp_path, written, change, message):
    with pytest.raises(InputError, match=message) as refusal:
        load(tmp_path, {"Crow": written["Crow"] | change})
    assert "mine.yaml" in str(refusal.value)


@pytest.mark.parametrize(
    ("name", "figure", "value", "message"),
    rows("records", "figures"),
)
def test_wrong_figures_and_impossible_shapes_are_refused(
    tmp_path, written, name, figure, value, message
):
    record = copy.deepcopy(written[name])
    record["figures"][figure] = value
    with pytest.raises(InputError, match=rf"mine\.yaml: {name}: .*{message}"):
        load(tmp_path, {name: record})


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    rows("records", "layouts"),
)
def test_layouts_that_do_not_fit_the_craft_are_refused(tmp_path, written, name, changes, message):
    record = written[name if changes else "Type-A Firefighting UAV"]
    with pytest.raises(InputError, match=rf"{name}: .*{message}"):
        load(tmp_path, {name: record | changes})


def test_unknown_and_missing_subtypes_are_refused(tmp_path):
    with pytest.raises(
        InputError, match=r"mine\.yaml: unknown subtype 'Dodo', expected a key `row` or one of"
    ):
        load(tmp_path, {"Dodo": {"source": "builtin"}})
    with pytest.raises(InputError, match=r"no record for \['AITO M9 2024'"):
        load_records(TABLE, [file for file in FILES if file.stem != "vehicle"])


@pytest.mark.parametrize(
    ("text", "message"),
    rows("records", "files"),
)
def test_files_that_hold_no_records_or_one_twice_are_refused(tmp_path, text, message):
    (tmp_path / "bad.yaml").write_text(text)
    with pytest.raises(InputError, match=message):
        read_records(tmp_path / "bad.yaml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    rows("records", "tables"),
)
def test_wrong_tables_are_refused(tmp_path, old, new, message):
    (tmp_path / "table.csv").write_text(TABLE.read_text().replace(old, new))
    with pytest.raises(InputError, match=message):
        load_table(tmp_path / "table.csv")


@pytest.mark.parametrize(
    ("name", "words"),
    rows("records", "names"),
)
def test_a_file_outside_the_folder_or_of_a_name_that_the_workflow_cannot_pass_on_is_refused(
    name, words
):
    row = load_table(TABLE)["Walking Pedestrian 1"]
    for files in ({"skeleton": "s.asf", "motion": name}, {"skeleton": name, "motion": "m.amc"}):
        with pytest.raises(InputError, match=rf"here: file is .*{words}"):
            merge(row, {"source": "mocap", **files}, "here")


def run_of(tmp_path, overlay, inputs=None, base="default"):
    path = tmp_path / "overlay.yaml"
    path.write_text(yaml.safe_dump(overlay))
    files = [ROOT / "config/default.yaml", ROOT / f"config/{base}.yaml", path]
    return Run.of(layers.load(dict.fromkeys(files), SCHEMA), SCHEMA, inputs)


def records(tmp_path, content, name="mine"):
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content))
    return str(path)


def test_one_record_with_its_row_adds_one_target(tmp_path):
    own = records(tmp_path, {"My bus": BUS})
    run = run_of(tmp_path, {"targets": {"own": {"bus": own}}})
    assert [group for group, names in run.plan.groups.items() if "My bus" in names] == ["seen"]
    assert len(run.records) == 41 and run.records["My bus"]["published"]["len_m"] == 11.95
    assert (
        run.classes == ("UAV", "Bird", "Vehicle", "Pedestrian")
        and run.sources == "targets: 41 built-in"
    )
    bus = records(
        tmp_path,
        {"My bus": {**BUS, "like": "Vehicle", "row": BUS["row"] | {"category": "Bus"}}},
        "class",
    )
    assert run_of(tmp_path, {"targets": {"own": {"bus": bus}}}).classes[-1] == "Bus"
    # A null in a later layer takes the file out again.
    (tmp_path / "one.yaml").write_text(yaml.safe_dump({"targets": {"own": {"bus": own}}}))
    (tmp_path / "two.yaml").write_text(yaml.safe_dump({"targets": {"own": {"bus": None}}}))
    config = layers.load(
        [ROOT / "config/default.yaml", tmp_path / "one.yaml", tmp_path / "two.yaml"], SCHEMA
    )
    assert len(records_of(config["targets"])) == 40


def test_a_single_record_replaces_that_of_its_subtype_alone_and_cells_of_its_row(tmp_path):
    crow = yaml.safe_load((ROOT / "config/targets/bird.yaml").read_text())["Crow"]
    own = records(tmp_path, {"Crow": {**crow, "points": 77, "row": {"freq_hi_hz": 6}}})
    found = run_of(tmp_path, {"targets": {"own": {"crow": own}}}).records
    plain = run_of(tmp_path, {}).records
    assert {name for name in plain if found[name] != plain[name]} == {"Crow"} and list(
        found
    ) == list(plain)
    assert found["Crow"]["points"] == 77
    assert found["Crow"]["published"] == plain["Crow"]["published"] | {"freq_hi_hz": 6.0}


@pytest.mark.parametrize(
    ("row", "message"),
    rows("records", "rows"),
)
def test_wrong_rows_are_refused_and_a_target_may_stand_still(row, message):
    with pytest.raises(InputError, match=message):
        with_row(None, "Tram", row, "here")
    still = dict.fromkeys(("vx_abs_max", "vy_abs_max", "vz_abs_max", "speed_lo", "speed_hi"), 0)
    assert with_row(None, "Tram", {"category": "UAV", **still}, "here").items() >= still.items()


def test_one_file_is_enough_for_real_inputs_and_none_is_refused(tmp_path):
    inputs = tmp_path / "inputs"
    real = yaml.safe_load((ROOT / "config/targets/real.yaml").read_text())
    names = [
        part["file"] for item in real["DJI Mini 2"]["parts"].values() for part in item["meshes"]
    ]
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
