"""Kept tables: each names its command, and a row of each that needs no training is remade, chosen
by the date.
"""

import csv
import datetime
import re
import subprocess
import sys
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
KINDS = {"by date", "timed", "trained", "built from a run", "recordings", "by hand", "input"}


def read(path):
    with (ROOT / path).open(newline="") as file:
        return list(csv.DictReader(file))


KEPT = read("results/tables.csv")


def tracked():
    """The tables that git has."""
    found = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if found.returncode:
        pytest.skip("not a git checkout")
    folders = "results/", "studies/", "benchmarks/"
    names = {
        name
        for name in found.stdout.split("\0")
        if name.endswith(".csv") and name.startswith(folders)
    }
    return names - {"results/tables.csv"}


def test_every_kept_table_names_one_command():
    names = tracked()
    for name in names:
        assert len([row for row in KEPT if fnmatchcase(name, row["tables"])]) == 1, name
    for row in KEPT:
        assert any(fnmatchcase(name, row["tables"]) for name in names), row
        assert row["row"] in KINDS, row


def test_every_command_of_a_kept_table_is_there():
    root_targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for row in KEPT:
        for part in row["command"].split(" && "):
            if part.startswith("make -C "):
                folder = part.split()[2]
                targets = set(
                    re.findall(r"^(\w+):", (ROOT / folder / "Makefile").read_text(), re.MULTILINE)
                )
                asked = [word for word in part.split()[3:] if "=" not in word]
            else:
                targets = root_targets
                asked = [word for word in part.split()[1:2] if part.startswith("make ")]
                asked = [word for word in asked if word not in ("on", "study")]
            assert set(asked) <= targets, part
        for study in re.findall(r"NAME=([\w-]+)", row["command"]):
            assert (ROOT / f"studies/{study}/Makefile").is_file() or row["command"].endswith(
                "--label NAME"
            ), row
        for path in re.findall(r"\S+\.(?:py|yaml)\b", row["command"]):
            assert (ROOT / path).is_file(), row


def program(path):
    """A program of `benchmarks/` or of a study as a module."""
    sys.path.insert(0, str((ROOT / path).parent))
    return import_module(Path(path).stem)


def cells(kept):
    module = program("benchmarks/scene_cells.py")
    path = ROOT / f"config/scenes/{kept['scene']}.yaml"
    (row,) = module.rows(kept["scene"], module.findings(ROOT, path, 5, kept["class"]))
    return dict(zip(module.COLUMNS, row, strict=True))


def truth(kept):
    module = program("benchmarks/observed_truth.py")
    config = module.block_of(ROOT, kept["scene"])
    found = module.distances(config, kept["scene"], int(kept["symbols"]), module.LOOKS)
    largest = (f"{max(values):.3f}" for values in zip(*found, strict=True))
    return {"looks": len(found)} | dict(zip(module.COLUMNS[4:], largest, strict=True))


def scale(kept, tmp_path):
    module = program("docs/scale_table.py")
    overlay = f"config/{kept['configuration']}.yaml"
    module.main(
        [
            "--stages",
            "results/reference/default-stages.csv",
            "--costs",
            "results/reference/default-accuracy_cost.csv",
            "--schema",
            "workflow/schemas/config.schema.yaml",
            "--base",
            "config/default.yaml",
            "--overlays",
            overlay,
            "--out",
            str(tmp_path / "scale.csv"),
        ]
    )
    return read(tmp_path / "scale.csv")[0]


def fuzzed(kept, tmp_path):
    (reader,) = [
        each for each in import_module("fuzzing").all_readers() if each.name == kept["reader"]
    ]
    found = import_module("fuzzing").attack(reader, int(kept["inputs"]), 1, tmp_path)
    return {key: found[key] for key in ("reader", "inputs", "accepted", "refused", "faults")}


def coverage(kept):
    module = program("benchmarks/interval_coverage.py")
    rng = import_module("lowalt.numerics.streams").stream(1, "coverage", kept["case"])
    case = module.CASES[kept["case"]]
    # The plain intervals, of a stream of their own, take as long again.
    return {"held_percent": f"{100 * module.held(case, int(kept['trials']), 400, rng, False):.1f}"}


