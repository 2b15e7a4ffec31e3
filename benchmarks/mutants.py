"""Small faults set into the package one at a time, and how many of them the tests notice.

    python benchmarks/mutants.py --out mutants.csv --survivors mutants_survivors.csv --minutes 45     (make mutants)

For each room of `src/lowalt` a number of faults is drawn by seed. Each is set into a copy of the tree, and the tests
that run its line are run there until one fails. A failing test kills the fault, and so does a run that takes too much
processor time. A run that the clock stops first leaves the fault undecided: it is counted apart, and not as killed.
Maps of tests and outcomes are kept in `--kept`; the same command goes on where the last one stopped. Rooms take turns,
so that all of them have about as many outcomes when time is up. The list of survivors holds every fault that survived
a trial, also one that a test kills by now; verdicts that a reader wrote into its last column stay. Where edits of a
room change its draw, survivors of earlier draws are tried again and stay in the list; the table by room leaves them
out. A call for some rooms keeps the lines of the others in both tables.
"""

import argparse
import csv
import math
import os
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, zip_longest
from pathlib import Path
from queue import Queue

import numpy as np
from mutation.candidates import Mutant, draw, of_file
from mutation.coverage_map import ROOM_WIDE, Coverage, joined, measure, naming, shown_tests, unmapped
from mutation.forked import LIBRARIES, TRAINING, load
from mutation.kept import Kept
from mutation.survivors import earlier, survivor_row
from mutation.trials import Outcome, copy_of_tree, trial

from lowalt.common.csv_tables import write_csv

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = ("room", "places", "drawn", "tried", "survived_first", "killed", "by_time", "undecided", "survived",
           "equivalent", "killed_percent", "low_percent", "high_percent")  # fmt: skip
"""`survived_first`: before tests were added; `by_time`: killed, since processor time ran out; `undecided`: stopped by
the clock; `equivalent`: faults not killed that change no result, by their verdict; `killed_percent`: of the faults
tried except these; `low_percent`, `high_percent`: its 95 % interval."""
SURVIVORS = ("file", "line", "operator", "occurrence", "tests", "before", "after", "now", "verdict")
_COMMON = ("archives", "classes", "command", "config", "csv_tables", "download", "echo_rounding", "hardware", "noise",
           "plan", "portable", "splits", "turns", "workflow_board")  # fmt: skip
_MEASURE = ("measure", "limits", "report.py", "report_cost", "report_effects", "physics", "echo_command", "echo_hard",
            "command", "recognition_price", "recognition_stream")  # fmt: skip
_RECOGNITION = ("own_backbone", "command_options", *(f"recognition{name}" for name in (
    ".py", "_augment", "_choose", "_classical", "_data", "_distances", "_faults", "_features", "_fusion", "_gpus",
    "_height_cue", "_made", "_nodes", "_null_space", "_predictions", "_rates", "_recipe", "_rotor",
    "_schemes", "_shards", "_sharing", "_signals", "_start", "_stream", "_tables", "_track", "_training",
    "_transfer")))  # fmt: skip
_TARGETS = ("targets", "gait", "mesh", "mocap", "cloud", "surfaces", "sampling", "record_schema", "records")
NEAR = {
    "statistics": ("statistics", "recognition_tables", "recognition_macro_f1"),
    "spectra": ("spectra", "tiles_device"),
    "shards": ("shards", "dataset", "command.py"),
    "recognition": _RECOGNITION,
    "targets": _TARGETS,
    "common": _COMMON,
    "commands": ("command", "gallery", "records_own"),
    "measure": _MEASURE,
    "motion": ("motion", "laws", "limits", "plan"),
    "noise": ("noise", "laws"),
    "tiles": ("tiles", "spectra"),
    "report": ("report", "gallery"),
    "workflow": ("workflow", "invented_sizes", "command.py", "command_options"),
}
"""How the names of files of tests of a room begin, where not by the room's name alone."""
FILE_S = 12.0
"""Seconds that a file of tests is taken to need where `--files` spares the map that tells its time."""


def near(root: Path, asked: list[str]) -> list[str]:
    """Files of tests that are named after one of these rooms, or hold all of it."""
    begins = tuple(f"test_{name}" for room in asked for name in NEAR.get(room, (room,)))
    wide = {name for name, held in ROOM_WIDE.items() if set(held) & set(asked)}
    names = {path.name for path in (root / "tests").glob("test_*.py") if path.name.startswith(begins)}
    return sorted(names | wide)


