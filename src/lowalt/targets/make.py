"""A target's calibration point cloud from its record, whatever source the record names."""

from pathlib import Path

from lowalt.files.errors import InputError
from lowalt.targets.cloud import Cloud, check


def make(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a merged record from the source it names; `inputs` is the folder of meshes and recordings.

    Raises: InputError where the record or an input is wrong, or a folder is needed and none is given.
    """
    return check(_made(record, inputs, seed), record["subtype"])


def _made(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a merged record, unchecked; arguments and errors as `make`."""
    # Each source imports its own modules, so that a built-in cloud does not wait for the import of pymeshlab.
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
