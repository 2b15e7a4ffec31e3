"""One shard: the samples of a chunk in one fold, shuffled by their names, with their table."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import CATEGORIES, label
from lowalt.config.network import Network
from lowalt.config.splits import FOLDS, fold
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.shards.clean import packed
from lowalt.shards.sample_list import model_key, sample_key
from lowalt.shards.sample_record import rank, record
from lowalt.shards.sample_table import EXTENSIONS, KINDS, SAMPLE, table_path
from lowalt.shards.sample_table import write as write_table
from lowalt.shards.tar import Span, Writer

Content = Callable[[int, int], tuple[bytes, dict]]


class ChunkSamples(NamedTuple):
    """The samples of a chunk: every motion model at every SNR.

    rows: the motion table; snrs: dB; split, seed: determine each sample's fold; classes: in the
    order of their labels; powers: (stations, rows) W, reference powers of the SNRs, None for those
    of the echoes;
    filters: the effects that filter the noise, by name (both for kind "recipe").
    """

    rows: list[dict]
    snrs: list[float]
    split: dict
    seed: int
    network: Network
    classes: tuple[str, ...] = CATEGORIES
    powers: np.ndarray | None = None
    filters: Mapping[str, dict] = {}


Chosen = list[tuple[int, int]]
"""(row, SNR index) of samples of a chunk, in the order of their shard."""


def select(rows: list[dict], snrs: list[float], split: dict, seed: int, wanted: str) -> Chosen:
    """Return (row, SNR index) of the samples of the fold `wanted`, in the shard's order."""
    chosen = []
    for number, row in enumerate(rows):
        model = row.get("track", row["model"])
        for level, snr_db in enumerate(snrs):
            # The row of a measured sample names its fold; that of a simulated sample is drawn.
            of_sample = row.get("fold") or fold(split, seed, row["subtype"], model, snr_db)
            if of_sample == wanted:
                chosen.append((rank(seed, row["subtype"], row["model"], snr_db), number, level))
    return [(number, level) for _, number, level in sorted(chosen)]


def _of_piece(chosen: Chosen, piece: int, pieces: int) -> Chosen:
    """The samples of one of the pieces of a fold: its motion models are dealt out in turn."""
    piece_of: dict[int, int] = {}
    for number, _ in chosen:
        piece_of.setdefault(number, len(piece_of) % pieces)
    return [(number, level) for number, level in chosen if piece_of[number] == piece]


def _record(chunk: ChunkSamples, number: int, level: int, fold_name: str, cubes: dict) -> bytes:
    """The record of one sample of a chunk."""
    row = chunk.rows[number]
    snr_db = chunk.snrs[level]
    return record(row, snr_db, fold_name, chunk.seed, chunk.network, chunk.classes, cubes)


def _entry(chunk: ChunkSamples, number: int, level: int, span: Span) -> tuple:
    """A sample's row of the shard's table (`sample_table.SAMPLE`)."""
    row = chunk.rows[number]
    snr_db = chunk.snrs[level]
    key = sample_key(row["subtype"], row["model"], snr_db)
    digest = np.frombuffer(span.sha256, np.uint8)
    names = (key, label(chunk.classes, row), row["model"], snr_db)
    return *names, span.offset, span.size, *span.record, *span.data, digest


def _add_samples(
    tar: Writer, chunk: ChunkSamples, chosen: Chosen, wanted: str, kind: str, content: Content
) -> list[tuple]:
    """Add the samples of a chunk to a shard; return the rows of its table."""
    entries = []
    for number, level in chosen:
        row = chunk.rows[number]
        key = sample_key(row["subtype"], row["model"], chunk.snrs[level])
        data, cubes = content(number, level)
        text = _record(chunk, number, level, wanted, cubes)
        span = tar.add(key, text, EXTENSIONS[kind], data)
        entries.append(_entry(chunk, number, level, span))
    return entries


def _add_models(
    tar: Writer, chunk: ChunkSamples, chosen: Chosen, wanted: str, content: Content
) -> list[tuple]:
    """Add each motion model of a chunk to a recipe shard, where its first sample comes.

    Return the rows of its table; those of all samples of a motion model refer to the model.
    """
    levels: dict[int, list[int]] = {}
    for number, level in chosen:
        levels.setdefault(number, []).append(level)
    spans: dict[int, Span] = {}
    entries = []
    for number, level in chosen:
        if number not in spans:
            row = chunk.rows[number]
            data, cubes = content(number, level)
            name = model_key(row["subtype"], row["model"])
            snrs_db = sorted(chunk.snrs[each] for each in levels[number])
            power_w = None if chunk.powers is None else chunk.powers[:, number]
            text = _record(chunk, number, level, wanted, cubes)
            text = packed(text, name, snrs_db, power_w, chunk.filters)
            spans[number] = tar.add(name, text, EXTENSIONS["recipe"], data)
        entries.append(_entry(chunk, number, level, spans[number]))
    return entries


def write_shard(
    path: str | Path,
    chunk: ChunkSamples,
    wanted: str,
    kind: str,
    content: Content,
    piece: tuple[int, int] = (0, 1),
) -> dict:
    """Write the samples of the fold `wanted` to `path` (.tar) and their table next to it.

    Return the table's header.
    content: a function of (row, SNR index) that returns the bytes of the sample's .png (kind
    "image") or .npy, or of the row's clean echoes (kind "recipe"), and what the record says of
    cubes ({} for other kinds). A recipe shard stores each motion model once, at the position of its
    first sample, to which all its samples refer.
    piece: index and number of the pieces into which the fold is split; samples of a motion model
    stay together.
    Raises: InputError where the chunk mixes groups, has a sample twice, or fold or kind is unknown.
    """
    if wanted not in FOLDS or kind not in KINDS:
        raise InputError(
            f"{path}: fold {wanted!r} of kind {kind!r}, expected one of {FOLDS} and of {KINDS}"
        )
    groups = sorted({row["group"] for row in chunk.rows})
    if len(groups) != 1:
        raise InputError(f"{path}: its motion table has the groups {groups}, expected exactly one")
    chosen = _of_piece(select(chunk.rows, chunk.snrs, chunk.split, chunk.seed, wanted), *piece)
    with replacing(path) as temporary:
        with temporary.open("wb") as file:
            tar = Writer(file)
            if kind == "recipe":
                entries = _add_models(tar, chunk, chosen, wanted, content)
            else:
                entries = _add_samples(tar, chunk, chosen, wanted, kind, content)
            checksum = tar.close()
        table = np.array(entries, SAMPLE)
        keys, counts = np.unique(table["key"], return_counts=True)
        if (counts > 1).any():
            twice = keys[counts > 1][0].decode()
            raise InputError(
                f"{path}: sample {twice!r} stands twice, expected each motion model of a subtype "
                "once"
            )
        header = {
            "name": Path(path).name,
            "kind": kind,
            "group": groups[0],
            "fold": wanted,
            "samples": len(table),
            "bytes": tar.size,
            "sha256": checksum,
        }
        write_table(table_path(path), header, table)
    return header
