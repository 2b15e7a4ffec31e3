"""The last lines of a run: its accuracies beside the paper's, its page, and what to try next."""

import logging
import shutil
from pathlib import Path

import pytest
import yaml
from test_workflow_display import handler_of, record

from lowalt.config.layers import merge
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow import closing

ROOT = Path(__file__).parents[2]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of a finished run of the default whose last scheme is right in 97.25 and 90 %."""
    monkeypatch.chdir(tmp_path)
    found = Path("results/mine")
    found.mkdir(parents=True)
    shutil.copy(ROOT / "config/default.yaml", found / "config.yaml")
    columns = ("protocol", "scheme", "snr_db", "accuracy_percent")
    rows = [
        ("seen", "A:VRP", "avg", 80),
        ("seen", "ABC:VRP+TRP+VT", 3, 12),
        ("seen", "ABC:VRP+TRP+VT", "avg", 97.25),
    ]
    write_csv(found / "accuracy.csv", columns, [*rows, ("unseen", "ABC:VRP+TRP+VT", "avg", 90)])
    return found


def test_the_last_scheme_stands_beside_the_paper_and_the_page_and_the_next_step_follow(folder):
    found = closing.lines(folder)
    assert (
        found[0]
        == "accuracy of ABC:VRP+TRP+VT: seen 97.2 % (paper 99.9), unseen 90.0 % (paper 97.8)"
    )
    assert found[1] == "page: results/mine/report.html"
    assert "lowalt run config/scenes/urban.yaml: " in found[2] and len(found) == 4
    small = merge(load_yaml(folder / "config.yaml"), {"targets": {"select": ["Crow"]}})
    (folder / "config.yaml").write_text(yaml.safe_dump(small))
    write_csv(
        folder / "accuracy.csv",
        ("protocol", "scheme", "snr_db", "accuracy_percent"),
        [("seen", "x", "avg", 50)],
    )
    found = closing.lines(folder)
    assert found[0] == "accuracy of x: seen 50.0 %" and "lowalt run: all subtypes" in found[2]


@pytest.mark.parametrize(
    ("rule", "error", "ends"), [("report", "", True), ("report", "x", False), ("echo", "", False)]
)
def test_a_run_that_made_its_page_ends_with_them(folder, rule, error, ends):
    handler = handler_of()
    handler.emit(record("run", event="run_info", stats={rule: 1, "total": 1}))
    files = [str(folder / "report.html"), str(folder / "stages.csv")]
    handler.emit(
        record(
            "rule", event="job_info", jobid=1, rule_name=rule, log=[], output=files, wildcards={}
        )
    )
    if error:
        handler.emit(record(error, logging.ERROR))
    handler.close()
    said = handler._stream.getvalue().splitlines()
    assert (said[-4:] == closing.lines(folder)) == ends and ("1 jobs" in said[-5 if ends else -1])
