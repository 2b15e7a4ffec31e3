"""Small faults set into the package one at a time, and how many of them the tests notice.

    python benchmarks/mutants.py --out mutants.csv --survivors mutants_survivors.csv     (make mutants)

For each room of `src/lowalt` a number of faults is drawn by seed. Each is set into a copy of the tree, and the tests
that run its line are run there until one fails. A failing test kills the fault, and so does a run that takes too long.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from typing import NamedTuple

import numpy as np
from mutation.candidates import Mutant, draw, mutated, of_file
from mutation.coverage_map import Coverage, measure, read, shown_tests

from lowalt.common.csv_tables import write_csv

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = ("room", "places", "drawn", "killed", "survived", "killed_percent")
SURVIVORS = ("file", "line", "operator", "occurrence", "tests", "before", "after")


class Outcome(NamedTuple):
    """A fault and its end: `killed` or `survived`, and how many tests were shown it."""

    mutant: Mutant
    killed: bool
    tests: int


def rooms(root: Path) -> dict[str, list[Mutant]]:
    """All places for faults by room of the package (a folder of `src/lowalt`)."""
    found: dict[str, list[Mutant]] = {}
    for path in sorted((root / "src/lowalt").rglob("*.py")):
        file = str(path.relative_to(root))
        room = path.relative_to(root / "src/lowalt").parts[0]
        found.setdefault(room.removesuffix(".py"), []).extend(of_file(root, file))
    return found


def copy_of_tree(root: Path, folder: Path) -> Path:
    """A copy of the checkout's files, with its environment linked, in which faults can be set."""
    files = subprocess.run(["git", "ls-files", "-z"], cwd=root, check=True, capture_output=True, text=True).stdout
    for name in files.split("\0"):
        if name and (root / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(root / name, folder / name)
    (folder / ".venv").symlink_to((root / ".venv").resolve())
    return folder


def trial(tree: Path, mutant: Mutant, tests: list[str], seconds: float) -> Outcome:
    """Set a fault into `tree`, run `tests` until one fails, and take the fault out again.

    A fault that no test runs survives. `seconds`: the time that the tests take without a fault, which bounds the run.
    """
    if not tests:
        return Outcome(mutant, False, 0)
    path = tree / mutant.file
    source = path.read_text(encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": f"{tree}/src", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        path.write_text(mutated(source, mutant), encoding="utf-8")
        ended = subprocess.run(command, cwd=tree, env=environment, timeout=120 + 5 * seconds, check=False,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode  # fmt: skip
    except subprocess.TimeoutExpired:
        ended = 1
    finally:
        path.write_text(source, encoding="utf-8")
    return Outcome(mutant, ended != 0, len(tests))


def run(root: Path, found: Coverage, drawn: list[Mutant], jobs: int, limit: float) -> list[Outcome]:
    """Try faults in `jobs` copies of the tree at a time, in the order given."""
    trees: Queue = Queue()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        for job in range(jobs):
            trees.put(copy_of_tree(root, Path(folder) / str(job)))

        def one(mutant: Mutant) -> Outcome:
            """Try one fault in a tree that is free."""
            tests = shown_tests(root, found, mutant.file, mutant.line, limit)
            tree = trees.get()
            try:
                outcome = trial(tree, mutant, tests, sum(found.seconds[test] for test in tests))
            finally:
                trees.put(tree)
            print(f"{'killed  ' if outcome.killed else 'SURVIVED'} {mutant.file}:{mutant.line} {mutant.operator}"
                  f" {mutant.occurrence} ({outcome.tests} tests)", flush=True)  # fmt: skip
            return outcome

        with ThreadPoolExecutor(jobs) as pool:
            return list(pool.map(one, drawn))


def survivor_row(root: Path, outcome: Outcome) -> dict:
    """A line of the table of survivors: where the fault stood, and the line before and after."""
    source = (root / outcome.mutant.file).read_text(encoding="utf-8")
    before, after = source.splitlines(), mutated(source, outcome.mutant).splitlines()
    changed = next(i for i in range(len(before)) if i >= len(after) or before[i] != after[i])
    return {**outcome.mutant._asdict(), "tests": outcome.tests, "before": before[changed].strip(),
            "after": after[changed].strip() if changed < len(after) else ""}  # fmt: skip


def main(argv: list[str] | None = None) -> None:
    """Draw faults, try them, write the table by room and the list of survivors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--survivors", type=Path, required=True)
    parser.add_argument("--map", type=Path, default=Path("results/mutants"), help="folder of the map of tests")
    parser.add_argument("--count", type=int, default=25, help="faults a room")
    parser.add_argument("--rooms", nargs="*", help="these rooms only")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=40, help="seconds of tests shown to a fault")
    asked = parser.parse_args(argv)
    found = read(asked.map) if (asked.map / "map.json").exists() else measure(ROOT, asked.map.resolve())
    places = {room: mutants for room, mutants in rooms(ROOT).items() if not asked.rooms or room in asked.rooms}
    generator = np.random.default_rng(asked.seed)
    drawn = {room: draw(mutants, asked.count, generator) for room, mutants in places.items()}
    outcomes = run(ROOT, found, [mutant for chosen in drawn.values() for mutant in chosen], asked.jobs, asked.limit)
    killed = Counter(outcome.mutant.file for outcome in outcomes if outcome.killed)
    rows = []
    for room, chosen in drawn.items():
        count = sum(killed[file] for file in {mutant.file for mutant in chosen})
        share = f"{100 * count / len(chosen):.1f}" if chosen else ""
        rows.append(dict(zip(COLUMNS, (room, len(places[room]), len(chosen), count, len(chosen) - count, share),
                             strict=True)))  # fmt: skip
    write_csv(asked.out, COLUMNS, rows)
    write_csv(asked.survivors, SURVIVORS, [survivor_row(ROOT, each) for each in outcomes if not each.killed])


if __name__ == "__main__":
    main()
