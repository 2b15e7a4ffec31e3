"""Memory of a process: the least that it needs, a limit for a block of code, and reuse of freed arrays.

By default glibc returns each large freed block to the system, which later provides zeroed pages one
by one. That took a fifth of the time of a sample with many effects. With other C libraries nothing
changes.
"""

import contextlib
import ctypes
import os
import resource
from collections.abc import Iterator
from pathlib import Path

from lowalt.files.errors import SpaceError

LEAST_BYTES = 1_000_000_000
THREAD_BYTES = 64 << 20
"""Address space of a process that makes a sample, and of each further thread of its BLAS."""
LEAST_HELD_BYTES = 400_000_000
"""Memory that such a process holds while it compiles."""


def refuse_little(root: Path = Path("/")) -> None:
    """Refuse to go on where the limits of this process leave too little memory: with less, OpenBLAS
    asks for it again and again without end.

    root: below which the system's files lie. Raises: SpaceError naming the limit.
    """
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    least = LEAST_BYTES + THREAD_BYTES * ((os.cpu_count() or 1) - 1)
    if soft != resource.RLIM_INFINITY and soft < least:
        raise SpaceError(
            f"memory: this process may take {soft / 1e6:.0f} MB (ulimit -v), expected at least "
            f"{least / 1e6:.0f} MB of address space"
        )
    held = min(_group_limits(root), default=LEAST_HELD_BYTES)
    if held < LEAST_HELD_BYTES:
        raise SpaceError(
            f"memory: the control group of this process may hold {held / 1e6:.0f} MB, expected at "
            f"least {LEAST_HELD_BYTES / 1e6:.0f} MB"
        )


def _group_limits(root: Path) -> Iterator[int]:
    """Yield the limits (bytes) of the control groups that this process is in.

    Source: cgroups(7); Linux, Control Group v2, memory.max, and v1, memory.limit_in_bytes.
    """
    try:
        lines = (root / "proc/self/cgroup").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, kinds, name = line.split(":", 2)
        if kinds not in ("", "memory"):
            continue
        base = root / "sys/fs/cgroup" / kinds
        file = "memory.limit_in_bytes" if kinds else "memory.max"
        group = base / name.lstrip("/")
        for folder in (group, *group.parents):
            with contextlib.suppress(OSError, ValueError):
                yield int((folder / file).read_text())
            if folder == base:
                break


@contextlib.contextmanager
def at_most(size: int) -> Iterator[None]:
    """Let a block of code take at most `size` more bytes of address space.

    An allocation beyond that fails.
    Systems without /proc set no limit. Source: setrlimit(2), RLIMIT_AS; proc(5), statm.
    """
    statm = Path("/proc/self/statm")
    if not statm.exists():
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = int(statm.read_text().split()[0]) * resource.getpagesize() + size
    limits = [limit, *(known for known in (soft, hard) if known != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_AS, (min(limits), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def keep_freed_memory() -> None:
    """Let the C library keep freed blocks of any size; only for the project's own processes.

    A stage frees arrays of the same sizes for each sample, and training frees its activations in
    each step.
    Source: mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD.
    """
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mmap_threshold = -3
        trim_threshold = -1
        mallopt(mmap_threshold, 1 << 30)
        mallopt(trim_threshold, (1 << 31) - 1)
