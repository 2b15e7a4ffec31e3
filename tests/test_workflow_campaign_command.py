"""The campaign's command (`lowalt.workflow.campaign`): moments and words of its rows, its table, its folders."""

import random
from types import SimpleNamespace

import psutil
import pytest

from lowalt.common.csv_tables import read_csv
from lowalt.common.errors import InputError
from lowalt.workflow import campaign, disturb, trial

LONG = "a" + 3000 * "b"
"""The last 3000 characters of what a run said stand in the message."""


@pytest.fixture
def clock(monkeypatch):
    """Time that only the test moves on."""
    found = SimpleNamespace(now=100.0)
    monkeypatch.setattr(campaign, "time", SimpleNamespace(monotonic=lambda: found.now))
    return found


def row_of(name):
    """A row of the table whose trial has this verdict."""
    return {column: f"<{column}>" for column in campaign.COLUMNS} | {"identical": name}


def test_a_moment_is_drawn_from_a_tenth_of_a_second_to_the_length_and_told_from_the_start_on(clock, monkeypatch):
    drawn = []

    class Runs:
        def wait(self, seconds):
            clock.now += seconds
            raise psutil.TimeoutExpired(seconds)

    choose = SimpleNamespace(random=lambda: campaign.EARLY, uniform=lambda *ends: drawn.append(ends) or 2.5)
    runs = SimpleNamespace(
        start=Runs, finish=lambda main: -9, remarks=lambda: "clear", group=None, said=LONG, folder="f"
    )
    waited = []
    monkeypatch.setattr(campaign, "one_worker", lambda main, choose: waited.append(main))
    monkeypatch.setattr(campaign, "disturb", lambda *given: "echo")
    with pytest.raises(StopIteration):
        campaign.killed(runs, iter("a"), 8.0, 9, choose)
    assert drawn == [(0.1, 8.0)] * 2 and clock.now == 102.5
    # A share of EARLY itself is not early: the moment counts from the first worker on.
    assert len(waited) == 1
    ends = iter([-9, 3])
    runs.finish = lambda main: next(ends)
    starts = iter([Runs(), SimpleNamespace(wait=lambda seconds: None)])
    runs.start = lambda: next(starts)
    with pytest.raises(InputError, match=f"^f: the resumed run ended with status 3:\n{LONG[1:]}$"):
        campaign.killed(runs, iter("ab"), 8.0, 9, choose)


def test_rows_tell_the_seconds_from_the_start_of_the_run_on(clock, monkeypatch):
    class Runs:
        def wait(self, seconds):
            clock.now += 2.25
            raise psutil.TimeoutExpired(seconds)

    ends = iter([-9, 0, 1, 0])

    def finish(main):
        clock.now += 30
        return next(ends)

    runs = SimpleNamespace(start=Runs, finish=finish, remarks=lambda: "clear", group=None, said="?", folder="f")
    monkeypatch.setattr(campaign, "disturb", lambda kind, *given: {"a": "echo", "b": None}[kind])
    choose = SimpleNamespace(random=lambda: 0.0, uniform=lambda low, high: high)
    (row,) = campaign.killed(runs, iter("ab"), 8.0, 9, choose)
    assert row["moment_s"] == "2.2"
    monkeypatch.setattr(campaign.subprocess, "run", lambda line, check: check or pytest.fail("not checked"))
    (row,) = campaign.filled(runs, 12.4)
    assert row["moment_s"] == "30.0"


def test_a_disk_that_is_not_mended_tells_the_end_of_what_the_run_said(monkeypatch):
    ends = iter([1, 2])
    runs = SimpleNamespace(
        start=lambda: None, finish=lambda main: next(ends), remarks=lambda: "", said=LONG, folder="f"
    )
    monkeypatch.setattr(campaign.subprocess, "run", lambda line, check: None)
    with pytest.raises(InputError, match=f"^f: the resumed run ended with status 2:\n{LONG[1:]}$"):
        campaign.filled(runs, 12.4)


@pytest.mark.parametrize("status", [0, 1])
def test_a_campaign_spreads_moments_over_twice_the_run_s_time_for_each_kill(status, clock, tmp_path, monkeypatch):
    lengths, removed = [], []

    class Made:
        def __init__(self, project, folder, options, group):
            self.folder, self.said, self.group = folder, LONG, group
            folder.mkdir(exist_ok=True)

        def start(self):
            return None

        def finish(self, main):
            clock.now += 12
            return status

        def whole(self):
            return {"same": "1"}

        def written_mb(self):
            return 10.0

    def killed(trial, kinds, length_s, most, choose):
        lengths.append(length_s)
        assert trial.group is group
        return [{"kind": next(kinds)} for _ in range(6)]

    group = SimpleNamespace(remove=lambda: removed.append(True))
    monkeypatch.setattr(campaign, "Trial", Made)
    monkeypatch.setattr(campaign, "MemoryGroup", lambda folder: group)
    monkeypatch.setattr(campaign, "copy_project", lambda project, folder: None)
    monkeypatch.setattr(campaign, "killed", killed)
    options = SimpleNamespace(seed=1, memory_group="/x", configfile=["tiny.yaml"], targets=[], disks=0, kills=6,
                              kills_per_run=8)  # fmt: skip
    if status:
        with pytest.raises(InputError, match=f"^the undisturbed run ended with status 1:\n{LONG[1:]}$"):
            list(campaign.campaign(options, tmp_path))
    else:
        rows = list(campaign.campaign(options, tmp_path))
        assert lengths == [3.0] and sorted(row["kind"] for row in rows) == sorted(disturb.KINDS)
    assert removed == [True]


