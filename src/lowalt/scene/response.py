"""The frequency response Y[n, m] (Eq. 24) of a moving target over all paths.

Squint and spherical waves are computed on request.

A target fills few range cells, so its response is a smooth function of frequency. In each symbol,
the excess ranges of the points are summed into Chebyshev moments, at one frequency of the band or,
where array sums depend on frequency, at a few. Two matrix products turn the moments into all M
subcarriers, so that no array of symbols x points x subcarriers is needed:

    exp(-j B x u) = sum over p of eps_p (-j)^p J_p(B x) T_p(u),   |u| <= 1.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.chebyshev_series import band_tables, chebyshev_points, orders_of, over_band
from lowalt.scene import response_loops, spherical
from lowalt.scene.view import View

ERROR = 1e-11
"""Largest error of the expansions in frequency, relative to the sum of the points' amplitudes."""


class ImagePath(NamedTuple):
    """A one-way propagation path between a station and every point, given by the points' images.

    places: (N, L, 3) m, where the station sees the points (their images); coefficient: the path's
    complex factor in addition to 1/r, a number or (N, L); station_m: (3,) m, the station's image,
    where the points see the station; sender: on a link, the path of the same kind between the
    sender and the points, None where both are alike.
    """

    places: np.ndarray
    coefficient: np.ndarray | complex = 1.0
    station_m: np.ndarray | None = None
    sender: "ImagePath | None" = None

    @property
    def outward(self) -> "ImagePath":
        """The path out to the points."""
        return self.sender or self


def response(
    view: View,
    paths: Sequence[ImagePath] = (),
    factor: np.ndarray | float = 1.0,
    *,
    squint: bool = False,
    wavefront: bool = False,
) -> np.ndarray:
    """Return the subcarriers Y (N, M) complex128 of a view's target, the known symbol removed.

    paths: all but the direct one; waves go out on any path and return on any; factor: real factor
    on each point's two-way amplitude, (N, L), or (R, R, N, L) by outward and return path, the
    direct path first; squint: array phases follow the frequency of each subcarrier, beam weights do
    not; wavefront: elements see spherical waves. On a link, waves leave from the transmitter's
    array and return to the receiver's.
    Raises: InputError for a point in the station. Source: paper Eqs. 4, 7 and 24; Jacobi-Anger
    expansion; Willis, Bistatic Radar, 2nd ed. 1995, ch. 3, for links.
    """
    network = view.network
    station = view.station
    physics = (squint, wavefront)
    all_paths = [ImagePath(view.places), *paths]
    strength = _amplitudes(view, factor)
    back = _end(view, station, network.receive, all_paths, physics)
    out = back
    same = station.transmitter is None and network.transmit == network.receive
    if not same:
        sender = station.transmitter or station
        outward = [path.outward for path in all_paths]
        out = _end(view, sender, network.transmit, outward, physics)
    points = back.places[0]
    off_middle = points - points.mean(axis=2, keepdims=True)
    reach = float(np.sqrt(np.square(off_middle).sum(axis=1).max()))
    if squint:
        # Ranges are then measured from the arrays' middles, whose directions to the points differ.
        ends = (out, back)
        aperture = max(end.spacing * _half_diagonal(end.counts) for end in ends)
        nearest = min(float(end.centre.min()) for end in ends) - reach
        sine = 1.0
        if nearest > reach:
            sine = reach / nearest
        reach += 2.0 * aperture * sine
    # Rounded up to a power of sqrt(2), so that a few tables serve all samples.
    reach = 2.0 ** (math.ceil(2 * math.log2(max(reach, 1e-3))) / 2)
    band_m = network.subcarriers * network.subcarrier_spacing_hz / SPEED_OF_LIGHT
    tables = band_tables(len(out.kappas), float(2.0 * reach * band_m), network.subcarriers, ERROR)
    symbols = len(view.times_s)
    bands = len(out.kappas)
    orders = len(tables[0]) // (2 * bands)
    result = np.empty((len(out.places), len(back.places), symbols, bands, 2, orders))
    fault = response_loops.moments(out, back, same, strength, reach, result)
    if fault:
        raise InputError(
            f"position of a point at symbol {fault - 1} is that of station {station.name} (r = 0), "
            "expected r > 0"
        )
    total = np.zeros((symbols, network.subcarriers), np.complex128)
    for a, b in np.ndindex(result.shape[:2]):
        if same and b < a:
            continue
        # Out by a and back by b also stands for out by b and back by a.
        weight = 2.0 if same and a != b else 1.0
        values = over_band(weight * result[a, b].reshape(symbols, -1), tables)
        range_m = out.centre[a] + back.centre[b]
        start = -out.turns * range_m
        step = -range_m * band_m / network.subcarriers
        response_loops.add_turned(values, start, step, total)
    return total