def rooms(root: Path) -> dict[str, list[Mutant]]:
    """All places for faults by room of the package (a folder of `src/lowalt`); statistics are a room of their own."""
    found: dict[str, list[Mutant]] = {}
    for path in sorted((root / "src/lowalt").rglob("*.py")):
        file = str(path.relative_to(root))
        found.setdefault(room_of(file), []).extend(of_file(root, file))
    return found


def room_of(file: str) -> str:
    """The room of a file, whose name is given from the root of the repository."""
    if file.endswith(("recognition/statistics.py", "recognition/intervals.py", "recognition/metrics.py")):
        return "statistics"
    return Path(file).parts[2].removesuffix(".py")


def run(
    root: Path, found: Coverage, drawn: list[Mutant], asked: argparse.Namespace, until: float, kept: Kept
) -> list[Outcome]:
    """Try faults in `asked.jobs` copies of the tree at a time, in the order given, until time is up."""
    trees: Queue = Queue()
    for job in range(asked.jobs):
        trees.put(copy_of_tree(root, asked.kept.resolve() / f"tree-{job}"))

    def one(mutant: Mutant) -> Outcome | None:
        """Try one fault in a tree that is free."""
        tests = shown_tests(root, found, mutant.file, mutant.line, asked.limit)
        if kept.outcome(mutant, tests) is None and time.monotonic() > until:
            return None
        tree = trees.get()
        try:
            spent = sum(found.seconds[test] for test in tests) * (FILE_S if asked.files else 1)
            outcome = kept.of(mutant, tests, lambda: trial(tree, mutant, tests, spent))
        finally:
            trees.put(tree)
        end = "killed   " if outcome.killed else "UNDECIDED" if outcome.undecided else "SURVIVED "
        print(f"{end} {mutant.file}:{mutant.line} {mutant.operator} {mutant.occurrence} ({outcome.tests} tests)",
              flush=True)  # fmt: skip
        return outcome

    with ThreadPoolExecutor(asked.jobs) as pool:
        return [outcome for outcome in pool.map(one, drawn) if outcome]


def looks(
    root: Path, faults: list[Mutant], asked: argparse.Namespace, until: float, kept: Kept
) -> list[Outcome] | None:  # fmt: skip
    """Try faults; None where time was up before the tests were mapped.

    With `asked.near`, tests near the rooms that name the modules of the faults come first. Survivors get a second look,
    by tests of other rooms that name their modules.
    """
    every = sorted(path.name for path in (root / "tests").glob("test_*.py"))

    def mapped(names: list[str]) -> Coverage | None:
        """The map of files of tests."""
        if asked.files:
            return unmapped(root, names, {mutant.file for mutant in faults})
        return measure(root, names, asked.kept.resolve() / "map", asked.jobs, lambda: time.monotonic() < until)

    def that_name(names: list[str], some: list[Mutant]) -> set[str]:
        """Files of tests that name the modules of faults."""
        return set().union(*(naming(root, names, file) for file in {mutant.file for mutant in some}))

    first = sorted(that_name(near(root, asked.rooms), faults)) if asked.near else every
    found = mapped(first)
    if found is None:
        return None
    outcomes = run(root, found, faults, asked, until, kept)
    left = [outcome.mutant for outcome in outcomes if not (outcome.killed or outcome.undecided)]
    others = sorted(that_name(every, left) - set(first)) if asked.near and left else []
    more = mapped(others) if others else None
    if more:
        second = run(root, joined([found, more]), left, asked, until, kept)
        outcomes = [*(outcome for outcome in outcomes if outcome.killed or outcome.undecided), *second]
    kept.note(outcome.mutant for outcome in outcomes if not outcome.killed)
    return outcomes


