"""Wall and processor time of `make`, part by part, from an empty clone of what is committed.

    python benchmarks/from_clone.py --out results/benchmarks/workflow.csv --label NAME [--cold] [--configfile FILE ...]

Clones this repository into an empty folder, runs `make` there, and lets every Python process note its own times when it
ends. Rows of other labels that the table holds already are kept. Needs a quiet machine. Columns:

    label       the name given: a revision, a state of the caches
    part        "make" is the whole command; "set-up" is over when data can be made, "packages of training" when
                trainings can start; "Snakemake" is its own process; every other part is a stage, named after its module
    processes   number of processes of the part
    wall_s      duration of the command, time since its start for the two parts of set-up, else sum over processes (s)
    cpu_s       processor time (s): of all processes for "make" and both parts of set-up, which share one figure
    percent     wall_s of a stage or of Snakemake in percent of all stages; for "make" the share of the cores' time in
                which they had a stage to run
"""

import argparse
import contextlib
import ctypes
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from lowalt.files.csv_tables import read_csv, short, write_csv
from lowalt.machine.hardware import describe

ROOT = Path(__file__).parents[1]
COLUMNS = ("label", "part", "processes", "wall_s", "cpu_s", "percent", "hardware")
NOTES = """
import atexit, json, os, sys, time
begin = time.time()
def note():
    times, folder = os.times(), os.environ["LOWALT_NOTES"]
    kept = {"words": sys.orig_argv, "begin": begin, "end": time.time(), "cpu": times.user + times.system}
    with open(os.path.join(folder, f"{os.getpid()}-{time.time_ns()}.json"), "w") as file:
        json.dump(kept, file)
atexit.register(note)
"""
"""Run by every Python process at its start (the module sitecustomize)."""


def part(words: list[str]) -> str | None:
    """Return the part that a process's command line belongs to: a stage, Snakemake, or None for neither."""
    if "-m" in words:
        module, *rest = words[words.index("-m") + 1 :]
        if module.startswith("lowalt."):
            verb = f" {rest[0]}" if rest and rest[0].isalpha() else ""
            return module.removeprefix("lowalt.") + verb
        return "Snakemake" if module == "snakemake" else None
    return "Snakemake" if any(Path(word).name == "snakemake" for word in words[:3]) else None


def table(notes: list[dict], cores: int, wall_s: float, cpu_s: float, ready: dict[str, float]) -> list[dict]:
    """Return the rows of one `make`, without label and hardware.

    notes: words, begin, end, cpu of each Python process (s). ready: time (s) after which each part of set-up was done.
    """
    parts = defaultdict(list)
    for entry in notes:
        name = part(entry["words"])
        if name:
            parts[name].append((entry["end"] - entry["begin"], entry["cpu"]))
    walls = {name: sum(wall for wall, _ in found) for name, found in parts.items()}
    stages = sum(wall for name, wall in walls.items() if name != "Snakemake")
    own = sum(cpu for found in parts.values() for _, cpu in found)
    rows = [{"part": "make", "processes": len(notes), "wall_s": wall_s, "cpu_s": cpu_s,
             "percent": 100 * stages / (cores * wall_s)}]  # fmt: skip
    rows += [{"part": name, "wall_s": seconds, "cpu_s": cpu_s - own} for name, seconds in ready.items()]
    for name in sorted(parts, key=walls.get, reverse=True):
        cpu = sum(cpu for _, cpu in parts[name])
        percent = 100 * walls[name] / stages
        rows.append(
            {"part": name, "processes": len(parts[name]), "wall_s": walls[name], "cpu_s": cpu, "percent": percent}
        )
    return rows


def measure(work: Path, cores: int, configfiles: list[str], cold: bool) -> list[dict]:
    """Clone, run `make` and return its rows.

    cold: packages come from their index, not from the caches of this machine.
    """
    clone, notes, hook = work / "clone", work / "notes", work / "hook"
    notes.mkdir()
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(NOTES)
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    environment = {**os.environ, "PYTHONPATH": str(hook), "LOWALT_NOTES": str(notes)}
    if cold:
        environment |= {"UV_CACHE_DIR": str(work / "uv"), "PIP_CACHE_DIR": str(work / "pip")}
    snakemake = [".venv/bin/snakemake", "--cores", str(cores)]
    snakemake += ["--configfile", *(str(Path(file).resolve()) for file in configfiles)] if configfiles else []
    before, begun, clock = _used(), time.monotonic(), time.time()
    _adopt_orphans()
    subprocess.run(["make", f"SNAKEMAKE={' '.join(snakemake)}"], cwd=clone, env=environment, check=True)
    wall_s = time.monotonic() - begun
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    cpu_s = _used() - before
    stamps = {"set-up": "set-up-data", "packages of training": "set-up"}
    ready = {name: (clone / ".venv" / stamp).stat().st_mtime - clock for name, stamp in stamps.items()}
    return table([json.loads(path.read_text()) for path in notes.iterdir()], cores, wall_s, cpu_s, ready)


def _adopt_orphans() -> None:
    """Make processes whose parent ends children of this one, so that their processor time is counted (Linux)."""
    set_child_subreaper = 36  # of <linux/prctl.h>
    ctypes.CDLL(None).prctl(set_child_subreaper, 1)


def _used() -> float:
    """Processor time of all children that have ended (s)."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(description="Measure `make` from an empty clone, part by part.")
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--label", required=True, help="name of these rows; rows of the same name are replaced")
    options.add_argument("--cores", type=int, default=os.cpu_count())
    options.add_argument("--cold", action="store_true", help="fetch all packages from their index")
    options.add_argument("--configfile", nargs="+", default=[], help="overlays of the configuration (default: none)")
    options.add_argument("--keep", type=Path, help="new folder for the clone and its results (default: removed)")
    given = options.parse_args()
    with contextlib.ExitStack() as stack:
        if given.keep:
            given.keep.mkdir(parents=True)
        work = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        rows = measure(work.resolve(), given.cores, given.configfile, given.cold)
    facts = {"label": given.label, "hardware": describe()}
    rows = [facts | {key: short(value) for key, value in row.items()} for row in rows]
    kept = [row for row in read_csv(given.out) if row["label"] != given.label] if given.out.exists() else []
    write_csv(given.out, COLUMNS, [*kept, *rows])
    for row in rows:
        print(*(row.get(name, "") for name in COLUMNS[1:-1]), sep=", ", file=sys.stderr)


if __name__ == "__main__":
    main()
