"""Refusals: each contradiction of a configuration is refused by its key and words before any job,
in one sentence.
"""

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

ALONE = {"stations": {"B": None, "C": None}}
CORNERS = {"region": {"polygon_m": [[0, 0], [500, 0], [250, 433]]}}
A = "A:VRP+TRP+VT"
LINKS = {"stations": {"A-B": {"transmit": "A", "receive": "B"}}}
GROUND = {"permittivity": 5.0, "conductivity_s_m": 0.1}
AT_12_GHZ = {"carrier_hz": 12e9, "symbol_interval_s": 1e-3}
CELLS = {"spectra": {"hrrp": {"window": 1, "hop": 1, "cells": 9}}}


def recognition(**block) -> dict:
    """An overlay of the block `recognition`."""
    return {"recognition": block}


@pytest.mark.parametrize(
    "overlay",
    [
        {"network": ALONE, "motion": CORNERS, **recognition(schemes=[A])},
        {
            "network": {"carrier_hz": "28e9"},
            "spectra": {"vt": {"speed_min_mps": -1.0, "speed_max_mps": 1.0}},
        },
        {
            "network": {"carrier_hz": 28e9},
            "spectra": {"vt": None},
            **recognition(schemes=["A:VRP"]),
        },
        # Only the width of the axis counts, and symbols at known uneven instants tell more speeds
        # apart.
        {"spectra": {"vt": {"speed_min_mps": 0.0, "speed_max_mps": 12.2}}},
        {"spectra": {"vt": {"speed_max_mps": 20.0}, "times": "known"}},
        {"motion": {"sizes_m": {"UAV": [0.3, 0.3], "Bird": [0.1, 0.4]}}},
        {"motion": {"height_m": {"Crow": [1, 1], "UAV": [1, 2]}}},
        recognition(input="dataset", cache=False),
        {"effects": {"ground_reflection": {}}},
        {"effects": {"ground_reflection": GROUND}, "network": AT_12_GHZ},
        {"effects": {"cell_noise": {}}, "added": []},
        {"added": [{"snr_db": [2]}]},
        {"shards": {"kind": "cube", "cells": "int16"}},
        {**CELLS, "shards": {"kind": "cube"}},
    ],
)
def test_what_suits_is_taken(overlay):
    assert run_of(overlay).schemes


@pytest.mark.parametrize(
    ("overlay", "words"),
    [
        (
            {"network": ALONE},
            r"motion.region.polygon_m: None, the area between the stations, .* \[\[0.0, 0.0\]\]; "
            r"exp",
        ),
        (
            {"motion": {"region": {"polygon_m": [[0, 0], [1, 1]]}}},
            r"polygon_m: \[\[0, 0\], \[1, 1\]\]; expected corners",
        ),
        ({"motion": {"region": {"polygon_m": []}}}, r"polygon_m: \[\]; expected corners"),
        (
            {"motion": {"sizes_m": {"UAV": [1, 2]}}, "effects": {"adc": {}}},
            r"sizes_m: given together with effects \['adc'",
        ),
        ({"motion": {"sizes_m": {"Bird": [0.4, 0.1]}}}, r"motion.sizes_m.Bird: value \[0.4, 0.1\]"),
        (
            {"motion": {"sizes_m": {"Boat": [1, 2]}}},
            r"motion.sizes_m: \['Boat'\], expected some of the classes",
        ),
        ({"motion": {"height_m": {"Kite": [1, 2]}}}, r"height_m: \['Kite'\]"),
        ({"motion": {"height_m": {"Crow": [2, 1]}}}, r"motion.height_m.Crow: value \[2, 1\]"),
        (
            {"network": ALONE, "motion": CORNERS},
            "recognition.schemes: 'ABC:.* line 8: stations 'ABC', .* has .*'A:VT'",
        ),
        (
            {"spectra": {"vt": None}},
            r"recognition.schemes: 'A:.* needs \['vt'\]; .* has \['A:VRP', 'A:TRP'\]",
        ),
        (recognition(schemes=["x"]), r"recognition.schemes: 'x': .* which has [^;]*$"),
        (recognition(timed=["x"]), "recognition.timed: 'x'"),
        (recognition(schemes=[A, "a-vrp-trp-vt"]), "expected every scheme once"),
        (
            recognition(schemes=["ABC:mean fusion"], protocols=["seen"]),
            r"recognition.protocols: .* gives \['unseen'\]",
        ),
        (recognition(input="dataset"), "'dataset' together with recognition.cache true"),
        (recognition(transfer=["default"]), "recognition.transfer: 'default' is this run"),
        (
            {"network": {"carrier_hz": 28e9, "symbol_interval_s": 1e-3}},
            r"speed_max_mps 6.1, .* to 2.68: .* 2.8e\+10 .* 0.001",
        ),
        (
            {"spectra": {"vt": {"speed_step_mps": 1e-6}}},
            "spectra.vt: .* expected a step that makes at most 65536",
        ),
        ({"spectra": {"trp": {"window": 9}}}, "spectra.trp: window is 9"),
        ({"network": {"symbols": 256}}, "spectrum vrp: .*256"),
        (
            {"shards": {"kind": "signal", "cells": "int16"}},
            "shards.cells: 'int16' and shards.kind 'signal', expected",
        ),
        ({**CELLS, "shards": {"kind": "signal"}}, r"spectra: \['hrrp'\] and shards.kind 'signal'"),
        ({**CELLS, "effects": {"slow_time": {"regrid": "nudft"}}}, "slow_time.regrid: 'nudft'"),
        (
            {"shards": {"kind": "recipe"}, "effects": {"cell_noise": {}}},
            "'recipe' with the effect 'cell_noise'",
        ),
        # However weak the direct path is, also where there is none.
        *(
            (
                {"network": LINKS, "effects": {"direct_path": {"loss_db": loss_db}, name: {}}},
                rf"\['{name}'\] are not modelled between two stations",
            )
            for loss_db in (0.0, None)
            for name in ("background_channel", "interference", "transmit_leakage")
        ),
        ({"effects": {"ground_reflection": {"permittivity": 0.9}}}, "effects.ground_reflection"),
        *(
            (
                {
                    "network": AT_12_GHZ,
                    "effects": {"ground_reflection": {key: GROUND[key] for key in known}},
                },
                "medium dry ground is known from 1 to 10 GHz, station A sends at 12 GHz",
            )
            for known in ((), ("permittivity",), ("conductivity_s_m",))
        ),
        (
            {"effects": {"companions": {"subtypes": ["Kite"]}}},
            r"companions.subtypes: \['Kite'\], expected subtypes of the",
        ),
        (
            {"effects": {"cell_noise": {}}, "added": [{"snr_db": [2]}]},
            "added: snr_db together with effects.cell_noise",
        ),
        ({"inputs": "none"}, "inputs: 'none' is not there"),
        ({"inputs": "in{x}"}, r"inputs: 'in\{x\}', expected a path without braces"),
        (
            {"report": {"accuracy": "a}.csv"}},
            r"report.accuracy: 'a\}.csv', expected a path without braces",
        ),
        ({"targets": {"records": ["config/targets/none.yaml"]}}, "none.yaml"),
        (
            recognition(network={"weights": "a.pth"}),
            "recognition.network.weights: 'a.pth' is not there",
        ),
        (
            recognition(network={"backbone": "a.py:f"}),
            "recognition.network.backbone: 'a.py' is not there",
        ),
        (recognition(table="a.csv"), "recognition.table: 'a.csv' is not there"),
        ({"report": {"accuracy": "a.csv"}}, "report.accuracy: 'a.csv' is not there"),
        (
            {"targets": {"select": ["crow"]}},
            r"targets.select: \['crow'\], expected perhaps \['Crow'\]$",
        ),
    ],
)
def test_what_does_not_is_refused_with_its_key_and_what_was_expected(overlay, words):
    with pytest.raises(InputError, match=words) as refused:
        run_of(overlay, overlay.get("inputs"))
    assert "\n" not in str(refused.value).removeprefix("configuration refused: ")


