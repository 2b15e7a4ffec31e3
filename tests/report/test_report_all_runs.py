"""The gallery of runs: every run is linked, and two of them differ on the page as `lowalt compare`
says.
"""

import json
import re

from lowalt.__main__ import main
from lowalt.commands.compare import compared
from pages import browsed, sound
from run_folders import run_folder


def made(folder):
    """Two runs, one with a report, and the gallery's text."""
    one = run_folder(folder / "one", 80, 5.0)
    other = run_folder(folder / "other", 81, 2.5, seed=2)
    with (one / "config.yaml").open("w") as file:
        file.write("{run: one, seed: 1, motion: {models: 3}, noise: {snr_db: [3.0, .inf]}}")
    (one / "report.html").write_text("page")
    (other / "shards").mkdir()
    (other / "shards/index.json").write_text(json.dumps({"samples": 40, "bytes": 2_500_000}))
    (folder / "reference").mkdir()
    assert main(["report", "--gallery", "--results", str(folder)]) == 0
    return one, other, (folder / "index.html").read_text()


def test_every_run_stands_in_the_table_and_those_with_a_page_are_linked(tmp_path, capsys):
    *_, text = made(tmp_path)
    assert "index.html: 2 runs" in capsys.readouterr().out
    page = sound(text)
    assert [link for link in page.links if not link.startswith("#")] == ["one/report.html"]
    assert page.tables[0]["rows"] == [
        ["one", "", "", "81.00 (A:VT)", "", "5"],
        ["other (no report)", "40", "0.003", "82.00 (A:VT)", "", "2"],
    ]


def test_a_folder_without_runs_is_an_error_and_leaves_no_page(tmp_path, capsys):
    assert main(["report", "--gallery", "--results", str(tmp_path)]) == 2
    assert f"{tmp_path}: no run, expected" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_two_runs_on_the_page_differ_as_the_command_says(tmp_path):
    one, other, text = made(tmp_path)
    script = """
    const words = (row) => [...row.cells].map((cell) => cell.textContent);
    const lines = () => [...document.querySelectorAll("#compared tbody tr")].map(words);
    const first = lines();
    document.getElementById("first").value = "other";
    document.getElementById("first").dispatchEvent(new Event("change"));
    document.body.dataset.said = JSON.stringify([first, lines()]);
    """
    said = re.search('data-said="(.*?)"', browsed(tmp_path, text, script), re.S)[1]
    differing, same = json.loads(said.replace("&quot;", '"').replace("&amp;", "&"))
    wanted = compared(one, other)
    assert {row[0] for row in differing} == {name for part in wanted.values() for name in part}
    rows = {row[0]: row[1:] for row in differing}
    assert rows["seen A:VT"] == ["81", "82", "+1"] and rows["echo"] == ["5", "2.50", "-2.50"]
    assert rows["seed"] == ["1", "2", ""] and rows["bytes"] == ["-", "2500000", ""]
    assert rows["noise.snr_db"] == ["[3.0, Infinity]", "-", ""]
    # A run compared with itself differs in nothing; what is measured stands there twice.
    assert {row[0] for row in same} == {"seen A:VT", "echo", "samples", "bytes"}
