"""Rows of others: a folder of submissions is scored anew.

The page on it leads to a confirmed row.
"""

import csv
import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import small_benchmark
import yaml
from sklearn.linear_model import LogisticRegression

from lowalt.__main__ import main
from lowalt.extensions.benchmark import confirm, submitted_rows
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.recognition.predictions import probability_columns

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/benchmark-submissions.md").read_text()
CARD = yaml.safe_load(re.search(r'title="card.yaml"\n(.*?)```', PAGE, re.DOTALL)[1])


def submitted(folder, name, tracks=("unseen",), **card):
    """Write a submission of answers that are right in three of four samples; return its folder."""
    own = folder / name
    own.mkdir(parents=True)
    (own / "card.yaml").write_text(yaml.safe_dump({**CARD, **card}))
    for track in tracks:
        facts, classes = TRACKS[track].samples()
        wrong = np.arange(len(facts)) % 4 == 0
        shares = np.eye(len(classes))[(facts.label + wrong) % len(classes)]
        rows = [
            [key, *values] for key, values in zip(facts.key.tolist(), shares.tolist(), strict=True)
        ]
        write_csv(own / f"{track}-0.csv", ("key", *probability_columns(classes)), rows)
    return own


def test_the_table_follows_from_the_files_of_the_folder(tmp_path, capsys):
    stated = {"unseen": {"percent": [88.0, 70.0, 97.0], "sha256": "ab"}}
    submitted(tmp_path, "b-mine", ("one-station", "unseen"), confirmed=stated)
    submitted(tmp_path, "a-other")
    assert main(["benchmark", "submissions", str(tmp_path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [(row["submission"], row["track"]) for row in rows] == [
        ("a-other", "unseen"),
        ("b-mine", "unseen"),
        ("b-mine", "one-station"),
    ]
    assert {row["percent"] for row in rows} == {"75"} and rows[1]["confirmed_percent"] == "88"
    with (tmp_path / submitted_rows.TABLE).open(newline="") as file:
        kept = list(csv.DictReader(file))
    for name in ("submission", "track", "percent", "answers_sha256"):
        assert [row[name] for row in kept] == [row[name] for row in rows]


# The script starts the command twice.
@pytest.mark.slow
def test_the_script_of_the_checks_refuses_a_table_that_the_files_do_not_give(tmp_path):
    submitted(tmp_path, "mine")
    assert main(["benchmark", "submissions", str(tmp_path)]) == 0
    table = (tmp_path / submitted_rows.TABLE).read_text()
    checked = {**os.environ, "LOWALT": str(Path(sys.executable).with_name("lowalt"))}
    words = [str(ROOT / ".ci/submissions.sh"), str(tmp_path)]
    assert subprocess.run(words, env=checked, capture_output=True).returncode == 0
    (tmp_path / submitted_rows.TABLE).write_text(table.replace("75", "99", 1))
    found = subprocess.run(words, env=checked, capture_output=True, text=True)
    assert found.returncode == 1 and "differs from the scores of the files" in found.stderr


def test_a_wrong_submission_is_named(tmp_path):
    for name, card, sentence in (
        ("one", {"licence": ""}, r"card.yaml: missing \['licence'\]"),
        ("five", {"method": "=cmd|' /C calc'!A0"}, r"card.yaml: method is .*, expected text that"),
        ("six", {"method": "<script>alert(1)</script>"}, r"card.yaml: method is "),
        ("seven", {"code": "@SUM(1)"}, r"card.yaml: code is "),
        ("eight", {"chosen_on": "a\x1b[2J"}, r"card.yaml: chosen_on is "),
        ("two", {"colour": "red"}, r"unknown \['colour'\]"),
        ("three", {"confirmed": {"unseen": "88 %"}}, "confirmed.unseen is '88 %', expected what"),
    ):
        own = submitted(tmp_path / name, name, **card)
        with pytest.raises(InputError, match=sentence):
            list(submitted_rows.rows(own.parent))
    own = submitted(tmp_path / "four", "four")
    (own / "unseen-0.csv").rename(own / "unsen-0.csv")
    with pytest.raises(InputError, match=r"unsen-0\.csv: expected a name TRACK-SEED.csv"):
        list(submitted_rows.rows(own.parent))


def test_the_form_and_the_page_ask_for_the_lines_of_a_card():
    form = yaml.safe_load((ROOT / ".github/ISSUE_TEMPLATE/row.yml").read_text())
    (asked,) = [
        part["attributes"]["value"] for part in form["body"] if "value" in part["attributes"]
    ]
    assert tuple(yaml.safe_load(asked)) == tuple(CARD) == submitted_rows.CARD


def test_scoring_submissions_needs_no_torch(tmp_path):
    submitted(tmp_path, "mine")
    code = (
        "import sys; from lowalt.extensions.benchmark import submitted_rows; "
        f"print(len(list(submitted_rows.rows({str(tmp_path)!r}))), 'torch' in sys.modules)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert found.stdout == "1 False\n", found.stderr


def test_the_file_on_the_page_is_confirmed(tmp_path, monkeypatch):
    small_benchmark.shrink(monkeypatch)
    monkeypatch.setattr(confirm, "USUAL", 1)
    (text,) = re.findall(r'title="predict.py"\n(.*?)```', PAGE, re.DOTALL)
    (tmp_path / "predict.py").write_text(text)
    generator = np.random.default_rng(0)
    model = LogisticRegression().fit(generator.normal(size=(40, 12)), np.arange(40) % 4)
    (tmp_path / "mine.pkl").write_bytes(pickle.dumps(model))
    found = confirm.confirm_predictions(tmp_path / "predict.py", TRACKS["unseen"])
    small_benchmark.clear()
    assert found.samples == 16 and 0 <= found.percent.value <= 100
