"""The benchmark's results beside a run: two methods compared, and its section of the report."""

import functools
import json
from pathlib import Path
from types import SimpleNamespace

import benchmark_picture
import pytest

from configured import stages_of
from lowalt.__main__ import main
from lowalt.extensions.benchmark import baseline_table, benchmark_results, compared_methods
from lowalt.files.csv_tables import read_csv
from lowalt.report.inputs import FILES, Inputs
from lowalt.report.page import added_sections, assembled
from pages import sound

ROOT = Path(__file__).parents[3]


def test_compare_holds_two_methods_of_the_benchmark_against_each_other(monkeypatch, capsys):
    # Facts and text come from the same numbers, which take seconds.
    once = functools.cache(compared_methods.compared)
    monkeypatch.setattr(compared_methods, "compared", once)
    first = "nearest centroid on moments"
    second = "majority class"
    assert main(["compare", first, second, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)["tracks"]
    kept = {row["track"]: row for row in baseline_table.read() if row["method"] == first}
    assert set(facts) == set(kept)
    for track, found in facts.items():
        value, low, high = found["difference"]
        assert found["first"] == [float(kept[track][name]) for name in ("percent", "low", "high")]
        # What is kept of AUROC has three digits.
        assert (
            value == pytest.approx(found["first"][0] - found["second"][0], abs=0.05)
            and low < value < high
        )
    assert main(["compare", first, second]) == 0
    text = capsys.readouterr().out
    assert (
        text.startswith(f"paired difference in percent: {first} | {second}\n  seen ")
        and "  better; " in text
    )
    for wrong, words in (
        ("majority clas", "expected perhaps ['majority class']"),
        ("none", "lowalt benchmark table"),
    ):
        assert main(["compare", first, wrong]) == 2
        error = capsys.readouterr().err
        assert f"{wrong!r}: neither a folder nor a method" in error and words in error


def test_a_run_on_a_benchmark_s_data_shows_the_table_of_baselines():
    files = dict.fromkeys(FILES, "none.csv") | {"clouds": [], "benchmarks": []}
    assert benchmark_results.values(SimpleNamespace(inputs=Inputs(files))) is None
    path = "results/reference/lowalt-40-v1/table.csv"
    own = SimpleNamespace(inputs=Inputs(files | {"benchmark": path}))
    html = added_sections(own)
    assert "Baselines of lowalt-40-v1" in html
    tables = sound(assembled("page", [{"id": "results", "title": "Results", "html": html}])).tables
    rows = read_csv(path, "method", "track", "percent", "low", "high", "group")
    assert sum(len(table["rows"]) for table in tables) == 2 * len({row["method"] for row in rows})
    for row in rows:
        (cell,) = [
            line[table["head"].index(row["track"])]
            for table in tables
            if row["track"] in table["head"]
            for line in table["rows"]
            if line[0] == row["method"]
        ]
        interval = "{:.1f} ({:.1f} to {:.1f})".format(
            *(float(row[name]) for name in ("percent", "low", "high"))
        )
        assert cell.startswith(f"{interval} {'abcdefghijkl'[int(row['group']) - 1]}")


def test_the_code_and_the_template_of_the_section_are_inputs_of_the_page_that_shows_it():
    folder = "src/lowalt/extensions/benchmark"
    inputs = {}
    for name in ("default", "lowalt-40-v1"):
        wildcards = SimpleNamespace(run=name)
        page = stages_of({"run": name}).page
        inputs[name] = {*page.templates, *page.added_sections(wildcards)}
    added = inputs["lowalt-40-v1"] - inputs["default"]
    assert {f"{folder}/benchmark_results.py", f"{folder}/benchmark_results.html"} <= added
    assert not [path for path in inputs["default"] if "extensions/benchmark" in path]
    assert inputs["default"] < inputs["lowalt-40-v1"]


def test_the_picture_of_the_benchmark_is_that_of_the_kept_table():
    rows = baseline_table.read()
    for name, narrow in (("benchmark.svg", False), ("benchmark-narrow.svg", True)):
        kept = (ROOT / "docs/pictures" / name).read_text()
        assert kept == benchmark_picture.picture(rows, narrow)
