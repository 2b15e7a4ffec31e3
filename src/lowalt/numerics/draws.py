"""Random numbers that are the same with every version of NumPy and on every processor.

NumPy guarantees the streams of its bit generators, but not how a `Generator` turns bits into
numbers. Only the raw 64-bit words are therefore taken from NumPy. The transforms are defined here,
in operations that IEEE 754 specifies:

    random       the word's upper 53 bits times 2^-53
    uniform      low + (high - low) random
    integers     Lemire's method on 32-bit halves, the lower half of a word first
    permutation  Fisher and Yates's shuffle from the last position p down. The partner of p is
                 given by the lowest bits of a 32-bit half, as many as p has; where that is above
                 p, the next half is taken. Choice without replacement is the tail.
    normal       Box and Muller's method on two words: sqrt(-2 ln u) cos(2 pi v), followed by
                 sqrt(-2 ln u) sin(2 pi v), with
                     u = (upper 53 bits of the first word + 1) 2^-53
                     v = (upper 53 bits of the second word) 2^-53

All other methods are still NumPy's, without this guarantee.
Sources: Lemire 2019, ACM TOMACS 29(1); Box and Muller 1958; NumPy NEP 19.
"""

import math
import sys
from functools import lru_cache

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics.portable import log, sine_cosine_turns

Size = int | tuple[int, ...] | None
_HALF = np.uint64(0xFFFFFFFF)
_HALVES = 2**32
"""How many values a 32-bit half has."""
_SURPLUS = np.uint64(11)
"""Bits of a 64-bit word that a float64 between 0 and 1 cannot hold."""
COMPILED = 4096
"""Number of normals from which on loading compiled code pays; it gives the same bits faster."""


def _count(size: Size) -> int:
    """How many numbers an array of this size has; None means one number."""
    if size is None:
        return 1
    if isinstance(size, tuple):
        return math.prod(size)
    return int(size)


def _shaped(values: np.ndarray, size: Size):
    """The one value as a number, or all in the shape asked for."""
    if size is None:
        return values[0].item()
    return values.reshape(size)


@lru_cache(maxsize=256)
def _masks(count: int) -> list[int]:
    """For each number below `count`, a mask of as many low bits as the number has."""
    return [(1 << number.bit_length()) - 1 for number in range(count)]


