"""Echoes later than the cyclic prefix: the receive window then begins with the end of the previous symbol.

Symbols follow each other without a pause. An echo of delay tau has its own symbol from tau - T_cp on; before that it
still carries the previous one, whose data are random too. The echo loses a share e = (tau - T_cp) / T_u of its window:
its amplitude falls to 1 - e, and 1 - (1 - e)^2 of its power becomes interference, spread over all range cells. Every
point is cut at its direct delay, on the reflected paths too; other echoes are cut at the delay of their range cell.
"""

import math
from functools import cache

import numpy as np

from lowalt.common.jit import INNER, LEAN
from lowalt.common.memory import aligned
from lowalt.common.network import SPEED_OF_LIGHT, Network
from lowalt.effects import transforms
from lowalt.effects.prefix import length_s as length_s
from lowalt.effects.prefix import turn as turn
from lowalt.effects.transform_loops import transformed
from lowalt.effects.view import View

SOURCE = (
    "3GPP TS 38.211, 5.3.1 (normal cyclic prefix, 144 of 2048 samples); interference beyond it: D. Kim, G. L. Stuber, "
    "Residual ISI cancellation for OFDM with applications to HDTV broadcasting, IEEE J. Sel. Areas Commun. 16(8), 1998"
)
DEFAULTS = {"prefix_s": None}


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect gets it wherever an echo may be later than the prefix."""
    return False


def lost(delay_s: np.ndarray | float, prefix_s: float, network: Network) -> np.ndarray | float:
    """Return the share of the receive window that an echo of this delay loses, 0 to 1; any shape."""
    return np.clip((delay_s - prefix_s) * network.subcarrier_spacing_hz, 0.0, 1.0)


def bound(settings: dict, view: View, others: frozenset[str] = frozenset()) -> np.ndarray:
    """Return a bound (N, P) of the cut's change of any range cell, relative to each part's peak amplitudes.

    Nothing changes for echoes within the prefix. For others the window's first samples are replaced by samples of the
    same 2-norm at most, so a range cell changes by at most 2.
    """
    ends = [view.station.transmitter or view.station, view.station]
    farthest = sum(np.linalg.norm(view.middles - np.asarray(end.position_m), axis=2) + view.radii for end in ends)
    return np.where(farthest / SPEED_OF_LIGHT > length_s(settings, view.network), 2.0, 0.0)


@LEAN
def _late(places, station, prefix_s, rate_hz, most, result):
    """Fill result (N, L) as in `first_samples` for places (N, 3, L) m; rate_hz: samples a second; most: of a symbol."""
    s0, s1, s2 = station[0], station[1], station[2]
    for n in range(len(places)):
        at, row = places[n], result[n]
        for i in range(np.uint64(places.shape[2])):
            x, y, z = at[0, i] - s0, at[1, i] - s1, at[2, i] - s2
            delay = 2 * math.sqrt(x * x + y * y + z * z) / SPEED_OF_LIGHT
            row[i] = np.int64(min(max(np.ceil((delay - prefix_s) * rate_hz), 0.0), most))


def first_samples(settings: dict, view: View) -> np.ndarray:
    """Return the number (N, L) of each point's samples, at the window's start, that carry the previous symbol."""
    network = view.network
    if view.station.transmitter is not None:
        ways = [view.places - np.asarray(end.station.position_m) for end in view.ends()]
        delay = sum(np.sqrt(np.einsum("nli,nli->nl", away, away)) for away in ways) / SPEED_OF_LIGHT
        late = (delay - length_s(settings, network)) * network.subcarriers * network.subcarrier_spacing_hz
        return np.clip(np.ceil(late), 0, network.subcarriers).astype(np.int64)
    places, count = np.ascontiguousarray(view.places.swapaxes(1, 2)), network.subcarriers
    result = np.empty((len(places), places.shape[2]), np.int64)
    _late(
        places, np.asarray(view.station.position_m, float), length_s(settings, network),
        count * network.subcarrier_spacing_hz, count, result,
    )  # fmt: skip
    return result


def convolved(
    settings: dict, network: Network, cells: np.ndarray, symbols: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the samples (N, M) of echoes in range cells (N, M): the linear convolution of the sent stream with them.

    symbols: time samples (N, M) of the symbol and of the one before it. The prefix counts in whole samples.
    """
    now, before = symbols
    count = now.shape[1]
    prefix = min(round(length_s(settings, network) * count * network.subcarrier_spacing_hz), count)
    if count == transforms.LENGTH:
        cells, now, before = (np.ascontiguousarray(one, np.complex128) for one in (cells, now, before))
        result = np.empty(cells.shape, np.complex128)
        _convolved(cells, now, before, prefix, _half_turn(count), transforms.table(), aligned(8, count), result)
        return result
    # From one symbol length before the window: the previous symbol's end, the prefix, and the symbol itself.
    stream = np.concatenate([before[:, prefix:], now[:, count - prefix :], now], axis=1)
    spectrum = np.fft.fft(stream, axis=1) * np.fft.fft(cells, 2 * count, axis=1)
    return np.fft.ifft(spectrum, axis=1)[:, count:]


