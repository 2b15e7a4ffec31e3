"""The compiled loops from a target's points to moments of their ranges, symbol by symbol."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.polynomials import smooth
from lowalt.machine.jit import INLINED, INNER, LEAN, kernel
from lowalt.numerics.large_matrices import multiply

LANES = 8
"""Numbers of double precision in the widest vector register."""
LEAST_TURN = 1e-30
"""Least angle off a lobe (turns), so that no sine of it is zero."""
LOOPS = kernel(error_model="numpy")
"""As LEAN, for functions that allocate."""

# cos(2 pi t) and sin(2 pi t) / t as polynomials of t^2 on [-1/2, 1/2], to rounding; written out one
# by one, all steps stay in registers.
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11 = smooth("cosine", 11)[0].tolist()
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9, _S10, _S11 = smooth("sine", 11)[0].tolist()


@INLINED
def phasor(turns):
    """Cosine and sine of 2 pi turns; the angle's rounding is that of `turns`."""
    t = turns - np.rint(turns)
    z = t * t
    c = (((((_C11 * z + _C10) * z + _C9) * z + _C8) * z + _C7) * z + _C6) * z + _C5
    c = ((((c * z + _C4) * z + _C3) * z + _C2) * z + _C1) * z + _C0
    s = (((((_S11 * z + _S10) * z + _S9) * z + _S8) * z + _S7) * z + _S6) * z + _S5
    s = ((((s * z + _S4) * z + _S3) * z + _S2) * z + _S1) * z + _S0
    return c, s * t


class End(NamedTuple):
    """One station's array and its R paths to L points at N symbols.

    station: (3,) m; axes: (2,) horizontal axis (-sin Theta, cos Theta); counts: (2,) elements
    across and up; spacing: between elements (m); beam: f_k / f0; kappas: (Q,) frequencies over the
    carrier at which array sums are taken; squint: whether they also set the phase of the array's
    middle; turns: f_c / c, turns a metre of one way; aims: (N, 2) direction cosines of the beam;
    places: (R, N, 3, L) m, images of the points; coefficient: (R, N, L) complex; centre: (R, N) m,
    range to which excess ranges refer; gains: (R, N, Q, L) complex array sums of spherical waves,
    without any entry for plane waves.
    """

    station: np.ndarray
    axes: np.ndarray
    counts: np.ndarray
    spacing: float
    beam: float
    kappas: np.ndarray
    squint: bool
    turns: float
    aims: np.ndarray
    places: np.ndarray
    coefficient: np.ndarray
    centre: np.ndarray
    gains: np.ndarray


@LEAN
def row_sum(cosine, kappa, beam, aim, count, gain):
    """Multiply gain (L,) by the sum of `count` elements in a row about their middle.

    The sum is sin(N pi x / 2) / sin(pi x / 2).

    x = kappa times the direction cosine (L,), less beam times that of the aim; elements are half a
    wavelength apart.
    """
    for i in range(np.uint64(len(gain))):
        turns = 0.25 * (kappa * cosine[i] - beam * aim)
        # Both sines keep all their digits if the angle counts from the nearest grating lobe. In an
        # even row every second lobe is negative.
        lobe = np.rint(2.0 * turns)
        sign = 1.0 - 2.0 * ((count - 1) % 2) * abs(lobe - 2.0 * np.rint(0.5 * lobe))
        off = turns - 0.5 * lobe
        if abs(off) <= LEAST_TURN:
            off = LEAST_TURN
        _, single = phasor(off)
        _, every = phasor(count * off)
        gain[i] *= sign * every / single


@INNER
def _one_way(end, path, n, work, factors, excess):
    """Fill factors (Q, 2, L) and excess ranges (L,) of one end, by one path, at symbol n.

    The factors are coefficient, array sum, 1/r and half the two-way phase; the excess is in metres.

    work: (3, L). Returns whether every point stands away from the station.
    """
    at = end.places[path, n]
    h = 0.5 * (end.counts[0] - 1)
    v = 0.5 * (end.counts[1] - 1)
    first = end.aims[0]
    aims = end.aims[n]
    clear = True
    across = work[0]
    up = work[1]
    weight = end.coefficient[path, n]
    for i in range(np.uint64(at.shape[1])):
        x = at[0, i] - end.station[0]
        y = at[1, i] - end.station[1]
        z = at[2, i] - end.station[2]
        r = np.sqrt(x * x + y * y + z * z)
        clear &= r > 0.0
        inverse = 1.0 / r
        across[i] = (end.axes[0] * x + end.axes[1] * y) * inverse
        up[i] = z * inverse
        ahead = h * across[i] + v * up[i]
        excess[i] = r - end.centre[path, n]
        turns = 0.5 * end.beam * (ahead - h * first[0] - v * first[1])
        if end.squint:
            excess[i] -= end.spacing * ahead
            turns = -0.5 * end.beam * (h * first[0] + v * first[1])
        c, s = phasor(turns - end.turns * excess[i])
        re = weight[i].real * inverse
        im = weight[i].imag * inverse
        factors[0, 0, i] = re * c - im * s
        factors[0, 1, i] = re * s + im * c
    # Entry 0 holds the factor that all frequencies share, so it is overwritten last.
    for q in range(len(end.kappas) - 1, -1, -1):
        real = factors[q, 0]
        imag = factors[q, 1]
        gain = work[2]
        if len(end.gains) > 0:
            sums = end.gains[path, n, q]
            for i in range(np.uint64(len(gain))):
                re = factors[0, 0, i]
                im = factors[0, 1, i]
                real[i] = re * sums[i].real - im * sums[i].imag
                imag[i] = re * sums[i].imag + im * sums[i].real
            continue
        for i in range(np.uint64(len(gain))):
            gain[i] = 1.0
        row_sum(across, end.kappas[q], end.beam, aims[0], end.counts[0], gain)
        row_sum(up, end.kappas[q], end.beam, aims[1], end.counts[1], gain)
        for i in range(np.uint64(len(gain))):
            real[i] = factors[0, 0, i] * gain[i]
            imag[i] = factors[0, 1, i] * gain[i]
    return clear


