"""Locks: a dead owner's is taken over, a living one's refused by name, and of many at once exactly
one wins.
"""

import errno
import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import snakemake_runs
from lowalt.files.processes import started
from lowalt.workflow import locks
from lowalt.workflow.locks import (
    TOKEN,
    Owner,
    guarded,
    holders,
    locked_message,
    numbers,
    take,
    take_over,
)

ROOT = Path(__file__).parents[2]
KEYS = {"input": ["in.txt"], "output": ["out.txt"]}
# The process id of a process that has ended, and whose number the system has not given to another.
GONE = Owner(pid=2**22 + 1)

SNAKEFILE = """
from lowalt.workflow import mends

mends.install()

rule all:
    output: "out.txt"
    shell: "echo $$ > worker.pid; while [ ! -e go ]; do sleep 0.05; done; touch {output}"
"""


def takers(locks):
    return [Owner.read(locks / f"{number}.owner.json") for number in numbers(locks)]


def leave(locks, owner=GONE):
    """Take a lock and end, as a killed run does: its record is no longer held."""
    number, holding = take(locks, owner, KEYS)
    holding.release()
    return number


def test_a_damaged_record_has_no_owner(tmp_path):
    number, holding = take(tmp_path, Owner(), KEYS)
    path = tmp_path / f"{number}.owner.json"
    whole = path.read_text()
    assert Owner.read(path) == Owner(token=json.loads(whole)["token"])
    for text in ("", whole[:-5], "{}", "[1]", whole.replace("pid", "pit")):
        path.write_text(text)
        assert Owner.read(path) is None
    assert Owner.read(tmp_path / "none") is None
    holding.release()


def test_a_dead_owner_s_lock_is_taken_over_and_all_others_stay(tmp_path):
    mine = Owner()
    leave(tmp_path)
    _, holding = take(tmp_path, mine, KEYS)
    leave(tmp_path, replace(GONE, host="elsewhere"))
    (tmp_path / "7.output.lock").write_text("out.txt\n")
    said = []
    take_over(tmp_path, said.append)
    assert numbers(tmp_path) == [1, 2, 7]
    assert takers(tmp_path)[:2] == [mine, replace(GONE, host="elsewhere")]
    assert len(said) == 1 and str(GONE.pid) in said[0]
    text = locked_message(tmp_path)
    assert f"process {os.getpid()} of {mine.host} is running" in text
    assert "host elsewhere, which cannot be seen from here" in text
    assert "7.output.lock: no record of its owner" in text and "--unlock" in text
    assert holders(tmp_path, living=True) == [
        f"process {os.getpid()} of {mine.host} is running; wait for it or end it"
    ]
    holding.release()
    take_over(tmp_path, said.append)
    assert numbers(tmp_path) == [2, 7]


def test_a_lock_that_cannot_be_written_whole_leaves_nothing(tmp_path, monkeypatch):
    def full(path, text):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space left"):
        take(tmp_path, Owner(), KEYS)
    assert not list(tmp_path.iterdir())


