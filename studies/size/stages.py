"""What each stage of a finished data set took, for a million samples.

    python studies/size/stages.py --run results/paper --out studies/size/results/stages.csv

Reads the measurements that Snakemake leaves of each job. Processor time is sampled, so jobs of less
than a second have none; their time by the clock is an upper bound for it. Both are sums over the
jobs of a stage.
"""

import argparse
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.report.stage_times import stage_times
from lowalt.shards import ShardSet

COLUMNS = (
    "stage",
    "jobs",
    "clock_s",
    "processor_s",
    "processor_s_per_million",
    "peak_mib",
    "bytes_per_sample",
    "samples",
    "hardware",
)
FILES = {
    "cloud": "clouds/*.npz",
    "motion": "motion/*.csv",
    "echo": "echo/*/*.npy",
    "noise": "noisy/*.npy",
    "shard": "shards/*.tar",
    "index": "shards/index.json",
}
"""What a stage leaves on disk."""


def main(arguments: list[str]) -> None:
    """Write the table."""
    line = argparse.ArgumentParser("stages.py", description=__doc__.splitlines()[0])
    line.add_argument("--run", type=Path, required=True, help="folder of a finished run")
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    samples = len(ShardSet(given.run / "shards/index.json", check=False))
    rows = []
    found = {
        one["rule"]: one for one in stage_times(sorted((given.run / "benchmarks").rglob("*.jsonl")))
    }
    for name in (name for name in FILES if name in found):
        stage = found[name]
        stored = sum(path.stat().st_size for path in given.run.glob(FILES[name]))
        rows.append(
            [
                name,
                stage["jobs"],
                f"{stage['wall_s']:.0f}",
                f"{stage['cpu_s']:.0f}",
                f"{1e6 * stage['cpu_s'] / samples:.0f}",
                f"{stage['peak_mib']:.0f}",
                f"{stored / samples:.0f}",
                samples,
                describe(),
            ]
        )
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
