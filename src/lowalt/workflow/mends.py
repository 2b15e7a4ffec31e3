"""Workarounds for faults of Snakemake, its Slurm executor and `logging`.

Each states fault, cause, cure and versions.
`workflow/rules/common.smk` calls `install`, so that they apply to `make`, `lowalt run` and plain
`snakemake`. For each a test shows that the installed version still has the fault. Those of numba
stand in `machine/machine_code.py`.
"""

import contextlib
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from lowalt.config.command import user_errors_in_one_line
from lowalt.files.atomic import FULL
from lowalt.files.errors import InputError
from lowalt.machine.run_pipe import end_with_starter, hold_pipe
from lowalt.workflow.locks import (
    TOKEN,
    Owner,
    drop,
    guarded,
    holders,
    locked_message,
    take,
    take_over,
)


def install() -> None:
    """Apply all workarounds to this process."""
    end_locks()
    end_jobs()
    answer_ctrl_c()
    keep_one_timer()
    ask_slurm_sooner()
    quiet_logs_on_a_full_disk()


# Fault: when a run is killed, its lock and its jobs remain.
# github.com/snakemake/snakemake/issues/2919
# Cause: a lock is a list of files without the process that holds it. Held in: Snakemake 9.27.
# Cure: record the lock's owner; the next run takes over the lock of a dead run and ends its
# orphaned jobs.


def end_locks() -> None:
    """Replace the locks of Snakemake's file backend with locks that record their owner."""
    from snakemake.persistence.file import FilePersistence

    FilePersistence.lock = _lock
    FilePersistence.lock_warn_only = _lock_warn_only
    FilePersistence.cleanup_locks = _cleanup_locks


@contextlib.contextmanager
def _lock(self: Any) -> Iterator[None]:
    """Hold the lock of a working directory for the length of a block.

    self: Snakemake's persistence. Raises: SystemExit after one line that names the holders, or the
    folder in which no lock can be written.
    """
    from snakemake.logging import logger

    folder = Path(self.path)
    locks = Path(self._lockdir)
    owner = Owner()
    with user_errors_in_one_line():
        try:
            with guarded(folder):
                take_over(locks, logger.warning)
                if self.locked:
                    raise InputError(locked_message(locks))
                keys = {
                    "input": [*map(str, self.all_inputfiles())],
                    "output": [*map(str, self.all_outputfiles())],
                }
                number, holding = take(locks, owner, keys)
        except OSError as error:
            raise InputError(f"{folder}: cannot write a lock ({error.strerror or error})") from None
    os.environ[TOKEN] = owner.token
    try:
        yield
    finally:
        drop(locks, number)
        holding.release()


@contextlib.contextmanager
def _lock_warn_only(self: Any) -> Iterator[None]:
    """Print who holds the lock and continue, as Snakemake does for runs that write nothing."""
    from snakemake.logging import logger

    if self.locked:
        logger.info(locked_message(Path(self._lockdir)))
    yield


def _cleanup_locks(self: Any) -> None:
    """Remove all locks, as `--unlock` asks.

    Raises: SystemExit after one line that names a living holder.
    """
    with user_errors_in_one_line(), guarded(Path(self.path)):
        alive = holders(Path(self._lockdir), living=True)
        if alive:
            raise InputError("not unlocked: " + "; ".join(alive))
        self.unlock()


# Fault: jobs go on for minutes after SIGKILL of the run. No issue upstream.
# Cause: nothing tells a job that Snakemake has ended. Held in: Snakemake 9.27.
# Cure: jobs inherit a pipe that the system closes with the run; the run itself ends in this way with
# the command `lowalt run`.


def end_jobs() -> None:
    """Let the jobs of this process end with it, and this process with `lowalt run`."""
    from snakemake.shell import shell

    if "pass_fds" not in shell._process_args:
        end_with_starter()
        shell._process_args["pass_fds"] = (hold_pipe(),)


