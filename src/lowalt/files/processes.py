"""Which processes of this machine live, as Linux tells in /proc."""

import os
from pathlib import Path


def lives(pid: int) -> bool:
    """Return whether this machine runs a process of that id; one that has ended does not, though its id may be kept."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return state(pid) not in ("Z", "X")


def started(pid: int) -> int | None:
    """Return when a process started, in clock ticks after boot, or None where no such process lives."""
    fields = _fields(pid)
    # A zombie has ended; only its parent has not asked for its status yet.
    return None if fields is None or fields[0] in "ZX" else int(fields[19])


def state(pid: int) -> str | None:
    """Return the state of a process as one letter, None where there is no such process or no /proc."""
    fields = _fields(pid)
    return None if fields is None else fields[0]


def _fields(pid: int) -> list[str] | None:
    """Fields of /proc/PID/stat from the third (the state) on; the second may itself hold spaces and brackets."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
