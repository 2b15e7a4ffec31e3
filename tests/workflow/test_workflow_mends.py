"""Mends of Snakemake: plain Snakemake still has each fault, and with its mend it has it no more."""

import logging
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import snakemake_runs
from lowalt.files.processes import lives
from lowalt.workflow import mends
from lowalt.workflow.locks import TOKEN, Owner, numbers, take

pytest.importorskip("snakemake")
from snakemake.logging import logger
from snakemake.persistence.file import FilePersistence
from snakemake.scheduling.job_scheduler import JobScheduler

SOURCE = Path(__file__).parents[2] / "src"
KEYS = {"input": ["a", "b"], "output": ["c"]}


class Kept(SimpleNamespace):
    """A persistence of Snakemake's as far as its lock needs one."""

    @property
    def locked(self):
        return bool(numbers(self._lockdir))


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The persistence of a folder, with the mended lock; Snakemake's own comes back after the test."""
    for name in ("lock", "lock_warn_only", "cleanup_locks"):
        monkeypatch.setattr(FilePersistence, name, getattr(FilePersistence, name))
    monkeypatch.setenv(TOKEN, "before")
    mends.end_locks()
    found = Kept(path=tmp_path, _lockdir=tmp_path / "deep/locks", unlocked=[])
    found.all_inputfiles = lambda: KEYS["input"]
    found.all_outputfiles = lambda: KEYS["output"]
    found.unlock = lambda: found.unlocked.append("all")
    return found


KILLED = 'rule all:\n    output: "out"\n    shell: "kill -9 $PPID; sleep 5"\n'


def test_the_lock_of_a_killed_run_stays_in_plain_snakemake(tmp_path):
    """`tests/workflow/test_workflow_locks.py` kills a run whose lock is mended."""
    (tmp_path / "Snakefile").write_text(KILLED)
    killed, _ = snakemake_runs.run(tmp_path, ["--cores", "1"], os.environ)
    status, text = snakemake_runs.run(tmp_path, ["--cores", "1", "--rerun-incomplete"], os.environ)
    assert killed == -signal.SIGKILL and status == 1 and "Directory cannot be locked" in text


JOB = """
import os, time
from pathlib import Path
from lowalt.config.command import run

def main(arguments):
    Path("job.pid").write_text(str(os.getpid()))
    time.sleep(60)

run(main)
"""
KILLED_WITH_A_JOB = """
{mend}
rule all:
    output: "out"
    shell: "python job.py & while [ ! -s job.pid ]; do sleep 0.02; done; kill -9 $PPID; wait"
"""


@pytest.mark.parametrize("mended", [False, True])
def test_a_job_outlives_a_killed_run_of_plain_snakemake_and_ends_with_a_mended_one(
    mended, tmp_path
):
    mend = "from lowalt.workflow import mends; mends.end_jobs()" if mended else ""
    (tmp_path / "Snakefile").write_text(KILLED_WITH_A_JOB.format(mend=mend))
    (tmp_path / "job.py").write_text(JOB)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = os.environ | {"PYTHONPATH": str(SOURCE), "PATH": path}
    killed, text = snakemake_runs.run(tmp_path, ["--cores", "1"], environment)
    assert killed == -signal.SIGKILL, text
    job = int((tmp_path / "job.pid").read_text())
    stop = time.monotonic() + (10 if mended else 0.3)
    while lives(job) and time.monotonic() < stop:
        time.sleep(0.02)
    assert lives(job) is not mended
    if not mended:
        os.kill(job, signal.SIGKILL)


def test_the_mended_lock_has_an_owner_for_the_length_of_its_block(kept, monkeypatch, capsys):
    said = []
    folder = kept._lockdir
    monkeypatch.setattr(logger, "info", said.append)
    with FilePersistence.lock_warn_only(kept):
        assert not said
    with FilePersistence.lock(kept):
        assert (folder / "0.input.lock").read_text() == "a\nb\n" and (
            folder / "0.output.lock"
        ).read_text() == "c\n"
        assert Owner.read(folder / "0.owner.json") == Owner(token=os.environ[TOKEN])
        with pytest.raises(SystemExit, match=r"^2$"), FilePersistence.lock(kept):
            pytest.fail("two runs at once")
        assert re.fullmatch(
            rf"error: .*process {os.getpid()} of .* is running.*\n", capsys.readouterr().err
        )
        with FilePersistence.lock_warn_only(kept):
            assert f"process {os.getpid()}" in said[0]
    assert numbers(folder) == []
    kept.path = kept.path / "file"
    kept.path.touch()
    with pytest.raises(SystemExit, match=r"^2$"), FilePersistence.lock(kept):
        pytest.fail("a lock in a file")
    assert "cannot write a lock" in capsys.readouterr().err


