"""A target's calibration point cloud from its record, whatever source the record names."""

from importlib import import_module
from pathlib import Path

from lowalt.files.errors import InputError
from lowalt.targets.cloud import Cloud, check
from lowalt.targets.records import SOURCES


def make(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a merged record from the source it names; `inputs` is the folder of meshes and recordings.

    Raises: InputError where the record or an input is wrong, or a folder is needed and none is given.
    """
    source = record.get("source")
    if source not in SOURCES:
        raise InputError(f"settings: record.source is {source!r}, expected one of {SOURCES}")
    if source in ("mesh", "mocap") and inputs is None:
        raise InputError(f"{record['subtype']}: source {source} needs the folder of real inputs, expected --inputs DIR")
    # Each source imports its own modules, so that a built-in cloud does not wait for the import of pymeshlab.
    made = getattr(import_module(f"lowalt.targets.{source}"), f"{source}_cloud")
    return check(made(record, inputs, seed) if source in ("mesh", "mocap") else made(record, seed), record["subtype"])
