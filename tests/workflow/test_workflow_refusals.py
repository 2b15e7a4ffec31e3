"""Refusals: each contradiction is refused by its words, and the same configuration without it is taken."""

import os
import re
from pathlib import Path

import pytest
import yaml

import snakemake_runs
from configured import run_of
from lowalt.config.layers import load_yaml
from lowalt.files.errors import InputError
from lowalt.workflow import refusals


def config(**recognition):
    """What the refusals read of a configuration."""
    block = {"cache": True, **recognition}
    return {"motion": {}, "effects": {}, "shards": {"kind": "image"}, "recognition": block,
            "network": {"symbols": 400, "stations": {"A": {}, "B": {}}}}  # fmt: skip


def assert_refused(words, function, *given):
    with pytest.raises(InputError, match=words):
        function(*given)


def test_sizes_of_motion_models_rise_and_stand_without_effects():
    given = {"motion": {"sizes_m": {"UAV": [0.3, 0.3], "Bird": [0.1, 0.4]}}, "effects": {}}
    refusals.refuse_sizes(given)
    refusals.refuse_sizes({"motion": {}, "effects": {"adc": {}}})
    assert_refused(
        r"sizes_m: given together with effects \['adc'\]", refusals.refuse_sizes, {**given, "effects": {"adc": {}}}
    )
    given["motion"]["sizes_m"]["Bird"] = [0.4, 0.1]
    assert_refused("Bird from 0.4 to 0.1 m", refusals.refuse_sizes, given)
    assert_refused("expected some of the classes", refusals.refuse_sizes, {"motion": {"sizes_m": {"Boat": [1, 2]}}})


def test_samples_made_on_the_spot_have_no_cache():
    refusals.refuse_input(config(input="dataset", cache=False))
    refusals.refuse_input(config(input="shards"))
    assert_refused("'dataset' together with recognition.cache true", refusals.refuse_input, config(input="dataset"))


def test_a_folder_without_any_named_file_is_refused_where_built_in_models_would_replace_them(monkeypatch):
    sources = {"Crow": "mesh", "Walk": "mocap", "Mini": "builtin"}
    asked = []

    def records_of(targets):
        asked.append(targets["where_missing"])
        return {name: {"source": source} for name, source in sources.items()}

    monkeypatch.setattr(refusals, "records_of", records_of)
    there = {"Walk"}
    monkeypatch.setattr(refusals, "missing_inputs", lambda records, inputs: sorted(set(records) - there))
    refusals.refuse_no_files({"where_missing": "builtin"}, "folder")
    there.clear()
    assert_refused(r"inputs: folder, expected .* one of \['Crow', 'Walk'\]", refusals.refuse_no_files,
            {"where_missing": "builtin"}, "folder")  # fmt: skip
    assert asked == ["refuse"] * 2
    for other in ({"where_missing": "refuse"}, {}):
        refusals.refuse_no_files(other, "folder")
    sources.update(Crow="builtin", Walk="builtin")
    refusals.refuse_no_files({"where_missing": "builtin"}, "folder")


def test_flight_heights_are_of_subtypes_and_classes_the_lower_first():
    good = {"Crow": [1, 1], "UAV": [1, 2], "Glider": [3, 4]}
    refusals.refuse_heights(good, {"Crow": {}}, ("Glider",))
    for more, words in (({"Kite": [1, 2]}, r"height_m: \['Kite'\]"), ({"Crow": [2, 1]}, "Crow from 2 to 1 m")):
        assert_refused(words, refusals.refuse_heights, good | more, {"Crow": {}}, ("Glider",))


def test_another_run_s_data_are_there_and_made_with_the_same_settings(tmp_path, monkeypatch):
    own = load_yaml("config/default.yaml") | {"run": "own"}
    monkeypatch.chdir(tmp_path)
    refusals.refuse_data(own)
    assert_refused("data: no results/made/config.yaml", refusals.refuse_data, own | {"data": "made"})
    (tmp_path / "results/made").mkdir(parents=True)
    kept = tmp_path / "results/made/config.yaml"
    kept.write_text(yaml.safe_dump(own | {"run": "made", "recognition": {}, "cost": 1}))
    refusals.refuse_data(own | {"data": "made"})
    kept.write_text(yaml.safe_dump(own | {"run": "made", "seed": own["seed"] + 1, "more": 1}))
    assert_refused(r"other settings of \['more', 'seed'\]", refusals.refuse_data, own | {"data": "made"})


def test_paths_with_braces_are_refused_by_their_key_and_other_odd_names_are_not():
    config = {
        "recognition": {"table": "my 'table'.csv"},
        "report": dict.fromkeys(("published", "accuracy")),
    }
    refusals.refuse_braces(config, "in$(touch y)")
    refusals.refuse_braces(config, None)
    assert_refused(r"inputs: 'in\{x\}', expected a path without braces", refusals.refuse_braces, config, "in{x}")
    config["report"]["accuracy"] = "a}.csv"
    assert_refused(r"report\.accuracy: 'a\}\.csv'", refusals.refuse_braces, config, None)


@pytest.mark.parametrize(
    ("overlay", "words"),
    [
        ({"noise": {"snr_db": []}}, "noise.snr_db: value [], expected at least 1 item(s)"),
        ({"targets": {"select": ["Dodo"]}}, "targets.select: ['Dodo']"),
        ({"network": {"carrier_hz": 4.9}}, "network.carrier_hz: value 4.9"),
        ({"network": {"symbols": 256}}, "256"),
        ({"targets": {"records": ["config/targets/none.yaml"]}}, "none.yaml"),
        ({"recogniton": {}}, "unknown key(s) ['recogniton']"),
        ({"effects": {"receiver_noise": {}}}, "a link budget or set SNRs, not both"),
        ({"effects": {"ground_reflection": {"permittivity": 0.9}}}, "effects.ground_reflection"),
    ],
)
def test_a_wrong_configuration_makes_no_run(overlay, words):
    with pytest.raises(InputError, match=re.escape(words)):
        run_of(overlay)


@pytest.mark.workflow
@pytest.mark.parametrize(("overlay", "target", "sentence"), [
    ({"seed": -1}, "data", r"error: configuration refused: seed: value -1, expected at least 0.*"),
    ({}, "accuracy_cost", r"error: no results/default-heights-invented/.*: `make study NAME=heights` makes it first"),
    ({"run": "mine", "recognition": {"transfer": ["missing"]}}, "results/mine/transfer.csv",
     r"error: recognition\.transfer: no results/missing/config\.yaml, expected a finished run 'missing' .*"),
])  # fmt: skip
def test_a_refusal_is_one_sentence_and_status_2_wherever_it_is_found(overlay, target, sentence, tmp_path):
    """Whether the configuration is read or a rule asks for its files."""
    pytest.importorskip("snakemake")
    root = Path(__file__).parents[2]
    (tmp_path / "overlay.yaml").write_text(yaml.safe_dump(overlay))
    line = ["-n", "--snakefile", str(root / "Snakefile"), "--workflow-profile", "none", "--configfile"]
    environment = os.environ | {"PYTHONPATH": str(root / "src")}
    status, text = snakemake_runs.run(
        tmp_path, [*line, str(root / "config/default.yaml"), "overlay.yaml", "--", target], environment
    )
    *before, found = text.strip().splitlines()
    assert status == 2 and re.fullmatch(sentence, found) and "Traceback" not in text
    assert not [line for line in before if "rror" in line]
