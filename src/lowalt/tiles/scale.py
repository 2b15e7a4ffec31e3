"""Maps amplitudes to 256 index values.

The scale is a list of thresholds, for which there are lookup tables.

With x = value / the image's own largest |value|, and y = f(x) in [0, 1],
    linear   y = x
    decibel  y = max(0, 1 + 20 log10(x) / floor_db)
    power    y = x^gamma
a spectrum of magnitudes takes the index floor(255 y + 1/2), a signed one 128 +- floor(127 y + 1/2),
exactly symmetric about 128. Every f increases, so an index is the number of thresholds that x
reaches. Thresholds are computed once in float64 and comparisons are exact, so no pixel needs a
logarithm. An image of zeros gets 0 (128 if signed).
"""

from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable

SCALES = ("linear", "decibel", "power")


@dataclass(frozen=True)
class Scale:
    """An amplitude scale.

    name: of SCALES; floor_db: > 0, decibel only; gamma: > 0, power only.
    """

    name: str = "decibel"
    floor_db: float = 40.0
    gamma: float = 1.0

    def __post_init__(self) -> None:
        if self.name not in SCALES:
            raise InputError(f"images.scale is {self.name!r}, expected one of {SCALES}")
        for key, value, low, high in (
            ("floor_db", self.floor_db, 1, 140),
            ("gamma", self.gamma, 0.2, 2),
        ):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not is_number or not low <= value <= high:
                raise InputError(
                    f"images.{key} is {value!r}, expected a number from {low} to {high}"
                )

    def thresholds(self, levels: int) -> np.ndarray:
        """Return the x at which the index rises to 1 .. levels, (levels,) float64.

        They ascend in (0, 1).
        """
        y = (np.arange(1, levels + 1) - 0.5) / levels
        if self.name == "decibel":
            return portable.exp(self.floor_db * (y - 1) * (portable.LN_10 / 20))
        if self.name == "linear":
            return y
        return portable.power(y, 1 / self.gamma)


@dataclass(frozen=True)
class Lookup:
    """Tables that map a float32 x in [0, 1] to its index with one comparison.

    A key is the leading bits of x above `lowest`; `base[key]` counts the thresholds below the key's
    interval and `cut[key]` is the one inside it (2 where there is none).
    """

    lowest: np.int32
    shift: np.int32
    base: np.ndarray
    cut: np.ndarray


def lookup(scale: Scale, levels: int) -> Lookup:
    """Return the tables of a scale with `levels` thresholds, rounded to float32.

    A key has enough mantissa bits that no interval contains two thresholds.
    """
    thresholds = scale.thresholds(levels).astype(np.float32)
    bits = thresholds.view(np.int32)
    top = int(np.float32(1).view(np.int32))
    power_below = np.ldexp(np.float32(1), np.frexp(thresholds[0])[1] - 1)
    lowest = int(power_below.view(np.int32))
    shift = 0
    keys = bits
    for mantissa in range(6, 24):
        shift = 23 - mantissa
        keys = (bits - lowest) >> shift
        if len(np.unique(keys)) == levels:
            break
    count = ((top - lowest) >> shift) + 1
    base = np.searchsorted(keys, np.arange(count), side="left").astype(np.int32)
    cut = np.full(count, 2, np.float32)
    cut[keys] = thresholds
    return Lookup(np.int32(lowest), np.int32(shift), base, cut)