def test_another_run_s_data_are_there_and_made_with_the_same_settings(tmp_path, monkeypatch):
    own = load_yaml("config/default.yaml") | {"run": "own"}
    monkeypatch.chdir(tmp_path)
    refusals.refuse_data(own)
    with pytest.raises(
        InputError, match=r"data: no results/made/config\.yaml, expected a finished run"
    ):
        refusals.refuse_data(own | {"data": "made"})
    (tmp_path / "results/made").mkdir(parents=True)
    kept = tmp_path / "results/made/config.yaml"
    kept.write_text(yaml.safe_dump(own | {"run": "made", "recognition": {}, "cost": 1}))
    with pytest.raises(
        InputError,
        match=r"results/made has no SHA256SUMS and no views, expected a run made to its end",
    ):
        refusals.refuse_data(own | {"data": "made"})
    (kept.parent / "SHA256SUMS").touch()
    refusals.refuse_data(
        own | {"data": "made", "recognition": own["recognition"] | {"cache": False}}
    )
    (kept.parent / "views").mkdir()
    refusals.refuse_data(own | {"data": "made"})
    kept.write_text(yaml.safe_dump(own | {"run": "made", "seed": own["seed"] + 1, "more": 1}))
    with pytest.raises(InputError, match=r"other settings of \['more', 'seed'\]"):
        refusals.refuse_data(own | {"data": "made"})


@pytest.mark.workflow
@pytest.mark.parametrize(
    ("overlay", "target", "sentence"),
    [
        (
            {"seed": -1},
            "data",
            r"error: configuration refused: seed: value -1, expected at least 0.*",
        ),
        (
            {},
            "accuracy_cost",
            r"error: no results/default-heights-invented/.*: `make study NAME=heights` makes it "
            r"first",
        ),
        (
            {"run": "mine", "recognition": {"transfer": ["missing"]}},
            "results/mine/transfer.csv",
            r"error: recognition\.transfer: no results/missing/config\.yaml, expected a finished "
            r"run 'missing' .*",
        ),
    ],
)
def test_a_refusal_is_one_sentence_and_status_2_wherever_it_is_found(
    overlay, target, sentence, tmp_path
):
    """Whether the configuration is read or a rule asks for its files."""
    pytest.importorskip("snakemake")
    root = Path(__file__).parents[2]
    (tmp_path / "overlay.yaml").write_text(yaml.safe_dump(overlay))
    line = [
        "-n",
        "--snakefile",
        str(root / "Snakefile"),
        "--workflow-profile",
        "none",
        "--configfile",
    ]
    environment = os.environ | {"PYTHONPATH": str(root / "src")}
    status, text = snakemake_runs.run(
        tmp_path,
        [*line, str(root / "config/default.yaml"), "overlay.yaml", "--", target],
        environment,
    )
    *before, found = text.strip().splitlines()
    assert status == 2 and re.fullmatch(sentence, found) and "Traceback" not in text
    assert not [line for line in before if "rror" in line]
