"""The sample table of a shard, `{shard}.npz` next to `{shard}.tar`: a row per sample, a header.

    header    str, JSON: name, kind, group, fold, samples, bytes, sha256
    samples   (n,) structured, in the order of the tar (offsets and sizes in bytes)

The table is stored uncompressed, so that a loader maps it into memory instead of reading it.
"""

import json
from pathlib import Path

import numpy as np

from lowalt.files.archives import write_arrays
from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import existing, replacing
from lowalt.files.errors import InputError
from lowalt.files.json_objects import json_object
from lowalt.tiles.tile_files import map_array

SAMPLE = np.dtype(
    [
        ("key", "S96"),
        ("label", "<i8"),
        ("model", "<i8"),
        ("snr_db", "<f8"),
        ("offset", "<i8"),
        ("size", "<i8"),
        ("record_offset", "<i8"),
        ("record_size", "<i8"),
        ("data_offset", "<i8"),
        ("data_size", "<i8"),
        ("sha256", "u1", (32,)),
    ]
)
MOST_OVERHEAD_BYTES = 1 << 16
"""Most bytes of a table next to its rows: the header and what the archive adds."""
LARGEST_SAMPLE = 1 << 30
LARGEST_OFFSET = 1 << 50
"""Largest size of a sample, and place in a shard (bytes): a sample is read as a whole."""
KINDS = ("image", "signal", "recipe", "cube")
"""Tiles as PNG files, noisy signals, clean echoes from which noisy signals are made
(`lowalt.shards.clean`), or all range cells with noise."""
EXTENSIONS = {"image": "png", "signal": "npy", "recipe": "clean.npy", "cube": "cube.npy"}
"""Of the member next to a sample's record."""


def table_path(shard: str | Path) -> Path:
    """Return the path of a shard's table."""
    return Path(shard).with_suffix(".npz")


def write(path: str | Path, header: dict, samples: np.ndarray) -> None:
    """Write header and rows; equal content, equal bytes."""
    text = np.array(json.dumps(header, sort_keys=True))
    with replacing(path) as temporary:
        write_arrays(temporary, {"header": text, "samples": samples})


def read_header(path: str | Path) -> dict:
    """Return the header of a shard's table.

    Raises: InputError naming the file where it is missing or damaged.
    """
    checked_archive(path, "shard table")
    try:
        with np.load(path, allow_pickle=False) as data:
            return json_object(str(data["header"]), path, "a shard table")
    except UNREADABLE as error:
        raise InputError(f"{path}: not a shard table ({error})") from error


def map_samples(path: str | Path) -> np.ndarray:
    """Return the rows of a shard's table as a read-only memory map.

    Raises: InputError naming the file where it is missing or damaged, and the first row whose places
    or sizes no sample has.
    """
    samples = map_array(existing(path, "shard table"), "samples.npy")
    if samples.dtype != SAMPLE:
        raise InputError(f"{path}: columns {samples.dtype.names}, expected {SAMPLE.names}")
    places = np.stack([samples[name] for name in ("offset", "record_offset", "data_offset")])
    sizes = np.stack([samples[name] for name in ("size", "record_size", "data_size")])
    wrong = (places < 0) | (places > LARGEST_OFFSET) | (sizes < 0) | (sizes > LARGEST_SAMPLE)
    rows = np.flatnonzero(wrong.any(axis=0))
    if len(rows):
        raise InputError(
            f"{path}: row {rows[0]} has a place or a size of a sample in its shard that "
            f"no sample has, expected sizes from 0 to {LARGEST_SAMPLE} bytes"
        )
    return samples
