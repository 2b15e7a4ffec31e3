"""The holder of a run's lock: a process named so that it is recognised, or known to be dead, after any crash.

The system reuses process ids, so the record also holds the start time of the process; the boot id tells whether the
machine has started anew since; host and process-id namespace tell whether the id can be looked up here at all.
"""

import json
import os
import socket
from dataclasses import asdict, dataclass
from pathlib import Path

from lowalt.common.processes import started, state

TOKEN = "LOWALT_RUN"
"""Environment variable that every job of a run inherits: the token of the run."""


@dataclass(frozen=True)
class Owner:
    """A process: id, start time in clock ticks after boot, host, boot id, process-id namespace, token of the run."""

    pid: int
    started: int
    host: str
    boot: str
    namespace: str
    token: str

    @classmethod
    def current(cls) -> "Owner":
        """Return this process as an owner, with a token that no other run has."""
        pid, boot = os.getpid(), _boot()
        token = f"{socket.gethostname()}-{boot[:8]}-{pid}-{started(pid)}"
        return cls(pid, started(pid), socket.gethostname(), boot, _namespace(), token)

    @classmethod
    def read(cls, path: Path) -> "Owner | None":
        """Return the owner that a file records, or None where the file is damaged, as after a power loss."""
        try:
            return cls(**json.loads(path.read_text()))
        except (OSError, ValueError, TypeError):
            return None

    def write(self, path: Path) -> None:
        """Record the owner, flushed to the disk."""
        with path.open("w") as file:
            json.dump(asdict(self), file)
            file.flush()
            os.fsync(file.fileno())

    @property
    def here(self) -> bool:
        """Whether this process can tell if the owner lives: same host and, since its last start, same namespace."""
        return self.host == socket.gethostname() and (self.boot != _boot() or self.namespace == _namespace())

    @property
    def alive(self) -> bool:
        """Whether the owner lives; only meaningful where it is `here`."""
        return self.boot == _boot() and started(self.pid) == self.started

    def left_behind(self) -> list[int]:
        """Process ids on this machine that carry the owner's token: jobs that outlived it, ours to end."""
        if self.boot != _boot():
            return []
        mark, found = f"{TOKEN}={self.token}".encode(), []
        for folder in Path("/proc").glob("[0-9]*"):
            if int(folder.name) == os.getpid():
                continue
            try:
                if mark in (folder / "environ").read_bytes().split(b"\0") and state(int(folder.name)) != "Z":
                    found.append(int(folder.name))
            except OSError:
                continue
        return found


def _boot() -> str:
    """Id of this start of the machine."""
    return Path("/proc/sys/kernel/random/boot_id").read_text().strip()


def _namespace() -> str:
    """Namespace in which this process has its id."""
    return str(Path("/proc/self/ns/pid").readlink())
