"""Motion inside a symbol: points move while an OFDM symbol lasts, so their subcarriers leak into each other.

A symbol is interpolated between a few instants. A recording is linear between its frames; a symbol in which a frame
begins has a bend there, which no interpolation follows, so it is interpolated before the bend and after it.
"""

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.effects import interpolation
from lowalt.effects.elements import farthest_m, mean_distance_m
from lowalt.effects.view import View

SOURCE = (
    "Robertson and Kaiser, The effects of Doppler spreads in OFDM(A) mobile radio systems, Proc. IEEE VTC Fall, 1999; "
    "number of instants: Trefethen, Approximation Theory and Approximation Practice, 2013, theorem 8.2"
)
DEFAULTS: dict[str, float] = {}

ELLIPSES = 1.0 + 2.0 ** np.arange(-3.0, 14.0)
"""Sums of the semi-axes of the ellipses in complex time on which a symbol's response is bounded."""


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect always gets it, where its bound exceeds the tolerance."""
    return False


def duration_s(view: View) -> float:
    """Return the useful length of an OFDM symbol, 1 / df (s)."""
    return 1.0 / view.network.subcarrier_spacing_hz


def bound(settings: dict, view: View, others: frozenset[str] = frozenset()) -> np.ndarray:
    """Return a bound (N, P) of the motion's change of any range cell, relative to each part's peak amplitudes.

    A point's path to every element changes by at most the point's travel, in the plane-wave model by 1 + D / r times
    as much, D being the element's distance from the corner. The phase at the band's centre and the amplitude change all
    subcarriers alike; sent data of unit modulus and the transforms keep the 2-norm, so no range cell changes by more.
    The rest of the phase, up to half the band away, enters by its power series, which gives expm1.
    """
    network, radio = view.network, radar(view.network, view.station)
    path = view.speeds.travel_m(duration_s(view))
    spherical = "wavefront" in others
    near = np.maximum(view.nearest_m() - path - (farthest_m(network) if spherical else 0.0), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        oblique = 1.0 + sum(mean_distance_m(network, shape) for shape in (network.transmit, network.receive)) / near
        phase = np.minimum(2 * np.pi * radio.turns * path * oblique, 2.0)
        edge = np.expm1(np.minimum(2 * np.pi * radio.bandwidth_hz / SPEED_OF_LIGHT * path * oblique, 50.0))
        stretch = (1.0 + path / near) ** 2 - 1.0
        louder = (1.0 + farthest_m(network) / near) ** 2 if spherical else 1.0
        return np.nan_to_num(louder * ((1.0 + stretch) * (phase + edge) + stretch), nan=np.inf)


def _frames(view: View) -> np.ndarray:
    """The place (N, 2) in a recording, in frames, at which each symbol begins and ends."""
    ends = view.times_s[:, None] + [0.0, duration_s(view)]
    return (view.row["start_s"] + view.row["playback"] * ends) * view.cloud.record["track_rate_hz"]


def bent(view: View) -> np.ndarray:
    """Return whether a recording's frame begins within each symbol, (N,) bool; never for other targets."""
    if not view.nodes:
        return np.zeros(len(view.times_s), np.bool_)
    place = np.floor(_frames(view))
    return place[:, 0] != place[:, 1]


def pieces(view: View, error: float = 1e-12) -> tuple[np.ndarray, np.ndarray]:
    """Return instants (Q, N) s within symbols that are bent once, and their interpolation weights (Q, N, M).

    A symbol is interpolated before its bend and after it as a whole symbol is in `instants`: on a part of a symbol the
    same number of points errs by less. Where that needs no fewer points than samples, as `every_sample`.
    """
    first, last = _frames(view).T
    samples, useful_s = view.network.subcarriers, duration_s(view)
    points = count(view, error)
    if 2 * points >= samples or (abs(np.floor(last) - np.floor(first)) > 1).any():
        delays, weights = every_sample(view)
        return delays[:, None], weights[:, None]
    bend = np.maximum(np.floor(first), np.floor(last))
    share = np.clip((bend - first) / (last - first), 1e-9, 1.0 - 1e-9)[:, None]
    at = np.arange(samples) / samples
    before, nodes = at < share, 0.5 * (interpolation.points(points) + 1.0)
    place = np.where(before, at / share, (at - share) / (1.0 - share))
    weight = interpolation.weights(points, np.clip(2.0 * place - 1.0, -1.0, 1.0).ravel())
    weight = weight.reshape(*place.shape, points).transpose(2, 0, 1)
    delays = np.concatenate([share * nodes, share + (1.0 - share) * nodes], axis=1)
    return useful_s * delays.T, np.concatenate([weight * before, weight * ~before])