# Fault: a second Ctrl-C interrupts the clean-up of jobs and files, with tracebacks. No issue
# upstream.
# Cause: KeyboardInterrupt is handled once, and raised again inside its handler. Held in: Snakemake
# 9.27.
# Cure: answer every Ctrl-C after the first with one line.

ANSWER = b"already ending; the same command goes on where this run stops\n"


def answer_ctrl_c() -> None:
    """Let the first Ctrl-C of this process act as usual, and later ones only print ANSWER.

    Does nothing if Ctrl-C is already ignored or handled, or outside the main thread.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _first)


def _first(number: int, frame: FrameType | None) -> None:
    """Answer the next Ctrl-C, and raise KeyboardInterrupt for this one."""
    signal.signal(signal.SIGINT, _again)
    raise KeyboardInterrupt


def _again(number: int, frame: FrameType | None) -> None:
    """Answer a Ctrl-C after the first."""
    os.write(2, ANSWER)


# Fault: after n jobs Snakemake schedules n times a second.
# github.com/snakemake/snakemake/issues/2354
# Cause: each scheduling round starts a timer that starts another round `--max-jobs-per-timespan`
# later (1 s), and each finished job starts a round. Held in: Snakemake 9.27.
# Cure: one timer at a time. A longer timespan would not help, because a finished run waits for its
# timers.


def keep_one_timer() -> None:
    """Let Snakemake's scheduler have one timer for its next round."""
    from snakemake.scheduling.job_scheduler import JobScheduler

    JobScheduler._schedule_reevalutation = _one_timer


def _one_timer(self: Any, delay: float) -> None:
    """Start a scheduling round after `delay` (s), unless one is already pending."""
    timer = getattr(self, "_next_round", None)
    if timer is None or timer.finished.is_set() or not timer.is_alive():
        self._next_round = threading.Timer(delay, self._open_jobs.release)
        # A daemon timer does not delay the end of a run.
        self._next_round.daemon = True
        self._next_round.start()


# Fault: the end of a job of 46 s is noticed 34 s later.
# github.com/snakemake/snakemake-executor-plugin-slurm/issues/319
# Cause: after each poll that finds no finished job, the Slurm executor waits 10 s longer, up to 180
# s. Held in: snakemake-executor-plugin-slurm 2.8.
# Cure: each wait is 20 % longer than the last, at most 30 s; the end of a job of length T is
# noticed within T / 5.

PLUGIN = "snakemake_executor_plugin_slurm"
GROWTH = 1.2
MOST_S = 30.0


def ask_slurm_sooner() -> None:
    """Replace the executor's waiting times, once; without the plugin do nothing."""
    plugin = sys.modules.get(PLUGIN)
    if plugin is None:
        return
    before = plugin.Executor.next_seconds_between_status_checks
    if before.fset is not _slower:
        plugin.Executor.next_seconds_between_status_checks = property(before.fget, _slower)


def _slower(executor: Any, asked_s: float | None) -> None:
    """Set the seconds until the next poll.

    The plugin asks for a longer wait than the last if no job has finished.
    """
    last_s = executor._next_seconds_between_status_checks
    if last_s is not None and asked_s is not None and asked_s > last_s:
        asked_s = min(GROWTH * last_s, max(MOST_S, last_s))
    executor._next_seconds_between_status_checks = asked_s


# Fault: on a full disk every line of a log prints two tracebacks, although the run itself reports
# the disk. No issue.
# Cause: `logging.Handler.handleError` prints the exception and the stack of the call. Held in:
# Python 3.11 to 3.13.
# Cure: a log file says nothing of a full disk; other faults keep their tracebacks.


def quiet_logs_on_a_full_disk() -> None:
    """Let log files be silent where their disk is full."""
    logging.FileHandler.handleError = _quiet  # type: ignore[method-assign, assignment]


def _quiet(file: logging.FileHandler, record: logging.LogRecord) -> None:
    """Report that a line could not be written to a log file, unless its disk is full."""
    if getattr(sys.exc_info()[1], "errno", None) not in FULL:
        logging.Handler.handleError(file, record)
