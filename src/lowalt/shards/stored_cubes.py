"""Cubes as a shard stores them: range cells as complex64 or as int16 times a step, and facts.

A step is a power of two, so that nothing but the rounding changes a value: real and imaginary part
come back within half a step, exactly. The largest real or imaginary part of a station's cells has
at least 16383 steps, so half a step is at least 90 dB weaker.
"""

import math
from collections.abc import Sequence

import numpy as np

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.shards.clean import complex_signals
from lowalt.shards.sample_record import npy, real_and_imaginary
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.tiles.tile_files import npy_header

LARGEST = 2**15 - 1
LEAST_EXPONENT = -149
"""Of the smallest step: float32 has no smaller numbers."""


def rounded(cells: np.ndarray) -> tuple[np.ndarray, float]:
    """Return cells (N, M) complex64 as whole numbers (N, M, 2) int16, and their step.

    The last axis is real and imaginary part. The step is the smallest power of two that leaves
    both within 32767 steps, 2**-15 where all are zero. Raises: InputError for cells that are not
    finite.
    """
    pairs = real_and_imaginary(cells).astype(float)
    largest = float(np.abs(pairs).max(initial=0.0))
    if not math.isfinite(largest):
        raise InputError("cells that are not finite, expected numbers")
    exponent = math.frexp(largest)[1] - 15
    exponent += round(math.ldexp(largest, -exponent)) > LARGEST
    step = math.ldexp(1.0, max(exponent, LEAST_EXPONENT))
    return np.rint(pairs / step).astype("<i2"), step


def restored(whole: np.ndarray, step: float) -> np.ndarray:
    """Return cells (N, M) complex64 of whole numbers (N, M, 2) int16 and their step."""
    return complex_signals((whole * step).astype("<f4"))


def of_cubes(cubes: Sequence[Cube], network: Network, cell_type: str) -> tuple[bytes, dict]:
    """Return the cubes of a sample as the bytes of an .npy file, and what its record tells of them.

    The file has (stations, symbols, cells, 2) float32 or int16. The record tells of each station
    the step of whole numbers, the chosen cells, and the truth of each symbol to six decimals, of
    the target and of the others in the beam.
    cell_type: "complex64" or "int16". Raises: InputError for cells that are not finite.
    """
    facts = {}
    stored = []
    for station, cube in zip(network.stations, cubes, strict=True):
        block: dict = {}
        if cell_type == "complex64":
            stored.append(cube.cells)
        else:
            whole, block["step"] = rounded(cube.cells)
            stored.append(whole)
        block["chosen"] = cube.chosen.tolist()
        block |= _columns(cube.truth)
        block["others"] = [_columns(truth) for truth in cube.others]
        facts[station.name] = block
    if cell_type == "complex64":
        return npy(np.stack(stored)), facts
    cells = np.stack(stored)
    return npy_header("<i2", cells.shape) + cells.tobytes(), facts


def _columns(truth: np.ndarray) -> dict[str, list[float]]:
    """The truth of one target, (N, 7), as a record keeps it."""
    return {name: truth[:, column].round(6).tolist() for column, name in enumerate(TRUTH)}


def _truth(columns: dict) -> np.ndarray:
    """The truth (N, 7) that `_columns` kept."""
    return np.column_stack([columns[name] for name in TRUTH])


def cell_type_of(entry: dict) -> str:
    """Return how the cells of a record's sample are stored: "int16" or "complex64"."""
    has_step = ["step" in block for block in entry.get("cube", {}).values()]
    return "int16" if any(has_step) else "complex64"


def cubes_of(entry: dict, stored: np.ndarray) -> list[Cube]:
    """Return the cubes that a record and its array (stations, symbols, cells, 2) hold."""
    whole_numbers = cell_type_of(entry) == "int16"
    if not whole_numbers:
        stored = complex_signals(stored)
    cubes = []
    for cells, block in zip(stored, entry["cube"].values(), strict=True):
        if whole_numbers:
            cells = restored(cells, block["step"])
        others = tuple(map(_truth, block["others"]))
        cubes.append(Cube(cells, np.array(block["chosen"]), _truth(block), others))
    return cubes
