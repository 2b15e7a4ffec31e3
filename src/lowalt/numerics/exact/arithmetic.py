"""Double-double arithmetic for compiled loops.

A number of about 32 digits is a pair (high, low) of doubles.

All operations, including fused multiply-add, are specified by IEEE 754 and must not be reordered,
so results have the same bits on every processor. A processor without fused multiply-add uses the C
library, slowly but equally. Relative errors are below 2^-100 for products, quotients and roots; a
sum's error is below 2^-103 of its larger term.
Source: Dekker 1971; Hida, Li and Bailey 2001, "Algorithms for quad-double precision floating point
arithmetic".
"""

import math

from numba import types
from numba.extending import intrinsic

from lowalt.machine.jit import INLINED
from lowalt.numerics import double_double

two_sum = INLINED(double_double.two_sum)


@intrinsic
def fma(typing_context, a, b, c):
    """Return a b + c with one rounding."""

    def generate(context, builder, signature, arguments):
        """Emit the machine instruction."""
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@INLINED
def normal(high, low):
    """Return high + low as a double-double, for |high| >= |low| or high = 0."""
    s = high + low
    return s, low - (s - high)


@INLINED
def product(a, b):
    """Return the double-double product of two doubles, exactly."""
    p = a * b
    return p, fma(a, b, -p)


@INLINED
def add(a, b):
    """Return a + b."""
    s, e = two_sum(a[0], b[0])
    return normal(s, e + (a[1] + b[1]))


@INLINED
def subtract(a, b):
    """Return a - b."""
    s, e = two_sum(a[0], -b[0])
    return normal(s, e + (a[1] - b[1]))


@INLINED
def multiply(a, b):
    """Return a b."""
    p, e = product(a[0], b[0])
    return normal(p, fma(a[0], b[1], fma(a[1], b[0], e)))


@INLINED
def scale(a, k):
    """Return a k for a double k."""
    p, e = product(a[0], k)
    return normal(p, fma(a[1], k, e))


@INLINED
def divide(a, b):
    """Return a / b."""
    q = a[0] / b[0]
    p, e = product(q, b[0])
    rest = ((a[0] - p) - e) + a[1] - q * b[1]
    return normal(q, rest / b[0])


@INLINED
def root(a):
    """Return the square root of a > 0."""
    s = math.sqrt(a[0])
    p, e = product(s, s)
    return normal(s, (((a[0] - p) - e) + a[1]) / (2.0 * s))
