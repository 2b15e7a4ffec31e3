"""Disturbances of a running Snakemake: signals to all its processes, to it alone or to a worker, and lack of memory.

Only processes of the run that the caller started are touched: each function takes that run's main process.
"""

import itertools
import os
import random
import signal
import time
from pathlib import Path

import psutil

from lowalt.common.errors import InputError

KINDS = ("all", "snakemake", "worker", "terminate", "interrupt", "memory")
"""SIGKILL of all processes, of Snakemake alone, of one worker; SIGTERM of Snakemake; Ctrl-C; out-of-memory kill."""
PATIENCE_S = 60.0


def tree(main: psutil.Process) -> list[psutil.Process]:
    """Return a process and all that descend from it."""
    try:
        return [main, *main.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def workers(main: psutil.Process) -> dict[psutil.Process, str]:
    """Return the run's processes that compute, with the stage that each works for."""
    found = {}
    for process in tree(main)[1:]:
        try:
            words = process.cmdline()
        except (psutil.NoSuchProcess, psutil.AccessDenied):
            continue
        # `bash -c "python -m lowalt.echo ..."` is one word after -c, so only the interpreter itself matches.
        for flag, module in itertools.pairwise(words):
            if flag == "-m" and module.startswith("lowalt."):
                found[process] = module.removeprefix("lowalt.")
    return found


def running(main: psutil.Process) -> str:
    """Return the stages that work at this moment, or "none"."""
    return "+".join(sorted(workers(main).values())) or "none"


def _kill(processes: list[psutil.Process], number: int) -> None:
    """Send a signal to processes; those that have ended are left out."""
    for process in processes:
        try:
            process.send_signal(number)
        except psutil.NoSuchProcess:
            continue


def one_worker(main: psutil.Process, choose: random.Random) -> psutil.Process | None:
    """Wait until the run has a worker and return one of them, or None where it ends before."""
    stop = time.monotonic() + PATIENCE_S
    while main.is_running() and main.status() != psutil.STATUS_ZOMBIE and time.monotonic() < stop:
        found = workers(main)
        if found:
            return choose.choice(sorted(found, key=lambda process: process.pid))
        time.sleep(0.02)
    return None


def disturb(kind: str, main: psutil.Process, choose: random.Random, group: "MemoryGroup | None") -> str | None:
    """Do one disturbance of KINDS to a run; return the stages that ran at that moment, or None where it had ended.

    group: the memory group that the run was started in, for the kind "memory".
    Raises: InputError for a kind of another name.
    """
    if kind not in KINDS:
        raise InputError(f"disturbance {kind!r}, expected one of {KINDS}")
    victim = one_worker(main, choose) if kind in ("worker", "memory") else None
    if kind in ("worker", "memory") and victim is None:
        return None
    now = running(main)
    if kind == "all":
        _kill(tree(main), signal.SIGKILL)
    elif kind == "snakemake":
        _kill([main], signal.SIGKILL)
    elif kind == "worker":
        _kill([victim], signal.SIGKILL)
    elif kind == "terminate":
        _kill([main], signal.SIGTERM)
    elif kind == "interrupt":
        # A terminal sends Ctrl-C to the whole foreground group; the run was started as the leader of its own.
        os.killpg(main.pid, signal.SIGINT)
    elif not group.starve():
        return None
    return now


class MemoryGroup:
    """A memory control group of our own, in whose processes the kernel's out-of-memory killer can be called."""

    def __init__(self, parent: Path) -> None:
        """Make the group's folder in the folder of its parent group."""
        self.folder = parent / f"lowalt-campaign-{os.getpid()}"
        self.folder.mkdir()
        unified = (self.folder / "memory.max").exists()
        self.limit, self.none = (self.folder / "memory.max", "max") if unified else (self._v1("limit"), "-1")
        self.usage = self.folder / "memory.current" if unified else self._v1("usage")
        self.events = self.folder / ("memory.events" if unified else "memory.oom_control")

    def _v1(self, what: str) -> Path:
        """File of a limit or a usage in bytes, in the first version of control groups."""
        return self.folder / f"memory.{what}_in_bytes"

    def enter(self) -> None:
        """Put the calling process, and with it all that it will start, into the group."""
        (self.folder / "cgroup.procs").write_text(str(os.getpid()))

    def _kills(self) -> int:
        """Number of processes that the kernel has killed in the group for lack of memory."""
        words = self.events.read_text().split()
        return int(words[words.index("oom_kill") + 1])

    def starve(self) -> bool:
        """Lower the limit below what the group holds until the kernel has killed one process, then lift it."""
        before, stop = self._kills(), time.monotonic() + PATIENCE_S
        try:
            while self._kills() == before and time.monotonic() < stop:
                try:
                    self.limit.write_text(str(int(self.usage.read_text()) * 9 // 10))
                except OSError:
                    # The kernel could not take that much back at once; as much as is held now is a limit too.
                    self._to_usage()
                time.sleep(0.02)
        finally:
            self.limit.write_text(self.none)
        return self._kills() > before

    def _to_usage(self) -> None:
        """Set the limit to the memory that the group holds; change nothing where the kernel refuses."""
        try:
            self.limit.write_text(self.usage.read_text().strip())
        except OSError:
            return

    def remove(self) -> None:
        """Remove the group, once its processes have ended."""
        stop = time.monotonic() + PATIENCE_S
        while (self.folder / "cgroup.procs").read_text().strip() and time.monotonic() < stop:
            time.sleep(0.1)
        self.folder.rmdir()
