"""The campaign's own logic: disks that a run really fills, and files that two runs must share to the byte."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import psutil
import pytest

from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.workflow import campaign as campaigns
from lowalt.workflow import disturb as disturbances
from lowalt.workflow.campaign import LARGE_MB, SMALL_MB, room_mb
from lowalt.workflow.disturb import MemoryGroup, _kill, disturb, one_worker, workers
from lowalt.workflow.trial import checksums


@pytest.mark.parametrize("written_mb", [0.5, 5, 40, 5000])
def test_every_disk_is_too_small_for_the_run_and_holds_something(written_mb):
    rooms = [room_mb(written_mb, share / 100) for share in range(100)]
    assert rooms == sorted(rooms) and rooms[0] > 0 and rooms[-1] < written_mb
    assert max(rooms) <= LARGE_MB
    if written_mb == 5000:
        assert rooms[0] == SMALL_MB == 3 and rooms[-1] > 0.9 * LARGE_MB == 54


def test_files_that_hold_times_are_not_compared_and_all_others_are(tmp_path):
    names = ["clouds/crow.npz", "logs/a.log", "benchmarks/echo/a.jsonl", "predictions/seen/a/0.csv"]
    names += ["predictions/seen/a/0.json", "stages.csv", "shards/index.json", "models/seen/a/0/run.json"]
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    found = checksums(tmp_path)
    assert set(found) == {"clouds/crow.npz", "predictions/seen/a/0.csv", "shards/index.json"}
    (tmp_path / names[0]).write_text("x")
    assert checksums(tmp_path)[names[0]] != found[names[0]]


def test_a_killed_worker_is_one_that_computes_and_no_process_of_another_run(tmp_path):
    """A shell that waits for a stage stands for Snakemake; a second one is none of its business."""
    (tmp_path / "lowalt").mkdir()
    (tmp_path / "lowalt/__init__.py").write_text("")
    (tmp_path / "lowalt/echo.py").write_text("import time; time.sleep(60)")
    command = ["bash", "-c", f"{sys.executable} -m lowalt.echo; true"]
    runs = [psutil.Popen(command, cwd=tmp_path, start_new_session=True, stderr=subprocess.DEVNULL) for _ in range(2)]
    try:
        stop = time.monotonic() + 60
        while not all(workers(run) for run in runs) and time.monotonic() < stop:
            time.sleep(0.02)
        (other,) = workers(runs[1])
        assert disturb("worker", runs[0], random.Random(0), None) == "echo"
        assert runs[0].wait(60) == 0 and other.is_running()
        with pytest.raises(InputError, match="'flood'"):
            disturb("flood", runs[1], random.Random(0), None)
        assert disturb("all", runs[1], random.Random(0), None) == "echo"
        assert runs[1].wait(60) == -signal.SIGKILL and not workers(runs[1])
    finally:
        for run in runs:
            for process in [*workers(run), run]:
                if process.is_running():
                    process.kill()


def test_a_file_s_next_writer_removes_what_a_killed_one_left_and_nothing_else(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = [f".seen.{ended.pid}.part.npy", f".seen.{os.getppid()}.part.npy", f".seen2.{ended.pid}.part.npy"]
    left += [".seen.x.part.npy"]
    for name in left:
        (tmp_path / name).write_text("left")
    with replacing(tmp_path / "seen.npy") as temporary:
        temporary.write_text("whole")
    assert {path.name for path in tmp_path.iterdir()} == {"seen.npy", *left[1:]}


def test_a_signal_reaches_every_process_that_still_runs():
    class Process:
        def __init__(self, runs):
            self.runs, self.got = runs, []

        def send_signal(self, number):
            if not self.runs:
                raise psutil.NoSuchProcess(1)
            self.got.append(number)

    processes = [Process(True), Process(False), Process(True)]
    _kill(processes, signal.SIGTERM)
    assert [process.got for process in processes] == [[signal.SIGTERM], [], [signal.SIGTERM]]


def test_a_memory_group_without_the_files_of_the_second_version_uses_those_of_the_first(tmp_path):
    group = MemoryGroup(tmp_path)
    files = [path.relative_to(tmp_path / f"lowalt-campaign-{os.getpid()}") for path in
             (group.limit, group.usage, group.events)]  # fmt: skip
    assert [*map(str, files)] == ["memory.limit_in_bytes", "memory.usage_in_bytes", "memory.oom_control"]
    assert group.none == "-1"
    group.enter()
    assert (group.folder / "cgroup.procs").read_text() == str(os.getpid())
    (group.folder / "cgroup.procs").unlink()


def test_a_campaign_numbers_its_trials_makes_all_disturbances_and_keeps_only_folders_that_differ(tmp_path, monkeypatch):
    """One disk and five kills, at most two a run; the run of the third trial has a file of its own."""
    left, rooms = [], []

    class Made:
        def __init__(self, project, folder, options, group):
            self.folder, self.said = folder, ""
            folder.mkdir(exist_ok=folder.name == "disk-1")
            (folder / "kept").touch()

        def start(self):
            return None

        def finish(self, main):
            return 0

        def whole(self):
            return {"same": "1", "other": "2" if self.folder.name == "kill-3" else "1"}

        def written_mb(self):
            return 10.0

    def killed(trial, kinds, length_s, most, choose):
        left.append(most)
        return [{"kind": next(kinds)} for _ in range(most)]

    monkeypatch.setattr(campaigns, "Trial", Made)
    monkeypatch.setattr(campaigns, "copy_project", lambda project, folder: None)
    monkeypatch.setattr(campaigns, "killed", killed)
    monkeypatch.setattr(campaigns, "filled", lambda trial, megabytes: rooms.append(megabytes) or [{"kind": "disk"}])
    monkeypatch.setattr(campaigns, "_small_disk", lambda folder: contextlib.nullcontext(folder))
    monkeypatch.setattr(campaigns.subprocess, "run", lambda line, check: rooms.append(line[:3]))
    monkeypatch.setattr(campaigns.shutil, "disk_usage", lambda folder: SimpleNamespace(used=5_000_000))
    options = SimpleNamespace(seed=1, memory_group=None, configfile=["tiny.yaml"], targets=["data"], disks=1, kills=5,
                              kills_per_run=2)  # fmt: skip
    rows = list(campaigns.campaign(options, tmp_path))
    assert [row["trial"] for row in rows] == [1, 2, 2, 3, 3, 4] and left == [2, 2, 1]
    assert [row["identical"] for row in rows] == [*3 * ["yes"], *2 * ["no: 1 files, first other"], "yes"]
    assert {row["configuration"] for row in rows} == {"tiny.yaml data"} and rows[0]["kind"] == "disk"
    assert sorted(row["kind"] for row in rows[1:4]) == sorted({row["kind"] for row in rows[1:4]})
    # The disk has room for what it holds already, 5 MB, and for what the run is to fill.
    assert rooms[0] == ["mount", "-o", f"remount,size={5_000_000 + int(1e6 * rooms[1])}"] and 0 < rooms[1] < 10
    assert {path.parent.name for path in tmp_path.glob("*/kept")} == {"undisturbed", "kill-3"}
    assert {path.name for path in tmp_path.iterdir()} == {"project", "undisturbed", "disk-1", "kill-2", "kill-3",
                                                          "kill-4"}  # fmt: skip


@pytest.fixture
def clock(monkeypatch):
    """Time that passes only while the code sleeps: a namespace with `now` (s), and `each`, called at every sleep."""
    found = SimpleNamespace(now=0.0, each=lambda: None)

    def sleep(seconds):
        found.now += seconds
        found.each()

    monkeypatch.setattr(disturbances, "time", SimpleNamespace(monotonic=lambda: found.now, sleep=sleep))
    return found


def test_a_run_without_a_worker_is_left_after_a_minute_and_one_that_ended_at_once(clock, monkeypatch):
    monkeypatch.setattr(disturbances, "workers", lambda main: {})
    runs = SimpleNamespace(is_running=lambda: True, status=lambda: psutil.STATUS_SLEEPING)
    assert one_worker(runs, random.Random(0)) is None
    assert clock.now == pytest.approx(60, abs=0.03)
    for over in ({"is_running": lambda: False}, {"status": lambda: psutil.STATUS_ZOMBIE}):
        clock.now = 0.0
        assert disturb("worker", SimpleNamespace(**(vars(runs) | over)), random.Random(0), None) is None
        assert clock.now == 0


@pytest.mark.parametrize("starved", [True, False])
def test_a_lack_of_memory_counts_only_where_the_kernel_killed_a_process(starved, monkeypatch):
    monkeypatch.setattr(disturbances, "one_worker", lambda main, choose: object())
    monkeypatch.setattr(disturbances, "running", lambda main: "echo")
    group = SimpleNamespace(starve=lambda: starved)
    assert disturb("memory", SimpleNamespace(), random.Random(0), group) == ("echo" if starved else None)


@pytest.mark.parametrize("killed_after", [3, None])
def test_a_memory_limit_follows_what_is_held_until_one_process_is_killed_and_is_then_lifted(
    killed_after, tmp_path, clock
):
    group, limits = MemoryGroup(tmp_path), []
    group.usage.write_text("1000\n")
    group.events.write_text("oom_kill_disable 0\nunder_oom 0\noom_kill 4\n")

    def each():
        clock.now += 7
        limits.append(group.limit.read_text())
        group.usage.write_text("900\n")
        if len(limits) == killed_after:
            group.events.write_text("oom_kill_disable 0\nunder_oom 0\noom_kill 5\n")

    clock.each = each
    assert group.starve() == (killed_after is not None)
    assert limits[:3] == ["900", "810", "810"] and group.limit.read_text() == "-1"
    if killed_after:
        # Seven seconds pass at each look, and a fiftieth until the next.
        assert len(limits) == killed_after and clock.now == pytest.approx(3 * 7.02)
    else:
        assert 60 <= clock.now < 68


@pytest.mark.parametrize("ends_after_s", [0.5, None])
def test_a_memory_group_is_removed_once_its_processes_have_ended_or_after_a_minute(ends_after_s, clock):
    """The folder stands for the kernel's, which refuses to go while it has processes."""
    ended = ends_after_s or 60
    group = MemoryGroup.__new__(MemoryGroup)

    class Folder:
        def __truediv__(self, name):
            return SimpleNamespace(read_text=lambda: "" if clock.now >= ended - 1e-9 and ends_after_s else "17\n")

        def rmdir(self):
            self.removed = clock.now

    group.folder = Folder()
    group.remove()
    assert group.folder.removed == pytest.approx(ended, abs=0.11)
