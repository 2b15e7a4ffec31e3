"""SHA256SUMS in the folder of the index: a line of `sha256sum` for every other file of a data set.

Checksums form a chain: those of samples are in their shard's table, those of tables and shards in
the index, those of the index and the data card here. SHA256SUMS itself needs none: any changed byte
of it contradicts one of the files.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from lowalt.files.atomic import sha256, write_file
from lowalt.shards.sample_table import table_path

NAME = "SHA256SUMS"
CARD = ("README.md", "croissant.json", "samples.csv")
LINE = re.compile(r"([0-9a-f]{64})  ([^\n]+)\n")


def _of_index(index: dict) -> dict[str, str]:
    """Checksums that the index already states: path relative to the index's folder -> SHA-256."""
    sums = {}
    for entry in index["shards"]:
        sums[entry["path"]] = entry["sha256"]
        sums[table_path(entry["path"]).as_posix()] = entry["table_sha256"]
    return sums


def _text(sums: dict[str, str]) -> str:
    """Text of SHA256SUMS, sorted by file name."""
    return "".join(f"{checksum}  {name}\n" for name, checksum in sorted(sums.items()))


def write(index_path: str | Path, index: dict) -> None:
    """Write SHA256SUMS next to an index whose data card is complete.

    Shards are not read again; their checksums are taken from the index.
    """
    folder = Path(index_path).parent
    card = {name: sha256(folder / name) for name in (*CARD, Path(index_path).name)}
    write_file(folder / NAME, _text(_of_index(index) | card))


def faults(index_path: str | Path, index: dict) -> Iterator[str]:
    """Yield one line per fault in the index, the data card and SHA256SUMS, and per foreign file.

    The bytes of shards and tables are not read here; `verify.shard_faults` checks them against the
    index.
    """
    folder = Path(index_path).parent
    path = folder / NAME
    if not path.is_file():
        yield f"{NAME}: missing, so the data card cannot be checked"
        return
    text = path.read_bytes().decode(errors="replace")
    listed = {name: checksum for checksum, name in LINE.findall(text)}
    if text != _text(listed):
        yield f"{NAME}: damaged, expected lines of a SHA-256, two spaces and a name, sorted by name"
    stated = _of_index(index)
    card = {*CARD, Path(index_path).name}
    for name in sorted({*stated, *card, *listed}):
        if name not in listed:
            yield f"{NAME}: no line for {name}"
        elif name in stated:
            if listed[name] != stated[name]:
                yield f"{NAME}: its line for {name} differs from the index"
        elif name not in card:
            yield f"{NAME}: a line for {name}, which is no part of the data set"
        elif not (folder / name).is_file():
            yield f"{name}: missing"
        elif sha256(folder / name) != listed[name]:
            yield f"{name}: damaged (SHA-256 differs from its line in {NAME})"
    known = {*stated, *card, *listed, NAME}
    files = [file for file in folder.rglob("*") if not file.is_dir()]
    present = {file.relative_to(folder).as_posix() for file in files}
    for name in sorted(present - known):
        yield f"{name}: no part of the data set"
