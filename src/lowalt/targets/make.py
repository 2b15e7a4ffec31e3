"""Make the calibration point cloud of a target from any source that its record may name."""

from pathlib import Path
from types import ModuleType

from lowalt.files.errors import InputError
from lowalt.targets.cloud import Cloud, check

SOURCES = ("builtin", "mesh", "mocap", "gait")
"""The sources of clouds.

The module of a source defines `check_record(merged, where)` and `SOURCE_cloud`.
"""


def source_module(source: str) -> ModuleType:
    """Return the module of one of SOURCES, imported at the call.

    A built-in cloud waits for no reader of files.
    """
    if source == "mesh":
        from lowalt.targets import mesh

        return mesh
    if source == "mocap":
        from lowalt.targets import mocap

        return mocap
    if source == "gait":
        from lowalt.targets import gait

        return gait
    from lowalt.targets import builtin

    return builtin


def refuse_source(record: dict, inputs: Path | None) -> None:
    """Refuse a record of an unknown source, and one of files where there is no folder of `inputs`.

    Raises: InputError naming the source or the subtype.
    """
    source = record.get("source")
    if source not in SOURCES:
        raise InputError(f"settings: record.source is {source!r}, expected one of {SOURCES}")
    if source in ("mesh", "mocap") and inputs is None:
        raise InputError(
            f"{record['subtype']}: source {source} needs the folder of real inputs, expected "
            "--inputs DIR"
        )


def make(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a merged record from the source it names.

    inputs: the folder of meshes and recordings.

    Raises: InputError where the record or an input is wrong, or a folder is needed and none is
    given.
    """
    refuse_source(record, inputs)
    source = record["source"]
    cloud_of = getattr(source_module(source), f"{source}_cloud")
    if source in ("mesh", "mocap"):
        cloud = cloud_of(record, inputs, seed)
    else:
        cloud = cloud_of(record, seed)
    return check(cloud, record["subtype"])
