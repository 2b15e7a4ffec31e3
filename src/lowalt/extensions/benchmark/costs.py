"""What making the data of a track costs: processor time and disk space, as measured on runs.

`costs.csv` has a row for the signals and shards of each part, and one for the images of each group
and fold.
"""

from pathlib import Path
from typing import NamedTuple

from lowalt.extensions.benchmark.benchmark_tracks import Track
from lowalt.extensions.benchmark.definition import MAIN, PARTS, REFERENCE, run_name
from lowalt.files.csv_tables import number, read_csv, write_csv
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.machine.hardware import describe
from lowalt.machine.job_times import job_times

NAME = "costs.csv"
COLUMNS = ("part", "files", "core_s", "megabytes", "hardware")
SHARED = "signals and shards"
"""The files of a part that every track needs which trains or tests on it."""


class TrackCost(NamedTuple):
    """Processor time (core-seconds) and disk space (MB)."""

    core_s: float
    megabytes: float

    @property
    def words(self) -> str:
        """The cost as text, with the minutes on two cores."""
        core_minutes = self.core_s / 60
        minutes = core_minutes / 2
        return f"{self.core_s:.0f} core-s, {minutes:.1f} min on two cores, {self.megabytes:.0f} MB"


def parts_of(tracks: list[Track]) -> dict[str, set[tuple[str, str]]]:
    """Return the (group, fold) pairs whose images some tracks need, by part.

    All tracks train on the main part.
    """
    found: dict[str, set[tuple[str, str]]] = {MAIN: set()}
    for track in tracks:
        for use in ("train", "validation", "test"):
            part = track.part if use == "test" else MAIN
            facts = track.samples(use).facts
            pairs = zip(facts.group.tolist(), facts.fold.tolist(), strict=True)
            found.setdefault(part, set()).update(pairs)
    return found


def cost_of(tracks: list[Track]) -> TrackCost | None:
    """Return the cost of making all data of some tracks; None where a part has not been measured.

    Raises: InputError where the table of costs is missing or wrong.
    """
    path = shipped(f"{REFERENCE}/{NAME}")
    rows = {}
    for row in read_csv(path, *COLUMNS, what="table of costs"):
        core_s = number(row, "core_s", path)
        megabytes = number(row, "megabytes", path)
        rows[row["part"], row["files"]] = TrackCost(core_s, megabytes)
    found = []
    for part, pairs in parts_of(tracks).items():
        needed = [SHARED]
        for group, fold in pairs:
            needed.append(f"images {group}-{fold}")
        for files in needed:
            if (part, files) not in rows:
                return None
            found.append(rows[part, files])
    return TrackCost(sum(one.core_s for one in found), sum(one.megabytes for one in found))


def measured(part: str, folder: str | Path) -> list[tuple]:
    """Return the rows of a part whose run is in a folder, from the kept times of its jobs.

    Raises: InputError where the run's times are missing.
    """
    run = Path(folder) / run_name(part)
    core_s: dict[str, float] = {SHARED: 0.0}
    megabytes: dict[str, float] = {SHARED: 0.0}
    times = sorted((run / "benchmarks").rglob("*.jsonl"))
    if not times:
        raise InputError(
            f"{run}/benchmarks: no times of jobs, expected those of `lowalt benchmark make`"
        )
    for path in times:
        files = _files_of(path.relative_to(run / "benchmarks"))
        core_s[files] = core_s.get(files, 0.0) + job_times(path).processor_s
    for path in sorted(run.rglob("*")):
        if path.is_file():
            files = _files_of(path.relative_to(run))
            megabytes[files] = megabytes.get(files, 0.0) + path.stat().st_size / 1e6
    hardware = describe()
    rows = []
    for files in sorted(core_s):
        rows.append((part, files, f"{core_s[files]:.1f}", f"{megabytes[files]:.1f}", hardware))
    return rows


def _files_of(path: Path) -> str:
    """Return what the column `files` says of a file of a run, or of the times of its job."""
    if path.parts[0] != "views":
        return SHARED
    group, fold, _ = path.stem.split("-")
    return f"images {group}-{fold}"


def write(folder: str | Path, out: str | Path) -> None:
    """Write the costs of the parts whose runs are in a folder.

    The table keeps the rows of all other parts.
    """
    path = Path(out) / NAME
    kept = {}
    if path.is_file():
        for row in read_csv(path, *COLUMNS, what="table of costs"):
            kept[row["part"], row["files"]] = tuple(row[name] for name in COLUMNS)
    for part in PARTS:
        if (Path(folder) / run_name(part)).is_dir():
            for part_row in measured(part, folder):
                _, files, *_ = part_row
                kept[part, files] = part_row
    order = sorted(kept, key=lambda name: (PARTS.index(name[0]), name[1]))
    write_csv(path, COLUMNS, [kept[name] for name in order])
