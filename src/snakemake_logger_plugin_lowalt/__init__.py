"""Snakemake's log as one line per stage: `snakemake --logger lowalt`, which this project's profiles
select.

On a terminal, the lines of running stages are redrawn in place. In a log, each stage has a line
when it starts, every half minute, and when it ends. Everything else is in files: Snakemake's own
log, whose path it prints at the end, and the log of each job, whose last lines are shown if it
fails. A dry run prints a table of stages, with their jobs and why these would run; with
--printshellcmds it prints what Snakemake prints for every job. A quiet run shows only warnings and
failures and keeps no status, because Snakemake then does not report which jobs have ended.
"""

import contextlib
import json
import logging
import os
import shutil
import sys
import threading
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from snakemake.logging import ColorizingTextHandler, DefaultFilter, DefaultFormatter
from snakemake.settings.enums import Quietness
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from lowalt.files.atomic import FULL, NEARLY_FULL_BYTES, free_bytes
from lowalt.files.errors import InputError
from lowalt.machine import progress
from lowalt.workflow import closing, mends, status
from lowalt.workflow.board import Board, Job

EVERY_S = {True: 1.0, False: 30.0}
"""Seconds between two updates of the display: on a terminal (True), and in a log."""
LAST_LINES = 15
"""Lines of a failed job's log that are shown."""
QUIET = {
    LogEvent.RUN_INFO,
    LogEvent.WORKFLOW_STARTED,
    LogEvent.SHELLCMD,
    LogEvent.JOB_STARTED,
    LogEvent.PROGRESS,
    LogEvent.RESOURCES_INFO,
    LogEvent.GROUP_INFO,
    LogEvent.DEBUG_DAG,
    LogEvent.RULEGRAPH,
}
NOISE = (
    "Assuming unrestricted shared filesystem",
    "Building DAG of jobs",
    "Conda environments: ignored",
    "Config file",
    "Job rate limit",
    "Removing temporary output",
    "Select jobs to execute",
    "Singularity containers: ignored",
    "Using profile",
    "Using shell",
    "Using workflow specific profile",
    "host:",
    "Would remove temporary output",
    "Some jobs were triggered by provenance",
    "If you prefer that only modification time",
    "If you are sure that",
    "Rules with provenance triggered jobs",
    "Reasons:",
)
"""Messages that begin like this say nothing about the run and are not shown."""
FOLLOWS = "input files updated by another job"
"""Snakemake's reason for a job that runs only because another job does."""

INTERRUPTED = "on user request"
"""Part of the message with which Snakemake answers Ctrl-C and SIGTERM."""


def short_reason(reason: str) -> str:
    """Return why a job would run without the files that Snakemake names, such as "missing output
    files".
    """
    kinds = dict.fromkeys(part.partition(":")[0].strip().lower() for part in reason.split("; "))
    # A job with another reason would run even if its inputs stayed the same.
    own = [kind for kind in kinds if kind and kind != FOLLOWS]
    return ", ".join(own or kinds)


def plan_table(planned: Mapping[str, Mapping[str, int]]) -> list[str]:
    """Return the lines of a dry run's table. planned: by rule the number of jobs for each reason."""
    wide = max(map(len, ("stage", *planned)))
    lines = [f"{'stage':{wide}}  jobs  why"]
    for rule, reasons in planned.items():
        for count, (reason, jobs) in enumerate(sorted(reasons.items(), key=lambda pair: -pair[1])):
            lines.append(f"{'' if count else rule:{wide}}  {jobs:4}  {reason}")
    total = sum(sum(reasons.values()) for reasons in planned.values())
    more = "files, reasons and commands of every job: the same with --printshellcmds"
    return [*lines, f"{'total':{wide}}  {total:4}  ({more})"]


