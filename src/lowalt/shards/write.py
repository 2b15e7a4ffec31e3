"""One shard: the samples of a chunk that belong to one fold, shuffled by their names, with their
table.
"""

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
    order of their labels;
    powers: (stations, rows) W, reference powers of the SNRs, None for those of the echoes;
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


def select(
    rows: list[dict], snrs: list[float], split: dict, seed: int, wanted: str
) -> list[tuple[int, int]]:
    """Return (row, SNR index) of the samples of the fold `wanted`, in the shuffled order of the
    shard.
    """
    chosen = []
    for number, row in enumerate(rows):
        for level, snr_db in enumerate(snrs):
            # The row of a measured sample names its fold; that of a simulated sample is drawn.
            dealt = row.get("fold") or fold(
                split, seed, row["subtype"], row.get("track", row["model"]), snr_db
            )
            if dealt == wanted:
                chosen.append((rank(seed, row["subtype"], row["model"], snr_db), number, level))
    return [(number, level) for _, number, level in sorted(chosen)]


def _entry(key: str, number: int, model: int, snr_db: float, span: Span) -> tuple:
    """Return a sample's row of the table (`sample_table.SAMPLE`); number: its label."""
    digest = np.frombuffer(span.sha256, np.uint8)
    return key, number, model, snr_db, span.offset, span.size, *span.record, *span.data, digest


def write_shard(
    path: str | Path,
    chunk: ChunkSamples,
    wanted: str,
    kind: str,
    content: Content,
    piece: tuple[int, int] = (0, 1),
) -> dict:
    """Write the samples of the fold `wanted` to `path` (.tar) and their table next to it; return
    the table's header.

    content: a function of (row, SNR index) that returns the bytes of the sample's .png (kind
    "image") or .npy, or of the row's clean echoes (kind "recipe"), and the part of the record about
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
    rows, snrs, split, seed, network, classes, powers, filters = chunk
    groups = sorted({row["group"] for row in rows})
    if len(groups) != 1:
        raise InputError(f"{path}: its motion table has the groups {groups}, expected exactly one")
    chosen = select(rows, snrs, split, seed, wanted)
    turns: dict[int, int] = {}
    for number, _ in chosen:
        turns.setdefault(number, len(turns) % piece[1])
    chosen = [(number, level) for number, level in chosen if turns[number] == piece[0]]
    table = np.zeros(len(chosen), SAMPLE)
    levels: dict[int, list[float]] = {}
    for number, level in chosen:
        levels.setdefault(number, []).append(snrs[level])
    with replacing(path) as temporary:
        with temporary.open("wb") as file:
            tar = Writer(file)
            spans: dict[int, Span] = {}
            for place, (number, level) in enumerate(chosen):
                row = rows[number]
                snr_db = snrs[level]
                key = sample_key(row["subtype"], row["model"], snr_db)
                span = spans.get(number)
                if span is None:
                    data, cubes = content(number, level)
                    name = key
                    text = record(row, snr_db, wanted, seed, network, classes, cubes)
                    if kind == "recipe":
                        name = model_key(row["subtype"], row["model"])
                        power_w = None if powers is None else powers[:, number]
                        text = packed(text, name, sorted(levels[number]), power_w, filters)
                    span = tar.add(name, text, EXTENSIONS[kind], data)
                    if kind == "recipe":
                        spans[number] = span
                table[place] = _entry(key, label(classes, row), row["model"], snr_db, span)
            checksum = tar.close()
        keys, counts = np.unique(table["key"], return_counts=True)
        if (counts > 1).any():
            twice = keys[counts > 1][0].decode()
            raise InputError(
                f"{path}: sample {twice!r} stands twice, expected each motion model of a subtype once"
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
