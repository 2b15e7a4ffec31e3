"""Command line of the stage: one subtype's record in, its calibration point cloud out."""

from lowalt.config.command import run
from lowalt.targets.cloud import write
from lowalt.targets.make import make, options


def main(arguments: list[str]) -> None:
    """Write one cloud."""
    about = "One subtype's record to its calibration point cloud."
    record, inputs, seed, out = options("lowalt.targets", about, arguments)
    write(out, make(record, inputs, seed))


if __name__ == "__main__":
    run(main)
