"""Command line of the stage: one subtype's record in, its calibration point cloud out."""

import os
from pathlib import Path

from lowalt.config.command import parser, pick, run
from lowalt.machine.environment import INPUTS
from lowalt.targets.cloud import write
from lowalt.targets.make import make


def options(
    module: str, description: str, arguments: list[str]
) -> tuple[dict, Path | None, int, Path]:
    """Return record, folder of inputs, seed and output file of a command line of this stage."""
    line = parser(module, description)
    help_text = f"folder of the meshes and recordings the record names (default: ${INPUTS})"
    line.add_argument("--inputs", type=Path, default=os.environ.get(INPUTS) or None, help=help_text)
    line.add_argument("--out", required=True, type=Path, help="file to write (.npz)")
    asked = line.parse_args(arguments)
    seed, record = pick(asked.settings, "seed", "record")
    return record, asked.inputs, seed, asked.out


def main(arguments: list[str]) -> None:
    """Write one cloud."""
    about = "One subtype's record to its calibration point cloud."
    record, inputs, seed, out = options("lowalt.targets", about, arguments)
    write(out, make(record, inputs, seed))


if __name__ == "__main__":
    run(main)
