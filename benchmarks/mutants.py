"""Small faults set into the package one at a time, and how many of them the tests notice.

    python benchmarks/mutants.py --out mutants.csv --survivors mutants_survivors.csv --minutes 45     (make mutants)

For each room of `src/lowalt` a number of faults is drawn by seed. Each is set into a copy of the tree, and the tests
that run its line are run there until one fails. A failing test kills the fault, and so does a run that takes too long.
Maps of tests and outcomes are kept in `--kept`; the same command goes on where the last one stopped. Rooms take turns,
so that all of them have about as many outcomes when time is up.
"""

import argparse
import os
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, zip_longest
from pathlib import Path
from queue import Queue

import numpy as np
from mutation.candidates import Mutant, draw, mutated, of_file
from mutation.coverage_map import Coverage, measure, shown_tests
from mutation.kept import Kept
from mutation.trials import Outcome, copy_of_tree, trial

from lowalt.common.csv_tables import write_csv

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = ("room", "places", "drawn", "tried", "killed", "by_time", "survived", "killed_percent")
SURVIVORS = ("file", "line", "operator", "occurrence", "tests", "before", "after")


def rooms(root: Path) -> dict[str, list[Mutant]]:
    """All places for faults by room of the package (a folder of `src/lowalt`); statistics are a room of their own."""
    found: dict[str, list[Mutant]] = {}
    for path in sorted((root / "src/lowalt").rglob("*.py")):
        file = str(path.relative_to(root))
        room = path.relative_to(root / "src/lowalt").parts[0].removesuffix(".py")
        if file.endswith(("recognition/statistics.py", "recognition/intervals.py", "recognition/metrics.py")):
            room = "statistics"
        found.setdefault(room, []).extend(of_file(root, file))
    return found


def run(root: Path, found: Coverage, drawn: list[Mutant], asked: argparse.Namespace, until: float) -> list[Outcome]:
    """Try faults in `asked.jobs` copies of the tree at a time, in the order given, until time is up."""
    trees: Queue = Queue()
    for job in range(asked.jobs):
        trees.put(copy_of_tree(root, asked.kept.resolve() / f"tree-{job}"))
    kept = Kept(asked.kept / "outcomes.jsonl", root)

    def one(mutant: Mutant) -> Outcome | None:
        """Try one fault in a tree that is free."""
        tests = shown_tests(root, found, mutant.file, mutant.line, asked.limit)
        if kept.outcome(mutant, tests) is None and time.monotonic() > until:
            return None
        tree = trees.get()
        try:
            spent = sum(found.seconds[test] for test in tests)
            outcome = kept.of(mutant, tests, lambda: trial(tree, mutant, tests, spent))
        finally:
            trees.put(tree)
        print(f"{'killed  ' if outcome.killed else 'SURVIVED'} {mutant.file}:{mutant.line} {mutant.operator}"
              f" {mutant.occurrence} ({outcome.tests} tests)", flush=True)  # fmt: skip
        return outcome

    with ThreadPoolExecutor(asked.jobs) as pool:
        return [outcome for outcome in pool.map(one, drawn) if outcome]


def survivor_row(root: Path, outcome: Outcome) -> dict:
    """A line of the table of survivors: where the fault stood, and the line before and after."""
    source = (root / outcome.mutant.file).read_text(encoding="utf-8")
    before, after = source.splitlines(), mutated(source, outcome.mutant).splitlines()
    changed = next(i for i in range(len(before)) if i >= len(after) or before[i] != after[i])
    return {**outcome.mutant._asdict(), "tests": outcome.tests, "before": before[changed].strip(),
            "after": after[changed].strip() if changed < len(after) else ""}  # fmt: skip


def room_rows(places: dict[str, list], drawn: dict[str, list], outcomes: list[Outcome]) -> list[dict]:
    """Lines of the table by room: places for faults, faults drawn and tried, and how the tried ones ended."""
    rows = []
    for room, chosen in drawn.items():
        mine = [outcome for outcome in outcomes if outcome.mutant in set(chosen)]
        killed = sum(outcome.killed for outcome in mine)
        share = f"{100 * killed / len(mine):.1f}" if mine else ""
        values = (room, len(places[room]), len(chosen), len(mine), killed, sum(outcome.late for outcome in mine),
                  len(mine) - killed, share)  # fmt: skip
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def main(argv: list[str] | None = None) -> None:
    """Draw faults, try them, write the table by room and the list of survivors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--survivors", type=Path, required=True)
    parser.add_argument("--kept", type=Path, default=Path("results/mutants"), help="folder of maps and outcomes")
    parser.add_argument("--count", type=int, default=25, help="faults a room")
    parser.add_argument("--rooms", nargs="*", help="these rooms only")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=40, help="seconds of tests shown to a fault")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin nothing new after this time")
    asked = parser.parse_args(argv)
    os.nice(19)
    until = time.monotonic() + 60 * asked.minutes
    found = measure(ROOT, asked.kept.resolve() / "map", asked.jobs, lambda: time.monotonic() < until)
    if found is None:
        print(f"time is up; the map of tests goes on with the next call ({asked.kept})")
        return
    places = {room: mutants for room, mutants in rooms(ROOT).items() if not asked.rooms or room in asked.rooms}
    drawn = {
        room: draw(mutants, asked.count, np.random.default_rng([asked.seed, *room.encode()]))
        for room, mutants in places.items()
    }
    in_turn = [mutant for mutant in chain(*zip_longest(*drawn.values())) if mutant]
    outcomes = run(ROOT, found, in_turn, asked, until)
    write_csv(asked.out, COLUMNS, room_rows(places, drawn, outcomes))
    write_csv(asked.survivors, SURVIVORS, [survivor_row(ROOT, each) for each in outcomes if not each.killed])
    print(f"{len(outcomes)} of {len(in_turn)} faults tried, {sum(each.killed for each in outcomes)} killed")


if __name__ == "__main__":
    main()