def test_a_small_disk_is_a_file_system_of_its_own_for_the_length_of_a_block(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(campaign.subprocess, "run", lambda line, check: asked.append((line[0], line[-1], check)))
    with pytest.raises(KeyError), campaign._small_disk(tmp_path):
        raise KeyError
    assert asked == [("mount", tmp_path, True), ("umount", tmp_path, True)]


def test_the_command_keeps_each_row_as_it_comes_and_refuses_other_bytes(tmp_path, monkeypatch, capsys):
    rows, kept = [row_of("yes"), row_of("no: 1 files")], []

    def found(given, work):
        kept.append(work)
        assert work.is_dir()
        for number, row in enumerate(rows):
            yield row
            assert len(read_csv(tmp_path / "c.csv", *campaign.COLUMNS)) == number + 1

    monkeypatch.setattr(campaign, "campaign", found)
    words = ["--out", str(tmp_path / "c.csv")]
    for _ in range(2):
        with pytest.raises(InputError, match=r"c\.csv: 1 of 2 disturbances ended in other bytes"):
            campaign.main([*words, "--work", str(tmp_path / "deep/work")])
    shown = capsys.readouterr().err.splitlines()
    assert shown[0] == "<trial>, <kind>, <moment_s>, <running>, <outcome>, <said>, yes" and len(shown) == 4
    del rows[1]
    campaign.main([*words, "--work", str(tmp_path / "deep/work")])
    campaign.main(words)
    assert kept[2].is_dir() and not kept[3].exists()


def test_the_run_s_workers_are_descendants_that_run_a_module_of_the_package():
    class Process(SimpleNamespace):
        __hash__ = object.__hash__

    def made(pid, *words, fault=None):
        def cmdline():
            if fault:
                raise fault
            return list(words)

        return Process(pid=pid, cmdline=cmdline)

    below = [
        made(2, fault=psutil.NoSuchProcess(2)), made(3, fault=psutil.AccessDenied(3)),
        made(4, "python", "-m", "json.tool"), made(5, "python", "--logger", "lowalt.echo"),
        made(6, "bash", "-c", "python -m lowalt.echo"),
        made(7, "python", "-m", "lowalt.tiles", "--out", "x"), made(8, "python", "-m", "lowalt.echo"),
    ]  # fmt: skip
    main = made(1, "python", "-m", "lowalt.workflow")
    main.children = lambda recursive: below if recursive else below[:1]
    assert {worker.pid: stage for worker, stage in disturb.workers(main).items()} == {7: "tiles", 8: "echo"}
    assert disturb.running(main) == "echo+tiles"
    main.children = lambda recursive: []
    assert disturb.running(main) == "none"


@pytest.mark.parametrize("kind", ["snakemake", "terminate", "interrupt"])
def test_snakemake_alone_is_killed_or_terminated_and_its_group_interrupted(kind, monkeypatch):
    sent = []
    monkeypatch.setattr(disturb, "running", lambda main: "echo")
    monkeypatch.setattr(disturb.os, "killpg", lambda pid, number: sent.append(("group", pid, number.name)))
    main = SimpleNamespace(pid=5, send_signal=lambda number: sent.append(("one", 5, number.name)))
    assert disturb.disturb(kind, main, random.Random(0), None) == "echo"
    assert sent == {"snakemake": [("one", 5, "SIGKILL")], "terminate": [("one", 5, "SIGTERM")],
                    "interrupt": [("group", 5, "SIGINT")]}[kind]  # fmt: skip


def test_the_end_of_a_run_is_a_signal_below_zero_alone():
    assert [trial.ended(status) for status in (-2, -1, 0, 1)] == ["signal 2", "signal 1", "status 0", "status 1"]


def test_a_trial_copies_this_checkout_also_into_a_folder_that_is_there(tmp_path, monkeypatch):
    assert (trial.ROOT / "Snakefile").is_file() and (trial.ROOT / "src/lowalt/workflow/trial.py").is_file()
    monkeypatch.setattr(trial, "PARTS", ())
    (tmp_path / "disk").mkdir()
    assert trial.Trial(trial.ROOT, tmp_path / "disk", SimpleNamespace(), None).said == ""
