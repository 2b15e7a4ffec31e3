"""A long run of the data stages, verified, with time and peak memory by stage next to those of a short run.

    python benchmarks/long_run.py --out results/benchmarks/long_run.csv [--models N] [--short N] [--cores N]

Makes OVERLAY twice through the workflow, with few motion models and with many, checks every byte of each data
set (`lowalt verify`), and lets every Python process note its own peak memory and times when it ends. No network is
trained. Ends with status 1 where a stage needs more memory for many samples than for few. Linux. Columns:

    run         name of the run: its files lie in results/{run}
    models      motion models of each subtype
    samples     number of samples
    stage       a stage, named after its module; "Snakemake" is its own process, which knows all jobs of the run;
                "verify" is the check; "all" is the whole run with the check
    processes   number of processes
    wall_s      sum over processes (s); for "all" the time from begin to end
    cpu_s       processor time, sum over processes (s)
    peak_mib    most memory that one process held (MiB)
    growth      peak_mib over that of the short run
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from from_clone import part

from lowalt.common.csv_tables import short, write_csv
from lowalt.common.hardware import describe
from lowalt.common.yaml_files import load_yaml

ROOT = Path(__file__).parents[1]
OVERLAY = "config/checks/long.yaml"
COLUMNS = ("run", "models", "samples", "stage", "processes", "wall_s", "cpu_s", "peak_mib", "growth", "hardware")
NOTES = """
import atexit, json, os, sys, time
begin = time.time()
def note():
    with open("/proc/self/status") as file:
        peak = next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))
    times = os.times()
    kept = {"words": sys.orig_argv, "wall": time.time() - begin, "cpu": times.user + times.system, "peak_kib": peak}
    with open(os.path.join(os.environ["LOWALT_NOTES"], f"{os.getpid()}-{time.time_ns()}.json"), "w") as file:
        json.dump(kept, file)
atexit.register(note)
"""
"""Run by every Python process at its start (the module sitecustomize)."""
MOST_GROWTH = 1.1
"""Up to this growth memory counts as flat."""
MOST_MORE_MIB = 16.0
"""So does an increase by up to this: small processes differ by a few pages of libraries."""
GROWING = ("Snakemake", "all")
"""Rows that may grow: Snakemake holds a record of every job."""


def stage(words: list[str]) -> str | None:
    """Return the stage of a process's command line: "verify", as `from_clone.part` names it, or None for neither."""
    if words[1:4] == ["-m", "lowalt", "verify"]:
        return "verify"
    return part(words)


def commands(run: str, cores: int, overlays: list[str]) -> list[list[str]]:
    """Return the command lines that make a run and verify it.

    overlays: on top of config/checks/long.yaml; they name the run.
    """
    python = sys.executable
    make = [python, "-m", "snakemake", "--cores", str(cores), "--forceall", "--configfile", OVERLAY, *overlays]
    return [[*make, "--", "data"], [python, "-m", "lowalt", "verify", f"results/{run}/shards/index.json"]]


def size_overlay(run: str, models: int, folder: Path) -> str:
    """Write the overlay that names a run and says its number of motion models; return its path."""
    path = folder / "size.yaml"
    path.write_text(f"run: {run}\nmotion: {{models: {models}}}\n")
    return str(path)


def noted(lines: list[list[str]], folder: Path) -> tuple[list[dict], float]:
    """Run command lines one after the other; return the notes of all their Python processes and the whole time (s).

    folder: for the notes and the module that writes them. Raises: CalledProcessError where a command fails.
    """
    notes, hook = folder / "notes", folder / "hook"
    notes.mkdir()
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(NOTES)
    paths = os.pathsep.join(filter(None, (str(hook), str(ROOT / "src"))))
    environment = {**os.environ, "PYTHONPATH": paths, "LOWALT_NOTES": str(notes)}
    begun = time.monotonic()
    for line in lines:
        subprocess.run(line, cwd=ROOT, env=environment, check=True)
    wall_s = time.monotonic() - begun
    return [json.loads(path.read_text()) for path in sorted(notes.iterdir())], wall_s


def table(notes: list[dict], wall_s: float) -> list[dict]:
    """Return a row for each stage of one run and one for all, from the notes of its processes."""
    found = defaultdict(list)
    for entry in notes:
        name = stage(entry["words"])
        if name:
            found[name].append(entry)
    rows = [_row(name, entries, sum(entry["wall"] for entry in entries)) for name, entries in sorted(found.items())]
    return [*rows, _row("all", notes, wall_s)]


def _row(name: str, entries: list[dict], wall_s: float) -> dict:
    """One row: processes, times and the largest peak of one stage."""
    peak = max(entry["peak_kib"] for entry in entries) / 1024
    cpu_s = sum(entry["cpu"] for entry in entries)
    return {"stage": name, "processes": len(entries), "wall_s": wall_s, "cpu_s": cpu_s, "peak_mib": peak}


def compared(few: list[dict], many: list[dict]) -> tuple[list[dict], list[str]]:
    """Return the rows of the long run with their growth, and one line for each stage whose memory is not flat.

    few, many: rows of the short and the long run.
    """
    before = {row["stage"]: row["peak_mib"] for row in few}
    rows = [{**row, "growth": row["peak_mib"] / before[row["stage"]]} for row in many]
    lines = [
        f"{row['stage']}: {row['peak_mib']:.0f} MiB, in the short run {before[row['stage']]:.0f} MiB"
        for row in rows
        if row["stage"] not in GROWING
        and row["growth"] > MOST_GROWTH
        and row["peak_mib"] > before[row["stage"]] + MOST_MORE_MIB
    ]
    return rows, lines


def measured(run: str, models: int, cores: int, more: list[str]) -> list[dict]:
    """Make and verify one run; return its rows with run, models and samples.

    more: overlays on top of OVERLAY. Raises: CalledProcessError where the run fails or a byte of it is wrong.
    """
    with tempfile.TemporaryDirectory() as name:
        overlays = [*more, size_overlay(run, models, Path(name))]
        notes, wall_s = noted(commands(run, cores, overlays), Path(name))
    samples = json.loads((ROOT / f"results/{run}/shards/index.json").read_text())["samples"]
    return [{"run": run, "models": models, "samples": samples, **row} for row in table(notes, wall_s)]


def main() -> None:
    """Make both runs, write the table, and name each stage whose memory grew."""
    options = argparse.ArgumentParser(description="Make a short and a long run, and compare memory by stage.")
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--models", type=int, help=f"motion models of each subtype (default: those of {OVERLAY})")
    options.add_argument("--short", type=int, default=100, help="those of the short run (default 100)")
    options.add_argument("--cores", type=int, default=os.cpu_count())
    options.add_argument("--configfile", nargs="+", default=[], help=f"overlays on top of {OVERLAY} (default: none)")
    given = options.parse_args()
    name, models = "long", given.models or load_yaml(ROOT / OVERLAY)["motion"]["models"]
    few = measured(f"{name}-short", given.short, given.cores, given.configfile)
    many, lines = compared(few, measured(name, models, given.cores, given.configfile))
    facts = {"hardware": describe()}
    write_csv(
        given.out, COLUMNS, [{key: short(value) for key, value in {**row, **facts}.items()} for row in few + many]
    )
    if lines:
        sys.exit("\n".join(["memory grows with the samples:", *lines]))


if __name__ == "__main__":
    main()