def test_jobs_that_outlived_their_run_are_ended_by_force_where_they_do_not_heed_a_signal(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(locks, "GRACE_S", 0.5)
    program = (
        "import signal, time; signal.signal(signal.SIGTERM, signal.{}); print(1, flush=True);"
        " time.sleep(60)"
    )
    heeding, stubborn, another = jobs = [
        subprocess.Popen(
            [sys.executable, "-c", program.format(answer)],
            env=os.environ | {TOKEN: token},
            stdout=-1,
        )
        for answer, token in (
            ("SIG_DFL", GONE.token),
            ("SIG_IGN", GONE.token),
            ("SIG_IGN", "another"),
        )
    ]
    for job in jobs:
        job.stdout.readline()
    assert sorted(GONE.left_behind()) == sorted([heeding.pid, stubborn.pid])
    leave(tmp_path)
    said = []
    take_over(tmp_path, said.append)
    assert str(heeding.pid) in said[0] and "ending its 2 processes" in said[0]
    assert (heeding.wait(5), stubborn.wait(5), another.poll()) == (
        -signal.SIGTERM,
        -signal.SIGKILL,
        None,
    )
    another.kill()
    another.wait()


def test_a_system_without_locks_on_files_is_refused(tmp_path, monkeypatch):
    def refuse(descriptor, how):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(OSError, match=os.strerror(errno.ENOLCK)), guarded(tmp_path):
        pytest.fail("the block runs without a lock")


RACE = """
import sys, time
from pathlib import Path
from lowalt.workflow.locks import Owner, guarded, numbers, take, take_over

folder = Path(sys.argv[1])
print("ready", flush=True)
while not (folder / "go").exists():
    time.sleep(0.001)
with guarded(folder):
    take_over(folder / "locks", lambda line: None)
    free = not numbers(folder / "locks")
    if free:
        time.sleep(0.02)
        held = take(folder / "locks", Owner(), {"input": [], "output": ["out.txt"]})
print("won" if free else "lost", flush=True)
sys.stdin.read()
"""


def test_of_many_that_find_a_dead_owner_at_the_same_moment_one_wins(tmp_path):
    leave(tmp_path / "locks")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    racers = [
        subprocess.Popen([sys.executable, "-c", RACE, str(tmp_path)], **pipes) for _ in range(6)
    ]
    assert [racer.stdout.readline() for racer in racers] == ["ready\n"] * 6
    (tmp_path / "go").touch()
    assert sorted(racer.stdout.readline() for racer in racers) == ["lost\n"] * 5 + ["won\n"]
    for racer in racers:
        racer.communicate("")


def test_a_process_that_dies_inside_the_guard_lets_go(tmp_path):
    line = "import os, sys; from pathlib import Path; from lowalt.workflow.locks import guarded\n"
    line += f"with guarded(Path({str(tmp_path)!r})): os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", line]).returncode == -signal.SIGKILL
    with guarded(tmp_path):
        pass


def start(folder, *arguments):
    command = [sys.executable, "-m", "snakemake", "--cores", "1", "--rerun-incomplete", *arguments]
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    return subprocess.Popen(command, cwd=folder, env=environment, start_new_session=True, **output)


def ended(folder, *arguments):
    """Exit status and text of a run that ends by itself."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    return snakemake_runs.run(
        folder, ["--cores", "1", "--rerun-incomplete", *arguments], environment
    )


def wait_for(path):
    stop = time.monotonic() + 30
    while not path.exists() or not path.read_text().strip():
        assert time.monotonic() < stop, path
        time.sleep(0.02)
    return path.read_text()


@pytest.mark.workflow
def test_snakemake_refuses_a_living_owner_and_takes_over_a_killed_one(tmp_path):
    pytest.importorskip("snakemake")
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    first = start(tmp_path)
    worker = int(wait_for(tmp_path / "worker.pid"))
    status, text = ended(tmp_path)
    (sentence,) = [line for line in text.splitlines() if "process" in line]
    assert status == 2 and text.endswith(f"{sentence}\n") and "  File" not in text
    assert (
        sentence.startswith("error: ")
        and f"process {first.pid} of {Owner().host} is running" in sentence
    )
    # A refused run takes nothing from the one that runs.
    assert takers(tmp_path / ".snakemake/locks")[0].pid == first.pid
    assert f"process {first.pid}" in ended(tmp_path, "--dry-run")[1]
    first.kill()
    # Its job lives on and holds the pipe of its output open.
    first.wait()
    assert started(worker) is not None
    (tmp_path / "worker.pid").unlink()
    third = start(tmp_path)
    assert int(wait_for(tmp_path / "worker.pid")) != worker and started(worker) is None
    (tmp_path / "go").touch()
    text = third.communicate(timeout=60)[0]
    assert third.returncode == 0, text
    assert f"took over the lock of the dead process {first.pid}" in text
    assert (tmp_path / "out.txt").exists() and numbers(tmp_path / ".snakemake/locks") == []


@pytest.mark.workflow
def test_snakemake_never_takes_over_the_lock_of_another_host(tmp_path):
    pytest.importorskip("snakemake")
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    (tmp_path / "go").touch()
    leave(tmp_path / ".snakemake/locks", replace(GONE, host="elsewhere"))
    before = json.loads((tmp_path / ".snakemake/locks/0.owner.json").read_text())
    status, text = ended(tmp_path)
    assert status != 0 and "host elsewhere" in text and "--unlock" in text
    assert json.loads((tmp_path / ".snakemake/locks/0.owner.json").read_text()) == before
    assert ended(tmp_path, "--unlock")[0] == 0
    assert ended(tmp_path)[0] == 0
