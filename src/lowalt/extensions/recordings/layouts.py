"""Orders in which a file's numbers hold the samples of a complex channel, and which of them fits
the numbers.

    iqiq   in-phase and quadrature in turn
    iiqq   all in-phase values, then all quadrature values
    dca2   two and two, I0 I1 Q0 Q1: TI's DCA1000 with two lanes (xWR16xx, 18xx, 68xx)
    dca4   I of four receivers, then Q of the four: TI's DCA1000 with four lanes (xWR12xx, 14xx)
    polar  two columns, magnitude and phase
Source of the lanes: Texas Instruments, application report SWRA581, Mmwave Radar Device ADC Raw Data
Capture.
"""

from typing import NamedTuple

import numpy as np

from lowalt.extensions.recordings.evidence import code_bits, step_bits
from lowalt.files.errors import InputError

GROUPS = {"iqiq": 2, "iiqq": 2, "dca2": 4, "dca4": 8}
"""Numbers in the smallest whole group of each order."""
TYPES = (
    "int16",
    "uint8",
    "int8",
    "float32",
    "int16_be",
    "uint16",
    "float64",
    "int32",
    "float32_be",
    "uint16_be",
    "int32_be",
)
"""Types that bytes without a header are tried as, the usual ones first."""
HALVES = 0.01
"""Bits per number by which the rarer orders must fit better, I and Q in two halves and four lanes:
few receivers write so, many have a real channel or two lanes."""
LATER = 0.002
"""Bits per number by which a reading must fit better than a more usual one."""
CONTRADICTED = 0.06
"""Advantage, in bits per number, with which another reading contradicts a record. True readings of
simulated echoes lose at most 0.02 (`benchmarks/recording_layouts.py`)."""
MOST = 1 << 22
"""Number of numbers, from the start of a file, that are used as evidence."""


class Reading(NamedTuple):
    """One way to read numbers: their type ("" where the file says it), their order ("" for one real
    channel), and the bits per byte that the samples take under it."""

    dtype: str
    layout: str
    bits: float


def number_type(name: str) -> np.dtype:
    """Return the type that a record's `dtype` names: little-endian, big-endian where it ends in
    _be.
    """
    return np.dtype(name.removesuffix("_be")).newbyteorder(">" if name.endswith("_be") else "<")


def parted(numbers: np.ndarray, layout: str, where: str) -> list[np.ndarray]:
    """Return the complex channels (samples,) complex128 of numbers (n,) in an order of `GROUPS`,
    one a receiver.

    Raises: InputError naming `where` for complex numbers, or a count that is no multiple of the
    order's group.
    """
    group = GROUPS[layout]
    if np.iscomplexobj(numbers) or len(numbers) % group:
        count = "an even number" if group == 2 else f"a multiple of {group}"
        raise InputError(
            f"{where}: {len(numbers)} numbers {numbers.dtype}, expected {count} of real ones for "
            f"layout {layout!r}"
        )
    if layout == "iiqq":
        whole = numbers.reshape(2, -1, 1)
    elif layout == "iqiq":
        whole = numbers.reshape(-1, 2, 1).swapaxes(0, 1)
    else:
        whole = numbers.reshape(-1, 2, group // 2).swapaxes(0, 1)
    whole = whole.astype(np.float64)
    channels = whole[0] + 1j * whole[1]
    return [channels.ravel()] if layout == "dca2" else list(channels.T)


def readings(numbers: np.ndarray, dtype: str = "") -> list[Reading]:
    """Return the readings of real numbers (n,) of one type, those of the fewest bits first."""
    numbers = numbers[: min(MOST, len(numbers)) // 8 * 8]
    step = step_bits(numbers)
    found = []
    for layout in ("iqiq", "", "iiqq", *(("dca2", "dca4") if numbers.dtype.itemsize == 2 else ())):
        with np.errstate(all="ignore"):
            channels = parted(numbers, layout, "") if layout else [numbers]
        bits = code_bits(channels, step) + HALVES * (layout in ("iiqq", "dca4"))
        found.append(Reading(dtype, layout, bits / numbers.dtype.itemsize))
    return _ranked(found)


def raw_readings(path: str) -> list[Reading]:
    """Return the readings of a file without a header as numbers of any type of `TYPES`, those of
    the fewest bits first.

    A reading whose values are not finite is left out.
    """
    data = np.memmap(path, np.uint8, "r")
    found = []
    for name in TYPES:
        kind = number_type(name)
        numbers = data[: len(data) // kind.itemsize * kind.itemsize][: MOST * kind.itemsize].view(
            kind
        )
        if len(data) % kind.itemsize == 0 and len(numbers) >= 64:
            found += readings(numbers.astype(kind.newbyteorder("=")), name)
    return _ranked([reading for reading in found if np.isfinite(reading.bits)])


def _ranked(found: list[Reading]) -> list[Reading]:
    """Readings by their bits, in the given order where they differ by less than `LATER` a place."""
    return [
        reading
        for _, reading in sorted(enumerate(found), key=lambda pair: pair[1].bits + LATER * pair[0])
    ]


def contradiction(found: list[Reading], dtype: str, layout: str) -> str:
    """Return the reading of `found` that fits so much better than the stated one that the stated
    one must be wrong.

    Empty where none does. One real channel and I and Q in two halves are never held against each
    other: a signal with equal sides of the Doppler axis reads alike under both.
    """
    stated = [reading for reading in found if (reading.dtype, reading.layout) == (dtype, layout)]
    alike = {layout} | ({"", "iiqq"} if layout in ("", "iiqq") else set())
    best = next(iter(found), None)
    if best is None or (best.dtype == dtype and best.layout in alike):
        return ""
    size = number_type(dtype).itemsize if dtype else 1
    if stated and (stated[0].bits - best.bits) * size < CONTRADICTED:
        return ""
    words = [f"dtype {best.dtype!r}"] if best.dtype != dtype else []
    words.append(f"layout {best.layout!r}" if best.layout else "one real channel without layout")
    return " and ".join(words)
