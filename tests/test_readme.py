"""The README keeps its word: its code runs, and its figures are those of kept tables."""

import csv
import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_library_example_runs_as_printed(monkeypatch):
    monkeypatch.chdir(ROOT)
    names: dict = {}
    exec(
        compile(re.search(r"```python\n(.*?)```", README, re.DOTALL)[1], "README.md", "exec"), names
    )
    image = names["image"]
    signal = names["signal"]
    assert (image.shape, image.dtype) == ((768, 768), np.uint8)
    assert (signal.shape, signal.dtype) == ((3, 400), np.complex64)
    assert names["record"]["category"] == names["samples"].classes[names["label"]]
    assert len(np.unique(image)) > 100


def test_it_fits_two_screens():
    assert len(README.splitlines()) < 80


def rows(table: str) -> list[dict]:
    """The rows of a kept table."""
    with (ROOT / "results" / table).open(newline="") as file:
        return list(csv.DictReader(file))


def row(table: str, **wanted: str) -> dict:
    """The one row of a kept table with these values."""
    (found,) = [each for each in rows(table) if wanted.items() <= each.items()]
    return found


def decimal(text: str) -> str:
    """A figure of a table with one decimal place."""
    return f"{float(text):.1f}"


def test_the_accuracies_are_those_of_the_default_s_table():
    of_default = {"scheme": "ABC:VRP+TRP+VT", "snr_db": "avg", "seeds": "3"}
    for protocol, start in (("seen", "stations {} %"), ("unseen", "and {} % if it was not")):
        kept = row("reference/default-accuracy.csv", protocol=protocol, **of_default)
        low = decimal(kept["macro_f1_low"])
        assert start.format(decimal(kept["accuracy_percent"])) in README
        assert f"{low} to {decimal(kept['macro_f1_high'])})" in README


def test_the_share_of_two_subtypes_is_that_of_the_table():
    errors = {
        each["subtype"]: (100 - float(each["accuracy_percent"])) * int(each["samples"])
        for each in rows("reference/default-subtypes.csv")
        if (each["protocol"], each["scheme"]) == ("unseen", "ABC:VRP+TRP+VT")
    }
    assert len(errors) == 20
    assert sorted(errors, key=errors.get)[-2:] == ["Sparrow", "EH 216 S"]
    share = (errors["Sparrow"] + errors["EH 216 S"]) / sum(errors.values())
    assert f"make {100 * share:.0f} % of the errors on unseen ones" in README


def test_the_accuracies_on_recordings_are_those_of_the_tables():
    of_balanced = {"half": "test", "class": "balanced"}
    airborne = row("reference/measured-further.csv", radar="bird_drone_10ghz", **of_balanced)
    ground = row("reference/measured-accuracy.csv", radar="cw_24ghz", **of_balanced)
    for kept, devices in ((airborne, "one radar"), (ground, "two radars")):
        interval = f"{decimal(kept['low'])} to {decimal(kept['high'])}"
        assert f"({kept['files']} files of {devices}, {interval})" in README
        assert f"in {decimal(kept['right_percent'])} % of" in README
    assert (airborne["devices"], ground["devices"]) == ("1", "2")
    assert f"or {decimal(ground['named_percent'])} % of those" in README


def test_the_last_lines_of_make_are_those_of_the_kept_run():
    said = []
    for protocol in ("seen", "unseen"):
        of_run = {"protocol": protocol, "scheme": "ABC:VRP+TRP+VT"}
        ours = row("reference/default-seeds.csv", seed="0", **of_run)["accuracy_percent"]
        paper = row("../config/published_accuracy.csv", snr_db="avg", **of_run)["accuracy_percent"]
        said.append(f"{protocol} {float(ours):.1f} % (paper {float(paper):.1f})")
    assert f"accuracy of ABC:VRP+TRP+VT: {', '.join(said)}\n" in README


def test_the_time_of_make_is_that_of_the_table():
    """Without bfloat16 units only a run of more training steps was measured."""
    of_make = {"part": "make", "hardware": "AMD EPYC; 2 cores; 24 GiB; no GPU"}
    labels = "bf16, 1000 steps", "no bf16 units, AVX2, warm cache, batches of 32"
    fast, slow = (
        float(row("benchmarks/workflow.csv", label=label, **of_make)["wall_s"]) / 60
        for label in labels
    )
    assert f"it took {fast:.1f} minutes from an empty clone with bfloat16 units" in README
    assert f"it took {slow:.1f} minutes" in README
