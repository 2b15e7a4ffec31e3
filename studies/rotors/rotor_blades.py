"""Length and number of a rotor's blades, read from the comb of lines that the blades leave around the body.

A point at distance r from the axis, turning at F, is a sum of lines at multiples m of F with the Bessel functions
J_m(4 pi r g / lambda); g is the sine of the angle between the axis and the line of sight. N equal blades keep every
N-th line. J_m is small for m beyond its argument, so the comb ends at the line 4 pi R g / (lambda N): the lines of a
comb tell the blade's length R over N. Lines are told apart where they fold to different frequencies, so this works on
folded signals, and needs no rate. Equal blades leave only two more traces of N. With N even, lines k and -k have
products of one phase; with N odd, of alternating sign, since one blade comes while another goes. And blades that are
not quite equal leave weak lines at multiples of F between those of N F.
Source: Chen, The Micro-Doppler Effect in Radar, 2nd ed. 2019, ch. 3 (lines, flashes of odd and even numbers of blades).
"""

from typing import NamedTuple

import numpy as np
from rotor import Passing

MOST_LINES = 80
"""Lines on either side of the body that are looked at."""
APART_CYCLES = 2.5
"""Least distance of two folded lines, in cycles per look, at which a least squares fit tells them apart."""
LEAST_LINES = 3
"""Least lines on either side that must be told apart."""
EDGE_DB = 9.0
"""Least level of the comb over the lines beyond its edge."""
STRONGEST, DEEP_DB = 4, 18.0
"""Levels this far below the mean of the strongest lines count as none: beyond its edge a comb only fades."""
SURE, SPAN = 20.0, 2.0
"""Least gain in log likelihood by an edge, and the loss within which another edge counts as likely."""
FAINT = 0.15
"""Lines whose mean power is less than this share of that of the lines before them do not refine a frequency."""
BEYOND, UNSURE = 0.15, 0.5
"""A comb of x lines shows that many x^(1/3) lines more than x, and its interval is wider by that many to either side:
J_m fades over some m^(1/3) beyond its argument. Both were read off made signals of 1 and 4 rotors, 2 to 5
blades, with earlier settings of the edge."""
LEVEL, HELD = 5.0, 1 / 3
"""Least level of a comb over the noise, and least share of the rests' power up to the edge, at which blades are read.
Wrong combs and combs cut short hold less; the share was chosen on the default's signals."""
PARITY, PARITY_LINES = 0.5, 3
"""Least contrast at which the number of blades is called even or odd, and the least lines that have one."""


class Blades(NamedTuple):
    """Blade length over number of blades (m) with the bounds of an interval, and whether the number is odd.

    None: not told. contrast: of the two sides of the combs, positive for an even number of blades, -1 to 1; passing_hz:
    the folded passing frequency, refined.
    """

    length_over_count_m: float | None
    bounds_m: tuple[float, float] | None
    odd: bool | None
    contrast: float
    passing_hz: float


def resolved_lines(passing_hz: float, symbols: int, interval_s: float, most: int = MOST_LINES) -> int:
    """Return the largest K at which the folded lines -K..K of a comb are APART_CYCLES a look apart from each other."""
    turns = passing_hz * interval_s * np.arange(1, 2 * most + 1)
    # Lines j and k are as far apart as line j - k from the body.
    near = np.abs(turns - np.rint(turns)) * symbols < APART_CYCLES
    return int(near.argmax()) // 2 if near.any() else most


def comb(rest: np.ndarray, passing_hz: float, interval_s: float, most: int) -> np.ndarray:
    """Return the lines -most..most (2 most + 1,) of a rest (N,) complex by weighted least squares; 0 is the body's."""
    symbols = len(rest)
    weight = np.sqrt(np.hanning(symbols + 2)[1:-1])
    order = np.arange(-most, most + 1)
    waves = np.exp(2j * np.pi * passing_hz * interval_s * np.outer(np.arange(symbols), order)) * weight[:, None]
    gram, sides = waves.conj().T @ waves, waves.conj().T @ (weight * rest)
    return np.linalg.solve(gram + 1e-9 * symbols * np.eye(len(order)), sides)


