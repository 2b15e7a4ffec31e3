"""Constants as double-doubles, from exact fractions and long decimals.

They are pi, sines and Taylor coefficients.
"""

from decimal import Decimal, localcontext
from fractions import Fraction

DIGITS = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899")

Pair = tuple[float, float]


def pair(value: Fraction | Decimal | float) -> Pair:
    """Return the double-double nearest to a number: two doubles whose sum it is to 2^-106."""
    value = Fraction(value)
    high = float(value)
    return high, float(value - Fraction(high))


def decimal_of(value: Fraction | float) -> Decimal:
    """Return a number as a decimal of the present context's length."""
    exact = Fraction(value)
    return Decimal(exact.numerator) / Decimal(exact.denominator)


def sine_cosine(angle_rad: float) -> tuple[Fraction, Fraction]:
    """Return sine and cosine of an angle below 100 rad, to about 55 digits."""
    with localcontext() as context:
        context.prec = DIGITS + 45
        x = decimal_of(angle_rad)
        term = Decimal(1)
        sums = [Decimal(0), Decimal(0)]
        # Even orders belong to the cosine, odd ones to the sine; signs are +, +, -, -.
        for order in range(400):
            if order % 4 < 2:
                sums[order % 2] += term
            else:
                sums[order % 2] -= term
            term *= x / (order + 1)
        cosine, sine = sums
        return Fraction(sine), Fraction(cosine)


def taylor(first: int, factor: int, count: int) -> tuple[Pair, ...]:
    """Return the first `count` Taylor coefficients, in x^2, of a sine over x or of a cosine.

    first: 1 for sin(factor pi x) / x, 0 for cos(factor pi x).
    """
    with localcontext() as context:
        context.prec = DIGITS
        term = Decimal(1)
        result = []
        for order in range(1, first + 1):
            term *= factor * PI / order
        for index in range(count):
            result.append(pair(term))
            order = first + 2 * index
            term *= -((factor * PI) ** 2) / ((order + 1) * (order + 2))
        return tuple(result)
