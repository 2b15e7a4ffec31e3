"""Cubes as a shard stores them: range cells as complex64, or as int16 times a step, and what the
record tells of each.

A step is a power of two, so that nothing but the rounding changes a value: real and imaginary part
come back within half a step, exactly. The largest part of a station's cells has at least 16383
steps, so half a step is at least 90 dB weaker.
"""

import math
from collections.abc import Sequence

import numpy as np

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.shards.clean import complex_signals
from lowalt.shards.sample_record import npy, parts_of
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.tiles.tile_files import npy_header

LARGEST = 2**15 - 1
LEAST_EXPONENT = -149
"""Of the smallest step: float32 has no smaller numbers."""


def rounded(cells: np.ndarray) -> tuple[np.ndarray, float]:
    """Return cells (N, M) complex64 as whole numbers (N, M, 2) int16, real and imaginary part, and
    their step.

    The step is the smallest power of two that leaves every part within 32767 steps, 2**-15 where
    all are zero. Raises: InputError for cells that are not finite.
    """
    parts = parts_of(cells).astype(float)
    largest = float(np.abs(parts).max(initial=0.0))
    if not math.isfinite(largest):
        raise InputError("cells that are not finite, expected numbers")
    exponent = math.frexp(largest)[1] - 15
    exponent += round(math.ldexp(largest, -exponent)) > LARGEST
    step = math.ldexp(1.0, max(exponent, LEAST_EXPONENT))
    return np.rint(parts / step).astype("<i2"), step


def restored(whole: np.ndarray, step: float) -> np.ndarray:
    """Return cells (N, M) complex64 of whole numbers (N, M, 2) int16 and their step."""
    return complex_signals((whole * step).astype("<f4"))


def of_cubes(cubes: Sequence[Cube], network: Network, cell_type: str) -> tuple[bytes, dict]:
    """Return the cubes of a sample as the bytes of an .npy file, (stations, symbols, cells, 2)
    float32 or int16, and what its record tells of each station: the step of whole numbers, the
    chosen cells, and the truth of each symbol to six decimals, of the target and of the others in
    the beam.

    cell_type: "complex64" or "int16". Raises: InputError for cells that are not finite.
    """
    facts = {
        station.name: {
            "chosen": cube.chosen.tolist(),
            **_columns(cube.truth),
            "others": [*map(_columns, cube.others)],
        }
        for station, cube in zip(network.stations, cubes, strict=True)
    }
    if cell_type == "complex64":
        return npy(np.stack([cube.cells for cube in cubes])), facts
    whole, steps = zip(*(rounded(cube.cells) for cube in cubes), strict=True)
    facts = {
        name: {"step": step, **block}
        for (name, block), step in zip(facts.items(), steps, strict=True)
    }
    stored = np.stack(whole)
    return npy_header("<i2", stored.shape) + stored.tobytes(), facts


def _columns(truth: np.ndarray) -> dict[str, list[float]]:
    """The truth of one target, (N, 7), as a record keeps it."""
    return {name: truth[:, place].round(6).tolist() for place, name in enumerate(TRUTH)}


def _truth(columns: dict) -> np.ndarray:
    """The truth (N, 7) that `_columns` kept."""
    return np.column_stack([columns[name] for name in TRUTH])


def cell_type_of(entry: dict) -> str:
    """Return how the cells of a record's sample are stored: "int16" or "complex64"."""
    return (
        "int16" if any("step" in block for block in entry.get("cube", {}).values()) else "complex64"
    )


def cubes_of(entry: dict, stored: np.ndarray) -> list[Cube]:
    """Return the cubes that a record and its array (stations, symbols, cells, 2) hold."""
    blocks = entry["cube"].values()
    if cell_type_of(entry) == "int16":
        cells = [
            restored(whole, block["step"]) for whole, block in zip(stored, blocks, strict=True)
        ]
    else:
        cells = [*complex_signals(stored)]
    return [
        Cube(held, np.array(block["chosen"]), _truth(block), tuple(map(_truth, block["others"])))
        for held, block in zip(cells, blocks, strict=True)
    ]
