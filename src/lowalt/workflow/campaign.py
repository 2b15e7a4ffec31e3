"""`python -m lowalt.workflow.campaign`: runs disturbed at random moments and resumed, held against an undisturbed one.

Each trial is a fresh copy of the project. A trial of kills starts the run again after every kill, by the same command,
until it ends well; a trial of a full disk stands on a small file system of its own, which grows before the run is
resumed. At the end every file that does not hold timings must have the bytes of the undisturbed run.
"""

import argparse
import contextlib
import itertools
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psutil

from lowalt.common.command import run
from lowalt.common.csv_tables import write_csv
from lowalt.common.errors import InputError
from lowalt.common.hardware import describe
from lowalt.workflow.disturb import KINDS, MemoryGroup, disturb, one_worker
from lowalt.workflow.trial import ROOT, Trial, copy_project, ended

COLUMNS = ("trial", "kind", "moment_s", "running", "outcome", "said", "identical", "configuration", "hardware")
SMALL_MB, LARGE_MB = 3, 60
EARLY = 0.1
"""Share of the disturbances whose moment counts from the command on, so that they also hit a run that starts."""


def room_mb(written_mb: float, share: float) -> float:
    """Return the room of a disk (MB) that a run of `written_mb` fills: smallest x (largest / smallest)^share.

    share: in [0, 1). largest = min(LARGE_MB, 0.8 written_mb); smallest = min(SMALL_MB, largest / 2).
    """
    largest = min(LARGE_MB, 0.8 * written_mb)
    smallest = min(SMALL_MB, largest / 2)
    return smallest * (largest / smallest) ** share


def killed(trial: Trial, kinds: Iterator[str], length_s: float, left: int, choose: random.Random) -> list[dict]:
    """Disturb a run until it has finished or `left` disturbances are done; return a row for each."""
    rows = []
    while True:
        main, begun = trial.start(), time.monotonic()
        early, wait_s = choose.random() < EARLY, choose.uniform(0.1, length_s)
        kind = next(kinds) if len(rows) < left else None
        if kind is not None:
            # Most moments count from the first job on: a run that is started ten times would else mostly be starting.
            if not early:
                one_worker(main, choose)
            try:
                main.wait(wait_s)
            except psutil.TimeoutExpired:
                now, moment = disturb(kind, main, choose, trial.group), time.monotonic() - begun
                if now is not None:
                    outcome = ended(trial.finish(main))
                    row = {"kind": kind, "moment_s": f"{moment:.1f}", "running": now, "outcome": outcome}
                    rows.append(row | {"said": trial.remarks()})
                    continue
        status = trial.finish(main)
        if status == 0:
            return rows
        raise InputError(f"{trial.folder}: the resumed run ended with {ended(status)}:\n{trial.said[-3000:]}")


def filled(trial: Trial, megabytes: float) -> list[dict]:
    """Run on a disk with so much room, let it grow, resume; return the row of the full disk."""
    begun = time.monotonic()
    status = trial.finish(trial.start())
    row = {"kind": "disk", "moment_s": f"{time.monotonic() - begun:.1f}", "running": f"{megabytes:.0f} MB free"}
    full = "the disk is full" if "disk is full" in trial.said else "no word of the disk"
    row |= {"outcome": ended(status), "said": f"{trial.remarks()}; {full}"}
    subprocess.run(["mount", "-o", "remount,size=8g", trial.folder], check=True)
    status = trial.finish(trial.start())
    if status:
        raise InputError(f"{trial.folder}: the resumed run ended with {ended(status)}:\n{trial.said[-3000:]}")
    return [row]


