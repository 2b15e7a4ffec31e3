"""A trial: a copy of the project in which one run is started again and again, and the bytes it must end with."""

import argparse
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import psutil

from lowalt.common.errors import InputError
from lowalt.workflow.disturb import MemoryGroup

ROOT = Path(__file__).parents[3]
PARTS = ("Snakefile", "workflow", "config", "profiles", "src", "envs")
TIMINGS = (
    "logs", "benchmarks", "report.html", "stages.csv", "seeds.csv", "run.json", "progress",
    "cost.csv", "cost_pixels.csv", "cost.png", "echo_cost.csv", "echo_cost.svg", "stage_times.csv", "stage_times.svg",
)  # fmt: skip
"""Names of files and folders of a run that hold times, which no run repeats."""
LOUD = ("Traceback (most recent call last)", "Directory cannot be locked")
"""Texts that the output of a disturbed run must not contain."""


def checksums(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file of a run that a run of the same settings repeats."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    kept = {path.relative_to(folder): path for path in files}
    return {
        str(name): hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in kept.items()
        if not set(name.parts) & set(TIMINGS) and not (name.parts[0] == "predictions" and path.suffix == ".json")
    }


def copy_project(project: Path, folder: Path) -> None:
    """Copy the files that a run reads and the compiled machine code, without results and bytecode."""
    for name in PARTS:
        source = project / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("*.pyc", "*.egg-info"))
        else:
            shutil.copy(source, folder / name)


class Trial:
    """One copy of the project in which a run is started again and again."""

    def __init__(self, project: Path, folder: Path, options: argparse.Namespace, group: MemoryGroup | None) -> None:
        """Copy the project into a folder; options are those of the campaign."""
        self.folder, self.options, self.group, self.said = folder, options, group, ""
        folder.mkdir(exist_ok=True)
        copy_project(project, folder)

    def start(self) -> psutil.Popen:
        """Start the run as a leader of its own process group and return its main process."""
        command = [sys.executable, "-m", "snakemake", "--cores", str(self.options.cores), "--configfile"]
        command += [*self.options.configfile, *(["--", *self.options.targets] if self.options.targets else [])]
        environment = os.environ | {"PYTHONPATH": str(self.folder / "src"), "LOWALT_SPACE": "off"}
        # Bytecode stays out of the trial's own, perhaps small, disk, but is kept: each job would compile it anew.
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        environment["PYTHONPYCACHEPREFIX"] = str(self.folder.parent / "bytecode")
        descriptor, self.output = tempfile.mkstemp(prefix="lowalt-trial-")
        with open(descriptor, "wb") as output:  # noqa: PTH123
            return psutil.Popen(
                command, cwd=self.folder, env=environment, stdout=output, stderr=subprocess.STDOUT,
                start_new_session=True, preexec_fn=self._first,
            )  # fmt: skip

    def _first(self) -> None:
        """In the new process, before Snakemake: take Ctrl-C as at a terminal, and enter the memory group."""
        # A shell's background job ignores Ctrl-C and hands that on; the run must feel it as at a terminal.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        if self.group:
            self.group.enter()

    def finish(self, main: psutil.Popen) -> int:
        """Wait for a run's end, keep what it printed, and return its exit status (negative: ended by that signal)."""
        status = main.wait()
        self.said = Path(self.output).read_text(errors="replace")
        Path(self.output).unlink()
        return status

    def name(self) -> str:
        """Name of the run in its folder of results."""
        names = [path.name for path in (self.folder / "results").iterdir() if (path / "config.yaml").is_file()]
        if len(names) != 1:
            raise InputError(f"{self.folder}/results: runs {names}, expected exactly one")
        return names[0]

    def whole(self) -> dict[str, str]:
        """Checksums of the finished run."""
        return checksums(self.folder / "results" / self.name())

    def written_mb(self) -> float:
        """Size of all files of the finished run (MB)."""
        files = (path for path in (self.folder / "results" / self.name()).rglob("*") if path.is_file())
        return sum(path.stat().st_size for path in files) / 1e6

    def remarks(self) -> str:
        """Return the part of a disturbed run's output that must not be there, or "clear"."""
        return "; ".join(text for text in LOUD if text in self.said) or "clear"


def ended(status: int) -> str:
    """Return how a process ended, in words."""
    return f"signal {-status}" if status < 0 else f"status {status}"
