"""What accuracy costs in time, as the page says it: the sentence of the echo, the figures and the
presets.
"""

import re

import pytest
from filled_tables import presets

from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.measure import accuracy_cost, echo_cost
from lowalt.report.figures import cost_plots
from lowalt.report.page import rendered
from lowalt.report.sections import recognition_cost
from lowalt.report.sections.simulation_cost import sentence


def echo_rows(**tolerances):
    """Rows of lowalt at 300 points: seconds by tolerance."""
    return [
        {"method": "lowalt", "tolerance": name, "points": "300", "seconds": str(seconds)}
        for name, seconds in tolerances.items()
    ]


def test_the_sentence_says_what_tolerances_save_and_advises_exactness_where_that_is_little():
    rows = echo_rows(exact=3e-3, loose=2.5e-3, fine=2.9e-3)
    said = "Exact costs 3.00 ms per signal of 300 points, and tolerances save at most 0.50 ms of it"
    assert sentence(rows) == f"{said}, so use exact."
    more = [
        row | {"points": "9000", "seconds": str(10 * float(row["seconds"]))} for row in rows[:2]
    ]
    assert sentence([*rows, *more]) == f"{said} (5 of 30 ms at 9000 points), so use exact."
    assert sentence(echo_rows(exact=3e-3, loose=1e-3)).endswith("save at most 2.00 ms of it.")
    assert "at most 0.00 ms" in sentence(echo_rows(exact=1e-3, slower=2e-3))
    assert sentence(echo_rows(exact=1e-3)) == sentence([]) == ""


def trained(scheme, seconds, percent, low=0.0, high=0.0, front="no", **more):
    """A trained row, every column text as a CSV file gives it."""
    values = {
        "scheme": scheme,
        "kind": "trained",
        "core_s_data": seconds / 2,
        "core_s_training": seconds / 2,
        "unseen_percent": percent,
        "low": low,
        "high": high,
        "front": front,
        "hardware": "here",
    }
    return dict.fromkeys(accuracy_cost.COLUMNS, "") | {
        name: str(value) for name, value in (values | more).items()
    }


PRESETS = [
    trained(
        "default",
        200,
        90.0,
        front="yes",
        preset="default",
        command="make",
        macro_f1_low=80,
        macro_f1_high=97,
    ),
    trained("slow", 300, 85.0, -6, -1),
    trained(
        "quick",
        50,
        88.0,
        -4,
        1,
        "yes",
        preset="quick",
        command="lowalt run",
        macro_f1_low=70,
        macro_f1_high=95,
    ),
    trained(
        "best",
        400,
        99.0,
        2,
        17,
        "yes",
        preset="best",
        command="make study",
        macro_f1_low=98,
        macro_f1_high=100,
    ),
    dict.fromkeys(accuracy_cost.COLUMNS, "")
    | {"scheme": "large", "kind": "timed", "core_s_training": "9e4"},
]


def test_points_are_the_trained_rows_and_names_rise_along_the_front():
    plot = cost_plots.recognition(PRESETS)
    rows = {row["scheme"]: row for row in plot.rows}
    assert [(row["scheme"], row["core_s"]) for row in plot.rows] == [
        ("quick", 50),
        ("default", 200),
        ("slow", 300),
        ("best", 400),
    ]
    assert [name for name, row in rows.items() if row["same"]] == ["quick", "default"]
    assert [name for name, row in rows.items() if row["first"]] == ["default"]
    assert (rows["slow"]["low"], rows["slow"]["high"], rows["best"]["high"]) == (84.0, 89.0, 100.0)
    # Names of the front rise from left to right; the name of what is beaten stands below its point.
    heights = {
        name: float(height)
        for height, name in re.findall(r'y="([0-9.]+)"[^>]*>(quick|default|slow|best)<', plot.svg)
    }
    assert (
        heights["quick"] > heights["default"] > heights["best"]
        and heights["slow"] > heights["default"]
    )


def test_presets_stand_by_their_time_with_interval_and_command():
    inputs = type(
        "Held", (), {"own_or_kept": lambda *_: "accuracy_cost", "table": lambda *_: PRESETS}
    )()
    text = rendered(
        "recognition_cost", recognition_cost.values(type("Run", (), {"inputs": inputs})())
    )
    places = [text.index(f"{name}: <code>") for name in ("quick", "default", "best")]
    assert places == sorted(places) and "<td>100 + 100</td><td>90.0 (80.0 to 97.0)</td>" in text
    assert "large (timed only)" in text


def test_a_document_shows_the_presets_and_nothing_where_none_was_measured(tmp_path):
    for name, rows in (("a", PRESETS), ("b", PRESETS[1:2])):
        write_csv(tmp_path / f"{name}-accuracy_cost.csv", accuracy_cost.COLUMNS, rows)
    lines = presets(f"{tmp_path}/a-").splitlines()
    assert [line.split(" | ")[0] for line in lines[2:]] == ["| quick", "| default", "| best"]
    assert (
        lines[3] == "| default | 100 + 100 | 90.0 (80.0 to 97.0) | `make` |"
        and presets(f"{tmp_path}/b-") == ""
    )


@pytest.mark.parametrize(
    ("name", "columns", "rows"),
    [
        ("recognition", accuracy_cost.COLUMNS, PRESETS),
        (
            "echo",
            echo_cost.COLUMNS,
            [["lowalt", "exact", points, 1e-3 * points, 1e-14, "here"] for points in (10, 100)],
        ),
    ],
)
def test_the_command_draws_either_table(name, columns, rows, tmp_path):
    write_csv(tmp_path / "table.csv", columns, rows)
    cost_plots.main(
        [name, "--table", str(tmp_path / "table.csv"), "--figure", str(tmp_path / "figure.svg")]
    )
    text = (tmp_path / "figure.svg").read_text()
    assert (
        text.startswith("<svg")
        and {"recognition": "default", "echo": "lowalt, exact"}[name] in text
    )
    assert (
        len(getattr(cost_plots, name)(read_csv(tmp_path / "table.csv")).rows)
        == {"recognition": 4, "echo": 2}[name]
    )
