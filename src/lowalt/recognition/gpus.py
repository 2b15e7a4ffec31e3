"""GPUs of one's own: jobs of one machine that run at the same time never share a GPU; a job that finds none free waits.

A job locks one file a GPU, and the system frees the locks of a job that ends. One process chooses its GPU itself
(`Machine.here`). Several processes of one training get theirs together, before they start:

    python -m lowalt.recognition.gpus COUNT MODULE [ARGUMENT ...]

runs the module with as many GPUs visible, or as it is where the machine has no GPU. Two trainings of several processes
can therefore not wait for each other's GPUs.
"""

import contextlib
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from lowalt.files.errors import InputError

POLL_S = 1.0


def visible() -> list[str]:
    """Return the UUIDs of the GPUs that this process may use, by the driver's own tool and CUDA_VISIBLE_DEVICES.

    Raises: InputError where the variable names a GPU that is not there.
    """
    tool = shutil.which("nvidia-smi")
    if not tool:
        return []
    query = subprocess.run([tool, "--query-gpu=uuid", "--format=csv,noheader"], capture_output=True, text=True)
    every = [line.strip() for line in query.stdout.splitlines() if line.strip()] if query.returncode == 0 else []
    chosen = os.environ.get("CUDA_VISIBLE_DEVICES")
    if chosen is None:
        return every
    known = {**{str(number): name for number, name in enumerate(every)}, **{name: name for name in every}}
    names = [name.strip() for name in chosen.split(",") if name.strip()]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"CUDA_VISIBLE_DEVICES: {unknown}, expected numbers or UUIDs of {every}")
    return [known[name] for name in names]


def _opened(name: str) -> int:
    """Return a descriptor of a lock file, which other users of the machine may have made."""
    path = Path(tempfile.gettempdir()) / f"lowalt-gpu-{name.removeprefix('GPU-')}.lock"
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDONLY, 0o644))
    return os.open(path, os.O_RDONLY)


@contextlib.contextmanager
def _turn() -> Iterator[None]:
    """Let one job at a time choose."""
    descriptor = _opened("turn")
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _free(names: Sequence[str], count: int) -> dict[int, int]:
    """Lock `count` free GPUs of `names`: their places and descriptors; none where fewer are free."""
    held: dict[int, int] = {}
    with _turn():
        for place, name in enumerate(names):
            descriptor = _opened(name)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                continue
            held[place] = descriptor
            if len(held) == count:
                return held
    for descriptor in held.values():
        os.close(descriptor)
    return {}


def claim(names: Sequence[str], count: int) -> dict[int, int]:
    """Return the places in `names` (UUIDs) of GPUs that are this process's own until it ends, with their locks.

    A lock is an open descriptor. Waits until so many are free. Raises: InputError where there are fewer.
    """
    if count > len(names):
        raise InputError(f"{count} GPUs asked for, this machine has {len(names)}; expected fewer recognition.processes")
    told = False
    while not (held := _free(names, count)):
        if not told:
            print(f"waiting for {count} of {len(names)} GPUs, which other jobs use", file=sys.stderr, flush=True)
            told = True
        time.sleep(POLL_S)
    return held


_OWN: dict[int, int] = {}
"""The GPU that this process has claimed."""


def own(names: Sequence[str]) -> int:
    """Return the place in `names` of this process's own GPU, claimed at the first call."""
    if not _OWN:
        _OWN.update(claim(names, 1))
    return next(iter(_OWN))


def main(arguments: list[str]) -> None:
    """Run a module with GPUs of its own: COUNT MODULE [ARGUMENT ...]."""
    if len(arguments) < 2 or not arguments[0].isdigit() or not int(arguments[0]):
        raise InputError(f"arguments {arguments}, expected COUNT MODULE [ARGUMENT ...]")
    count, names = int(arguments[0]), visible()
    if names:
        held = claim(names, count)
        os.environ["CUDA_VISIBLE_DEVICES"] = ",".join(names[place] for place in held)
        for descriptor in held.values():
            os.set_inheritable(descriptor, True)
    os.execv(sys.executable, [sys.executable, "-m", *arguments[1:]])


if __name__ == "__main__":
    from lowalt.config.command import run

    run(main)
