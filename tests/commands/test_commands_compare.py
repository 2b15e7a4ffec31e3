"""The command compare: the differences between two finished runs, and their size."""

import json

import pytest

from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.files.errors import LONGEST
from run_folders import run_folder


def test_compare_says_what_differs_and_by_how_much(tmp_path, capsys):
    one = run_folder(tmp_path / "one", 80, 5.0)
    other = run_folder(tmp_path / "other", 81, 2.5, seed=2)
    assert main(f"compare {one} {other} --json".split()) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["configuration"] == {"run": ["one", "other"], "seed": [1, 2]}
    assert found["accuracy_percent"] == {"seen A:VT": [81.0, 82.0]}
    assert found["processor_s"] == {"echo": [5.0, 2.5]} and found["data"] == {}
    (one / "shards").mkdir()
    (one / "shards/index.json").write_text(json.dumps({"samples": 30, "bytes": 4000}))
    assert main(["compare", str(one), str(other)]) == 0
    assert (
        capsys.readouterr().out
        == f"""configuration: {one} | {other}
  run   one | other
  seed  1 | 2

accuracy percent: {one} | {other}
  seen A:VT  81 | 82   +1

processor s: {one} | {other}
  echo  5 | 2.5   -2.5 (-50.0%)

data: {one} | {other}
  samples  30 | -
  bytes    4000 | -
"""
    )
    assert main(["compare", str(one), str(tmp_path)]) == 2
    assert f"{tmp_path}: has no config.yaml" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "text"),
    [
        (file, text)
        for file, texts in {
            "shards/index.json": [
                "",
                "[" * 100_000,
                "[]",
                "{}",
                '{"samples": "x", "bytes": []}',
                '{"samples": NaN, "bytes": 1}',
                f'{{"samples": 1, "bytes": {"9" * 5000}}}',
            ],
            "stages.csv": [
                "rule,cpu_s\necho,abc\n",
                "rule,cpu_s\necho,\n",
                "rule,cpu_s\necho,nan\n",
            ],
            "accuracy.csv": [
                "protocol,scheme,snr_db,accuracy_percent\nseen,A:VT,avg," + "9" * 5000 + "x\n"
            ],
            "config.yaml": [
                "run: {1: 2}\n",
                "seed: .nan\n",
                "run: 2026-01-01\n",
                "a: " + "{a: " * 300 + "1" + "}" * 300,
            ],
        }.items()
        for text in texts
    ],
)
def test_a_damaged_file_of_a_run_is_refused_in_one_line(tmp_path, capsys, file, text):
    one = run_folder(tmp_path / "one", 80, 5.0)
    other = run_folder(tmp_path / "other", 81, 2.5)
    (one / "shards").mkdir()
    (one / file).write_text(text)
    for line in (
        ["compare", str(one), str(other)],
        ["report", "--gallery", "--results", str(tmp_path)],
    ):
        assert main(line) == 2
        told = capsys.readouterr().err
        assert (
            told.count("\n") == 1
            and f"{one / file}: " in told
            and len(told) <= LONGEST + len("error: \n")
        )
    assert not (tmp_path / "index.html").exists()


def test_an_interrupted_command_ends_with_one_line_and_130(tmp_path, capsys, monkeypatch):
    def interrupted(*given, **named):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workflow.subprocess, "run", interrupted)
    assert main(["run"]) == 130
    assert (
        capsys.readouterr().err
        == "interrupted: the same command continues a run, and starts anything else again\n"
    )
