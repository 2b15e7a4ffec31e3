"""The index of a data set: all shards with group, fold, counts, checksums, and how to render.

It is made from the headers of the shards' tables, without reading the shards. Offsets and SHA-256
of samples are in the shards' tables, and the tables' SHA-256 in the index, so one checksum of the
index covers everything.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from lowalt.config.classes import CATEGORIES
from lowalt.config.schema import check_brought
from lowalt.files.atomic import existing, sha256, write_file
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object
from lowalt.shards.sample_table import read_header, table_path

FORMAT = "lowalt-shards-2"
WHAT = "an index of shards"
READABLE = ("lowalt-shards-1", FORMAT)
"""Readable formats. In the first, records contain nulls and an SNR of \"inf\", and signals are
complex64.
"""


def build(
    shards: Sequence[str | Path],
    render: dict,
    out: str | Path,
    echo: dict | None = None,
    classes: tuple[str, ...] = CATEGORIES,
) -> dict:
    """Write the index of these shards to `out` and return it.

    render: the settings that turn signals into tiles ({network, spectra, images}); echo: those that
    turn motion into echoes ({tolerance, effects}), needed to remake samples; classes: in the order
    of their labels, stored only if they are not the published ones. Paths in the index are relative
    to its folder.
    Raises: InputError where a table is missing, a name appears twice or the kinds differ.
    """
    entries = []
    for shard in map(Path, shards):
        table = table_path(shard)
        header = read_header(table)
        existing(shard, "shard")
        if shard.stat().st_size != header["bytes"]:
            raise InputError(
                f"{shard}: {shard.stat().st_size} bytes, its table says {header['bytes']}"
            )
        path = _relative(shard, Path(out))
        entries.append({**header, "path": path, "table_sha256": sha256(table)})
    names = [entry["name"] for entry in entries]
    kinds = sorted({entry["kind"] for entry in entries})
    if len(set(names)) < len(names) or len(kinds) != 1:
        raise InputError(
            f"{out}: {len(names)} shards of kinds {kinds}, expected names once and one kind"
        )
    index = {
        "format": FORMAT,
        "kind": kinds[0],
        "samples": sum(entry["samples"] for entry in entries),
        "bytes": sum(entry["bytes"] for entry in entries),
        "render": render,
        "echo": echo,
        "shards": sorted(entries, key=lambda entry: entry["name"]),
    }
    if classes != CATEGORIES:
        index["classes"] = list(classes)
    index["sha256"] = _checksum(index)
    write_file(out, json.dumps(index, indent=1, sort_keys=True) + "\n")
    return index


def _checksum(index: dict) -> str:
    """SHA-256 of everything in an index except the checksum itself."""
    content = {name: value for name, value in index.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _relative(shard: Path, index: Path) -> str:
    """Path of a shard relative to the folder of the index.

    Raises: InputError where the shard is not below that folder.
    """
    try:
        return shard.resolve().relative_to(index.resolve().parent).as_posix()
    except ValueError:
        raise InputError(
            f"{shard}: not below the folder of the index, {index.resolve().parent}"
        ) from None


def load(path: str | Path) -> dict:
    """Return an index from disk.

    Raises: InputError naming the file where it is missing or no index, or the setting in it that is
    wrong.
    """
    existing(path, "index")
    return checked(read_object(path, WHAT), path)


def checked(index: dict, path: str | Path) -> dict:
    """Return an index that was read from `path`, after its check; no shard lies outside its folder.

    Raises: InputError naming `path` where it is damaged or no index, or the setting in it that is
    wrong.
    """
    try:
        written = index["format"]
        stated = index["sha256"]
        computed = _checksum(index)
    except KeyError as error:
        raise InputError(f"{path}: not an index of shards, it has no {error}") from None
    if written not in READABLE:
        raise InputError(f"{path}: format {written!r}, expected one of {READABLE}")
    if stated != computed:
        raise InputError(f"{path}: the index is damaged (SHA-256 differs)")
    check_brought("index", index, path)
    for entry in index["shards"]:
        shard = PurePosixPath(entry["path"])
        if shard.is_absolute() or ".." in shard.parts:
            raise InputError(f"{path}: shard {entry['path']!r} lies outside the index's folder")
    return index
