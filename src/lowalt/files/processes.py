"""State of processes on this machine, from /proc."""

import os
from pathlib import Path


def lives(pid: int) -> bool:
    """Return whether a process of that id is running on this machine; a zombie process is not."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return state(pid) not in ("Z", "X")


def started(pid: int) -> int | None:
    """Return when a process started, in clock ticks after boot, or None if it is not running."""
    fields = _fields(pid)
    # A zombie process has ended; its parent has not read its exit status yet.
    return None if fields is None or fields[0] in "ZX" else int(fields[19])


def state(pid: int) -> str | None:
    """Return the state of a process as one letter, None without such a process or /proc."""
    fields = _fields(pid)
    return None if fields is None else fields[0]


def _fields(pid: int) -> list[str] | None:
    """Fields of /proc/PID/stat from the third (the state) on.

    The second, the name in brackets, may itself contain spaces and brackets.
    """
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
