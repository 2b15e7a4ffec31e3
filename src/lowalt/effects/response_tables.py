"""Tables of the frequency response: Bessel functions at the subcarriers, series of waves, and nodes of the band.

None of them depends on a target's points, and a few of them, which are kept, serve all samples.
"""

from functools import lru_cache

import numpy as np
from scipy.special import factorial, jv

from lowalt.common.memory import aligned_copy
from lowalt.common.network import Network
from lowalt.echo.radar import Radar
from lowalt.effects import interpolation
from lowalt.effects.moment_loops import BLOCK


@lru_cache(maxsize=16)
def half_diagonal(shape: tuple[int, int]) -> float:
    """Return the distance of an array's corner from its middle, in spacings; no element's path differs by more."""
    return 0.5 * float(np.hypot(shape[0] - 1, shape[1] - 1))


def series(rates: np.ndarray, longest: float, error: float) -> np.ndarray:
    """Return the coefficients (Q, K) of exp(-j rate s) as a series in s, for the Q `rates` and |s| <= `longest`.

    The terms from s^K on sum to less than `error`. The result is kept and must not be changed.
    """
    return _series(tuple(rates.tolist()), longest, error)


@lru_cache(maxsize=64)
def _series(given: tuple[float, ...], longest: float, error: float) -> np.ndarray:
    """What `series` returns for these rates."""
    rates = np.array(given)
    band = float(abs(rates).max()) * longest
    count, term = 1, band
    # The terms left out sum to at most e^band times the first of them.
    while term * np.exp(band) > error:
        count += 1
        term *= band / count
    order = np.arange(count)
    return (-1j * rates[:, None]) ** order / factorial(order)


def round_up(value: float) -> float:
    """Return the next power of sqrt(2), so that a few tables serve all samples."""
    return 2.0 ** (np.ceil(2 * np.log2(max(value * (1 + 1e-12), 2.0**-5))) / 2)


@lru_cache(maxsize=64)
def table(reach: float, count: int, error: float) -> np.ndarray:
    """Return the matrix (P, M) of eps_p J_p(2 pi (m - (M-1)/2) reach / M), eps_0 = 1 and all other eps_p = 2.

    P is a multiple of BLOCK; the orders from P on sum to less than `error`.
    """
    at = 2 * np.pi * (np.arange(count) - 0.5 * (count - 1)) * reach / count
    return aligned_copy(_bessel(_orders(reach, error), at))


def _orders(reach: float, error: float) -> int:
    """Number of orders of the expansion over `reach` cells, rounded up to a whole block."""
    band = np.pi * reach
    order = int(band) + 1
    # From this order on, each J_p is below half the J_p before it.
    while 4.0 * abs(jv(order + 1, band)) > error:
        order += 1
    return _whole_blocks(order + 1)


def _whole_blocks(count: int) -> int:
    """`count`, rounded up to a multiple of BLOCK."""
    return -(-count // BLOCK) * BLOCK


def _bessel(orders: int, x: np.ndarray) -> np.ndarray:
    """Matrix (orders, len(x)): eps_p J_p(x)."""
    p = np.arange(orders)
    return np.where(p == 0, 1.0, 2.0)[:, None] * jv(p[:, None], x)


@lru_cache(maxsize=64)
def joined(reach: float, nodes: int, count: int, error: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix (nodes x P, K) from moments to Chebyshev orders over the band, and these orders' values (K, M).

    The moments are given at `nodes` frequencies, the values at the M = `count` subcarriers.
    An entry of the moments is at most the sum of amplitudes, so the orders left out change a response by at most the
    sum of their coefficients, which is below `error`.
    """
    band = np.pi * reach * (count - 1) / count
    mix = _products(nodes, _orders(reach, error), band)
    kept = 1 + int(np.flatnonzero(abs(mix).sum(axis=0)[::-1].cumsum()[::-1] > error)[-1])
    place = np.arccos(np.linspace(-1.0, 1.0, count))
    return np.ascontiguousarray(mix[:, :kept]), aligned_copy(np.cos(np.arange(kept)[:, None] * place))


def _products(nodes: int, orders: int, band: float) -> np.ndarray:
    """Chebyshev coefficients (nodes x P, K) in x of w_q(x) eps_p J_p(band x), w_q the Lagrange weight of frequency q.

    exp(-j B x u) is the sum over k and p of eps_k eps_p (-j)^k J_((k + p) / 2)(B / 2) J_((k - p) / 2)(B / 2) T_k(x)
    T_p(u) with k - p even. Each coefficient is a product, so small ones are not lost in the rounding of large ones.
    """
    # From twice the orders on, a coefficient holds a function whose order is P at least, at half the argument.
    last = 2 * (orders + nodes)
    p, k = np.arange(orders)[:, None], np.arange(last)
    half, values = (k - p) // 2, jv(np.arange(last), 0.5 * band)
    sign = np.where((half > 0) & (half % 2 == 1), -1.0, 1.0) * np.where(p == 0, 1.0, 2.0) * ((k - p) % 2 == 0)
    bessel = sign * values[abs(half)] * values[(k + p) // 2]
    # T_i T_k = (T_(i + k) + T_(i - k)) / 2: a product's coefficients are a convolution, orders below zero counting too.
    both = np.concatenate([bessel[:, :0:-1], bessel], axis=1)
    weights, result = interpolation.coefficients(nodes), np.zeros((nodes, orders, last - nodes))
    for i in range(1 - nodes, nodes):
        share = (1.0 if i == 0 else 0.5) * weights[abs(i)]
        result += share[:, None, None] * both[:, last - 1 - i : 2 * last - 1 - i - nodes]
    result[..., 1:] *= 2.0
    return result.reshape(nodes * orders, -1)


@lru_cache(maxsize=64)
def peaks(reach: float, nodes: int, count: int, error: float) -> np.ndarray:
    """Return the largest magnitude (K,) at the subcarriers of each function of `joined`, at one frequency of `table`.

    The result is kept and must not be changed.
    """
    functions = joined(reach, nodes, count, error)[1] if nodes > 1 else table(reach, count, error)
    return abs(functions).max(axis=1)


def frequencies(
    network: Network, radio: Radar, squint: bool, error: float, longest: float | None = None
) -> np.ndarray:  # fmt: skip
    """Return the frequencies (Q,) over the carrier at which the arrays are evaluated: Chebyshev points of the band.

    The phase of an array's middle counts as range. Only the elements' paths relative to the middle's remain, so they
    alone decide how many frequencies are needed; longest: bound of these of either array, in spacings, None for the
    distance of its corner. The result is kept and must not be changed.
    """
    count = radio.subcarriers
    if not squint or count == 1:
        return np.array([radio.kappa])
    half = 0.5 * (count - 1) * network.subcarrier_spacing_hz / network.carrier_hz
    both = [half_diagonal(shape) if longest is None else longest for shape in (network.transmit, network.receive)]
    return _band_points(radio.kappa + half, half, np.pi * half * sum(both), error)


@lru_cache(maxsize=64)
def _band_points(middle: float, half: float, band: float, error: float) -> np.ndarray:
    """Chebyshev points, `half` to either side of `middle`, that interpolate exp(j band x) within `error`."""
    # Interpolation of exp(j B x) errs by at most 4 times the sum of |J_p(B)| over p >= nodes. Each J_p is below half
    # the J_p before it, so the sum is at most 2 |J_nodes(B)|.
    nodes = int(band) + 2
    while 8.0 * abs(jv(nodes, band)) > error:
        nodes += 1
    return middle + half * interpolation.points(nodes)