def _amplitudes(view: View, factor: np.ndarray | float) -> np.ndarray:
    """Amplitudes (1 or R, 1 or R, N, L) of the points' echoes at unit distance.

    They are a0 lambda sqrt(sigma) / (4 pi)^1.5.
    """
    scale = radar(view.network, view.station).scale
    strength = scale * np.sqrt(view.cloud.rcs_m2) * np.asarray(factor, np.float64)
    strength = strength.reshape((1,) * (4 - strength.ndim) + strength.shape)
    shape = (*strength.shape[:2], *view.places.shape[:2])
    # Always a copy: what is broadcast is read-only, for which numba would compile the loops again.
    return np.broadcast_to(strength, shape).copy()


def _half_diagonal(counts: np.ndarray) -> float:
    """Distance of an array's corner from its middle, in spacings."""
    return 0.5 * float(np.hypot(counts[0] - 1, counts[1] - 1))


def cosines(station: Station, places: np.ndarray) -> np.ndarray:
    """Return the direction cosines (..., 2), across and up, of places (..., 3) m.

    They are as a station's array sees them.
    """
    away = places - np.asarray(station.position_m)
    across = portable.dot(away, station.horizontal)
    return np.stack([across, away[..., 2]], axis=-1) / portable.norm(away)[..., None]


def _end(
    view: View,
    station: Station,
    counts: tuple[int, int],
    paths: Sequence[ImagePath],
    physics: tuple[bool, bool],
) -> response_loops.End:
    """One end's array and paths as the loops take them; physics: squint and wavefront."""
    network = view.network
    squint, wavefront = physics
    # On a link, all frequencies are those of the signal, which is the transmitter's.
    radio = radar(network, view.station)
    beams = view.beams_of(station)
    # Rounding must not put the instant of a beam update before that update.
    current = np.searchsorted(beams.starts_s, view.times_s + 1e-9, side="right") - 1
    images = np.empty((len(paths), *view.places.swapaxes(1, 2).shape))
    coefficient = np.empty((len(paths), *view.places.shape[:2]), np.complex128)
    for number, path in enumerate(paths):
        images[number] = path.places.swapaxes(1, 2)
        coefficient[number] = path.coefficient
    mast_m = np.array(station.position_m, np.float64)
    end = response_loops.End(
        station=mast_m,
        axes=station.horizontal[:2].copy(),
        counts=np.array(counts),
        spacing=SPEED_OF_LIGHT / (2.0 * network.carrier_hz),
        beam=radio.kappa,
        kappas=frequencies(network, view.station, squint),
        squint=squint,
        turns=radio.centre_hz / SPEED_OF_LIGHT,
        aims=cosines(station, beams.aims_m)[current],
        places=images,
        coefficient=coefficient,
        # Reflection keeps distances, so images lie around their mean as the points do around
        # theirs.
        centre=portable.norm(images.mean(axis=3) - mast_m),
        gains=np.empty((0, 0, 0, 0), np.complex128),
    )
    if not wavefront:
        return end
    return end._replace(gains=spherical.gains(end, ERROR))


def frequencies(network: Network, station: Station, squint: bool) -> np.ndarray:
    """Return the frequencies (Q,), over the carrier, at which array sums are computed.

    They are Chebyshev points of the band.

    Their number follows from the elements' paths relative to the array's middle. Without squint,
    array sums are those at the lowest subcarrier.
    """
    lowest = radar(network, station).kappa
    half = 0.5 * (network.subcarriers - 1) * network.subcarrier_spacing_hz / network.carrier_hz
    if not squint or half == 0.0:
        return np.array([lowest])
    sends = _half_diagonal(np.array(network.transmit))
    hears = _half_diagonal(np.array(network.receive))
    spread = np.pi * half * (sends + hears)
    return lowest + half + half * chebyshev_points(orders_of(spread, ERROR))
