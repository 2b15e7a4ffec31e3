"""What each addition to the paper costs: milliseconds and kilobytes a sample, one subtype a class,
against the paper's.

    python benchmarks/parts.py --out results/benchmarks/parts.csv

Makes each data set anew by the workflow on one core, into results/parts-NAME, and removes it.
Seconds are wall time summed over the jobs of the data's stages, start-up included, so run it on a
quiet machine.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml
from stages import STAGES, measurements

from lowalt.config.layers import merge
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.hardware import describe
from lowalt.shards.index import load

BASE = {
    "targets": {"select": ["DJI Mini 2", "Crow", "AITO M9 2024", "Walking Pedestrian 1"]},
    "motion": {"models": 50, "models_per_chunk": 50},
    "tiles": {"reduced": []},
}
TARGET_LEVELS = {"effects": {"mean_cross_section": {}}}
PARTS = {
    "the paper's images": {},
    "signals instead of images": {"shards": {"kind": "signal"}},
    "cubes, complex64": {"shards": {"kind": "cube"}},
    "cubes, int16": {"shards": {"kind": "cube", "cells": "int16"}},
    "range-Doppler maps as well": {"spectra": {"range_doppler": {"cells": 65, "points": 512}}},
    "noise in every cell, CFAR detector": merge(
        TARGET_LEVELS, {"effects": {"cell_noise": {}, "detector": {}}}
    ),
    "five looks a track": {"motion": {"models": 10, "models_per_chunk": 10, "looks": 5}},
    "one to three companions": {
        "effects": {"companions": {"count": [1, 3], "spread_m": 4.0, "speed_mps": 1.0}}
    },
}
COLUMNS = ("part", "samples", "ms_per_sample", "kb_per_sample", "hardware")


def measured(name: str, overlay: dict) -> dict:
    """Return the table's row of one data set, which is made and removed."""
    run = f"parts-{name}"
    folder = Path("results") / run
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "overlay.yaml"
        path.write_text(yaml.safe_dump(merge(merge(BASE, overlay), {"run": run})))
        words = ["snakemake", "--cores", "1", "--configfile", path, "--", "data"]
        subprocess.run([sys.executable, "-m", *words], check=True)
    index = load(folder / "shards" / "index.json")
    jobs = measurements(folder)
    seconds = sum(
        float(job["s"]) for stage in STAGES if stage != "cloud" for job in jobs.get(stage, [])
    )
    shutil.rmtree(folder)
    samples = index["samples"]
    return {
        "samples": samples,
        "ms_per_sample": f"{1e3 * seconds / samples:.2f}",
        "kb_per_sample": f"{index['bytes'] / samples / 1e3:.0f}",
        "hardware": describe(),
    }


def main() -> None:
    """Make every data set and write the table."""
    line = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args()
    parts = {
        **PARTS,
        **{
            f"scene {path.stem}": load_yaml(path)
            for path in sorted(Path("config/scenes").glob("*fmcw*.yaml"))
        },
    }
    rows = [
        {"part": part, **measured(str(number), overlay)}
        for number, (part, overlay) in enumerate(parts.items())
    ]
    print(json.dumps(rows, indent=1))
    write_csv(options.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
