"""Beam squint: the arrays' phases follow each subcarrier's frequency, the beams' weights are set for the lowest one."""

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects.elements import distances_m, farthest_m
from lowalt.effects.view import View

SOURCE = "Mailloux, Phased Array Antenna Handbook, 3rd ed., 2018, section 1.3.4 (phase-steered arrays over a bandwidth)"
DEFAULTS: dict[str, float] = {}


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect always gets it, where its bound exceeds the tolerance."""
    return False


def bound(settings: dict, view: View, others: frozenset[str] = frozenset()) -> np.ndarray:
    """Return a bound (N, P) of squint's change of any range cell, relative to each part's peak amplitudes.

    At element i of a row the phase grows by pi i x (kappa_m - kappa_k). Its mean over the elements is half that of the
    last one, and the ways out and back add. Direction cosines are bounded by the target's own and its extent. Where
    elements see spherical waves, the path to one at distance D from the corner is up to D^2 / (2 (r - D)) longer than
    the plane wave's, and squint acts on that too; amplitudes are then up to 1 + D / (r - D) times the plane wave's.
    """
    network = view.network
    band = (network.subcarriers - 1) * network.subcarrier_spacing_hz
    across, up = _cosines(view)
    wide = 0.5 * (network.transmit[0] + network.receive[0] - 2)
    high = 0.5 * (network.transmit[1] + network.receive[1] - 2)
    plane = np.pi * band / network.carrier_hz * (wide * across + high * up)[:, None]
    if "wavefront" not in others:
        return plane
    distances = [distances_m(network, shape) for shape in (network.transmit, network.receive)]
    room = np.maximum(view.nearest_m() - farthest_m(network), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        longer = sum(float((distance**2).mean()) for distance in distances) / (2.0 * room)
        louder = (1.0 + farthest_m(network) / room) ** 2
        return np.nan_to_num(louder * (plane + 2 * np.pi * band / SPEED_OF_LIGHT * longer), nan=np.inf)


def _cosines(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of |Psi| and |Omega| over the target's points at each symbol, (N,) each."""
    if view.reflected:
        return np.ones(len(view.times_s)), np.ones(len(view.times_s))
    d = view.middles[:, 0] - np.asarray(view.station.position_m)
    r, extent = np.linalg.norm(d, axis=1), view.extent_m()
    # Two unit vectors, of ranges r and at least r - extent, are at most 2 extent / (r + r - extent) apart.
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(extent < r, 2.0 * extent / (2.0 * r - extent), 2.0)
        across, up = abs(d @ view.station.horizontal) / r, abs(d[:, 2]) / r
    return np.minimum(np.nan_to_num(across, nan=1.0) + turn, 1.0), np.minimum(np.nan_to_num(up, nan=1.0) + turn, 1.0)