@cache
def _half_turn(count: int) -> np.ndarray:
    """Cosine and sine (2, M) of -pi i / M."""
    turned = np.exp(-1j * np.pi * np.arange(count) / count)
    return np.stack([turned.real, turned.imag])


@INNER
def _circular(re, im, c_re, c_im, table, work):
    """Fill work[0] and work[1] with 256 times the circular convolution of re + j im and c_re + j c_im, all (256,).

    The given numbers are overwritten; work: (4, 256).
    """
    one_re, one_im, other_re, other_im = work[0], work[1], work[2], work[3]
    count = np.uint64(256)
    transformed(re, im, one_re, one_im, table)
    transformed(c_re, c_im, other_re, other_im, table)
    for m in range(count):
        a, b, c, d = one_re[m], one_im[m], other_re[m], other_im[m]
        re[m], im[m] = a * c - b * d, a * d + b * c
    # Real and imaginary parts change places: the inverse transform.
    transformed(im, re, one_im, one_re, table)


@LEAN
def _convolved(cells, now, before, prefix, half_turn, table, work, out):
    """Fill out (N, 256) as `convolved` does: one circular and one negacyclic convolution take no transform of 512.

    With the window's symbol B and A as long before it, the circular convolution of (B + A) / 2 plus the negacyclic one
    of (B - A) / 2 takes B up to each sample and A from there on. half_turn: (2, 256), as of `_half_turn`, makes a
    circular convolution negacyclic; table: `transform_loops.turns`; work: (8, 256).
    """
    count, scale = np.uint64(256), 1.0 / 256
    c, s = half_turn[0], half_turn[1]
    re, im, cell_re, cell_im, ways = work[0], work[1], work[2], work[3], work[4:]
    for n in range(len(out)):
        row, own, last, result = cells[n], now[n], before[n, prefix:], out[n]
        for i in range(count):
            re[i], im[i] = own[i].real, own[i].imag
            cell_re[i], cell_im[i] = row[i].real, row[i].imag
        for i in range(np.uint64(len(last))):
            re[i], im[i] = 0.5 * (own[i].real + last[i].real), 0.5 * (own[i].imag + last[i].imag)
        _circular(re, im, cell_re, cell_im, table, ways)
        for i in range(count):
            result[i] = complex(ways[0, i], ways[1, i])
            a, b = row[i].real, row[i].imag
            cell_re[i], cell_im[i] = a * c[i] - b * s[i], a * s[i] + b * c[i]
            re[i], im[i] = 0.0, 0.0
        for i in range(np.uint64(len(last))):
            a, b = 0.5 * (own[i].real - last[i].real), 0.5 * (own[i].imag - last[i].imag)
            re[i], im[i] = a * c[i] - b * s[i], a * s[i] + b * c[i]
        _circular(re, im, cell_re, cell_im, table, ways)
        for i in range(count):
            a, b = ways[0, i], ways[1, i]
            x, y = result[i].real + (a * c[i] + b * s[i]), result[i].imag + (b * c[i] - a * s[i])
            result[i] = complex(scale * x, scale * y)
