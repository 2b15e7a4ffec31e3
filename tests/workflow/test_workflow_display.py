"""The display of a run (`snakemake --logger lowalt`): what a log, a terminal, a full disk and a
quiet run show.
"""

import contextlib
import io
import logging
import os
import pty
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from lowalt.workflow import status

SOURCE = Path(__file__).parents[2] / "src"


def handler_of(**given):
    """The plugin's handler on a stream that is no terminal."""
    pytest.importorskip("snakemake")
    plugin = pytest.importorskip("snakemake_logger_plugin_lowalt")
    usual = {
        "printshellcmds": False,
        "nocolor": True,
        "quiet": set(),
        "debug_dag": False,
        "verbose": False,
        "show_failed_logs": True,
        "stdout": False,
        "dryrun": False,
    }
    handler = plugin.LogHandler(SimpleNamespace(**usual | given), None)
    handler._stream = io.StringIO()
    return handler


def record(message: str | None = None, level: int = logging.INFO, **extra) -> logging.LogRecord:
    made = logging.LogRecord("snakemake", level, "", 0, message, None, None)
    made.__dict__.update(extra)
    return made


def test_a_log_has_a_line_when_a_stage_starts_and_ends_and_a_failure_its_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    handler = handler_of()
    Path("job.log").write_text("".join(f"line {number}\n" for number in range(40)))
    handler.emit(record("Building DAG of jobs..."))
    handler.emit(record("table", event="run_info", stats={"echo": 2, "all": 1, "total": 3}))
    for number in (1, 2):
        handler.emit(
            record(
                "rule",
                event="job_info",
                jobid=number,
                rule_name="echo",
                log=["job.log"],
                output=["x"],
                wildcards={"run": "default", "group": "seen", "part": str(number)},
            )
        )
    handler.emit(record("Finished", event="job_finished", job_id=1))
    handler.emit(
        record(
            "error", logging.ERROR, event="job_error", jobid=2, rule_name="echo", log=["job.log"]
        )
    )
    for name, said in (("CalledProcessError", "C"), ("RuleException", "RuleException:\nC")):
        handler.emit(
            record(
                f"{said}alledProcessError in file x", logging.ERROR, event="error", exception=name
            )
        )
    handler.emit(record("took over a lock", logging.WARNING))
    handler.close()
    lines = handler._stream.getvalue().splitlines()
    assert lines[0] == "echo 0/2; seen/1"
    assert lines[1:3] == ["failed: echo, job 2", "  its log: job.log; the last lines:"]
    assert lines[3:18] == [f"    line {number}" for number in range(25, 40)]
    assert (
        lines[18] == "took over a lock"
        and lines[19].startswith("all  1/3 jobs")
        and len(lines) == 20
    )
    (kept,) = status.read()
    assert kept["state"] == "failed"


def test_a_full_disk_is_named_once_where_the_logs_of_jobs_have_no_room(monkeypatch, capsys):
    handler = handler_of()
    handler.emit(record("run", event="run_info", stats={"echo": 2, "total": 2}))
    handler.emit(
        record("error", logging.ERROR, event="job_error", jobid=1, rule_name="echo", log=["1.log"])
    )
    assert "disk is full" not in handler._stream.getvalue()
    monkeypatch.setattr("snakemake_logger_plugin_lowalt.free_bytes", lambda path: 4096)
    for job in (1, 2):
        handler.emit(
            record(
                "error",
                logging.ERROR,
                event="job_error",
                jobid=job,
                rule_name="echo",
                log=["1.log"],
            )
        )
    assert handler._stream.getvalue().count("the disk is full: 0.0 MB are free") == 1
    own_log = logging.FileHandler("/dev/full")
    own_log.emit(record("a line of Snakemake's own log"))
    assert "Traceback" not in capsys.readouterr().err


def test_a_full_disk_is_named_where_snakemake_meets_it_and_other_faults_of_a_log_keep_their_traceback(
    capsys,
):
    handler = handler_of()
    handler.emit(
        record("Error recording metadata ([Errno 28] No space left on device)", logging.ERROR)
    )
    assert "the disk is full" in handler._stream.getvalue()
    own_log = logging.FileHandler("/dev/full")
    own_log.emit(logging.LogRecord("log", logging.INFO, "", 0, "%d models", ("no number",), None))
    assert "Traceback" in capsys.readouterr().err