def fault(kept, tmp_path):
    module = program("benchmarks/planted_faults.py")
    (planted,) = [
        row for row in read("benchmarks/planted_faults.csv") if row["fault"] == kept["fault"]
    ]
    by = module.planted(module.copy_of_tree(ROOT, tmp_path / "tree"), planted)
    return {"fault": planted["fault"], "caught": "yes" if by else "no"}


def rounding(kept):
    module = program("benchmarks/rounding.py")
    dataset = module.Dataset(
        module.load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
    )
    points = None if kept["points"] == "as they are" else int(kept["points"])
    found = module.measured(dataset, 5, points, 1)
    return {key: found[key] for key in ("points", "signals", "symbols", "again", "left_open")}


def scene_level(kept):
    module = program("benchmarks/scene_levels.py")
    station, found = module.scene_levels(ROOT, kept["scene"])
    (level,) = [one for one in found if one.name == kept["level"]]
    return {"station": station, "value": f"{level.value:.1f}", "unit": level.unit}


def target_level(kept):
    module = program("benchmarks/scene_levels.py")
    config, records = module.target_records(ROOT)
    values = module.target_level(config, records[kept["subtype"]], 2000)
    return dict(zip(module.TARGET_COLUMNS[1:], (f"{value:.2f}" for value in values), strict=True))


def memory(kept):
    module = program("benchmarks/training_memory.py")
    overlay = "workstation" if "tiny" in kept["backbone"] else "paper"
    row = module.row(overlay, int(kept["accumulate"]), kept["activation_checkpointing"] == "True")
    return dict(zip(module.COLUMNS, row, strict=True))


def precision(kept):
    module = program("benchmarks/signal_precision.py")
    rows = module.rows(module.Dataset(module.overlaid([])), float(kept["snr_db"]))
    (row,) = [row for row in rows if row[0] == kept["kept_as"]]
    return dict(zip(module.COLUMNS, row, strict=True))


def gain(kept):
    module = program("benchmarks/sampling_gain.py")
    tone_hz = float(kept["tone_hz"])
    names = [name for name in kept if name.startswith("gain_") and kept[name]]
    rates_hz = (float(name.split("_")[1]) for name in names)
    found = (
        module.gain(kept["sampling"], kept["channel"], rate_hz, tone_hz) for rate_hz in rates_hz
    )
    return dict(zip(names, (f"{value:z.2f}" for value in found), strict=True))


def layout(kept, tmp_path):
    module = program("benchmarks/recording_layouts.py")
    snr_db = int(kept["snr_db"])
    values = module.echo(kept["echo"], snr_db, np.random.default_rng([snr_db, len(kept["echo"])]))
    return {"tries": module.tries(module.written(kept["layout"], values, tmp_path), values)}


REMADE = {
    "results/reference/scene_cells.csv": cells,
    "results/reference/scale.csv": scale,
    "results/reference/observed_truth.csv": truth,
    "results/benchmarks/fuzz.csv": fuzzed,
    "results/benchmarks/interval_coverage.csv": coverage,
    "results/benchmarks/planted_faults.csv": fault,
    "results/benchmarks/rounding.csv": rounding,
    "results/benchmarks/scene_levels.csv": scene_level,
    "results/benchmarks/target_levels.csv": target_level,
    "results/benchmarks/training_memory.csv": memory,
    "results/benchmarks/recording_layouts.csv": layout,
    "results/benchmarks/sampling_gain.csv": gain,
    "results/benchmarks/signal_precision.csv": precision,
}


def test_every_table_that_is_remade_by_date_has_its_way():
    assert set(REMADE) == {row["tables"] for row in KEPT if row["row"] == "by date"}


@pytest.mark.slow
@pytest.mark.parametrize("table", REMADE, ids=lambda name: Path(name).stem)
def test_a_row_chosen_by_date_is_remade(table, request, monkeypatch):
    monkeypatch.chdir(ROOT)
    rows = read(table)
    kept = rows[datetime.datetime.now(datetime.UTC).toordinal() % len(rows)]
    way = REMADE[table]
    wanted = way.__code__.co_varnames[1 : way.__code__.co_argcount]
    found = way(kept, **{name: request.getfixturevalue(name) for name in wanted})
    assert found
    for column, value in found.items():
        assert str(value) == kept[column], (column, kept)
