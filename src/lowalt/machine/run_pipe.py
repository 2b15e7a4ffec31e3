"""A pipe by which processes end with the one that started them, however that one ends.

The process that starts others keeps the writing end and hands the reading end on. The system closes
a dead process's ends, so that reading then returns. Where a process does not have the pipe, such as
a job that a cluster's scheduler starts, nothing happens.
"""

import os
import signal
import stat
import threading

PIPE = "LOWALT_RUN_PIPE"
"""Environment variable: number and inode of the reading end that a process has inherited."""


def hold_pipe() -> int:
    """Return the reading end of a new pipe, which the caller hands on (`pass_fds`); processes
    started later end with this one if they call `end_with_starter`.
    """
    reading, _ = os.pipe()
    os.environ[PIPE] = f"{reading} {os.fstat(reading).st_ino}"
    return reading


def end_with_starter() -> None:
    """Let this process be killed as soon as the one that holds the other end of its pipe has ended."""
    number, _, inode = os.environ.get(PIPE, "").partition(" ")
    if not number:
        return
    try:
        about = os.fstat(int(number))
    except (OSError, ValueError):
        return
    # Another file may have that number in a process that did not inherit the pipe.
    if stat.S_ISFIFO(about.st_mode) and str(about.st_ino) == inode:
        threading.Thread(target=_wait, args=(int(number),), daemon=True).start()


def _wait(reading: int) -> None:
    """Wait for the end of the pipe, into which nothing is ever written, and kill this process."""
    os.read(reading, 1)
    os.kill(os.getpid(), signal.SIGKILL)
