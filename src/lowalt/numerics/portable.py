"""Elementary functions, products and sums that give the same bits on every processor.

A library may use other polynomials for a sine with wider registers, a BLAS may add in another
order, and a fused multiply-add rounds once instead of twice. This module uses only additions,
products, divisions and square roots of float64 arrays in a fixed order, which IEEE 754 specifies;
NumPy performs each as a separate operation. Results are within a few units in the last place of the
true values. Arguments are arrays of float64 or numbers; shapes broadcast; NaN and infinity are not
expected. Source of the polynomials and of the reductions: Sun's fdlibm (Ng 1993).
"""

import math

import numpy as np

_TWO_OVER_PI = 0.6366197723675814
# Pi / 2 in pieces of 33 bits: products with whole numbers below 2^20 are exact.
_HALF_PI = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
_LARGEST_ANGLE = 1.0e6
SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
_EXPONENTIAL = (
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)
LOGARITHM = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860511658591e-01,
)
LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
LN_10 = 2.302585092994046
"""Natural logarithm of 10."""
TANGENT = (
    3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01, -1.11111104054623557880e-01,
    9.09088713343650656196e-02, -7.69187620504482999495e-02, 6.66107313738753120669e-02, -5.83357013379057348645e-02,
    4.97687799461593236017e-02, -3.65315727442169155270e-02, 1.62858201153657823623e-02,
)  # fmt: skip
_ANCHORS = (
    (4.63647609000806093515e-01, 2.26987774529616870924e-17),
    (7.85398163397448278999e-01, 3.06161699786838301793e-17),
    (9.82793723247329054082e-01, 1.39033110312309984516e-17),
    (1.57079632679489655800e00, 6.12323399573676603587e-17),
)


