"""Motion inside a symbol: points move while an OFDM symbol lasts, so their subcarriers leak into each other."""

import numpy as np

from lowalt.echo.radar import radar
from lowalt.effects import interpolation
from lowalt.effects.view import View

SOURCE = (
    "Robertson and Kaiser, The effects of Doppler spreads in OFDM(A) mobile radio systems, Proc. IEEE VTC Fall, 1999"
)
DEFAULTS: dict[str, float] = {}


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect always gets it, where its bound exceeds the tolerance."""
    return False


def duration_s(view: View) -> float:
    """Return the useful length of an OFDM symbol, 1 / df (s)."""
    return 1.0 / view.network.subcarrier_spacing_hz


def travel(view: View) -> np.ndarray:
    """Return a bound (N, P) of how far any point of each part moves within one symbol (m).

    The chord between a symbol's two ends, lengthened by 2 %: an arc of less than 0.3 rad a symbol is that close to
    its chord up to a factor of 1.004. A difference of two turns about one axis stretches by its norm over sqrt(2).
    """
    later = view.at(view.times_s + duration_s(view))
    step = np.linalg.norm(later.middles - view.middles, axis=2)
    if not view.nodes:
        turned = np.linalg.norm(later.motion.rotation - view.motion.rotation, axis=(2, 3)) / np.sqrt(2.0)
        step = step + turned * view.radii
    return 1.02 * step


def bound(settings: dict, view: View, others: frozenset[str] = frozenset()) -> np.ndarray:
    """Return a bound (N, P) of the motion's change of any range cell, relative to each part's peak amplitudes.

    The largest phase a point gains within the symbol, 2 pi times turns a metre times its travel, and its amplitude's
    change. Sent data of unit modulus and the transforms keep the 2-norm, so no range cell gains more than that.
    """
    turns = radar(view.network, view.station).turns
    path = travel(view)
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.maximum(view.nearest_m() - path, 0.0)
        stretch = (2.0 + beam_change(view)) * path / near
    return 2 * np.pi * turns * path + np.nan_to_num(stretch, nan=np.inf)


def beam_change(view: View) -> float:
    """Return a bound of the gain's change per unit of direction cosine, relative to its peak (both arrays)."""
    kappa = view.station.frequency_hz / view.network.carrier_hz
    return float(np.pi * kappa * sum(count - 1 for count in (*view.network.transmit, *view.network.receive)))


def instants(view: View, error: float = 1e-12) -> tuple[np.ndarray, np.ndarray]:
    """Return Chebyshev instants (Q,) s within a symbol and their Lagrange weights (Q, M) at its M samples.

    Q follows from the phase a point gains within a symbol, as interpolation of exp(j B x) on [-1, 1] errs by at most
    4 sum over p >= Q of |J_p(B)|, below `error`.
    """
    band = np.pi * radar(view.network, view.station).turns * float(travel(view).max()) * 1.05
    # |J_p(B)| <= (B / 2)^p / p!
    count, term = 2, (0.5 * band) ** 2 / 2.0
    while 8.0 * term > error or count < band + 2:
        count += 1
        term *= 0.5 * band / count
    samples = view.network.subcarriers
    weights = interpolation.weights(count, 2.0 * np.arange(samples) / samples - 1.0)
    return 0.5 * duration_s(view) * (interpolation.points(count) + 1.0), weights.T