def refined(rests: np.ndarray, passing_hz: float, interval_s: float, most: int) -> float:
    """Return the passing frequency (Hz) near `passing_hz` at which combs of up to `most` lines are strongest.

    rests: (B, N). The comb grows from 4 lines by half at a time, so it never slips by a line, until the lines that are
    added are FAINT; each search spans a fifth of a cycle a look at the last line.
    """
    symbols = rests.shape[-1]
    windowed = (np.hanning(symbols + 2)[1:-1] * rests).T
    found, lines, inner = passing_hz, min(most, 4), 0
    while True:
        order = np.arange(1, lines + 1)
        rates = found + 0.2 / (lines * symbols * interval_s) * np.linspace(-1, 1, 11)
        waves = np.exp(-2j * np.pi * interval_s * rates[:, None, None] * order[:, None] * np.arange(symbols))
        power = ((np.abs(waves @ windowed) ** 2) + (np.abs(waves.conj() @ windowed) ** 2)).sum(2)
        best = power.sum(1).argmax()
        if inner and power[best, inner:].mean() < FAINT * power[best, :inner].mean():
            return found
        found = float(rates[best])
        if lines == most:
            return found
        inner, lines = lines, min(most, lines + (lines + 1) // 2)


def line_levels(found: np.ndarray) -> np.ndarray:
    """Return the powers (K,) of a comb's lines, both sides together, none further below the strongest than DEEP_DB."""
    half = len(found) // 2
    power = np.abs(found) ** 2
    both = power[half + 1 :] + power[:half][::-1]
    top = np.sort(both)[-STRONGEST:].mean()
    return np.maximum(both, 10 ** (-DEEP_DB / 10) * top + 1e-300)


def edge_costs(levels: np.ndarray) -> np.ndarray:
    """Return how unlikely (K + 1,) it is that a comb with line powers `levels` (K,) ends at its line 0 .. K.

    The logarithm of the likelihood, its sign turned: two lines of complex normal values a power, one mean power up to
    the edge and another one beyond.
    """
    count = np.arange(len(levels) + 1)
    sums = np.concatenate([[0.0], np.cumsum(levels)])
    inner, outer = sums / np.maximum(count, 1), (sums[-1] - sums) / np.maximum(count[::-1], 1)
    return 2 * (count * np.log(np.maximum(inner, 1e-300)) + count[::-1] * np.log(np.maximum(outer, 1e-300)))


def length_of(levels: list[np.ndarray], line_m: np.ndarray) -> tuple[float, tuple[float, float]] | None:
    """Return blade length over number of blades (m) and its bounds from several stations' line powers; None: not told.

    levels: (K,) a station; line_m: (B,) the length over number of blades that one more line means at each station. All
    stations must agree on one length. It is not told where the lines up to the edge are not EDGE_DB above those beyond,
    or where nothing shows that the comb ends.
    """
    reach = len(levels[0])
    lengths = np.geomspace(0.8 * line_m.min(), reach * line_m.max(), 400)
    costs, inner, outer = np.zeros(len(lengths)), np.zeros(len(lengths)), np.zeros(len(lengths))
    for power, step in zip(levels, line_m, strict=True):
        last = np.minimum((lengths / step).astype(int), reach)
        sums = np.concatenate([[0.0], np.cumsum(power / power.mean())])
        costs += edge_costs(power)[last]
        inner += sums[last] / np.maximum(last, 1)
        outer += (sums[-1] - sums[last]) / np.maximum(reach - last, 1)
    never = sum(edge_costs(power)[-1] for power in levels)
    # Rising levels are no edge.
    costs[inner < 10 ** (EDGE_DB / 10) * outer] = np.inf
    best = costs.min()
    if not never - best >= SURE:
        return None
    likely = lengths[costs <= best + SPAN]
    step = float(line_m.mean())

    def moved(length: float, share: float) -> float:
        """Return a length less `share` cube roots of its lines."""
        return max(float(length) - share * step * (length / step) ** (1 / 3), 0.0)

    middle = moved(np.sqrt(likely[0] * likely[-1]), BEYOND)
    return middle, (moved(likely[0], BEYOND + UNSURE), moved(likely[-1], BEYOND - UNSURE))


def contrast_of(found: list[np.ndarray], edges: list[int]) -> float:
    """Return how much more the combs' two sides are those of an even number of blades than of an odd one, -1 to 1."""
    even = odd = whole = 0.0
    for one, edge in zip(found, edges, strict=True):
        half, last = len(one) // 2, edge
        product = one[half + 1 : half + 1 + last] * one[half - last : half][::-1]
        product = product / np.sqrt(np.maximum(np.abs(product), 1e-300))
        sign = (-1.0) ** np.arange(1, last + 1)
        even += np.abs(product.sum()) ** 2
        odd += np.abs((sign * product).sum()) ** 2
        whole += np.abs(product).sum() ** 2
    return float((even - odd) / max(whole, 1e-300))


def held_share(rests: np.ndarray, found: list[np.ndarray], edges: list[int]) -> float:
    """Return the share of the rests' power (B, N) that lines up to each comb's edge hold, the mean over stations."""
    window = np.hanning(rests.shape[-1] + 2)[1:-1]
    shares = []
    for rest, one, edge in zip(rests, found, edges, strict=True):
        half = len(one) // 2
        inner = np.sum(np.abs(one[half - edge : half + edge + 1]) ** 2)
        shares.append(inner / max(np.average(np.abs(rest) ** 2, weights=window), 1e-300))
    return float(np.mean(shares))


def blades(
    rests: np.ndarray, found: Passing, interval_s: float, wavelengths_m: np.ndarray, sines: np.ndarray
) -> Blades:
    """Return what the rests (B, N) complex of one target at B stations tell of its blades.

    found: their passing frequency (`passing_of_rests`); wavelengths_m, sines: (B,), sines of the angles between the
    rotors' axis and the lines of sight, such as cosines of the elevation for a level craft.
    """
    symbols, hertz = rests.shape[-1], found.hertz
    nothing = Blades(None, None, None, 0.0, hertz)
    if found.level < LEVEL or resolved_lines(hertz, symbols, interval_s) < LEAST_LINES:
        return nothing
    hertz = refined(rests, hertz, interval_s, resolved_lines(hertz, symbols, interval_s))
    most = resolved_lines(hertz, symbols, interval_s)
    if most < LEAST_LINES:
        return nothing
    combs = [comb(rest, hertz, interval_s, most) for rest in rests]
    line_m = wavelengths_m / (4 * np.pi * sines)
    told = length_of([line_levels(one) for one in combs], line_m)
    if told is None:
        return nothing
    edges = [min(max(int(told[0] / step), 1), most) for step in line_m]
    if held_share(rests, combs, edges) < HELD:
        return nothing
    contrast = contrast_of(combs, edges)
    odd = None if abs(contrast) < PARITY or max(edges) < PARITY_LINES else contrast < 0
    return Blades(*told, odd, contrast, hertz)
