"""Sums and products of doubles with their rounding errors: the basis of double-double arithmetic.

A double-double is the unevaluated sum of two doubles, about 32 digits. The functions here use
additions, subtractions and multiplications alone, so they take numbers and arrays alike, and every
processor returns the same bits. Where they are compiled, no fast-math flag may be set: it would
remove the corrections.
"""

SPLITTER = 134217729.0
"""2^27 + 1: multiplying by it splits a double into two halves of 26 bits."""


def two_sum(a, b):
    """Return (s, e) with s = a + b rounded and s + e = a + b exactly.

    Source: Knuth, TAOCP 2, 4.2.2.
    """
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(a, b):
    """Return (p, e) with p = a b rounded and p + e = a b exactly, unless it over- or underflows.

    Source: Dekker 1971, "A floating-point technique for extending the available precision", Numer.
    Math. 18.
    """
    p = a * b
    x = SPLITTER * a
    a_high = x - (x - a)
    a_low = a - a_high
    y = SPLITTER * b
    b_high = y - (y - b)
    b_low = b - b_high
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low
