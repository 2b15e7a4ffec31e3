"""A run of all stages that is ended at random moments and started again has the bytes of an
undisturbed run.
"""

import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

pytest.importorskip("snakemake")
pytest.importorskip("torch")
pytestmark = [pytest.mark.workflow, pytest.mark.slow]

ROOT = Path(__file__).parents[2]
TIMINGS = {
    "logs",
    "benchmarks",
    "report.html",
    "stages.csv",
    "seeds.csv",
    "run.json",
    "progress",
    "cost.csv",
    "cost.svg",
    "echo_cost.csv",
    "echo_cost.svg",
}
"""Names of files and folders of a run that hold times, which no run repeats."""


def checksums(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a run that a run of the same settings repeats."""
    files = {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {
        str(name): hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in files.items()
        if not set(name.parts) & TIMINGS
        and not (name.parts[0] == "predictions" and path.suffix == ".json")
    }


def project(folder: Path) -> Path:
    """A copy of the files that a run reads."""
    for name in ("workflow", "config", "profiles", "src", "envs"):
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("*.pyc", "*.egg-info")
        )
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def start(folder: Path) -> psutil.Popen:
    """Start the run as the leader of a process group of its own, which feels Ctrl-C as at a
    terminal.
    """
    command = [
        sys.executable,
        "-m",
        "snakemake",
        "--cores",
        "2",
        "--configfile",
        "config/checks/kills.yaml",
    ]
    with (folder / "said").open("w") as said:
        return psutil.Popen(
            command,
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(folder / "src")},
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )


def end_all(main: psutil.Popen) -> None:
    """SIGKILL of Snakemake and of all its processes."""
    for process in [main, *main.children(recursive=True)]:
        process.kill()


def end_a_worker(main: psutil.Popen) -> None:
    """SIGKILL of the process that was started last."""
    for process in main.children(recursive=True)[-1:]:
        process.kill()


DISTURBANCES = {
    "all": end_all,
    "snakemake": psutil.Popen.kill,
    "a worker": end_a_worker,
    "terminated": psutil.Popen.terminate,
    "interrupted": lambda main: os.killpg(main.pid, signal.SIGINT),
}


def test_a_run_that_was_ended_again_and_again_has_the_bytes_of_an_undisturbed_one(tmp_path):
    whole = project(tmp_path / "whole")
    disturbed = project(tmp_path / "disturbed")
    assert start(whole).wait() == 0, (whole / "said").read_text()[-3000:]
    expected = checksums(whole / "results/kills")
    choose = random.Random(7)
    assert len(expected) > 30
    kinds = [*DISTURBANCES, *DISTURBANCES]
    while True:
        main = start(disturbed)
        try:
            status = main.wait(choose.uniform(4, 20) if kinds else None)
        except psutil.TimeoutExpired:
            DISTURBANCES[kinds.pop(0)](main)
            status = main.wait()
            assert "Directory cannot be locked" not in (disturbed / "said").read_text()
            continue
        assert status == 0, (disturbed / "said").read_text()[-3000:]
        break
    assert checksums(disturbed / "results/kills") == expected