def campaign(options: argparse.Namespace, work: Path) -> Iterator[dict]:
    """Yield a row of COLUMNS for every disturbance, as each trial ends."""
    choose = random.Random(options.seed)
    group = MemoryGroup(Path(options.memory_group)) if options.memory_group else None
    kinds = [kind for kind in KINDS if kind != "memory" or group]
    order = itertools.cycle(choose.sample(kinds, len(kinds)))
    facts = {"configuration": " ".join(options.configfile + options.targets), "hardware": describe()}
    try:
        # All trials start from one copy, whatever happens to the checkout in the meantime.
        project = work / "project"
        project.mkdir()
        copy_project(ROOT, project)
        trial = Trial(project, work / "undisturbed", options, None)
        begun = time.monotonic()
        status = trial.finish(trial.start())
        if status:
            raise InputError(f"the undisturbed run ended with {ended(status)}:\n{trial.said[-3000:]}")
        length_s, expected, done, number = time.monotonic() - begun, trial.whole(), 0, 0
        written_mb = trial.written_mb()
        print(f"undisturbed: {length_s:.0f} s, {len(expected)} files", file=sys.stderr, flush=True)
        for _ in range(options.disks):
            number += 1
            folder = work / f"disk-{number}"
            folder.mkdir()
            megabytes = room_mb(written_mb, choose.random())
            with _small_disk(folder):
                trial = Trial(project, folder, options, None)
                room = shutil.disk_usage(folder).used + int(1e6 * megabytes)
                subprocess.run(["mount", "-o", f"remount,size={room}", folder], check=True)
                yield from _judged(number, filled(trial, megabytes), trial, expected, facts)
        while done < options.kills:
            number += 1
            trial = Trial(project, work / f"kill-{number}", options, group)
            left = min(options.kills - done, options.kills_per_run)
            rows = killed(trial, order, 2 * length_s / options.kills_per_run, left, choose)
            done += len(rows)
            yield from _judged(number, rows, trial, expected, facts)
    finally:
        if group:
            group.remove()


def _judged(number: int, rows: list[dict], trial: Trial, expected: dict[str, str], facts: dict) -> Iterator[dict]:
    """The rows of a finished trial, with the verdict on its files; a trial whose files are right is removed."""
    found = trial.whole()
    differing = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    verdict = "yes" if not differing else f"no: {len(differing)} files, first {differing[0]}"
    for row in rows:
        yield {"trial": number, **row, "identical": verdict, **facts}
    if not differing:
        for path in trial.folder.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()


@contextlib.contextmanager
def _small_disk(folder: Path) -> Iterator[Path]:
    """A file system in memory at a folder, for the length of a block."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8g", "lowalt", folder], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


def main(arguments: list[str]) -> None:
    """Disturb runs at random moments, resume them, and compare their bytes with those of an undisturbed run."""
    options = argparse.ArgumentParser(prog="python -m lowalt.workflow.campaign", description=main.__doc__)
    options.add_argument("--configfile", nargs="+", default=["config/tiny.yaml"], help="overlays (default: tiny)")
    options.add_argument("--targets", nargs="*", default=[], help="targets of the run (default: all)")
    options.add_argument("--kills", type=int, default=30, help="disturbances in all (default 30)")
    options.add_argument("--kills-per-run", type=int, default=10, help="at most so many to one run (default 10)")
    options.add_argument("--disks", type=int, default=5, help="full disks; needs root (default 5)")
    options.add_argument("--cores", type=int, default=2, help="cores of every run (default 2)")
    options.add_argument("--seed", type=int, default=1, help="seed of moments, kinds and sizes (default 1)")
    options.add_argument("--memory-group", help="folder of a memory control group that may be extended, for 'memory'")
    options.add_argument("--work", help="folder for the copies (default: a temporary one)")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    work = Path(given.work or tempfile.mkdtemp(prefix="lowalt-campaign-"))
    work.mkdir(parents=True, exist_ok=True)
    rows = []
    for row in campaign(given, work):
        rows.append(row)
        # After every row: a campaign that is ended early keeps what it has found.
        write_csv(given.out, COLUMNS, rows)
        print(*(row[name] for name in COLUMNS[:7]), sep=", ", file=sys.stderr, flush=True)
    bad = [row for row in rows if row["identical"] != "yes"]
    if bad:
        raise InputError(f"{given.out}: {len(bad)} of {len(rows)} disturbances ended in other bytes")
    if not given.work:
        shutil.rmtree(work)


if __name__ == "__main__":
    run(main)