def every_sample(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return a symbol's own samples as instants (M,) s, with their weights (M, M)."""
    samples = view.network.subcarriers
    return np.arange(samples) * (duration_s(view) / samples), np.eye(samples)


def instants(view: View, error: float = 1e-12) -> tuple[np.ndarray, np.ndarray]:
    """Return instants (Q,) s within a symbol and their interpolation weights (Q, M) at its M samples.

    Q Chebyshev points keep every range cell to `error` (`count`). Where that needs more points than samples, the
    instants are the samples themselves, which is exact.
    """
    samples, points = view.network.subcarriers, count(view, error)
    if points >= samples:
        return every_sample(view)
    return nodes_s(view, points), interpolation.weights(points, interpolation.samples(samples)).T


def nodes_s(view: View, points: int) -> np.ndarray:
    """Return the Chebyshev points (points,) of a symbol (s), from its end to its beginning."""
    return 0.5 * duration_s(view) * (interpolation.points(points) + 1.0)


def farther_m(view: View) -> float:
    """Return a bound of how much any point's range differs within a symbol (m), inf next to the station.

    With squint ranges count to an array's middle, which changes by the point's travel over its range times the array's
    size. Images move as far as their points and are no nearer.
    """
    travel = float(view.speeds.travel_m(duration_s(view)).max())
    room = float(view.nearest_m().min()) - travel - farthest_m(view.network)
    return travel * (1.0 + farthest_m(view.network) / room) if room > 0.0 else np.inf


def rounding(view: View) -> float:
    """Return the error of a range cell by the last binary digit of positions, relative to the sum of amplitudes.

    A coordinate is rounded by up to 2^-53 of itself, at each instant by another amount. No number of instants and of
    orders in time gives a response that is more accurate than its places.
    """
    farthest = float(abs(view.middles).max() + view.radii.max())
    return 2.0**-53 * farthest * 2 * np.pi * radar(view.network, view.station).turns


def complex_motion(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Return ellipses of complex time (E,) by semi-axes' sum, and bounds of the motion on them; None next to a station.

    The bounds (m): least range (P,) of each part's points, how far positions move (E, P), how large their imaginary
    parts are (E, P).
    """
    speeds, half = view.speeds, 0.5 * duration_s(view)
    near, rho = view.nearest_m().min(axis=0), ELLIPSES[:, None]
    wide, high = 0.5 * (rho + 1.0 / rho), 0.5 * (rho - 1.0 / rho)
    beyond = speeds.imaginary_m(high[:, 0] * half)
    # Real times reach a half-symbol times `wide` from its middle; positions also swell by the imaginary turn.
    moved = speeds.travel_m(1.0) * (1.0 + wide) * half + 2.0 * beyond + farthest_m(view.network)
    holds = (near > 4.0 * moved).all(axis=1)
    if not holds[0]:
        return None
    holds = np.logical_and.accumulate(holds)
    return ELLIPSES[holds], near, moved[holds], beyond[holds]


def count(view: View, error: float, shares: np.ndarray | None = None) -> int:
    """Return how many Chebyshev points of a symbol keep every range cell to `error`; at most its samples.

    The error is relative to the sum of peak amplitudes, of which shares (P,) are the parts', None for unknown ones. On
    an ellipse of semi-axes' sum rho subcarriers are bounded by B, so the coefficients of each order k in time are at
    most 2 B rho^-k, and interpolation errs by up to twice those of all orders from Q on. Data of unit modulus and the
    transforms keep the 2-norm of an order's coefficients, so a range cell errs by at most 4 B rho^(1-Q) / (rho - 1). It
    errs by up to twice as much where some of a symbol's samples carry another symbol, or where the symbol is
    interpolated in two pieces.
    """
    return count_of(view, complex_motion(view), error, shares)


def count_of(view: View, found: tuple | None, error: float, shares: np.ndarray | None = None) -> int:
    """Return what `count` does; found: as `complex_motion` returns it, which also bounds other series in time."""
    samples, radio = view.network.subcarriers, radar(view.network, view.station)
    if found is None:
        return samples
    rho, near, moved, beyond = found
    farthest = farthest_m(view.network)
    wave = 2 * np.pi * (2 * radio.centre_hz + radio.bandwidth_hz) / SPEED_OF_LIGHT
    # |Im d| is below a third of |Re d|, so |Im r| <= 1.07 |Im d|; elements add their distance over the range.
    growth = wave * 1.07 * beyond * (1.0 + 2.5 * farthest / (near - moved))
    largest = growth - 2.0 * np.log1p(-moved / near)
    largest = largest.max(axis=1) if shares is None else np.log(np.exp(np.minimum(largest, 700.0)) @ shares + 1e-300)
    need = 1.0 + (np.log(8.0 / (error * (rho - 1.0))) + largest) / np.log(rho)
    return min(samples, max(int(np.ceil(need.min())), 1))