class LogHandler(LogHandlerBase):
    """Shows a run on the stream that Snakemake would write to."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self) -> None:
        """Choose the stream, and whether the display is a board, lines, or Snakemake's own text."""
        given = self.common_settings
        self._stream = sys.stdout if given.stdout else sys.stderr
        self._terminal = self._stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self._plain = ColorizingTextHandler(
            given.nocolor,
            self._stream,
            DefaultFormatter(given.quiet, given.show_failed_logs),
            DefaultFilter(
                given.quiet, given.debug_dag, given.verbose, given.dryrun, given.printshellcmds
            ),
        )
        # These options of Snakemake ask for its own messages.
        self._all = given.verbose or given.debug_dag or given.printshellcmds
        self._planned: dict[str, Counter[str]] | None = (
            {} if given.dryrun and not self._all else None
        )
        self._quiet = bool({Quietness.PROGRESS, Quietness.ALL} & set(given.quiet or ()))
        self._board: Board | None = None
        self._drawn = 0
        self._shown = 0.0
        self._full = False
        self._outcome = "ended"
        self._page: Path | None = None
        # Snakemake keeps its own log on the run's disk, and begins it before it reads any rule.
        mends.quiet_logs_on_a_full_disk()
        self._guard = threading.RLock()
        self._stop = threading.Event()
        self._ticker = threading.Thread(target=self._tick, daemon=True)

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record of Snakemake's, or note what it says about the run."""
        try:
            with self._guard:
                self._plan(record)
                if self._planned is not None:
                    self._count(record)
                elif self._all:
                    if self._plain.filter(record):
                        self._plain.handle(record)
                else:
                    self._take(record)
        except Exception:
            self.handleError(record)

    def close(self) -> None:
        """Show the last state and leave the status file behind."""
        self._stop.set()
        with self._guard:
            if self._planned:
                print("\n".join(plan_table(self._planned)), file=self._stream, flush=True)
                self._planned = None
            if self._board:
                self._erase()
                self._keep(self._outcome)
                print(
                    "\n".join([self._board.total(time.time()), *self._closing()]),
                    file=self._stream,
                    flush=True,
                )
                self._board = None
        super().close()

    def _closing(self) -> list[str]:
        """The last lines of a run that has made its page; none where its tables cannot be read."""
        if self._page and self._outcome == "ended":
            with contextlib.suppress(OSError, InputError, KeyError, ValueError):
                return closing.lines(self._page.parent)
        return []

    def _plan(self, record: logging.LogRecord) -> None:
        """Add a job that would run to the file that `status.PLANNED_JOBS` names; rules without
        files only collect.
        """
        path = os.environ.get(status.PLANNED_JOBS)
        if path and getattr(record, "event", None) == LogEvent.JOB_INFO and record.output:
            job = {
                "rule": record.rule_name,
                "files": list(map(str, record.output)),
                "reason": str(record.reason),
            }
            with Path(path).open("a") as file:
                file.write(json.dumps(job) + "\n")

    def _count(self, record: logging.LogRecord) -> None:
        """Count a job that would run by its rule and reasons; show messages that say something
        about this run.
        """
        event = getattr(record, "event", None)
        if event == LogEvent.JOB_INFO:
            self._planned.setdefault(record.rule_name, Counter())[
                short_reason(str(record.reason))
            ] += 1
        elif event not in QUIET and not self._noise(record):
            self._say(self._plain.format(record))

    def _take(self, record: logging.LogRecord) -> None:
        """Update the display with one record of Snakemake."""
        event = getattr(record, "event", None)
        if self._quiet and record.levelno <= logging.INFO:
            return
        if event == LogEvent.RUN_INFO and getattr(record, "stats", None):
            totals = {name: count for name, count in record.stats.items() if name != "total"}
            self._board = Board(totals, record.created)
            self._shown = record.created
            if not self._ticker.is_alive():
                self._ticker.start()
        elif event == LogEvent.JOB_INFO and self._board:
            self._start(record)
        elif event == LogEvent.JOB_FINISHED and self._board:
            self._finish(record.job_id, record.created)
        elif event == LogEvent.JOB_ERROR:
            self._fail(record)
        elif event not in QUIET and not self._noise(record):
            self._say(self._plain.format(record))
        if INTERRUPTED in str(record.msg):
            self._outcome = "interrupted"
        if event == LogEvent.JOB_ERROR or record.levelno >= logging.ERROR:
            self._outcome = "failed" if self._outcome == "ended" else self._outcome
            self._say_full(str(record.msg))

    def _say_full(self, text: str) -> None:
        """Say once that the disk is full, if an error's text or the free space shows it; job logs
        may be cut short.
        """
        free = free_bytes(Path.cwd())
        if not self._full and (free < NEARLY_FULL_BYTES or os.strerror(FULL[0]) in text):
            self._full = True
            self._say(
                f"the disk is full: {free / 1e6:.1f} MB are free in {Path.cwd()}; whole files are"
                " kept, so make room and start the run again"
            )

    @staticmethod
    def _noise(record: logging.LogRecord) -> bool:
        """Whether a record tells nothing beyond what the display shows."""
        text = record.getMessage() if record.msg is not None else ""
        # The command of a failed job stands in Snakemake's own log; its error is shown by `_fail`.
        failed = hasattr(record, "exception") and "CalledProcessError" in text[:200]
        return failed or (
            record.levelno <= logging.INFO
            and (not text or text == "None" or text.startswith(NOISE))
        )

    def _start(self, record: logging.LogRecord) -> None:
        """Show that a job has started."""
        if not record.output:
            # The rule only collects files; it makes none itself.
            self._board.totals.pop(record.rule_name, None)
            return
        if record.rule_name == "report":
            self._page = Path(record.output[0])
        label = "/".join(str(value) for name, value in record.wildcards.items() if name != "run")
        job = Job(record.rule_name, label, record.log[0] if record.log else "", record.created)
        first = self._board.start(record.jobid, job)
        if self._terminal:
            self._draw()
        elif first:
            self._say(self._board.line(record.rule_name, record.created, progress.last))

    def _finish(self, job_id: object, now: float) -> None:
        """Show that a job has finished."""
        complete = self._board.finish(job_id, now)
        if complete:
            self._say(self._board.line(complete, now, progress.last))

    def _fail(self, record: logging.LogRecord) -> None:
        """Show a failed job with the last lines of its logs."""
        if self._board:
            self._board.finish(record.jobid, record.created, good=False)
        lines = [f"failed: {record.rule_name}, job {record.jobid}"]
        for log in record.log:
            try:
                text = Path(log).read_text(errors="replace").splitlines()
            except OSError:
                text = []
            if text[-1:] == ["KeyboardInterrupt"]:
                lines[0] = f"interrupted: {record.rule_name}, job {record.jobid}"
                continue
            lines += [
                f"  its log: {log}"
                + ("; the last lines:" if text else ", which is empty or not there")
            ]
            lines += [f"    {line}" for line in text[-LAST_LINES:]]
        self._say("\n".join(lines))

    def _say(self, text: str) -> None:
        """Print lines that stay, above those drawn in place."""
        if text:
            self._erase()
            print(text, file=self._stream, flush=True)
            self._draw()

    def _erase(self) -> None:
        """Erase the drawn lines from the terminal."""
        if self._drawn:
            print(f"\x1b[{self._drawn}F\x1b[J", end="", file=self._stream)
            self._drawn = 0

    def _draw(self) -> None:
        """Draw the running stages in place; do nothing in a log."""
        if not (self._terminal and self._board):
            return
        now = time.time()
        size = shutil.get_terminal_size()
        lines = [self._board.line(name, now, progress.last) for name in self._board.running()]
        lines = [
            line[: size.columns - 1] for line in [*lines, self._board.total(now)][-size.lines + 2 :]
        ]
        self._erase()
        print("\n".join(lines), file=self._stream, flush=True)
        self._drawn = len(lines)
        self._shown = now

    def _tick(self) -> None:
        """Show the state from time to time, also while no job starts or ends."""
        while not self._stop.wait(1.0):
            with self._guard:
                if not self._board or self._stop.is_set():
                    continue
                self._keep("running")
                if time.time() - self._shown < EVERY_S[self._terminal]:
                    continue
                self._shown = time.time()
                if self._terminal:
                    self._draw()
                else:
                    running = self._board.running()
                    text = [self._board.line(name, self._shown, progress.last) for name in running]
                    print(
                        "\n".join([*text, self._board.total(self._shown)]),
                        file=self._stream,
                        flush=True,
                    )

    def _keep(self, state: str) -> None:
        """Write the state of the run to its status file."""
        # On a full disk, jobs fail with their own messages; the display must not fail.
        with contextlib.suppress(OSError, InputError):
            status.write(self._board, state)