def wilson(part: int, whole: int) -> tuple[float, float]:
    """Return the 95 % interval of a share. Source: Wilson, J. Am. Stat. Assoc. 22, 1927."""
    share, z = part / whole, 1.959964
    middle = (share + z**2 / (2 * whole)) / (1 + z**2 / whole)
    half = z / (1 + z**2 / whole) * math.sqrt(share * (1 - share) / whole + z**2 / (4 * whole**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def kept_rows(path: Path) -> list[dict[str, str]]:
    """Lines of a kept table; none where it is not there."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def room_rows(places: dict[str, list], outcomes: list[Outcome], kept: Kept, survivors: list[dict]) -> list[dict]:
    """Lines of the table by room: places for faults, faults drawn and tried, and how the tried ones ended.

    `places`, by room: all places for faults, and those drawn of them.
    """
    rows = []
    for room, (every, chosen) in places.items():
        mine = [outcome for outcome in outcomes if outcome.mutant in set(chosen)]
        killed, undecided = sum(outcome.killed for outcome in mine), sum(outcome.undecided for outcome in mine)
        first = sum(kept.survived_once(outcome.mutant) for outcome in mine)
        same = sum(room_of(row["file"]) == room and row["verdict"].startswith("equivalent") for row in survivors)
        judged = len(mine) - same
        shares = (killed / judged, *wilson(killed, judged)) if judged else ()
        values = (room, len(every), len(chosen), len(mine), first, killed, sum(each.late for each in mine), undecided,
                  len(mine) - killed - undecided, same, *(f"{100 * share:.1f}" for share in shares))  # fmt: skip
        rows.append(dict(zip_longest(COLUMNS, values, fillvalue="")))
    return rows


def with_others(before: list[dict], found: list[dict], tried: set[str]) -> list[dict]:
    """Lines of a table: those found, and of the kept ones those of rooms that were not tried; in the order of rooms."""

    def room(row: dict) -> str:
        """The room of a line, or of the file that it names."""
        return row["room"] if "room" in row else room_of(row["file"])

    return sorted([row for row in before if room(row) not in tried] + found, key=room)


def main(argv: list[str] | None = None) -> None:
    """Draw faults, try them, write the table by room and the list of survivors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--survivors", type=Path, required=True)
    parser.add_argument("--kept", type=Path, default=Path("results/mutants"), help="folder of maps and outcomes")
    parser.add_argument("--count", type=int, default=25, help="faults a room")
    parser.add_argument("--rooms", nargs="*", help="these rooms only")
    parser.add_argument("--near", action="store_true", help="only files of tests named after these rooms, see NEAR")
    parser.add_argument("--files", action="store_true", help="whole files of tests that name a module, without a map")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=40, help="seconds of tests shown to a fault")
    parser.add_argument("--nice", type=int, default=19, help="added to the priority number of the process")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin nothing new after this time")
    asked = parser.parse_args(argv)
    os.nice(asked.nice)
    load(LIBRARIES + TRAINING if "recognition" in (asked.rooms or ["recognition"]) else LIBRARIES)
    until = time.monotonic() + 60 * asked.minutes
    every = rooms(ROOT)
    places = {room: every[room] for room in asked.rooms or every}
    drawn = {
        room: draw(mutants, asked.count, np.random.default_rng([asked.seed, *room.encode()]))
        for room, mutants in places.items()
    }
    in_turn = [mutant for mutant in chain(*zip_longest(*drawn.values())) if mutant]
    kept = Kept(asked.kept / "outcomes.jsonl", ROOT)
    before = kept_rows(asked.survivors)
    again = earlier(ROOT, before, list(chain(*places.values())), in_turn)
    outcomes = looks(ROOT, [*again, *in_turn], asked, until, kept)
    if outcomes is None:
        print(f"time is up; the map of tests goes on with the next call ({asked.kept})")
        return
    verdicts = {(row["file"], row["before"], row["after"]): row["verdict"] for row in before}
    known = [each for each in outcomes if each.mutant in again or kept.survived_once(each.mutant)]
    once = {each.mutant: survivor_row(ROOT, each, verdicts) for each in known}
    of_draw = [row for mutant, row in once.items() if mutant not in again]
    found = room_rows({room: (places[room], drawn[room]) for room in drawn}, outcomes, kept, of_draw)
    write_csv(asked.out, COLUMNS, with_others(kept_rows(asked.out), found, set(drawn)))
    untried = [row for mutant, row in again.items() if mutant not in once]
    write_csv(asked.survivors, SURVIVORS, with_others(before, [*once.values(), *untried], set(drawn)))
    print(f"{len(outcomes)} of {len(in_turn)} faults tried, {sum(each.killed for each in outcomes)} killed")


if __name__ == "__main__":
    main()
