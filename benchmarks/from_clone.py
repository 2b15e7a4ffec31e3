"""Wall and processor time of `make` from an empty clone, by part and by cause.

    python benchmarks/from_clone.py --out results/benchmarks/workflow.csv --label NAME [--cold]
    [--avx2]
        [--revision COMMIT] [--configfile FILE ...]

Clones this repository into an empty folder, runs `make` there, and lets every Python process note
its own times when it ends. Rows of other labels that the table holds already are kept. Needs a
quiet machine. Columns:

    label       the name given: a revision, a state of the caches
    part        "make" is the whole command; "set-up" is over when data can be made, "packages of
    training" when
                trainings can start; "machine code" is the sample whose kernels set-up compiles,
                "bytecode" the first import of torch; "Snakemake" is its own process; every other
                part is a stage, named after its module
    processes   number of processes of the part
    wall_s      duration of the command, time since its start for the two parts of set-up, else sum
    over processes (s) cpu_s       processor time (s): of all processes for "make" and both parts of
    set-up, which share one figure percent     wall_s of a stage or of Snakemake in percent of all
    stages; for "make" the share of the cores' time in
                which they had a stage to run
    start_s     processor time before the first line of Python runs (s)
    torch_s...  of importing each package, without the imports inside it; work_s: of everything else
    (s)
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

from waiting_times import PACKAGES

from lowalt.files.csv_tables import read_csv, short, write_csv
from lowalt.machine.hardware import describe

ROOT = Path(__file__).parents[1]
CAUSES = ("start_s", *(f"{package}_s" for package in (*PACKAGES, "others")), "work_s")
COLUMNS = ("label", "part", "processes", "wall_s", "cpu_s", "percent", *CAUSES, "hardware")
NOTES = """
import _thread, atexit, builtins, json, os, sys, time
begin, start, plain, main = time.time(), time.process_time(), builtins.__import__, _thread.get_ident()
imports, inside = {}, []
def timed(name, globals=None, locals=None, fromlist=(), level=0):
    if _thread.get_ident() != main:
        return plain(name, globals, locals, fromlist, level)
    before = time.process_time()
    inside.append(0.0)
    try:
        return plain(name, globals, locals, fromlist, level)
    finally:
        whole, own = time.process_time() - before, inside.pop()
        if inside:
            inside[-1] += whole
        package = (globals["__package__"] if level else name).partition(".")[0]
        imports[package] = imports.get(package, 0.0) + whole - own
builtins.__import__ = timed
def note():
    folder = os.environ["LOWALT_NOTES"]
    kept = {"words": sys.orig_argv, "begin": begin, "end": time.time(), "cpu": time.process_time(), "start": start,
            "imports": imports}
    with open(os.path.join(folder, f"{os.getpid()}-{time.time_ns()}.json"), "w") as file:
        json.dump(kept, file)
