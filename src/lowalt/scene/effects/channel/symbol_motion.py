"""Motion inside a symbol: points move while an OFDM symbol lasts.

Their subcarriers then leak into each other.

Every time sample of a symbol sees the target where it then stands. The samples are interpolated
between a few instants. A sample of an FMCW sweep is one frequency of Eq. 24 at its own time, so
Doppler frequency f moves an echo by f sweep_s range cells.
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.numerics.chebyshev_series import chebyshev_points, interpolation, orders_of
from lowalt.scene.response import ERROR
from lowalt.scene.truth import middle_of, rate
from lowalt.scene.view import Displacement, View

SOURCE = (
    "Robertson and Kaiser, The effects of Doppler spreads in OFDM(A) mobile radio systems, Proc. "
    "IEEE VTC Fall, 1999; FMCW: Stove, Linear FMCW radar techniques, IEE Proc. F 139(5), 1992; "
    "number of instants: Trefethen, Approximation Theory and Approximation Practice, 2013, theorem "
    "8.2"
)
DEFAULTS: dict[str, float] = {}
UNMODELLED = ("cw",)


def instants(settings: dict, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return instants (Q,) s after a symbol's beginning.

    Their weights (Q, M) in each of its M samples come second.

    Q Chebyshev points hold the phase that the fastest point gathers in a symbol of length T, 4 pi f
    v T / c in all.
    """
    network = view.network
    useful_s = 1.0 / network.symbol_rate_hz
    count = network.subcarriers
    moved_m = np.linalg.norm(view.at(view.times_s + useful_s).places - view.places, axis=2).max()
    highest_hz = view.station.frequency_hz + count * network.subcarrier_spacing_hz
    needed = orders_of(2.0 * np.pi * highest_hz / SPEED_OF_LIGHT * float(moved_m), ERROR)
    delays_s = 0.5 * useful_s * (chebyshev_points(needed) + 1.0)
    return delays_s, interpolation(needed, 2.0 * np.arange(count) / count - 1.0)


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return how late an FMCW echo appears by the range-Doppler coupling.

    It is f tau' sweep_s / sweep_hz.

    The frequency f is that at the end of the sweep, since f(t) tau(t) grows with tau' both by f and
    by its own slope.
    Source: Stove 1992.
    """
    network = view.network
    if network.sweep_s is None:
        return Displacement()
    way_mps = rate(lambda seen: seen.ways_m(middle_of(seen)), view)
    sweep_hz = network.subcarriers * network.subcarrier_spacing_hz
    last_hz = view.station.frequency_hz + sweep_hz
    return Displacement(delay_s=way_mps / SPEED_OF_LIGHT * last_hz * network.sweep_s / sweep_hz)