def _polynomial(x: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """c0 + x (c1 + x (c2 + ...))."""
    result = np.full_like(x, coefficients[-1])
    for value in reversed(coefficients[:-1]):
        result = result * x + value
    return result


def _eighth(high: np.ndarray, low: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine of high + low, |high| <= pi / 4."""
    square = high * high
    rest = _polynomial(square, SINE[1:])
    cube = square * high
    sine = high - ((square * (0.5 * low - cube * rest) - low) - cube * SINE[0])
    rest = square * _polynomial(square, COSINE)
    half = 0.5 * square
    one = 1.0 - half
    cosine = one + (((1.0 - one) - half) + (square * rest - high * low))
    return sine, cosine


def _turned(
    quarter: np.ndarray, sine: np.ndarray, cosine: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine after a whole number of quarter turns."""
    quarter = np.asarray(quarter, np.int64) & 3
    odd = (quarter & 1) == 1
    first = np.where(odd, cosine, sine)
    second = np.where(odd, sine, cosine)
    below = quarter >= 2
    left = (quarter == 1) | (quarter == 2)
    return np.where(below, -first, first), np.where(left, -second, second)


def sine_cosine(angle_rad: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine of angles of any shape, each of that shape.

    Raises: ValueError for an angle beyond 10^6 rad, where the reduction would lose digits.
    """
    angle = np.asarray(angle_rad, np.float64)
    if angle.size and not np.abs(angle).max() <= _LARGEST_ANGLE:
        raise ValueError(f"angle of {np.abs(angle).max()} rad, expected at most {_LARGEST_ANGLE:g}")
    quarter = np.rint(angle * _TWO_OVER_PI)
    rest = angle - quarter * _HALF_PI[0]
    middle_piece = quarter * _HALF_PI[1]
    near = rest - middle_piece
    last_piece = quarter * _HALF_PI[2] - ((rest - near) - middle_piece)
    high = near - last_piece
    return _turned(quarter, *_eighth(high, (near - high) - last_piece))


def sine_cosine_turns(turns: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine of 2 pi `turns`, below 2^50, of any shape.

    Quarter turns give exactly 0 and +-1.
    """
    turns = np.asarray(turns, np.float64)
    quarter = np.rint(4.0 * turns)
    return _turned(quarter, *_eighth((turns - 0.25 * quarter) * (2 * np.pi), np.zeros_like(turns)))


def sin(angle_rad: np.ndarray | float) -> np.ndarray:
    """Return the sine of angles of any shape."""
    return sine_cosine(angle_rad)[0]


def cos(angle_rad: np.ndarray | float) -> np.ndarray:
    """Return the cosine of angles of any shape."""
    return sine_cosine(angle_rad)[1]


def exp(x: np.ndarray | float) -> np.ndarray:
    """Return e^x for x of any shape, |x| <= 700."""
    x = np.asarray(x, np.float64)
    twos = np.rint(x * 1.44269504088896338700)
    high = x - twos * LN2[0]
    low = twos * LN2[1]
    rest = high - low
    square = rest * rest
    c = rest - square * _polynomial(square, _EXPONENTIAL)
    return np.ldexp(1.0 - ((low - (rest * c) / (2.0 - c)) - high), twos.astype(np.int32))


def from_decibels(level_db: np.ndarray | float) -> np.ndarray:
    """Return 10^(x / 10), the ratio of powers of levels (dB) of any shape, within 3000 dB of 0."""
    return exp(0.1 * LN_10 * np.asarray(level_db, np.float64))


def log(x: np.ndarray | float) -> np.ndarray:
    """Return the natural logarithm of positive numbers of any shape."""
    mantissa, twos = np.frexp(np.asarray(x, np.float64))
    small = mantissa < 0.70710678118654752440
    f = np.where(small, 2.0 * mantissa, mantissa) - 1.0
    twos = (twos - small).astype(np.float64)
    s = f / (2.0 + f)
    square = s * s
    rest = square * _polynomial(square, LOGARITHM)
    half = 0.5 * f * f
    return twos * LN2[0] - ((half - (s * (half + rest) + twos * LN2[1])) - f)


def power(base: np.ndarray | float, exponent: float) -> np.ndarray:
    """Return base^exponent of numbers >= 0 of any shape, for an exponent > 0.

    Small whole exponents are products of the base; others are exp(exponent log(base)).
    """
    base = np.asarray(base, np.float64)
    if float(exponent).is_integer() and 1 <= exponent <= 4:
        result = base
        for _ in range(int(exponent) - 1):
            result = result * base
        return result
    positive = base > 0
    return np.where(positive, exp(exponent * log(np.where(positive, base, 1.0))), 0.0)


def arctan(x: np.ndarray | float) -> np.ndarray:
    """Return the arc tangent (rad) of numbers of any shape."""
    x = np.asarray(x, np.float64)
    size = np.abs(x)
    limits = (0.4375, 0.6875, 1.1875, 2.4375)
    interval = sum((size >= limit).astype(np.int64) for limit in limits)
    # Every branch is computed for all numbers, so divisors must not be zero in unused branches
    # either.
    choices = [
        size,
        (2 * size - 1) / (2 + size),
        (size - 1) / (size + 1),
        (size - 1.5) / (1 + 1.5 * size),
        -1 / np.where(size > 0, size, 1.0),
    ]
    near = np.choose(interval, choices)
    square = near * near
    tail = near * (square * _polynomial(square, TANGENT))
    high = np.choose(interval, [0.0, *(anchor[0] for anchor in _ANCHORS)])
    low = np.choose(interval, [0.0, *(anchor[1] for anchor in _ANCHORS)])
    result = np.where(interval == 0, near - tail, high - ((tail - low) - near))
    return np.where(x < 0, -result, result)


def arctan2(y: np.ndarray | float, x: np.ndarray | float) -> np.ndarray:
    """Return the angle (rad) of the points (x, y), in [-pi, pi]; 0 at the origin."""
    y = np.asarray(y, np.float64)
    x = np.asarray(x, np.float64)
    steep = np.abs(y) > np.abs(x)
    over = np.where(steep, x, y)
    under = np.where(steep, y, x)
    angle = arctan(over / np.where(under == 0, 1.0, under))
    flat = np.where(x < 0, np.where(y < 0, angle - np.pi, angle + np.pi), angle)
    return np.where(steep, np.where(y > 0, np.pi / 2, -np.pi / 2) - angle, flat)


def total(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the sum along an axis that is not empty, added one by one from the first value on."""
    # Each value of a cumulative sum depends on the previous one, so every library adds in this
    # order.
    return np.add.accumulate(np.asarray(values, np.float64), axis=axis).take(-1, axis=axis)


def mean(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the mean along an axis that is not empty; the sum is that of `total`."""
    return total(values, axis) / np.shape(values)[axis]


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the sum over the last axis of a b.

    Products are added from the first one on; other axes broadcast.
    """
    a = np.asarray(a, np.float64)
    b = np.asarray(b, np.float64)
    result = a[..., 0] * b[..., 0]
    for index in range(1, max(a.shape[-1], b.shape[-1])):
        result = result + a[..., index] * b[..., index]
    return result


def norm(vectors: np.ndarray) -> np.ndarray:
    """Return the length of vectors along the last axis."""
    return np.sqrt(dot(vectors, vectors))


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the matrix product of (..., I, K) and (..., K, J): (..., I, J).

    Products are added from the first k on.
    """
    a = np.asarray(a, np.float64)
    b = np.asarray(b, np.float64)
    result = a[..., :, 0, None] * b[..., None, 0, :]
    for index in range(1, a.shape[-1]):
        result = result + a[..., :, index, None] * b[..., None, index, :]
    return result


def applied(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return matrix @ vector for each vector: (..., I, K) and (..., K) -> (..., I)."""
    return dot(matrix, np.asarray(vectors, np.float64)[..., None, :])


def rms(signal: np.ndarray) -> float:
    """Return the root of the mean of |signal|^2 of a complex array of any shape, 0 for zeros.

    Scaling by a power of two first prevents under- and overflow of the mean square.
    """
    signal = np.asarray(signal, dtype=np.complex128).ravel()
    real_imag = np.stack([signal.real, signal.imag])
    peak = float(np.abs(real_imag).max())
    if peak == 0:
        return 0.0
    twos = math.frexp(peak)[1]
    real, imag = np.ldexp(real_imag, -twos)
    # Square both separately and add one by one, because a library's |z| and sum depend on the
    # processor.
    mean_square = float(total(real * real + imag * imag)) / signal.size
    return math.ldexp(math.sqrt(mean_square), twos)
