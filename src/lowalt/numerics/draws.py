"""Random numbers that are the same with every version of NumPy and on every processor.

NumPy guarantees the streams of its bit generators, but not how a `Generator` turns bits into
numbers. Only the raw 64-bit words are therefore taken from NumPy. The transforms are defined here,
in operations that IEEE 754 specifies:

    random       the word's upper 53 bits times 2^-53
    uniform      low + (high - low) random
    integers     Lemire's method on 32-bit halves, the lower half of a word first
    permutation  Fisher and Yates's shuffle from the last place p down: its partner is a 32-bit
    half's lowest bits, as
                 many as p has, the next half where that is above p; choice without replacement is
                 the tail
    normal       Box and Muller's method on two words: sqrt(-2 ln u) cos(2 pi v) and sqrt(-2 ln u)
    sin(2 pi v) follow
                 each other, u = (upper 53 bits of the first + 1) 2^-53, v = (upper 53 bits of the
                 second) 2^-53

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
COMPILED = 4096
"""From this number of normals on, loading compiled code pays; it gives the same bits in less time.
"""


def _count(size: Size) -> int:
    """How many numbers an array of this size has; None means one number."""
    return 1 if size is None else math.prod(size) if isinstance(size, tuple) else int(size)


def _shaped(values: np.ndarray, size: Size):
    """The one value as a number, or all in the shape asked for."""
    return values[0].item() if size is None else values.reshape(size)


@lru_cache(maxsize=256)
def _masks(count: int) -> list[int]:
    """For each number below `count`, a mask of as many low bits as the number has."""
    return [(1 << place.bit_length()) - 1 for place in range(count)]


class Draws(np.random.Generator):
    """A generator whose draws are those of the module's table; arguments are as in NumPy's
    `Generator`.
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
        """The next `count` 32-bit halves, as (count,) uint64; an upper half left over waits for the
        next call.
        """
        kept = [] if self._kept is None else [self._kept]
        fresh = self.words((count - len(kept) + 1) // 2)
        # Viewed as 32-bit numbers, the lower half of a word comes first.
        halves = fresh.astype("<u8", copy=False).view("<u4").astype(np.uint64)
        if kept:
            halves = np.append(np.array(kept, np.uint64), halves)
        self._kept = int(halves[count]) if len(halves) > count else None
        return halves[:count]

    def random(self, size: Size = None, **kwargs):
        """Return numbers in [0, 1), float64."""
        if kwargs:
            raise InputError(f"random: arguments {sorted(kwargs)}, expected none besides size")
        return _shaped(
            (self.words(_count(size)) >> np.uint64(11)).astype(np.float64) * 2.0**-53, size
        )

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
        first, end = (0, int(low)) if high is None else (int(low), int(high))
        width = end - first
        if not 1 <= width <= 2**32 - 1:
            raise InputError(
                f"integers: from {first} to below {end}, expected 1 to {2**32 - 1} values"
            )
        count = _count(size)
        taken = np.zeros(count, np.uint64) if width == 1 else self._below(width, count)
        return _shaped(taken.astype(np.int64) + first, size)

    def _below(self, width: int, count: int) -> np.ndarray:
        """`count` whole numbers below `width`, uint64; halves that Lemire's method rejects are
        skipped.
        """
        if 2**32 % width == 0:
            # Every half is accepted where the width is a power of two.
            return (self._halves(count) * np.uint64(width)) >> np.uint64(32)
        parts = []
        missing = count
        while missing:
            scaled = self._halves(missing) * np.uint64(width)
            # Reject products whose lower half is below 2^32 modulo the width: they would favour
            # some numbers.
            accepted = scaled[(scaled & _HALF) >= np.uint64(2**32 % width)] >> np.uint64(32)
            parts.append(accepted)
            missing -= len(accepted)
        return np.concatenate(parts) if parts else np.zeros(0, np.uint64)

    def _shuffled(self, count: int, first: int) -> np.ndarray:
        """Return 0 .. count - 1, each place from the last to `first` swapped with a random place
        not above it.
        """
        order = list(range(count))
        place = count - 1
        masks = _masks(count)
        while place >= first:
            # Each place needs at least one half, so every half that is drawn is used.
            for half in self._halves(place - first + 1).tolist():
                partner = half & masks[place]
                if partner <= place:
                    order[place], order[partner] = order[partner], order[place]
                    place -= 1
        return np.array(order, np.int64)

    def permutation(self, x, axis: int = 0):
        """Return 0 .. x - 1 in random order, int64, or the entries of an array along its first
        axis.
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
        """Return entries of an array, or of 0 .. a - 1; without replacement the tail of a
        permutation.
        """
        if p is not None or axis != 0 or not shuffle:
            return super().choice(a, size, replace, p, axis, shuffle)
        count = int(a) if np.ndim(a) == 0 else len(a)
        wanted = _count(size)
        if replace or size is None:
            numbers = self.integers(count, size=size)
        elif wanted > count:
            raise InputError(
                f"choice: {wanted} of {count} without replacement, expected no more than there are"
            )
        else:
            numbers = self._shuffled(count, max(1, count - wanted))[count - wanted :].reshape(size)
        return numbers if np.ndim(a) == 0 else np.asarray(a)[numbers]

    def standard_normal(self, size: Size = None, **kwargs):
        """Return numbers with the normal distribution of mean 0 and variance 1, float64."""
        if kwargs:
            raise InputError(
                f"standard_normal: arguments {sorted(kwargs)}, expected none besides size"
            )
        count = _count(size)
        if count >= COMPILED or "lowalt.numerics.normals" in sys.modules:
            # Imported late: most commands draw few numbers, in less time than loading the compiler
            # takes.
            from lowalt.numerics.normals import interleaved

            return _shaped(interleaved(self.words(count + count % 2))[:count], size)
        first, second = (self.words(count + count % 2) >> np.uint64(11)).reshape(-1, 2).T
        radius = np.sqrt(-2.0 * log((first.astype(np.float64) + 1.0) * 2.0**-53))
        sine, cosine = sine_cosine_turns(second.astype(np.float64) * 2.0**-53)
        return _shaped(np.stack([radius * cosine, radius * sine], axis=1).ravel()[:count], size)

    def normal(self, loc=0.0, scale=1.0, size: Size = None):
        """Return numbers with the normal distribution of this mean and standard deviation, float64."""
        if size is None and (np.ndim(loc) or np.ndim(scale)):
            size = np.broadcast_shapes(np.shape(loc), np.shape(scale))
        return loc + scale * self.standard_normal(size)

    def exponential(self, scale=1.0, size: Size = None):
        """Return numbers with the exponential distribution of this mean: -scale ln(1 - random),
        float64.
        """
        if size is None and np.ndim(scale):
            size = np.shape(scale)
        share = self.random(1 if size is None else size)
        values = -log(1.0 - share) * scale
        return values[0].item() if size is None else values


def _restored(bit_generator: np.random.BitGenerator, kept: int | None) -> Draws:
    """A generator as it was before it was pickled."""
    draws = Draws(bit_generator)
    draws._kept = kept
    return draws
