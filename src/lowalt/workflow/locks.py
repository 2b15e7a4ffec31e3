"""Locks that end with their run: a record next to each pair of Snakemake's lock files.

A run holds a file lock on its record while it is alive.
Snakemake locks a working directory with files, which remain when it is killed. The operating system
releases a file lock when its holder ends for any reason. The next run can therefore remove the lock
files of a dead run and end its orphaned jobs, and it refuses to start while another run is alive.
`mends.py` replaces Snakemake's lock with this.
"""

import contextlib
import json
import os
import signal
import socket
import time
import uuid
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from itertools import count
from pathlib import Path

from filelock import FileLock, Timeout

from lowalt.files.processes import state

KINDS = ("input", "output")
TOKEN = "LOWALT_RUN"
"""Environment variable that every job of a run inherits: the token of the run."""
GRACE_S = 10.0
"""Seconds between SIGTERM and SIGKILL for the orphaned jobs of a dead run."""


@dataclass(frozen=True)
class Owner:
    """The run that holds a lock: its process id, host and unique token."""

    pid: int = field(default_factory=os.getpid)
    host: str = field(default_factory=socket.gethostname)
    token: str = field(default_factory=lambda: uuid.uuid4().hex)

    @classmethod
    def read(cls, path: Path) -> "Owner | None":
        """Return the owner that a file records, None for a damaged file, as after a power loss."""
        try:
            block = json.loads(path.read_text())
            return cls(block["pid"], block["host"], block["token"])
        except (OSError, ValueError, TypeError, KeyError):
            return None

    @property
    def here(self) -> bool:
        """Whether the owner is or was on this host, so that its file locks can be tested."""
        return self.host == socket.gethostname()

    def left_behind(self) -> list[int]:
        """Return the ids of other processes on this host that have the owner's token.

        If the owner is dead, they are its orphaned jobs.
        """
        mark = f"{TOKEN}={self.token}".encode()
        jobs = []
        for folder in Path("/proc").glob("[0-9]*"):
            pid = int(folder.name)
            try:
                variables = (folder / "environ").read_bytes().split(b"\0")
            except OSError:
                # The process has ended, or it is another user's.
                continue
            if mark in variables and pid != os.getpid() and state(pid) != "Z":
                jobs.append(pid)
        return jobs


def guarded(folder: Path) -> FileLock:
    """Return the mutex for reading and changing the locks of a folder."""
    return FileLock(folder / "lowalt.guard", fallback_to_soft=False)


def record(locks: Path, number: int) -> Path:
    """Return the path of the record of a lock's owner, who keeps it locked while alive."""
    return locks / f"{number}.owner.json"


def numbers(locks: Path) -> list[int]:
    """Return the numbers of all locks in a folder, with or without an owner."""
    names = {path.name.partition(".")[0] for path in locks.glob("*.*") if path.is_file()}
    return sorted(int(name) for name in names if name.isdigit())


def held(path: Path) -> bool:
    """Return whether a process of this machine holds a record locked."""
    try:
        with FileLock(path, timeout=0, fallback_to_soft=False):
            return False
    except Timeout:
        return True


def drop(locks: Path, number: int) -> None:
    """Remove one lock, the owner's record last: a crash in between leaves no lock without owner."""
    for kind in KINDS:
        (locks / f"{number}.{kind}.lock").unlink(missing_ok=True)
    record(locks, number).unlink(missing_ok=True)


def take_over(locks: Path, say: Callable[[str], None]) -> None:
    """Remove the locks of dead owners on this host and end their orphaned jobs.

    Call within `guarded`. say: called with one sentence per removed lock. Locks of other hosts and
    locks without a record stay.
    """
    for number in numbers(locks):
        owner = Owner.read(record(locks, number))
        if owner is None or not owner.here or held(record(locks, number)):
            continue
        ended = end(owner)
        drop(locks, number)
        sentence = f"took over the lock of the dead process {owner.pid} of {owner.host}"
        if ended:
            sentence += f", after ending its {len(ended)} processes that still ran ({ended})"
        say(sentence)


def end(owner: Owner) -> list[int]:
    """End the orphaned processes of a dead run, which would write files of the next; return ids."""
    ended = owner.left_behind()
    for ending in (signal.SIGTERM, signal.SIGKILL):
        for pid in owner.left_behind():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, ending)
        stop = time.monotonic() + GRACE_S
        while owner.left_behind() and time.monotonic() < stop:
            time.sleep(0.05)
    return ended


def holders(locks: Path, living: bool = False) -> list[str]:
    """Return one sentence per lock about its holder; living: only holders known to be alive."""
    lines = []
    for number in numbers(locks):
        path = record(locks, number)
        owner = Owner.read(path)
        if owner is not None and owner.here and held(path):
            lines.append(f"process {owner.pid} of {owner.host} is running; wait for it or end it")
        elif living:
            continue
        elif owner is None:
            lines.append(
                f"{locks / f'{number}.output.lock'}: no record of its owner in {path.name}"
            )
        elif not owner.here:
            lines.append(
                f"process {owner.pid} of host {owner.host}, which cannot be seen from here"
            )
        else:
            lines.append(
                f"process {owner.pid} of {owner.host} has died; the next run takes its lock over"
            )
    return lines


def locked_message(locks: Path) -> str:
    """Return one line about the holders of the locks of a folder and what the user can do."""
    away = "if nothing of this runs any more: snakemake --unlock"
    return f"the working directory is locked: {'; '.join([*holders(locks), away])}"


def take(locks: Path, owner: Owner, keys: dict[str, list[str]]) -> tuple[int, FileLock]:
    """Write a lock, the owner's record first; call within `guarded`.

    keys: the files read ("input") and written ("output") by the run. Returns the lock's number and
    the file lock on its record, to be released at the end. Raises: OSError where a file cannot be
    written or the file system locks none.
    """
    number = next(number for number in count() if number not in numbers(locks))
    holding = FileLock(record(locks, number), timeout=0, fallback_to_soft=False)
    try:
        holding.acquire()
        with record(locks, number).open("w") as file:
            file.write(json.dumps(asdict(owner)))
            file.flush()
            os.fsync(file.fileno())
        for kind in KINDS:
            (locks / f"{number}.{kind}.lock").write_text("".join(f"{key}\n" for key in keys[kind]))
    except OSError:
        holding.release()
        drop(locks, number)
        raise
    return number, holding
