"""The windows of a recording: coherent intervals at a radar's symbol rate, with their spectra,
tiles and a shard.

All of them are made by the functions that simulated signals use.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.recordings.channel import coherent_intervals, symbol_rate
from lowalt.extensions.recordings.faults import clipped, lost
from lowalt.extensions.recordings.files import Baseband, read
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import Twin
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.motion.table import NUMBERS
from lowalt.shards.index import build
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.spectra import trp, vrp, vt
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer

CLIPPED_SHARE = 1e-3
"""A window with this share of its samples in clipped peaks, or lost, or more, is left out."""
SPLIT = {"by": "motion", "train": 1, "val": 0, "test": 1}


def at_symbol_rate(record: Record, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's signal (symbols,) complex128 at the twin's symbol rate.

    baseband: the recording's samples where they have been read already. Where the radar has one
    real channel, the first of a recording's two is taken.
    Raises: InputError as `read`, naming the file: for a real recording where the radar has two
    channels, and for one slower than one sample per symbol.
    """
    values, rate_hz = baseband or read(record)
    if record.channel == "real" and twin.channel == "complex":
        raise InputError(
            f"{record.file}: channel 'real', but the radar has a complex channel, expected in-phase"
            " and quadrature"
        )
    if record.channel == "complex" and twin.channel == "real":
        values = values.real
    try:
        return symbol_rate(values, rate_hz, twin.symbol_interval_s, twin.sampling)
    except InputError as error:
        raise InputError(f"{record.file}: {error}") from None


class Looks(NamedTuple):
    """A recording's coherent intervals (n, symbols) complex128, which of them the receiver has
    clipped, and of which samples are lost, both (n,) bool."""

    intervals: np.ndarray
    clipped: np.ndarray
    lost: np.ndarray


def looks(record: Record, twin: Twin, baseband: Baseband | None = None) -> Looks:
    """Return a recording's coherent intervals at the twin's symbol rate. A clipped or lost stretch
    costs its own ones only.

    Raises: InputError as `at_symbol_rate`, and where the recording is shorter than a window or
    clipped in all of them.
    """
    baseband = baseband or read(record)
    signal = at_symbol_rate(record, twin, baseband)
    intervals = coherent_intervals(signal, twin.symbols, str(record.file), twin.slow)
    edges = np.arange(len(intervals) + 1) * twin.symbols * twin.symbol_interval_s * baseband.rate_hz
    share = _shares(clipped(baseband.values), edges)
    gone = _shares(lost(baseband.values), edges) > CLIPPED_SHARE
    if gone.all():
        raise InputError(
            f"{record.file}: samples are lost in every window, exact zeros in a row, expected a"
            " recording without gaps"
        )
    if (share > CLIPPED_SHARE).all():
        raise InputError(
            f"{record.file}: clipped, {100 * share.mean():.3g} % of the samples stick to the"
            f" extremes {baseband.values.real.min():.6g} and {baseband.values.real.max():.6g}, in"
            f" every window of {twin.symbols * twin.symbol_interval_s:.3g} s"
        )
    return Looks(intervals, share > CLIPPED_SHARE, gone)


def _shares(marked: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Share (n,) of the marked samples (samples,) bool between each of n + 1 edges and the next, in
    samples.
    """
    counts = np.concatenate([[0], np.cumsum(marked)])
    return np.diff(counts[np.minimum(np.rint(edges).astype(int), len(counts) - 1)]) / np.diff(edges)


def windows(record: Record, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's windows (n, symbols) complex128: its coherent intervals that are not
    clipped and of which no sample is lost.

    Raises: InputError as `looks`.
    """
    found = looks(record, twin, baseband)
    return found.intervals[~(found.clipped | found.lost)]


def spectra(intervals: np.ndarray, twin: Twin) -> dict[str, np.ndarray]:
    """Return the three spectra of intervals (n, symbols): vrp, trp and vt, each (n, rows, columns)."""
    settings = twin.spectra()
    return {
        "vrp": vrp(intervals, settings),
        "trp": trp(intervals, settings),
        "vt": vt(intervals, twin.carrier_hz, twin.symbol_interval_s, settings),
    }


def _row(record: Record, number: int) -> dict:
    """The motion row of a window: every number is NaN, since the target's motion is not known."""
    return {
        "subtype": record.name,
        "category": record.label,
        "group": "seen",
        "model": number,
        "fold": "test",
        **dict.fromkeys(NUMBERS, math.nan),
    }


def write(record: Record, radar: Twin, images: dict, folder: str | Path) -> int:
    """Write a recording's signals.npy, spectra.npz (of the first window), tile PNGs and, where it
    has a label, a shard with its index below `folder`; return the number of windows.

    images: the configuration's `images` block. Raises: InputError as `windows`.
    """
    twin = radar.at_carrier(record.carrier_hz)
    folder = Path(folder)
    intervals = windows(record, twin).astype(np.complex64)
    made_with = {
        "network": twin.network_settings(),
        "spectra": twin.spectra_settings(),
        "images": images,
    }
    renderer = Renderer.from_settings(made_with)
    tiles = [
        encode(renderer.tile(interval[None]), renderer.images.palette) for interval in intervals
    ]
    with replacing(folder / "signals.npy") as temporary:
        np.save(temporary, intervals)
    with replacing(folder / "spectra.npz") as temporary:
        np.savez(
            temporary, **{name: values[0] for name, values in spectra(intervals[:1], twin).items()}
        )
    for number, tile in enumerate(tiles):
        with replacing(folder / "tiles" / f"{number:06d}.png") as temporary:
            temporary.write_bytes(tile)
    if record.label is not None:
        shard = folder / "shards" / "recording.tar"
        rows = [_row(record, number) for number in range(len(tiles))]
        chunk = ChunkSamples(rows, [math.inf], SPLIT, 0, renderer.network)
        write_shard(shard, chunk, "test", "image", lambda number, _: (tiles[number], {}))
        build([shard], made_with, folder / "shards/index.json")
    return len(tiles)