def test_unlock_leaves_the_lock_of_an_owner_that_lives(kept, capsys):
    FilePersistence.cleanup_locks(kept)
    assert kept.unlocked == ["all"]
    _, holding = take(kept._lockdir, Owner(), KEYS)
    with holding, pytest.raises(SystemExit, match=r"^2$"):
        FilePersistence.cleanup_locks(kept)
    assert f"not unlocked: process {os.getpid()}" in capsys.readouterr().err
    assert kept.unlocked == ["all"]


@pytest.fixture
def interrupts():
    """Ctrl-C as Python handles it, put back after the test."""
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_plain_snakemake_takes_every_ctrl_c_as_an_interrupt(interrupts):
    program = (
        "import signal, snakemake.cli; print(signal.getsignal(signal.SIGINT) is"
        " signal.default_int_handler)"
    )
    assert (
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout
        == "True\n"
    )


def test_only_the_first_ctrl_c_interrupts_and_later_ones_are_answered(interrupts, capfd):
    mends.answer_ctrl_c()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    for _ in range(2):
        signal.raise_signal(signal.SIGINT)
    assert capfd.readouterr().err == 2 * mends.ANSWER.decode()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    mends.answer_ctrl_c()
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN


def timers_of_rounds(start, rounds: int) -> tuple[int, int]:
    """(timers that wait after so many rounds, rounds that they start)."""
    scheduler = SimpleNamespace(_open_jobs=threading.Semaphore(0))
    before = threading.active_count()
    for _ in range(rounds):
        start(scheduler, 0.2)
    waiting = threading.active_count() - before
    started = 0
    while scheduler._open_jobs.acquire(timeout=0.5):
        started += 1
    return waiting, started


def test_a_round_leaves_a_timer_each_in_plain_snakemake_and_one_in_the_mended_one(monkeypatch):
    assert timers_of_rounds(JobScheduler._schedule_reevalutation, 9) == (9, 9)
    monkeypatch.setattr(
        JobScheduler, "_schedule_reevalutation", JobScheduler._schedule_reevalutation
    )
    mends.keep_one_timer()
    assert timers_of_rounds(JobScheduler._schedule_reevalutation, 9) == (1, 1)


def test_a_timer_follows_one_that_has_fired_and_ends_with_its_run():
    scheduler = SimpleNamespace(_open_jobs=threading.Semaphore(0))
    mends._one_timer(scheduler, 0.01)
    assert scheduler._open_jobs.acquire(timeout=5)
    scheduler._next_round.join()
    mends._one_timer(scheduler, 30)
    assert scheduler._next_round.is_alive() and scheduler._next_round.daemon
    scheduler._next_round.cancel()


FIRST_S = 3.0


def asked(executor: type, seconds: float) -> list[float]:
    """Times at which an executor asks for the state of a job that ends after so many seconds, as
    the plugin asks.
    """
    waiting = object.__new__(executor)
    waiting._next_seconds_between_status_checks = None
    waiting.next_seconds_between_status_checks = FIRST_S
    times = [0.0]
    while times[-1] < seconds:
        times.append(times[-1] + waiting.next_seconds_between_status_checks)
        waiting.next_seconds_between_status_checks = min(
            waiting.next_seconds_between_status_checks + 10, 180
        )
    # A job has ended: the plugin goes back to the first wait.
    waiting.next_seconds_between_status_checks = FIRST_S
    assert waiting.next_seconds_between_status_checks == FIRST_S
    return times


@pytest.fixture
def executors(monkeypatch):
    """The plugin's executor as it is, and mended."""
    plugin = pytest.importorskip("snakemake_executor_plugin_slurm")
    plain = plugin.Executor
    mended = type("Executor", (plugin.Executor,), {})
    monkeypatch.setattr(plugin, "Executor", mended)
    mends.ask_slurm_sooner()
    mends.ask_slurm_sooner()
    return plain, mended


@pytest.mark.parametrize("seconds", [2, 10, 46, 130, 600, 7200])
def test_the_end_of_a_job_is_noticed_within_a_fifth_of_its_time(executors, seconds):
    times = asked(executors[1], seconds)
    assert times[-1] - seconds <= min(seconds / 5 + FIRST_S, 30)
    # An administrator minds questions: a day has fewer than three thousand.
    assert len(times) <= 18 + seconds / 30


def test_a_profile_that_asks_rarely_is_not_asked_more_often(executors):
    waiting = object.__new__(executors[1])
    waiting._next_seconds_between_status_checks = 60.0
    waiting.next_seconds_between_status_checks = 70.0
    assert waiting.next_seconds_between_status_checks == 60.0


def test_plain_logging_prints_tracebacks_on_a_full_disk_and_the_mended_one_nothing(
    monkeypatch, capsys
):
    record = logging.makeLogRecord({"msg": "a line"})
    for plain in (True, False):
        monkeypatch.setattr(logging.FileHandler, "handleError", logging.Handler.handleError)
        if not plain:
            mends.quiet_logs_on_a_full_disk()
        logging.FileHandler("/dev/full").emit(record)
        assert ("Traceback" in capsys.readouterr().err) == plain
