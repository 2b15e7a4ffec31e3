"""Command line of the stage: one subtype's record in, its calibration point cloud out."""

import os
from pathlib import Path

from lowalt.config.command import parser, pick, run
from lowalt.targets.cloud import write
from lowalt.targets.make import make


def main(arguments: list[str]) -> None:
    """Write one cloud."""
    line = parser("lowalt.targets", "One subtype's record to its calibration point cloud.")
    folder = os.environ.get("LOWALT_INPUTS")
    help_text = "folder of the meshes and recordings the record names (default: $LOWALT_INPUTS)"
    line.add_argument("--inputs", type=Path, default=folder and Path(folder), help=help_text)
    line.add_argument("--out", required=True, type=Path, help="cloud file to write (.npz)")
    given = line.parse_args(arguments)
    seed, record = pick(given.settings, "seed", "record")
    write(given.out, make(record, given.inputs, seed))


if __name__ == "__main__":
    run(main)
