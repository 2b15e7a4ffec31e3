"""The stages of a finished run as the workflow ran them: time, share, memory, and what 1.44 million
samples would take.

    python benchmarks/stages.py --run results/default --out results/benchmarks/stages.csv

Reads Snakemake's own measurements (results/<run>/benchmarks) and the run's index; runs nothing.
Seconds are wall time summed over jobs of one thread each, start-up and compilation included, so
they are at most those of one core however many worked; the processor times in those files are
sampled and miss the end of a job. Time of a stage grows with the samples, except that of the
clouds, which are made once. A run of signal shards skips tiles: its figure counts neither the tiles
nor their bytes.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

from lowalt.files.atomic import existing
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.machine.hardware import describe
from lowalt.shards.index import load
from lowalt.shards.sizes import sample_bytes

WHOLE = 1_440_000
STAGES = ("cloud", "motion", "echo", "noise", "tiles", "shard", "index")
COLUMNS = (
    "stage",
    "jobs",
    "samples",
    "wall_s",
    "ms_per_sample",
    "share_percent",
    "peak_mb",
    "largest_input_mb",
    "hours_of_1440000",
    "gb_of_1440000",
    "hardware",
)


def measurements(run: Path) -> dict[str, list[dict]]:
    """Every job's measurement, by rule."""
    found = defaultdict(list)
    for path in sorted((run / "benchmarks").rglob("*.jsonl")):
        for line in path.read_text().splitlines():
            entry = json.loads(line)
            found[entry["rule_name"]].append(entry)
    if not found:
        raise InputError(f"{run}: no measurements in {run / 'benchmarks'}")
    return found


def main() -> None:
    """Summarise and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--run", type=Path, required=True, help="folder of a finished run")
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    index = load(existing(given.run / "shards" / "index.json", "index"))
    found = measurements(given.run)
    samples = index["samples"]
    rows = []
    for stage in STAGES:
        jobs = found.get(stage, [])
        if not jobs:
            continue
        wall = sum(float(job["s"]) for job in jobs)
        hours = wall / 3600 * (1 if stage == "cloud" else WHOLE / samples)
        rows.append(
            {
                "stage": stage,
                "jobs": len(jobs),
                "samples": samples,
                "wall_s": wall,
                "ms_per_sample": 1e3 * wall / samples,
                "hours_of_1440000": hours,
                "peak_mb": max(float(job["max_rss"] or 0) for job in jobs),
                "largest_input_mb": max(sum(job["input_size_mb"].values()) for job in jobs),
            }
        )
    for row in rows:
        row["share_percent"] = 100 * row["wall_s"] / sum(other["wall_s"] for other in rows)
    size = {
        kind: sample_bytes({**index["render"], "shards": {"kind": kind}})
        for kind in ("image", "signal")
    }
    size[index["kind"]] = index["bytes"] / samples
    for kind in ("image", "signal"):
        kept = [row for row in rows if kind == "image" or row["stage"] != "tiles"]
        if kind == "image" and "tiles" not in found:
            continue
        rows.append(
            {
                "stage": f"all, {kind} shards",
                "samples": samples,
                "gb_of_1440000": size[kind] * WHOLE / 1e9,
                **{
                    key: sum(row[key] for row in kept if not row["stage"].startswith("all"))
                    for key in ("wall_s", "ms_per_sample", "hours_of_1440000")
                },
            }
        )
    table = [
        {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
        | {"hardware": describe()}
        for row in rows
    ]
    for row in table:
        print(row)
    write_csv(given.out, COLUMNS, table)


if __name__ == "__main__":
    main()
