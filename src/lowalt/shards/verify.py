"""Checks every byte of every file of a data set and names each fault."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from tarfile import BLOCKSIZE

import numpy as np

from lowalt.files.atomic import sha256
from lowalt.files.errors import InputError
from lowalt.shards import checksums
from lowalt.shards.index import load
from lowalt.shards.sample_table import map_samples, table_path
from lowalt.shards.tar import RECORD

FROZEN = "clouds", "motion"
"""Folders of a run whose files the first training freezes."""


def faults(index_path: str | Path) -> Iterator[str]:
    """Yield one line per fault of a published data set: the file, the sample, and what is wrong.

    First the shards and their tables are checked against the index. Then come all other files of
    the folder, against SHA256SUMS (a file without checksum is a fault), and the clouds and motion
    tables of the run, against `frozen`.
    Raises: InputError where the index itself cannot be read.
    """
    index = load(index_path)
    folder = Path(index_path).parent
    for entry in index["shards"]:
        yield from shard_faults(folder / entry["path"], entry)
    yield from checksums.faults(index_path, index)
    run = folder.resolve().parent
    present: set[str] = set()
    for stage in FROZEN:
        present |= {f"{stage}/{path.name}" for path in (run / stage).glob("*")}
    for name, checksum in frozen(index_path).items():
        if name not in present:
            yield f"../{name}: missing"
        elif sha256(run / name) != checksum:
            yield f"../{name}: has changed since it was frozen in ../{checksums.NAME}"


def frozen(index_path: str | Path) -> dict[str, str]:
    """Return the checksums, by file, of the clouds and motion tables of the index's run.

    The first training writes them into SHA256SUMS of the run's folder; without that file the result
    is empty.
    """
    path = Path(index_path).resolve().parent.parent / checksums.NAME
    if not path.is_file():
        return {}
    lines = checksums.LINE.findall(path.read_text(errors="replace"))
    return {name: checksum for checksum, name in lines if name.partition("/")[0] in FROZEN}


def shard_faults(path: Path, entry: dict) -> Iterator[str]:
    """Yield the faults of one shard and its table against the shard's entry of the index.

    If the SHA-256 of the shard is right, its samples are not checked one by one.
    """
    table = table_path(path)
    if not table.is_file():
        yield f"{table.name}: missing"
    elif sha256(table) != entry["table_sha256"]:
        yield f"{table.name}: the table is damaged (SHA-256 differs)"
    if not path.is_file():
        yield f"{path.name}: missing"
        return
    if path.stat().st_size == entry["bytes"] and sha256(path) == entry["sha256"]:
        return
    try:
        samples = map_samples(table)
    except InputError:
        yield f"{path.name}: damaged, and its table cannot tell where"
        return
    for line in _locate(path, samples, entry["bytes"]):
        yield f"{path.name}: {line}"


def _locate(path: Path, samples: np.ndarray, expected: int) -> Iterator[str]:
    """Faults of a shard known to be damaged, sample by sample, then those of the other bytes."""
    size = path.stat().st_size
    if size != expected:
        yield f"{size} bytes, expected {expected}"
    end = 0
    named = size != expected
    with path.open("rb") as file:
        for row in samples:
            # The samples of one motion model share their bytes in recipe shards.
            end = max(end, int(row["offset"]) + int(row["size"]))
            file.seek(int(row["offset"]))
            data = file.read(int(row["size"]))
            key = row["key"].decode(errors="replace")
            if len(data) < row["size"]:
                yield f"sample {key} is cut off or missing"
                named = True
            elif hashlib.sha256(data).digest() != row["sha256"].tobytes():
                yield f"sample {key} is damaged (SHA-256 differs)"
                named = True
        file.seek(end)
        # A damaged table may leave nearly the whole shard.
        ended = max(0, size - end) >= 2 * BLOCKSIZE
        while ended and (tail := file.read(RECORD)):
            ended = not tail.strip(b"\0")
    if not ended:
        yield "the end of the archive is damaged"
    elif not named:
        yield "SHA-256 differs"
