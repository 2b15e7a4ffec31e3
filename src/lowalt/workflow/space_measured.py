"""`python -m lowalt.workflow.space_measured`: fit lines to the disk and memory of jobs in finished runs.

Bytes are those of the files that a run left. Peak memory comes from each job's log or from a table of stages.
"""

import argparse
import json
import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from lowalt.common.command import run
from lowalt.common.config import load_yaml
from lowalt.common.csv_tables import read_csv, write_csv
from lowalt.common.errors import InputError
from lowalt.common.plan import Plan
from lowalt.common.shipped import located
from lowalt.common.splits import FOLDS
from lowalt.targets.records import records_of
from lowalt.workflow.space import COLUMNS, units

OUTPUTS = {
    "cloud": "clouds/{subtype}.npz",
    "motion": "motion/{group}-{part}.csv",
    "echo": "echo/{group}-{part}/{station}.npy",
    "noise": "noisy/{group}-{part}.npy",
    "tiles": "shards/{group}-*-{part}.tar",
    "shard": "shards/{group}-{fold}-{part}.*",
    "views": "views/{size}/{group}-{fold}-{part}.npz",
    "train": "models/{protocol}/{scheme}/{train_seed}/*",
    "evaluate": "predictions/{protocol}/{scheme}/{train_seed}.*",
}
"""Files of a run that one job of a rule leaves. Tiles are gone at the end; the shards hold the same images."""
TEMPORARY = ("tiles",)
ROUNDING = 1e-6
"""A slope that adds less than this share of the largest value is set to zero: it is rounding."""
PEAK = re.compile(r"peak memory (\d+) MiB")


def line(points: list[tuple[float, float]]) -> tuple[float, float]:
    """Return base and slope of a line that no measured (units, value) lies above; neither is negative.

    The slope is the least-squares one; the base lifts the line to the highest point.
    """
    size, value = np.array(points, float).T
    spread = size - size.mean()
    slope = max(0.0, float(spread @ (value - value.mean()) / (spread @ spread))) if spread.any() else 0.0
    if slope * size.max() < ROUNDING * value.max():
        slope = 0.0
    base = float(np.max(value - slope * size))
    if base < 0:
        return 0.0, float(np.max(value / size))
    return base, slope


def _plan(config: dict) -> Plan:
    """The plan of the run of a configuration."""
    records = records_of(config["targets"])
    return Plan.of(config, {name: record["published"] for name, record in records.items()})


def jobs(folder: Path) -> list[tuple[str, float, float, float]]:
    """Return (rule, units, bytes of its outputs, peak memory in bytes) of every job of a finished run.

    Raises: InputError naming the folder where it holds no benchmarks.
    """
    config = located(load_yaml(folder / "config.yaml"))
    plan, found = _plan(config), []
    for path in sorted((folder / "benchmarks").rglob("*.jsonl")):
        row = json.loads(path.read_text().splitlines()[-1])
        rule, wildcards = row["rule_name"], row["wildcards"]
        log = (folder / "logs" / path.relative_to(folder / "benchmarks")).with_suffix(".log")
        peaks = PEAK.findall(log.read_text()) if log.is_file() else []
        memory = 2**20 * (float(peaks[-1]) if peaks else float(row["max_rss"]))
        names = defaultdict(lambda: "*", wildcards)
        pattern = OUTPUTS.get(rule)
        size = sum(file.stat().st_size for file in folder.glob(pattern.format_map(names))) if pattern else 0
        found.append((rule, units(rule, wildcards, plan, config), float(size), memory))
    if not found:
        raise InputError(f"{folder}: no benchmarks of finished jobs")
    return found


def largest(path: Path, config: dict) -> list[tuple[str, float, float]]:
    """Return (rule, units, peak memory in bytes) of the largest jobs of a run by its table of stages, stages.csv.

    config: the run's merged configuration.
    """
    plan = _plan(config)
    group = max(plan.groups, key=lambda name: len(plan.groups[name]))
    chunk = {"group": group, "part": "00000"}
    fold = chunk | {"fold": max(FOLDS, key=lambda name: plan.split[name])}
    names = dict.fromkeys(("motion", "echo", "noise", "tiles"), chunk) | dict.fromkeys(("shard", "views"), fold)
    if config["echo"]["job"] == "station":
        names["echo"] = chunk | {"station": next(iter(config["network"]["stations"]))}
    return [
        (row["rule"], units(row["rule"], names.get(row["rule"], {}), plan, config), 2**20 * float(row["peak_mib"]))
        for row in read_csv(path, "rule", "peak_mib")
    ]


def measure(folders: list[Path], stages: Path | None = None, config: dict | None = None) -> list[dict]:
    """Return a row of COLUMNS for every rule of finished runs; two runs of different size tell base and slope apart.

    stages, config: the table of stages of one more run and its configuration, for peak memory.
    """
    disk, memory, runs = defaultdict(list), defaultdict(list), defaultdict(set)
    for rule, size, held in largest(stages, config) if stages else []:
        memory[rule].append((size, held))
        runs[rule].add(stages.stem)
    for folder in folders:
        for rule, size, written, held in jobs(folder):
            disk[rule].append((size, written))
            memory[rule].append((size, held))
            runs[rule].add(folder.name)
    rows = []
    for rule in sorted(disk):
        disk_base, disk_slope = line(disk[rule])
        # Jobs of one run differ too little in size to tell how memory grows.
        points = memory[rule] if len(runs[rule]) > 1 else [(0.0, max(held for _, held in memory[rule]))]
        memory_base, memory_slope = line(points)
        figures = (disk_base, disk_slope, memory_base / 2**20, memory_slope)
        texts = [f"{value:.6g}" for value in figures]
        temporary = "yes" if rule in TEMPORARY else "no"
        rows.append(dict(zip(COLUMNS, [rule, " ".join(sorted(runs[rule])), *texts, temporary], strict=True)))
    return rows


def main(arguments: list[str]) -> None:
    """Measure the disk and memory of the jobs of finished runs and write the table of figures."""
    options = argparse.ArgumentParser(prog="python -m lowalt.workflow.space_measured", description=main.__doc__)
    options.add_argument("--runs", nargs="+", required=True, type=Path, help="folders of finished runs, small to large")
    options.add_argument("--stages", type=Path, help="table of stages of one more run (stages.csv), for peak memory")
    options.add_argument("--config", help="configuration of that run (.yaml)")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    write_csv(given.out, COLUMNS, measure(given.runs, given.stages, load_yaml(given.config) if given.config else None))


if __name__ == "__main__":
    run(main)