atexit.register(note)
"""
"""Run by every Python process at its start (the module sitecustomize)."""
AVX2 = {
    "ATEN_CPU_CAPABILITY": "avx2",
    "ONEDNN_MAX_CPU_ISA": "AVX2",
    "MKL_ENABLE_INSTRUCTIONS": "AVX2",
    "NUMBA_CPU_NAME": "haswell",
}
"""What keeps libraries to the instructions of a processor without AVX-512 and bf16 units."""
FP32 = "recognition: {training: {precision: fp32}, evaluation: {precision: fp32}}\n"


def part(words: list[str]) -> str | None:
    """Return the part that a process's command line belongs to: a stage, Snakemake, a step of
    set-up, or None.
    """
    if "-m" in words:
        module, *rest = words[words.index("-m") + 1 :]
        if module.startswith("lowalt."):
            verb = f" {rest[0]}" if rest and rest[0].isalpha() else ""
            return module.removeprefix("lowalt.") + verb
        return "Snakemake" if module == "snakemake" else None
    if any("import lowalt.recognition" in word for word in words):
        return "bytecode"
    programs = [Path(word).name for word in words[:2]]
    if "snakemake" in programs:
        return "Snakemake"
    return "machine code" if "lowalt" in programs and "sample" in words else None


def causes(entries: list[dict]) -> dict[str, float]:
    """Return the processor time (s) of a part's processes by cause, the columns CAUSES.

    entries: start, imports (by package) and cpu of each process (s).
    """
    found = dict.fromkeys(CAUSES, 0.0)
    for entry in entries:
        found["start_s"] += entry["start"]
        for package, seconds in entry["imports"].items():
            found[f"{package if package in PACKAGES else 'others'}_s"] += seconds
        found["work_s"] += entry["cpu"] - entry["start"] - sum(entry["imports"].values())
    return found


def table(
    notes: list[dict], cores: int, wall_s: float, cpu_s: float, ready: dict[str, float]
) -> list[dict]:
    """Return the rows of one `make`, without label and hardware.

    notes: words, begin, end, cpu, start and imports of each Python process (s).
    ready: time (s) after which each part of set-up was done.
    """
    parts = defaultdict(list)
    for entry in notes:
        name = part(entry["words"])
        if name:
            parts[name].append(entry)
    walls = {
        name: sum(entry["end"] - entry["begin"] for entry in found) for name, found in parts.items()
    }
    stages = sum(
        wall
        for name, wall in walls.items()
        if name not in ("Snakemake", "machine code", "bytecode")
    )
    own = sum(entry["cpu"] for found in parts.values() for entry in found)
    rows = [
        {
            "part": "make",
            "processes": len(notes),
            "wall_s": wall_s,
            "cpu_s": cpu_s,
            "percent": 100 * stages / (cores * wall_s),
        }
    ]
    rows += [
        {"part": name, "wall_s": seconds, "cpu_s": cpu_s - own} for name, seconds in ready.items()
    ]
    for name in sorted(parts, key=walls.get, reverse=True):
        cpu = sum(entry["cpu"] for entry in parts[name])
        percent = 100 * walls[name] / stages
        row = {
            "part": name,
            "processes": len(parts[name]),
            "wall_s": walls[name],
            "cpu_s": cpu,
            "percent": percent,
        }
        rows.append(row | causes(parts[name]))
    return rows


def measure(work: Path, given: argparse.Namespace) -> list[dict]:
    """Clone, run `make` and return its rows; given: the options of the command line."""
    clone = work / "clone"
    notes = work / "notes"
    hook = work / "hook"
    notes.mkdir()
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(NOTES)
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    subprocess.run(["git", "checkout", "--quiet", given.revision], cwd=clone, check=True)
    environment = {**os.environ, "PYTHONPATH": str(hook), "LOWALT_NOTES": str(notes)}
    configfiles = [Path(file).resolve() for file in given.configfile]
    if given.avx2:
        environment |= AVX2
        (work / "fp32.yaml").write_text(FP32)
        configfiles.append(work / "fp32.yaml")
    if given.cold:
        environment |= {"UV_CACHE_DIR": str(work / "uv"), "PIP_CACHE_DIR": str(work / "pip")}
    snakemake = [".venv/bin/snakemake", "--cores", str(given.cores)]
    snakemake += ["--configfile", *map(str, configfiles)] if configfiles else []
    before = _used()
    begun = time.monotonic()
    clock = time.time()
    _adopt_orphans()
    subprocess.run(
        ["make", f"SNAKEMAKE={' '.join(snakemake)}"], cwd=clone, env=environment, check=True
    )
    wall_s = time.monotonic() - begun
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    cpu_s = _used() - before
    stamps = {"set-up": "set-up-data", "packages of training": "set-up"}
    ready = {
        name: (clone / ".venv" / stamp).stat().st_mtime - clock for name, stamp in stamps.items()
    }
    return table(
        [json.loads(path.read_text()) for path in notes.iterdir()],
        given.cores,
        wall_s,
        cpu_s,
        ready,
    )


def _adopt_orphans() -> None:
    """Make processes whose parent ends children of this one, so that their processor time is
    counted (Linux).
    """
    set_child_subreaper = 36  # of <linux/prctl.h>
    ctypes.CDLL(None).prctl(set_child_subreaper, 1)


def _used() -> float:
    """Processor time of all children that have ended (s)."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(
        description="Measure `make` from an empty clone, part by part."
    )
    options.add_argument("--out", type=Path, required=True)
    options.add_argument(
        "--label", required=True, help="name of these rows; rows of the same name are replaced"
    )
    options.add_argument("--cores", type=int, default=os.cpu_count())
    options.add_argument("--cold", action="store_true", help="fetch all packages from their index")
    options.add_argument(
        "--avx2", action="store_true", help="as on a processor without AVX-512 and bf16 units"
    )
    options.add_argument(
        "--revision", default="HEAD", help="commit to measure (default: the one checked out)"
    )
    options.add_argument(
        "--configfile", nargs="+", default=[], help="overlays of the configuration (default: none)"
    )
    options.add_argument(
        "--keep", type=Path, help="new folder for the clone and its results (default: removed)"
    )
    given = options.parse_args()
    with contextlib.ExitStack() as stack:
        if given.keep:
            given.keep.mkdir(parents=True)
        work = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        rows = measure(work.resolve(), given)
    facts = {"label": given.label, "hardware": describe()}
    rows = [facts | {key: short(value) for key, value in row.items()} for row in rows]
    kept = (
        [row for row in read_csv(given.out) if row["label"] != given.label]
        if given.out.exists()
        else []
    )
    write_csv(given.out, COLUMNS, [*kept, *rows])
    for row in rows:
        print(*(row.get(name, "") for name in COLUMNS[1:-1]), sep=", ", file=sys.stderr)


if __name__ == "__main__":
    main()
