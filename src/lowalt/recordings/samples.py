"""A recording as samples of the data set: signals, tiles and shards, by the functions that simulated signals use."""

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np

from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.motion.table import NUMBERS
from lowalt.recordings.channel import coherent_intervals
from lowalt.recordings.record import Record
from lowalt.recordings.sets import at_carrier, sampled
from lowalt.recordings.twin import Twin
from lowalt.shards.index import build
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.spectra import trp, vrp, vt
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer
from lowalt.tiles.settings import Images

SPLIT = {"by": "motion", "train": 1, "val": 0, "test": 1}


def signals(record: Record, twin: Twin) -> np.ndarray:
    """Return a recording's coherent intervals (n, symbols) complex64 at the twin's symbol rate, its mean removed.

    Raises: InputError as `sets.sampled`, and where the recording is shorter than a window.
    """
    return coherent_intervals(sampled(record, twin), twin.symbols, name=str(record.file)).astype(np.complex64)


def spectra(intervals: np.ndarray, twin: Twin) -> dict[str, np.ndarray]:
    """Return the three spectra of intervals (n, symbols): vrp, trp and vt, each (n, rows, windows)."""
    settings = twin.spectra()
    return {
        "vrp": vrp(intervals, settings),
        "trp": trp(intervals, settings),
        "vt": vt(intervals, twin.carrier_hz, twin.symbol_interval_s, settings),
    }


def _row(record: Record, number: int) -> dict:
    """The motion row of a window: every number is NaN, since the target's motion is not known."""
    return {
        "subtype": record.name, "category": record.label, "group": "seen", "model": number,
        **dict.fromkeys(NUMBERS, math.nan),
    }  # fmt: skip


def write(record: Record, twin: Twin, images: dict, folder: str | Path) -> int:
    """Write a recording's signals.npy, spectra.npz (of the first window), tile PNGs and, where it has a label, a shard
    with its index below `folder`; return the number of windows.

    images: the configuration's `images` block. Raises: InputError as `signals`.
    """
    own, folder = at_carrier(twin, record.carrier_hz), Path(folder)
    intervals = signals(record, own)
    settings = Images.from_settings(images)
    network = own.network(own.symbols)
    renderer = Renderer(network, own.spectra(), settings)
    tiles = [encode(renderer.tile(interval[None]), settings.palette) for interval in intervals]
    with replacing(folder / "signals.npy") as temporary:
        np.save(temporary, intervals)
    with replacing(folder / "spectra.npz") as temporary:
        np.savez(temporary, **{name: values[0] for name, values in spectra(intervals[:1], own).items()})
    for number, tile in enumerate(tiles):
        with replacing(folder / "tiles" / f"{number:06d}.png") as temporary:
            temporary.write_bytes(tile)
    if record.label is not None:
        rows = [_row(record, number) | {"fold": "test"} for number in range(len(tiles))]
        shard = folder / "shards" / "recording.tar"
        chunk = ChunkSamples(rows, [math.inf], SPLIT, 0, network)
        write_shard(shard, chunk, "test", "image", lambda number, _: (tiles[number], {}))
        build(
            [shard],
            {"network": block(own), "spectra": spectra_block(own), "images": images},
            folder / "shards/index.json",
        )
    return len(tiles)


def block(twin: Twin) -> dict:
    """Return the twin's network as a configuration's `network` block, which an index of shards carries."""
    return {
        "carrier_hz": twin.carrier_hz, "subcarrier_spacing_hz": 1.0, "subcarriers": 1, "guard_subcarriers": 0,
        "symbol_interval_s": twin.symbol_interval_s, "symbols": twin.symbols, "transmit_array": [1, 1],
        "receive_array": [1, 1], "power_w": 1.0, "stations": {"A": {"position_m": [0.0, 0.0, 0.0], "normal_deg": 90.0}},
    }  # fmt: skip


def spectra_block(twin: Twin) -> dict:
    """Return the twin's spectra as a configuration's `spectra` block."""
    return {name: asdict(settings) for name, settings in twin.spectra().items()}


def write_table(path: str | Path, columns: tuple[str, ...], rows: list) -> None:
    """Write rows as CSV; floats with five significant digits, NaN as an empty cell."""
    write_csv(path, columns, ([_cell(value) for value in row] for row in rows))


def _cell(value: object) -> object:
    """Return a value as a cell of the table."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.5g}"
    return value
