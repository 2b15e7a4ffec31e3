"""Correct rounding to complex64: recompute values whose error bound does not decide it.

This is Ziv's strategy. The second computation uses double-double arithmetic. The complex64 signal
is then the correctly rounded true value and depends neither on the processor nor on the kernel that
computed it. Source: Ziv 1991, "Fast evaluation of elementary mathematical functions with correctly
rounded last bit", ACM TOMS 17.
"""

from fractions import Fraction

import numpy as np

from lowalt.echo.fast.layout import EchoSample
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise import results as pointwise
from lowalt.echo.rounding.sums import ROWS, cell_value
from lowalt.machine.jit import INLINED, LEAN
from lowalt.numerics.exact.arithmetic import two_sum

ERROR = 2.0**-64
"""Bound of a double-double cell's error relative to the sum of amplitudes."""


@INLINED
def same_single(x, error):
    """Return whether all numbers within `error` of x have the same nearest float32."""
    margin = error + 1e-15 * abs(x)
    return np.float32(x - margin) == np.float32(x + margin)


@LEAN
def doubtful(values, bounds, totals, gaps, out):
    """Fill `out` with the symbols whose nearest complex64 or strongest cell is not decided.

    Returns their number, and how many of them lack a proved strongest cell. A symbol whose
    amplitudes are all zero is exactly zero.
    """
    count = 0
    unproved = 0
    for n in range(len(values)):
        decided = same_single(values[n].real, bounds[n]) and same_single(values[n].imag, bounds[n])
        if totals[n] > 0.0 and not (decided and gaps[n] > 0.0):
            out[count] = n
            count += 1
            unproved += not gaps[n] > 0.0
    return count, unproved


@INLINED
def to_odd(high, low, bits):
    """Return a double that rounds to the same float32 as the double-double (high, low).

    Rounding to odd: a sum that is not a double becomes the neighbouring double whose last bit is
    one. The two formats differ by more than one bit, so the second rounding is then correct. bits
    (1,) int64: work array.
    """
    if low == 0.0 or high == 0.0:
        return high
    bits.view(np.float64)[0] = high
    if bits[0] & 1 == 0:
        if (low > 0.0) == (high > 0.0):
            bits[0] += 1
        else:
            bits[0] -= 1
    return bits.view(np.float64)[0]


@LEAN
def compute_again(sample, symbols, found, work, bits):
    """Replace the values of `symbols` (K,) in their strongest cells by sums in double-double.

    work (ROWS, padded L + 4), bits (1,) int64: work arrays. Returns the number of symbols whose
    nearest complex64 is still undecided.
    """
    still = 0
    for n in symbols:
        real, imag = cell_value(sample, n, found.cells[n], work)
        error = ERROR * found.totals[n]
        still += not (same_double(real, error, bits) and same_double(imag, error, bits))
        found.values[n] = complex(to_odd(real[0], real[1], bits), to_odd(imag[0], imag[1], bits))
    return still


@INLINED
def same_double(x, error, bits):
    """Return whether all numbers within `error` of a double-double have the same nearest float32.

    bits: work array.
    """
    # Rounding to double first could move both ends onto the tie between them.
    least, below = two_sum(x[0], x[1] - error)
    most, above = two_sum(x[0], x[1] + error)
    return np.float32(to_odd(least, below, bits)) == np.float32(to_odd(most, above, bits))


def correct(
    sample: EchoSample, refs: np.ndarray, found: Found, pointwise_bound: tuple[float, float]
) -> tuple[int, int]:
    """Make every value of `found` round to the complex64 nearest to that of the strongest cell.

    Returns the number of recomputed symbols and how many of them remain undecided. Cells whose
    strengths differ by less than the error count as equal, and the lowest index wins.
    """
    open_ones = np.empty(len(refs), np.int64)
    count, _ = doubtful(found.values, found.bounds, found.totals, found.gaps, open_ones)
    if not count:
        return 0, 0
    open_ones = open_ones[:count]
    work = np.empty((ROWS, len(sample.lay.root) + 4))
    bits = np.empty(1, np.int64)
    unproved_ones = open_ones[found.gaps[open_ones] <= 0.0]
    for n in unproved_ones:
        cells = _contenders(sample, refs, int(n), pointwise_bound)
        if len(cells) > 1:
            strengths = {cell: _strength(cell_value(sample, n, cell, work)) for cell in cells}
            error = Fraction(ERROR * found.totals[n])
            least = max(strengths.values()) - 4 * error * Fraction(abs(found.values[n]))
            cells = [cell for cell, strength in strengths.items() if strength >= least]
        found.cells[n] = min(cells)
    return len(open_ones), compute_again(sample, open_ones, found, work, bits)


def _strength(value: tuple[tuple[float, float], tuple[float, float]]) -> Fraction:
    """Return |value|^2, without rounding, of a complex number whose halves are double-doubles."""
    (real, real_low), (imaginary, imaginary_low) = value
    real_square = (Fraction(real) + Fraction(real_low)) ** 2
    return real_square + (Fraction(imaginary) + Fraction(imaginary_low)) ** 2


def _contenders(
    sample: EchoSample, refs: np.ndarray, n: int, pointwise_bound: tuple[float, float]
) -> list[int]:
    """Return the cells of symbol n that may be the strongest by the error bounds of float64."""
    scene = sample.scene
    radar = sample.radar
    aims = sample.aims
    only = slice(n, n + 1)
    here = scene._replace(translation=scene.translation[only], rotation=scene.rotation[only])
    one = Found.empty(1)
    risks = np.zeros(1)
    cells = np.empty((1, radar.subcarriers), np.complex128)
    pointwise.signal(here, radar, refs[only], np.arange(1), aims, one, risks)
    pointwise.matrix(here, radar, refs[only], aims, cells)
    strengths = abs(cells[0])
    bound = one.totals[0] * pointwise_bound[0] + risks[0] * pointwise_bound[1]
    return np.flatnonzero(strengths >= strengths.max() - 2 * bound).tolist()
