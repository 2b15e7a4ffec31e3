"""Runs of Snakemake in one process, so that imports are paid for once: a plan of a workplace,
the files that it names, and a plan after each of several changes. The process's folder is the
workplace."""

import contextlib
import io
import json
import os
import re
from pathlib import Path

from snakemake.cli import main
from snakemake.executors import touch

import kept_records
from lowalt.targets import records

records.merge = kept_records.once(records.merge)
# Snakemake waits before it touches a job's files, for the clocks of coarse file systems. Files are
# touched in the order of their jobs, and equal times make nothing run again.
touch.Executor.SLEEPING_TIME = 0.0


def said(*arguments: str) -> str:
    """What a run prints."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        try:
            main(["--cores", "1", *arguments, "--configfile", "overlay.yaml", "change.yaml"])
        except SystemExit as end:
            print("exit", end.code)
    return text.getvalue()


def make_files(plan: str) -> None:
    """Make every file that the jobs of a plan name; it holds its name."""
    for line in re.findall(r"^    (?:output|benchmark|log): (.*)$", plan, re.MULTILINE):
        for path in map(Path, line.split(", ")):
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.name == "figures":  # the report's folder of plots
                path.mkdir()
            else:
                path.write_text(str(path))


@contextlib.contextmanager
def edited(path: Path, old: str, new: str):
    """A file in which a text is replaced, or added at the end, for the length of a block."""
    before = path.read_text()
    times = path.stat()
    path.write_text(before.replace(old, new, 1) if old else before + new)
    yield
    path.write_text(before)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def run() -> None:
    """Write what the first plan, and the plan after each change of changes.json, print: said.json."""
    Path("change.yaml").write_text("{}")
    plans = {"whole": said("--dry-run", "--printshellcmds")}
    make_files(plans["whole"])
    said("--touch", "--forceall")
    for name, (overlay, edit) in json.loads(Path("changes.json").read_text()).items():
        Path("change.yaml").write_text(overlay)
        with edited(Path(edit[0]), *edit[1:]) if edit else contextlib.nullcontext():
            plans[name] = said("--dry-run", "--printshellcmds")
    Path("said.json").write_text(json.dumps(plans))
