"""Ctrl-C pressed again while a run already ends: it is answered in one line and does not break the ending off.

After the first Ctrl-C Snakemake ends its jobs, removes their unfinished files and gives its lock back. A second one in
the middle of that would leave Python tracebacks on the screen and the lock behind.
"""

import os
import signal
import threading
from types import FrameType

ANSWER = b"already ending; the same command goes on where this run stops\n"


def install() -> None:
    """Let the first Ctrl-C of this process act as ever, and every later one print ANSWER.

    Nothing happens where Ctrl-C is ignored or handled already, or outside of the main thread.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _first)


def _first(number: int, frame: FrameType | None) -> None:
    """Answer the next Ctrl-C, and raise KeyboardInterrupt for this one."""
    signal.signal(signal.SIGINT, _again)
    raise KeyboardInterrupt


def _again(number: int, frame: FrameType | None) -> None:
    """Say that the run is ending."""
    os.write(2, ANSWER)
