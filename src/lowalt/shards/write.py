"""One shard: samples of a chunk in one fold, in an order drawn from their names, with a table."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import CATEGORIES, label
from lowalt.config.network import Network
from lowalt.config.splits import FOLDS, fold
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.shards.clean import recipe_record
from lowalt.shards.sample_list import model_key, sample_key
from lowalt.shards.sample_record import rank, record
from lowalt.shards.sample_table import EXTENSIONS, KINDS, SAMPLE, table_path
from lowalt.shards.sample_table import write as write_table
from lowalt.shards.tar import Span, Writer

Content = Callable[[int, int], tuple[bytes, dict]]
"""Given (row of the motion table, SNR index), returns the bytes of the member that stands next to
the record, and what the record says of cubes ({} for other kinds).
"""


class ChunkSamples(NamedTuple):
    """The samples of a chunk: every motion model at every SNR.

    rows: the motion table; snrs: dB; split, seed: determine each sample's fold; classes: in the
    order of their labels; powers: (stations, rows) W, reference powers of the SNRs, None: the
    echoes' own powers; filters: the effects that filter the noise, by name. Only shards of kind
    "recipe" store powers and filters.
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
    ranked = []
    for index, row in enumerate(rows):
        subtype = row["subtype"]
        # All looks along one track share a fold, so that a test sees no track of the training.
        model_or_track = row.get("track", row["model"])
        for level, snr_db in enumerate(snrs):
            # The row of a measured sample names its fold; that of a simulated sample is drawn.
            fold_name = row.get("fold") or fold(split, seed, subtype, model_or_track, snr_db)
            if fold_name == wanted:
                ranked.append((rank(seed, subtype, row["model"], snr_db), index, level))
    return [(index, level) for _, index, level in sorted(ranked)]


def _of_piece(chosen: Chosen, piece: int, pieces: int) -> Chosen:
    """The samples of one of the pieces of a fold: its motion models are dealt out in turn."""
    piece_of_row: dict[int, int] = {}
    for index, _ in chosen:
        if index not in piece_of_row:
            piece_of_row[index] = len(piece_of_row) % pieces
    return [(index, level) for index, level in chosen if piece_of_row[index] == piece]


def _record(chunk: ChunkSamples, index: int, level: int, fold_name: str, cubes: dict) -> bytes:
    """The record of one sample of a chunk."""
    row = chunk.rows[index]
    snr_db = chunk.snrs[level]
    return record(row, snr_db, fold_name, chunk.seed, chunk.network, chunk.classes, cubes)


def _entry(chunk: ChunkSamples, index: int, level: int, span: Span) -> tuple:
    """A sample's row of the shard's table (`sample_table.SAMPLE`)."""
    row = chunk.rows[index]
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
    for index, level in chosen:
        row = chunk.rows[index]
        key = sample_key(row["subtype"], row["model"], chunk.snrs[level])
        data, cubes = content(index, level)
        text = _record(chunk, index, level, wanted, cubes)
        span = tar.add(key, text, EXTENSIONS[kind], data)
        entries.append(_entry(chunk, index, level, span))
    return entries


def _add_models(
    tar: Writer, chunk: ChunkSamples, chosen: Chosen, wanted: str, content: Content
) -> list[tuple]:
    """Add each motion model of a chunk to a recipe shard, where its first sample comes.

    Return the rows of its table; those of all samples of a motion model refer to the model.
    """
    levels: dict[int, list[int]] = {}
    for index, level in chosen:
        levels.setdefault(index, []).append(level)
    spans: dict[int, Span] = {}
    entries = []
    for index, level in chosen:
        if index not in spans:
            row = chunk.rows[index]
            data, cubes = content(index, level)
            name = model_key(row["subtype"], row["model"])
            snrs_db = sorted(chunk.snrs[each] for each in levels[index])
            power_w = None if chunk.powers is None else chunk.powers[:, index]
            text = _record(chunk, index, level, wanted, cubes)
            of_model = recipe_record(text, name, snrs_db, power_w, chunk.filters)
            spans[index] = tar.add(name, of_model, EXTENSIONS["recipe"], data)
        entries.append(_entry(chunk, index, level, spans[index]))
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
    content: see `Content`; its bytes are those of the sample's .png (kind "image") or .npy, or of
    the row's clean echoes (kind "recipe"). A recipe shard stores each motion model once, at the
    position of its first sample, to which all its samples refer.
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
    of_fold = select(chunk.rows, chunk.snrs, chunk.split, chunk.seed, wanted)
    chosen = _of_piece(of_fold, *piece)
    with replacing(path) as temporary:
        with temporary.open("wb") as file:
            tar = Writer(file)
            if kind == "recipe":
                entries = _add_models(tar, chunk, chosen, wanted, content)
            else:
                entries = _add_samples(tar, chunk, chosen, wanted, kind, content)
            checksum = tar.close_with_checksum()
        table = np.array(entries, SAMPLE)
        # Looked for among the keys as the table stores them, and before the block ends, so that a
        # shard with a sample twice never replaces the file at `path`.
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
