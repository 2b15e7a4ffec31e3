"""Locks that end with their run: Snakemake's own lock, and a record of its owner in the same folder.

Snakemake locks a working directory by files that stay when it is killed. Here each pair of lock files has a third with
the owner (`owner.py`), so the next run takes the files of a dead owner away and refuses with the name of a living one.
`mends.py` puts this in the place of Snakemake's lock.
"""

import contextlib
import fcntl
import os
import signal
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

from lowalt.common.errors import InputError
from lowalt.workflow.owner import Owner

KINDS = ("input", "output")
GRACE_S = 10.0
"""Time that jobs of a dead run have to end after SIGTERM before they are killed."""


@contextlib.contextmanager
def guarded(folder: Path) -> Iterator[None]:
    """Let one process at a time look at the locks and change them; the system frees the guard of a process that dies.

    Raises: InputError where the file system of the folder cannot lock files, since two runs could then both win.
    """
    descriptor = os.open(folder / "lowalt.guard", os.O_CREAT | os.O_RDWR, 0o666)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        except OSError as error:
            raise InputError(f"{folder}: its file system cannot lock files ({error.strerror})") from error
        yield
    finally:
        os.close(descriptor)


def _owner_path(locks: Path, number: int) -> Path:
    """File of a lock's owner."""
    return locks / f"{number}.owner.json"


def _lock_path(locks: Path, number: int, kind: str) -> Path:
    """File of a lock's files of one kind, as Snakemake names it."""
    return locks / f"{number}.{kind}.lock"


def numbers(locks: Path) -> list[int]:
    """Return the numbers of all locks in a folder, with an owner or without."""
    names = {path.name.partition(".")[0] for path in locks.glob("*.*") if path.is_file()}
    return sorted(int(name) for name in names if name.isdigit())


def drop(locks: Path, number: int) -> None:
    """Remove one lock; its owner's record goes last, so that a crash in between leaves no lock without owner."""
    for kind in KINDS:
        _lock_path(locks, number, kind).unlink(missing_ok=True)
    _owner_path(locks, number).unlink(missing_ok=True)


def take_over(locks: Path, say: Callable[[str], None]) -> None:
    """Remove the locks of dead owners of this host and end the jobs that these left behind; call within `guarded`.

    say: called with one sentence for every lock taken over. Locks of other hosts stay, as do those without a record.
    """
    for number in numbers(locks):
        owner = Owner.read(_owner_path(locks, number))
        if owner is None or not owner.here or owner.alive:
            continue
        ended = end(owner)
        drop(locks, number)
        jobs = f", after ending its {len(ended)} processes that still ran ({ended})" if ended else ""
        say(f"took over the lock of the dead process {owner.pid} of {owner.host}{jobs}")


def end(owner: Owner) -> list[int]:
    """End the processes that a dead run left behind, since they would write the next run's files; return their ids."""
    ended = owner.left_behind()
    for number, wait_s in ((signal.SIGTERM, GRACE_S), (signal.SIGKILL, GRACE_S)):
        for pid in owner.left_behind():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)
        stop = time.monotonic() + wait_s
        while owner.left_behind() and time.monotonic() < stop:
            time.sleep(0.05)
    return ended


def living(locks: Path) -> list[str]:
    """Return who holds the locks of a folder and is seen to live, a sentence each."""
    owners = [Owner.read(_owner_path(locks, number)) for number in numbers(locks)]
    return [
        f"process {owner.pid} of {owner.host} is running; wait for it or end it"
        for owner in owners
        if owner and owner.here and owner.alive
    ]


def holders(locks: Path) -> str:
    """Return who holds the locks of a folder, and what a person can do about it, in one line."""
    lines = []
    for number in numbers(locks):
        path, owner = _owner_path(locks, number), Owner.read(_owner_path(locks, number))
        if owner is None:
            lines.append(f"{_lock_path(locks, number, 'output')}: no record of its owner in {path.name}")
        elif not owner.here:
            lines.append(f"process {owner.pid} of host {owner.host}, which cannot be seen from here")
        elif owner.alive:
            lines.append(f"process {owner.pid} of {owner.host} is running; wait for it or end it")
        else:
            lines.append(f"process {owner.pid} of {owner.host} has died; the next run takes its lock over")
    away = "if nothing of this runs any more: snakemake --unlock"
    return f"the working directory is locked: {'; '.join([*lines, away])}"


def take(locks: Path, owner: Owner, keys: dict[str, list[str]]) -> int:
    """Write a lock with its owner, the owner first, and return its number; call within `guarded`.

    keys: the files read ("input") and written ("output") by the run.
    """
    locks.mkdir(parents=True, exist_ok=True)
    taken = set(numbers(locks))
    number = next(number for number in count() if number not in taken)
    owner.write(_owner_path(locks, number))
    for kind in KINDS:
        _lock_path(locks, number, kind).write_text("".join(f"{key}\n" for key in keys[kind]))
    return number