@INNER
def _tabulate(u, table):
    """Fill table (L, K) with the Chebyshev polynomials T_0 to T_(K - 1) at u (L,)."""
    for i in range(len(u)):
        row = table[i]
        older = 1.0
        old = u[i]
        twice = 2.0 * u[i]
        row[0] = older
        row[1] = old
        for p in range(2, len(row)):
            new = twice * old - older
            row[p] = new
            older = old
            old = new


@INNER
def _fill_moments(factors, strength, excess, reach, work, result):
    """Fill result (Q, 2, P) with the sums over points of strength x factors x T_p(u).

    u = excess / (2 reach).

    factors, excess: of the way out and of the way back, whose factors (Q, 2, L) multiply and whose
    excess ranges (L,) add; work: u (L,), polynomials (L, K), products (2 Q, L), sums (2 Q, K).
    Points are added in their order: vector registers hold several polynomials, so that the order
    does not depend on their width.
    """
    out, back = factors
    excess_out, excess_back = excess
    u, table, products, sums = work
    scale = 0.5 / reach
    for i in range(np.uint64(len(u))):
        u[i] = scale * (excess_out[i] + excess_back[i])
    _tabulate(u, table)
    for q in range(len(out)):
        out_re = out[q, 0]
        out_im = out[q, 1]
        back_re = back[q, 0]
        back_im = back[q, 1]
        real = products[2 * q]
        imag = products[2 * q + 1]
        for i in range(np.uint64(len(strength))):
            a = out_re[i]
            b = out_im[i]
            c = back_re[i]
            d = back_im[i]
            real[i] = strength[i] * (a * c - b * d)
            imag[i] = strength[i] * (a * d + b * c)
    multiply(products, table, sums)
    for q in range(len(result)):
        for p in range(result.shape[2]):
            result[q, 0, p] = sums[2 * q, p]
            result[q, 1, p] = sums[2 * q + 1, p]


@LOOPS
def moments(out, back, same, strength, reach, result):
    """Fill result (A, B, N, Q, 2, P) with the moments of every way out and back.

    Waves go out by path a and back by path b.

    out, back: `End`; same: whether both are the same array; then a, b also stands for b, a, and
    only b >= a is filled; strength: (A, B, N, L), real amplitudes; reach: m, bound of half the
    two-way excess ranges.
    Returns 1 plus the number of the first symbol with a point in a station, 0 for none.
    """
    ways_out, ways_back, symbols, nodes, _, orders = result.shape
    points = strength.shape[3]
    there = np.empty((ways_out, nodes, 2, points))
    home = np.empty((ways_back, nodes, 2, points))
    excess_there = np.empty((ways_out, points))
    excess_home = np.empty((ways_back, points))
    work = np.empty((3, points))
    # A whole number of vector registers.
    padded = (orders + LANES - 1) // LANES * LANES
    sums = (
        np.empty(points),
        np.empty((points, padded)),
        np.empty((2 * nodes, points)),
        np.empty((2 * nodes, padded)),
    )
    for n in range(symbols):
        for a in range(ways_out):
            if not _one_way(out, a, n, work, there[a], excess_there[a]):
                return n + 1
        for b in range(ways_back):
            if not same and not _one_way(back, b, n, work, home[b], excess_home[b]):
                return n + 1
        for a in range(ways_out):
            for b in range(ways_back):
                if same and b < a:
                    continue
                homeward = home[b]
                excess = excess_home[b]
                if same:
                    homeward = there[b]
                    excess = excess_there[b]
                amplitudes = strength[a % strength.shape[0], b % strength.shape[1], n]
                factors = (there[a], homeward)
                ranges = (excess_there[a], excess)
                _fill_moments(factors, amplitudes, ranges, reach, sums, result[a, b, n])
    return 0


@LOOPS
def add_turned(values, start, step, result):
    """Add values exp(j 2 pi (start + (m - (M - 1) / 2) step)) to result (N, M).

    start, step: (N,) turns.

    values: (N, 2, M), real and imaginary parts.
    """
    middle = 0.5 * (result.shape[1] - 1)
    for n in range(len(result)):
        real = values[n, 0]
        imag = values[n, 1]
        out = result[n]
        first = start[n] - np.rint(start[n])
        for m in range(np.uint64(result.shape[1])):
            c, s = phasor(first + (np.float64(m) - middle) * step[n])
            out[m] += complex(real[m] * c - imag[m] * s, real[m] * s + imag[m] * c)
