"""Sines and cosines of double-doubles by Taylor series, for arguments in turns or half turns.

Terms below 10^-6 of the sum are computed in double; the series stop below 10^-22, so errors are
below 2^-71.
"""

import numpy as np

from lowalt.machine.jit import INLINED
from lowalt.numerics.exact.arithmetic import divide, multiply, normal, scale
from lowalt.numerics.exact.constants import taylor


def _split(first: int, factor: int, exact: int, count: int) -> tuple[tuple, tuple, tuple]:
    """Return Taylor coefficients in reverse.

    They are (high, low) of the first `exact`, and the others as doubles.
    """
    coefficients = taylor(first, factor, count)[::-1]
    high, low = zip(*coefficients[count - exact :], strict=True)
    return high, low, tuple(value for value, _ in coefficients[: count - exact])


HALF_HIGH, HALF_LOW, HALF_REST = _split(1, 1, 6, 14)
"""sin(pi x) / x for |x| <= 1/2, to x^26."""
SINE_HIGH, SINE_LOW, SINE_REST = _split(1, 2, 4, 11)
"""sin(2 pi x) / x for |x| <= 1/8, to x^20."""
COSINE_HIGH, COSINE_LOW, COSINE_REST = _split(0, 2, 5, 11)
"""cos(2 pi x) for |x| <= 1/8, to x^20."""


@INLINED
def series(x, high, low, rest):
    """Return a sum of powers of the double-double x.

    The lowest orders are in double-double, the others in double.
    """
    total = rest[0]
    for k in range(1, len(rest)):
        total = total * x[0] + rest[k]
    result = (total, 0.0)
    for k in range(len(high)):
        p = multiply(result, x)
        # Each coefficient is larger than all that follow it together.
        s, e = normal(high[k], p[0])
        result = normal(s, e + (p[1] + low[k]))
    return result


@INLINED
def fraction(x):
    """Return (x less the nearest whole number, that number) for a double-double x below 2^51."""
    whole = np.rint(x[0])
    return normal(x[0] - whole, x[1]), whole


@INLINED
def sine_half(x):
    """Return sin(pi x) for |x| <= 1/2."""
    return multiply(x, series(multiply(x, x), HALF_HIGH, HALF_LOW, HALF_REST))


@INLINED
def sine_cosine(x):
    """Return sin(2 pi x) and cos(2 pi x) for |x| below 2^51."""
    quarter = np.rint(4.0 * x[0])
    f = normal(x[0] - 0.25 * quarter, x[1])
    square = multiply(f, f)
    s = multiply(f, series(square, SINE_HIGH, SINE_LOW, SINE_REST))
    c = series(square, COSINE_HIGH, COSINE_LOW, COSINE_REST)
    q = quarter - 4.0 * np.floor(0.25 * quarter)
    # q quarter turns, 0 to 3: an odd number swaps sine and cosine.
    swapped = q == 1.0 or q == 3.0
    below = q >= 2.0
    left = q == 1.0 or q == 2.0
    sine = c if swapped else s
    cosine = s if swapped else c
    if below:
        sine = (-sine[0], -sine[1])
    if left:
        cosine = (-cosine[0], -cosine[1])
    return sine, cosine


@INLINED
def odd_sign(whole):
    """Return -1 for an odd whole number, 1 for an even one."""
    return 1.0 - 2.0 * (whole - 2.0 * np.floor(0.5 * whole))


@INLINED
def dirichlet(x, count):
    """Return sin(pi count x) / sin(pi x), with its limits at whole x; count: a whole double.

    `echo.pointwise.terms.dirichlet` in double-double: the sines, the quotient and the limits need
    their own arithmetic.
    """
    f, whole = fraction(x)
    top, turns = fraction(scale(f, count))
    sign = odd_sign(turns)
    even_count = count - 2.0 * np.floor(0.5 * count) == 0.0
    if even_count:
        sign *= odd_sign(whole)
    # Both cases are computed, so that the compiler can vectorise loops over points.
    whole_x = f[0] == 0.0
    below = sine_half(f)
    divisor = 1.0 if whole_x else below[0]
    high, low = divide(sine_half(top), (divisor, below[1]))
    if whole_x:
        high = count
        low = 0.0
    return sign * high, sign * low
