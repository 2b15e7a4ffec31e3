"""State of processes on this machine, from /proc."""

import os
from pathlib import Path

_ENDED = ("Z", "X")
"""States of a process that has ended: a zombie, of which only the exit status is left, or dead."""
_STATE = 0
_START_TIME = 19
"""Indices of the state and of the start time in the result of `_fields`. Source: proc(5), stat."""


def lives(pid: int) -> bool:
    """Return whether a process of that id is running on this machine; a zombie process is not."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return state(pid) not in _ENDED


def started(pid: int) -> int | None:
    """Return when a process started, in clock ticks after boot, or None if it is not running."""
    fields = _fields(pid)
    if fields is None or fields[_STATE] in _ENDED:
        return None
    return int(fields[_START_TIME])


def state(pid: int) -> str | None:
    """Return the state of a process as one letter, None if there is no such process or no /proc."""
    fields = _fields(pid)
    if fields is None:
        return None
    return fields[_STATE]


def _fields(pid: int) -> list[str] | None:
    """Return the fields of /proc/PID/stat from the third (the state) on, None if it is missing.

    The second, the name in brackets, may itself contain spaces and brackets.
    """
    try:
        line = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    _, _, behind_name = line.rpartition(")")
    return behind_name.split()
