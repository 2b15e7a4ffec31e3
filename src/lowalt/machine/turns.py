"""A lock file, so that one process at a time does work that all need once; the system frees it when its holder dies."""

import contextlib
import fcntl
import os
import time
from pathlib import Path

PATIENCE_S = 180.0
"""After so long a process goes on without its turn: doing the work twice is better than standing still."""
PAUSE_S = 0.05


class Turn:
    """The right to do one piece of work, shared by all processes that name the same file; may be taken repeatedly."""

    def __init__(self, path: Path) -> None:
        """path: lock file, which stays empty and is never removed; its folder is made where it is missing."""
        self._path, self._depth, self._descriptor = path, 0, -1

    def take(self, patience_s: float = PATIENCE_S) -> None:
        """Wait until no other process has the turn, at most `patience_s` (s); do not wait without a file to lock."""
        self._depth += 1
        if self._depth > 1:
            return
        stop = time.monotonic() + patience_s
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR, 0o666)
            while time.monotonic() < stop:
                with contextlib.suppress(BlockingIOError):
                    fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return
                time.sleep(PAUSE_S)
        except OSError:
            return

    def give(self) -> None:
        """Let the next process have the turn; without a turn nothing happens."""
        self._depth = max(0, self._depth - 1)
        if not self._depth and self._descriptor >= 0:
            # Closing the file frees the lock.
            os.close(self._descriptor)
            self._descriptor = -1
