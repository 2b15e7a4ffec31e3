"""Command line of the stage: one subtype's record in, its calibration point cloud out."""

import os
from pathlib import Path

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.targets.cloud import Cloud, write


def make(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a merged record from the source it names; `inputs` is the folder of meshes and recordings.

    Raises: InputError where the record or an input is wrong, or a folder is needed and none is given.
    """
    # Imports wait for the source: a built-in cloud must not pay for pymeshlab.
    source = record.get("source")
    if source == "builtin":
        from lowalt.targets.builtin import builtin_cloud

        return builtin_cloud(record, seed)
    if source == "gait":
        from lowalt.targets.gait import gait_cloud

        return gait_cloud(record, seed)
    if source not in ("mesh", "mocap"):
        raise InputError(f"settings: record.source is {source!r}, expected builtin, mesh, mocap or gait")
    if inputs is None:
        raise InputError(f"{record['subtype']}: source {source} needs the folder of real inputs, expected --inputs DIR")
    if source == "mesh":
        from lowalt.targets.mesh import mesh_cloud

        return mesh_cloud(record, inputs, seed)
    from lowalt.targets.mocap import mocap_cloud

    return mocap_cloud(record, inputs, seed)


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