class Draws(np.random.Generator):
    """A generator whose draws are those of the module's table.

    Arguments are as in NumPy's `Generator`.
    """

    def __init__(self, bit_generator: np.random.BitGenerator) -> None:
        super().__init__(bit_generator)
        self._kept: int | None = None

    def __reduce__(self) -> tuple:
        """State for pickle: the bit generator, and the kept half of a 64-bit draw."""
        return _restored, (self.bit_generator, self._kept)

    def words(self, count: int) -> np.ndarray:
        """Return the next `count` raw words of the bit generator, (count,) uint64."""
        return self.bit_generator.random_raw(count)

    def _halves(self, count: int) -> np.ndarray:
        """The next `count` 32-bit halves of words, as (count,) uint64.

        An upper half left over waits for the next call.
        """
        kept = np.zeros(0, np.uint64)
        if self._kept is not None:
            kept = np.array([self._kept], np.uint64)
        fresh = self.words((count - len(kept) + 1) // 2)
        # Viewed as 32-bit numbers, the lower half of a word comes first.
        lower_first = fresh.astype("<u8", copy=False).view("<u4").astype(np.uint64)
        halves = np.append(kept, lower_first)
        self._kept = None
        if len(halves) > count:
            self._kept = int(halves[count])
        return halves[:count]

    def random(self, size: Size = None, **kwargs):
        """Return numbers in [0, 1), float64."""
        if kwargs:
            raise InputError(f"random: arguments {sorted(kwargs)}, expected none besides size")
        upper_bits = (self.words(_count(size)) >> _SURPLUS).astype(np.float64)
        return _shaped(upper_bits * 2.0**-53, size)

    def uniform(self, low=0.0, high=1.0, size: Size = None):
        """Return numbers in [low, high), float64; arrays of bounds broadcast."""
        if size is None and (np.ndim(low) or np.ndim(high)):
            size = np.broadcast_shapes(np.shape(low), np.shape(high))
        share = self.random(size)
        if size is None:
            return float(low) + (float(high) - float(low)) * share
        low = np.asarray(low, np.float64)
        high = np.asarray(high, np.float64)
        return low + (high - low) * share

    def integers(self, low, high=None, size: Size = None, **kwargs):
        """Return whole numbers from `low` (0 where `high` is not given) to `high` - 1, int64.

        Raises: InputError where the range is empty or wider than 2^32, or bounds are arrays.
        """
        if kwargs or np.ndim(low) or np.ndim(high):
            return super().integers(low, high, size, **kwargs)
        first = 0
        end = int(low)
        if high is not None:
            first = int(low)
            end = int(high)
        width = end - first
        if not 1 <= width <= _HALVES - 1:
            raise InputError(
                f"integers: from {first} to below {end}, expected 1 to {_HALVES - 1} values"
            )
        above_first = self._below(width, _count(size))
        return _shaped(above_first.astype(np.int64) + first, size)

    def _below(self, width: int, count: int) -> np.ndarray:
        """Return `count` whole numbers below `width`, uint64, by Lemire's method.

        Halves that the method rejects are skipped.
        """
        if width == 1:
            return np.zeros(count, np.uint64)
        if _HALVES % width == 0:
            # Every half is accepted where the width is a power of two.
            return (self._halves(count) * np.uint64(width)) >> np.uint64(32)
        found = np.zeros(0, np.uint64)
        while len(found) < count:
            scaled = self._halves(count - len(found)) * np.uint64(width)
            # Reject products whose lower half is below 2^32 modulo the width: they would favour
            # some numbers.
            accepted = scaled[(scaled & _HALF) >= np.uint64(_HALVES % width)]
            found = np.append(found, accepted >> np.uint64(32))
        return found

    def _shuffled(self, count: int, first: int) -> np.ndarray:
        """Return 0 .. count - 1 in random order, or with an unsorted tail alone.

        Each position from the last one down to `first` is swapped with a random one not above it.
        """
        order = list(range(count))
        position = count - 1
        masks = _masks(count)
        while position >= first:
            # Each position needs at least one half, so every half that is drawn is used.
            for half in self._halves(position - first + 1).tolist():
                partner = half & masks[position]
                if partner <= position:
                    order[position], order[partner] = order[partner], order[position]
                    position -= 1
        return np.array(order, np.int64)

    def permutation(self, x, axis: int = 0):
        """Return 0 .. x - 1 in random order, or the entries of an array along its first axis.

        Whole numbers are int64.
        """
        if axis != 0:
            return super().permutation(x, axis)
        if np.ndim(x) == 0:
            return self._shuffled(int(x), 1)
        x = np.asarray(x)
        return x[self._shuffled(len(x), 1)]

    def choice(
        self,
        a,
        size: Size = None,
        replace: bool = True,
        p=None,
        axis: int = 0,
        shuffle: bool = True,
    ):
        """Return entries of an array, or of 0 .. a - 1.

        Without replacement they are the tail of a permutation.
        """
        if p is not None or axis != 0 or not shuffle:
            return super().choice(a, size, replace, p, axis, shuffle)
        is_number = np.ndim(a) == 0
        count = int(a) if is_number else len(a)
        wanted = _count(size)
        if replace or size is None:
            numbers = self.integers(count, size=size)
        elif wanted > count:
            raise InputError(
                f"choice: {wanted} of {count} without replacement, expected no more than there are"
            )
        else:
            first = count - wanted
            numbers = self._shuffled(count, max(1, first))[first:].reshape(size)
        if is_number:
            return numbers
        return np.asarray(a)[numbers]

    def standard_normal(self, size: Size = None, **kwargs):
        """Return numbers with the normal distribution of mean 0 and variance 1, float64."""
        if kwargs:
            raise InputError(
                f"standard_normal: arguments {sorted(kwargs)}, expected none besides size"
            )
        count = _count(size)
        words = self.words(count + count % 2)
        if count >= COMPILED or "lowalt.numerics.normals" in sys.modules:
            # Imported late: most commands draw few numbers, in less time than loading the compiler
            # takes.
            from lowalt.numerics.normals import interleaved

            return _shaped(interleaved(words)[:count], size)
        first, second = (words >> _SURPLUS).reshape(-1, 2).T
        radius = np.sqrt(-2.0 * log((first.astype(np.float64) + 1.0) * 2.0**-53))
        sine, cosine = sine_cosine_turns(second.astype(np.float64) * 2.0**-53)
        pairs = np.stack([radius * cosine, radius * sine], axis=1)
        return _shaped(pairs.ravel()[:count], size)

    def normal(self, loc=0.0, scale=1.0, size: Size = None):
        """Return normally distributed numbers of this mean and standard deviation, float64."""
        if size is None and (np.ndim(loc) or np.ndim(scale)):
            size = np.broadcast_shapes(np.shape(loc), np.shape(scale))
        return loc + scale * self.standard_normal(size)

    def exponential(self, scale=1.0, size: Size = None):
        """Return exponentially distributed numbers of this mean, -scale ln(1 - random), float64."""
        if size is None and np.ndim(scale):
            size = np.shape(scale)
        share = np.asarray(self.random(size))
        values = -log(1.0 - share) * scale
        return values.item() if size is None else values


def _restored(bit_generator: np.random.BitGenerator, kept: int | None) -> Draws:
    """A generator as it was before it was pickled."""
    draws = Draws(bit_generator)
    draws._kept = kept
    return draws
