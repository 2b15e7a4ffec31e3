"""A GPU of one's own: jobs of one process that run on a machine at the same time never share a GPU.

A job locks one file per GPU, and the system frees the lock of a job that ends. Processes that
torchrun starts take the visible GPUs in order and lock none: on one machine let one such training
run at a time, by `recognition.gpu: true` and `--resources gpu=N` with N its processes.
"""

import contextlib
import fcntl
import functools
import os
import sys
import tempfile
import time
from pathlib import Path

POLL_S = 1.0


def _opened(name: str) -> int:
    """Return a descriptor of a GPU's lock file, which another user of the machine may have made."""
    path = Path(tempfile.gettempdir()) / f"lowalt-gpu-{name.removeprefix('GPU-')}.lock"
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDONLY, 0o644))
    return os.open(path, os.O_RDONLY)


@functools.cache
def claimed(names: tuple[str, ...]) -> int:
    """Wait for a GPU of this process's own and return its index in `names` (UUIDs).

    No other job has that GPU until this process ends.
    """
    waiting = False
    while True:
        for index, name in enumerate(names):
            descriptor = _opened(name)
            try:
                # The lock lasts as long as this descriptor, which stays open.
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return index
            except BlockingIOError:
                os.close(descriptor)
        if not waiting:
            print(
                f"waiting for one of {len(names)} GPUs, which other jobs use",
                file=sys.stderr,
                flush=True,
            )
            waiting = True
        time.sleep(POLL_S)