def test_a_dry_run_shows_stages_jobs_and_reasons_and_on_demand_what_snakemake_shows():
    follows = "Input files updated by another job: results/a/echo/x.npy"
    reasons = [
        "Missing output files: results/a/echo/x.npy",
        follows,
        f"Params have changed; {follows}",
        follows,
    ]
    handler = handler_of(dryrun=True)
    handler.emit(record("Building DAG of jobs..."))
    for job, reason in enumerate(reasons):
        rule = "a rule of a long name" if job == 0 else "echo"
        handler.emit(
            record("rule", event="job_info", jobid=job, rule_name=rule, output=["x"], reason=reason)
        )
    handler.emit(record("Nothing to be done."))
    handler.close()
    lines = handler._stream.getvalue().splitlines()
    assert lines[0] == "Nothing to be done."
    assert [" ".join(line.split()) for line in lines[1:-1]] == [
        "stage jobs why",
        "a rule of a long name 1 missing output files",
        "echo 2 input files updated by another job",
        "1 params have changed",
    ]
    assert lines[-1].split()[:2] == ["total", "4"] and "--printshellcmds" in lines[-1]
    handler = handler_of(dryrun=True, printshellcmds=True)
    handler._plain.stream = handler._stream
    handler.emit(record("Building DAG of jobs..."))
    assert handler._stream.getvalue() == "Building DAG of jobs...\n"


@pytest.mark.parametrize("quiet", ["progress", "all"])
def test_a_quiet_run_shows_failures_alone(quiet, tmp_path, monkeypatch):
    """Snakemake names no finished jobs then, so counts of them would stay at zero."""
    monkeypatch.chdir(tmp_path)
    handler = handler_of(
        quiet={pytest.importorskip("snakemake.settings.enums").Quietness.parse_choice(quiet)}
    )
    handler.emit(record("table", event="run_info", stats={"echo": 2, "total": 2}))
    handler.emit(
        record(
            "rule", event="job_info", jobid=1, rule_name="echo", log=[], output=["x"], wildcards={}
        )
    )
    handler.emit(record("Nothing to be done"))
    handler.emit(
        record(
            "error", logging.ERROR, event="job_error", jobid=1, rule_name="echo", log=["none.log"]
        )
    )
    handler.close()
    shown = ["failed: echo, job 1", "  its log: none.log, which is empty or not there"]
    assert handler._stream.getvalue().splitlines() == shown and not status.read()


SNAKEFILE = """
rule all:
    input: expand("{number}", number=range(3))
rule short:
    output: "{number}"
    log: "{number}.log"
    shell: "sleep 0.2; echo progress 3/4 parts > {log}; sleep 1.5; touch {output}"
"""


@pytest.mark.workflow
def test_on_a_terminal_lines_are_drawn_in_place(tmp_path):
    pytest.importorskip("snakemake")
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    command = [
        sys.executable,
        "-m",
        "snakemake",
        "--cores",
        "1",
        "--logger",
        "lowalt",
        "--scheduler",
        "greedy",
    ]
    environment = {**os.environ, "PYTHONPATH": str(SOURCE), "TERM": "xterm", "COLUMNS": "60"}
    ours, theirs = pty.openpty()
    run = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=theirs, stderr=theirs)
    os.close(theirs)
    text = b""
    # Reading fails once the other end is closed.
    with contextlib.suppress(OSError):
        while part := os.read(ours, 65536):
            text += part
    os.close(ours)
    assert run.wait() == 0, text
    shown = text.decode().replace("\r", "")
    assert len(re.findall(r"\x1b\[\d+F\x1b\[J", shown)) >= 4
    assert "3/4 parts" in shown
    # What stays when all that was drawn in place is gone.
    screen: list[str] = []
    for line in shown.split("\n"):
        for up, words in re.findall(r"(?:\x1b\[(\d+)F\x1b\[J)?([^\x1b]*)", line):
            screen = screen[: len(screen) - int(up)] if up else screen
            if words:
                screen.append(words)
    stays = [line for line in screen if line.startswith("short")]
    assert len(stays) == 1 and stays[0].startswith("short 3/3, done in")
