"""A trial of the campaign by itself: its command line, its output, its files, and how it is killed and resumed."""

import json
import random
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
import yaml

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.workflow import campaign, space_measured, trial

OPTIONS = SimpleNamespace(cores=3, configfile=["tiny.yaml", "more.yaml"], targets=["data"])


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A trial in a folder of its own, of a project that holds one file."""
    monkeypatch.setattr(trial, "PARTS", ("Snakefile", "src"))
    (tmp_path / "project/src/lowalt").mkdir(parents=True)
    (tmp_path / "project/Snakefile").write_text("rules")
    (tmp_path / "project/src/lowalt/kept.nbi").touch()
    (tmp_path / "project/src/lowalt/left.pyc").touch()
    return trial.Trial(tmp_path / "project", tmp_path / "trial", OPTIONS, None)


def test_a_trial_starts_snakemake_in_its_own_copy_and_keeps_what_it_says(made, monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    assert {str(path.relative_to(made.folder)) for path in made.folder.rglob("*") if path.is_file()} == {
        "Snakefile", "src/lowalt/kept.nbi"}  # fmt: skip
    asked = []

    def process(command, **settings):
        asked.append((command, settings))
        settings["stdout"].write(b"Directory cannot be locked \xff")
        return SimpleNamespace(wait=lambda: -9)

    monkeypatch.setattr(trial.psutil, "Popen", process)
    status = made.finish(made.start())
    (command, settings) = asked[0]
    assert command == [sys.executable, "-m", "snakemake", "--cores", "3", "--configfile", "tiny.yaml", "more.yaml",
                       "--", "data"]  # fmt: skip
    assert settings["cwd"] == made.folder and settings["start_new_session"]
    environment = settings["env"]
    assert environment["PYTHONPATH"] == str(made.folder / "src") and environment["LOWALT_SPACE"] == "off"
    assert environment["PYTHONPYCACHEPREFIX"] == str(made.folder.parent / "bytecode")
    assert "PYTHONDONTWRITEBYTECODE" not in environment
    assert status == -9 and trial.ended(status) == "signal 9" and trial.ended(1) == "status 1"
    assert made.remarks() == "Directory cannot be locked" and not Path(made.output).exists()
    made.said = "Traceback (most recent call last): Directory cannot be locked"
    assert made.remarks() == "Traceback (most recent call last); Directory cannot be locked"
    made.said = "all well"
    assert made.remarks() == "clear"
    made.options = SimpleNamespace(**vars(OPTIONS) | {"targets": []})
    made.finish(made.start())
    assert asked[1][0] == command[:-2]


def test_a_trial_takes_an_interrupt_as_at_a_terminal_and_enters_its_memory_group(made):
    entered, before = [], signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        made._first()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
        made.group = SimpleNamespace(enter=lambda: entered.append(True))
        made._first()
    finally:
        signal.signal(signal.SIGINT, before)
    assert entered == [True]


def test_the_one_run_of_a_trial_is_named_summed_and_weighed(made):
    results = made.folder / "results"
    (results / "tiny/clouds").mkdir(parents=True)
    (results / "reference").mkdir()
    (results / "tiny/config.yaml").write_text("run: tiny")
    (results / "tiny/clouds/crow.npz").write_bytes(bytes(2_000_000))
    (results / "tiny/stages.csv").write_bytes(bytes(500_000 - 9))
    # What a run says of its predictions holds times; no other record does.
    for name in ("predictions/unseen/a.csv", "predictions/unseen/a.json", "clouds/predictions.json"):
        (results / "tiny" / name).parent.mkdir(parents=True, exist_ok=True)
        (results / "tiny" / name).touch()
    assert made.name() == "tiny" and made.written_mb() == 2.5
    kept = {"config.yaml", "clouds/crow.npz", "clouds/predictions.json", "predictions/unseen/a.csv"}
    assert set(made.whole()) == kept
    (results / "reference/config.yaml").touch()
    with pytest.raises(InputError, match="expected exactly one"):
        made.name()


class Run:
    """A run that ends at once or is still there when its time is up; `waits` notes for how long it was waited for."""

    def __init__(self, lasts, waits):
        self.lasts, self.waits = lasts, waits

    def wait(self, seconds):
        self.waits.append(seconds)
        if self.lasts:
            raise psutil.TimeoutExpired(seconds)


def resumed(runs, statuses):
    """A trial whose starts give `runs` and whose ends give `statuses`."""
    starts, ends = iter(runs), iter(statuses)
    return SimpleNamespace(start=lambda: next(starts), finish=lambda main: next(ends), remarks=lambda: "clear",
                           group=None, said="the log", folder="folder")  # fmt: skip


def test_a_run_is_killed_and_resumed_until_it_ends_well_or_enough_is_done(monkeypatch):
    waits, found = [], iter(["echo", None, "noise"])
    monkeypatch.setattr(campaign, "one_worker", lambda main, choose: waits.append("worker"))
    monkeypatch.setattr(campaign, "disturb", lambda kind, main, choose, group: next(found))
    # Killed; nothing to kill, so it ends by itself.
    rows = campaign.killed(resumed([Run(True, waits)] * 2, [-9, 0]), iter("abc"), 8.0, 5, random.Random(2))
    assert [(row["kind"], row["running"], row["outcome"], row["said"]) for row in rows] == [
        ("a", "echo", "signal 9", "clear")]  # fmt: skip
    assert all(0.1 <= wait <= 8 for wait in waits if wait != "worker") and "worker" in waits
    # One is enough: the second start is left alone.
    waits.clear()
    rows = campaign.killed(resumed([Run(True, waits)] * 2, [1, 0]), iter("abc"), 8.0, 1, random.Random(2))
    assert [row["outcome"] for row in rows] == ["status 1"] and len(waits) == 2
    with pytest.raises(InputError, match="folder: the resumed run ended with status 1:\nthe log"):
        campaign.killed(resumed([Run(False, waits)], [1]), iter("abc"), 8.0, 1, random.Random(2))


def test_a_moment_in_ten_counts_from_the_command_on(monkeypatch):
    waits = []
    monkeypatch.setattr(campaign, "one_worker", lambda main, choose: waits.append("worker"))
    choose = random.Random(1)
    for _ in range(400):
        assert not campaign.killed(resumed([Run(False, [])], [0]), iter("a"), 8.0, 1, choose)
    assert 340 < len(waits) < 380


@pytest.mark.parametrize(
    ("said", "word"), [("error: the disk is full", "the disk is full"), ("?", "no word of the disk")]
)
def test_a_full_disk_grows_before_the_run_is_resumed(said, word, monkeypatch):
    mounted, runs = [], resumed([None, None], [1, 0])
    runs.said = said
    monkeypatch.setattr(campaign.subprocess, "run", lambda line, check: mounted.append(line))
    (row,) = campaign.filled(runs, 12.4)
    assert (row["kind"], row["running"], row["outcome"]) == ("disk", "12 MB free", "status 1")
    assert row["said"] == f"clear; {word}" and mounted == [["mount", "-o", "remount,size=8g", "folder"]]
    with pytest.raises(InputError, match="ended with status 2"):
        campaign.filled(resumed([None, None], [1, 2]), 12.4)


def finished(folder, models, config):
    """A run of which one job of a rule has ended: noisy signals of 8 bytes a number, and 3 MiB more than those."""
    plan = space_measured._plan(config)
    jobs = {"noise": {"group": "seen", "part": "00000"}}
    for rule, wildcards in jobs.items():
        size = int(8 * space_measured.units(rule, wildcards, plan, config))
        out = folder / space_measured.OUTPUTS[rule].format(**wildcards)
        for path in (out, folder / f"benchmarks/{rule}/a.jsonl", folder / f"logs/{rule}/a.log"):
            path.parent.mkdir(parents=True, exist_ok=True)
        with out.open("wb") as file:
            file.truncate(size + 128)
        row = {"rule_name": rule, "wildcards": wildcards, "max_rss": models}
        (folder / f"benchmarks/{rule}/a.jsonl").write_text(f"an older line\n{json.dumps(row)}\n")
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return folder


def test_lines_of_disk_and_memory_come_from_the_jobs_of_runs_of_two_sizes(tmp_path):
    config = load_yaml("config/default.yaml")
    config["targets"]["select"] = ["Crow", "DJI Mini 2"]
    config["motion"]["models_per_chunk"] = 10
    small = finished(tmp_path / "small", 5, config)
    (small / "logs/noise/a.log").write_text("peak memory 900 MiB\npeak memory 4 MiB\n")
    config["motion"]["models_per_chunk"] = 20
    large = finished(tmp_path / "large", 7, config)
    out = tmp_path / "space.csv"
    space_measured.main(["--runs", str(small), str(large), "--out", str(out)])
    row = dict(zip(*(line.split(",") for line in out.read_text().splitlines()), strict=True))
    assert (row["rule"], row["runs"], row["temporary"]) == ("noise", "large small", "no")
    (rule, units, written, held) = space_measured.jobs(small)[0]
    assert (rule, written, held) == ("noise", 8 * units + 128, 2**20 * 4)
    assert [float(value) for value in list(row.values())[2:6]] == [
        pytest.approx(128), 8.0, pytest.approx(1.0), pytest.approx(3 * 2**20 / units, rel=1e-5)]  # fmt: skip
    # Of one run alone, the largest peak stands for all.
    (one,) = space_measured.measure([large])
    assert [one[name] for name in list(one)[4:6]] == ["7", "0"]
    (tmp_path / "none").mkdir()
    (tmp_path / "none/config.yaml").write_text(yaml.safe_dump(config))
    with pytest.raises(InputError, match="no benchmarks"):
        space_measured.jobs(tmp_path / "none")
