"""The progress of a long command, as lines in its log for users and the workflow's display.

A line is `progress 340/2000 steps`; the last one is current. Commands write to their log (standard
error) at most every two seconds, so short ones write none. A step that cannot count its parts is
`announced`.
"""

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, TextIO, TypeVar

EVERY_S = 2.0
LINE = re.compile(rb"^progress (\d+)/(\d+) (\w+)$", re.MULTILINE)
TAIL_BYTES = 4096

Item = TypeVar("Item")


class Progress(NamedTuple):
    """Number of parts of a command's work that are done, of how many, and the name of a part."""

    done: int
    total: int
    unit: str


class Reporter:
    """Writes progress lines to the log, at most one every EVERY_S seconds of `clock`."""

    def __init__(
        self,
        total: int,
        unit: str,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._total = total
        self._unit = unit
        self._stream = stream
        self._clock = clock
        self._last = clock()

    def __call__(self, done: int) -> None:
        """Write that `done` units are done, unless a line was written in the last EVERY_S."""
        now = self._clock()
        if now - self._last >= EVERY_S:
            self._last = now
            print(
                f"progress {done}/{self._total} {self._unit}",
                file=self._stream or sys.stderr,
                flush=True,
            )


@contextmanager
def announced(words: str, stream: TextIO | None = None, every_s: float = EVERY_S) -> Iterator[None]:
    """Write every `every_s` seconds that a step goes on which cannot count: words and seconds."""
    ended = threading.Event()
    began = time.monotonic()

    def write() -> None:
        """Write until the step has ended."""
        while not ended.wait(every_s):
            print(
                f"{words}, {time.monotonic() - began:.0f} s", file=stream or sys.stderr, flush=True
            )

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield
    finally:
        ended.set()
        writer.join()


def reported(items: Iterable[Item], total: int, unit: str) -> Iterator[Item]:
    """Yield the items and report how many are done."""
    report = Reporter(total, unit)
    for done, item in enumerate(items, start=1):
        yield item
        report(done)


def last(log: str | Path, since: float = 0.0) -> Progress | None:
    """Return the last progress in a log file, or None where its last lines have none.

    since: seconds since the epoch; a file last written more than a second before is of an earlier
    run.
    """
    try:
        with Path(log).open("rb") as file:
            # File systems may keep whole seconds.
            if os.fstat(file.fileno()).st_mtime < since - 1:
                return None
            file.seek(max(0, file.seek(0, 2) - TAIL_BYTES))
            marks = LINE.findall(file.read())
    except OSError:
        return None
    if not marks:
        return None
    done, total, unit = marks[-1]
    return Progress(int(done), int(total), unit.decode())
