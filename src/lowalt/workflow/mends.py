"""Mends of Snakemake and of its executor for Slurm, each with its fault, where upstream knows of it, and its cure.

The rules' common file calls `install`, so that `make`, `lowalt run` and plain `snakemake` all profit. A test for each
shows that the installed version still has the fault.
"""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from lowalt.config.command import refusing
from lowalt.files.errors import InputError
from lowalt.workflow.locks import TOKEN, Owner, drop, guarded, holders, refusal, take, take_over


def install() -> None:
    """Put every mend in place for this process."""
    end_locks()
    answer_ctrl_c()
    keep_one_timer()
    ask_slurm_sooner()


# Fault: the lock of a run that is killed stays, and so do its jobs. github.com/snakemake/snakemake/issues/2919
# Cure: a record of the lock's owner; the next run takes over the lock of a dead one and ends the jobs it left.


def end_locks() -> None:
    """Put locks with owners in the place of those of Snakemake's file backend."""
    from snakemake.persistence.file import FilePersistence

    FilePersistence.lock, FilePersistence.lock_warn_only = _lock, _lock_warn_only
    FilePersistence.cleanup_locks = _cleanup_locks


@contextlib.contextmanager
def _lock(self: Any) -> Iterator[None]:
    """Hold the lock of a working directory for the length of a block.

    self: Snakemake's persistence. Raises: SystemExit after one line that names the holders, or the folder that no lock
    can be written into.
    """
    from snakemake.logging import logger

    folder, locks, owner = Path(self.path), Path(self._lockdir), Owner()
    with refusing():
        try:
            with guarded(folder):
                take_over(locks, logger.warning)
                if self.locked:
                    raise InputError(refusal(locks))
                keys = {"input": [*map(str, self.all_inputfiles())], "output": [*map(str, self.all_outputfiles())]}
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
    """Say who holds the lock and go on, as Snakemake does for runs that write nothing."""
    from snakemake.logging import logger

    if self.locked:
        logger.info(refusal(Path(self._lockdir)))
    yield


def _cleanup_locks(self: Any) -> None:
    """Remove all locks, as `--unlock` asks. Raises: SystemExit after one line that names a holder seen to live."""
    with refusing(), guarded(Path(self.path)):
        alive = holders(Path(self._lockdir), living=True)
        if alive:
            raise InputError("not unlocked: " + "; ".join(alive))
        self.unlock()


# Fault: a second Ctrl-C, while a run ends its jobs and removes their files, breaks that off with tracebacks.
# No issue upstream. Cure: every Ctrl-C after the first is answered in one line.

ANSWER = b"already ending; the same command goes on where this run stops\n"


def answer_ctrl_c() -> None:
    """Let the first Ctrl-C of this process act as ever, and every later one print ANSWER.

    Nothing happens where Ctrl-C is ignored or handled already, or outside of the main thread.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _first)


def _first(number: int, frame: FrameType | None) -> None:
    """Answer the next Ctrl-C, and raise KeyboardInterrupt for this one."""
    signal.signal(signal.SIGINT, lambda number, frame: os.write(2, ANSWER) and None)
    raise KeyboardInterrupt


# Fault: each scheduling round starts a timer that starts another round `--max-jobs-per-timespan` later (1 s), and each
# finished job starts a round: after n jobs there are n rounds a second. github.com/snakemake/snakemake/issues/2354
# Cure: one timer at a time. A longer timespan would be no cure: a run that has ended waits for its timers.


def keep_one_timer() -> None:
    """Let Snakemake's scheduler have one timer for its next round."""
    from snakemake.scheduling.job_scheduler import JobScheduler

    JobScheduler._schedule_reevalutation = _one_timer


def _one_timer(self: Any, delay: float) -> None:
    """Start a round of a scheduler after `delay` (s), unless one is already to come."""
    timer = getattr(self, "_next_round", None)
    if timer is None or timer.finished.is_set() or not timer.is_alive():
        self._next_round = threading.Timer(delay, self._open_jobs.release)
        # A run that has ended does not wait for its timer.
        self._next_round.daemon = True
        self._next_round.start()


# Fault: the executor for Slurm waits 10 s longer after each question that found no job ended, up to 180 s, so it
# notices the end of a job of 46 s after another 34 s. github.com/snakemake/snakemake-executor-plugin-slurm/issues/319
# Cure: each wait is a fifth longer than the last, 30 s at most; the end of a job of T is noticed within T / 5.

PLUGIN = "snakemake_executor_plugin_slurm"
GROWTH, MOST_S = 1.2, 30.0


def ask_slurm_sooner() -> None:
    """Replace the executor's rule of waiting, once; without the plugin nothing happens."""
    plugin = sys.modules.get(PLUGIN)
    if plugin is None:
        return
    before = plugin.Executor.next_seconds_between_status_checks
    if before.fset is not _slower:
        plugin.Executor.next_seconds_between_status_checks = property(before.fget, _slower)


def _slower(executor: Any, asked_s: float | None) -> None:
    """Set the seconds until the next question; the plugin asks for more than the last wait where no job has ended."""
    last_s = executor._next_seconds_between_status_checks
    grown = last_s is not None and asked_s is not None and asked_s > last_s
    executor._next_seconds_between_status_checks = min(GROWTH * last_s, max(MOST_S, last_s)) if grown else asked_s
