"""Cross sections that follow the aspect: a point shines along its normal, and a turning blade flashes.

Bodies are diffuse: a point's cross section goes with a power of the cosine between its normal and the line of sight.
Blades are flat facets in physical optics, as large as a point's share of its part. Each lobe's mean over all directions
is one, so that a target keeps its mean cross section; points without a normal stay isotropic.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import j1

from lowalt.common.jit import LEAN
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.effects.kept_by_arrays import KeptByArrays
from lowalt.effects.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "diffuse: Phong-type cosine lobes, Lafortune & Willems 1994; flat circular plate in physical optics, "
    "sigma = 4 pi A^2 / lambda^2 (cos 2 J1(x) / x)^2, x = 2 k a sin: Knott, Shaeffer & Tuley, Radar Cross Section, 2nd "
    "ed. 1993, chapter 6; on links: R. E. Kell, On the derivation of bistatic RCS from monostatic measurements, Proc. "
    "IEEE 53(8), 1965; blade flash: Chen, The Micro-Doppler Effect in Radar, 2011, chapter 3"
)
DEFAULTS = {"strength": 1.0, "power": 1.0, "blades": "facet"}
DRAWS_NOTHING = True

_FACETS = KeptByArrays()
"""Points and facets of the blades of each target."""


def idle(settings: dict) -> bool:
    """Return whether every point shines alike in all directions."""
    return settings["strength"] == 0


def diffuse(cosine: np.ndarray, power: float) -> np.ndarray:
    """Return the one-sided lobe 2 (p + 1) max(cosine, 0)^p of mean 1 over the sphere; any shape."""
    return np.where(cosine > 0, 2.0 * (power + 1.0) * np.maximum(cosine, 0.0) ** power, 0.0)


def _plate(cosine: np.ndarray, size: float) -> np.ndarray:
    """Lobe of a circular plate of k a = `size`, one at its normal."""
    x = 2.0 * size * np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    small = x < 1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        disc = np.where(small, 1.0, 2.0 * j1(x) / x)
    return np.where(cosine > 0, (cosine * disc) ** 2, 0.0)


@lru_cache(maxsize=256)
def _plate_mean(size: float) -> float:
    """Mean of a plate's lobe over the sphere, by Gauss-Legendre quadrature fine enough for its side lobes."""
    node, weight = np.polynomial.legendre.leggauss(32 + int(2 * size))
    angle = 0.25 * np.pi * (node + 1.0)
    return float(0.25 * np.pi * weight @ (_plate(np.cos(angle), size) * np.sin(angle)) / 2.0)


def facet(cosine: np.ndarray, size: float) -> np.ndarray:
    """Return the one-sided lobe of a flat circular facet, of mean 1 over the sphere; size: k a, its radius in rad."""
    return _plate(cosine, size) / _plate_mean(size)


def bistatic_facet(view: View, mine: np.ndarray, cosines: list[np.ndarray], size: float) -> np.ndarray:
    """Return a facet's lobe on a link for the points `mine`, (N, points), dark where it faces away from either end.

    cosines: toward both ends; size: as in `facet`. The plate's pattern follows the sum q of the unit vectors toward the
    ends: x = k a |q across the facet|, amplitude by q along its normal. Source: Kell 1965; Crispin and Siegel 1968.
    """
    ends = [np.asarray(end.station.position_m) for end in view.ends()]
    toward = [place - view.places[:, mine] for place in ends]
    q = sum(way / np.linalg.norm(way, axis=2, keepdims=True) for way in toward)
    half = 0.5 * np.linalg.norm(q, axis=2)
    along = 0.5 * (cosines[0] + cosines[1])
    x = 2.0 * size * np.sqrt(np.maximum(half**2 - along**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        disc = np.where(x < 1e-6, 1.0, 2.0 * j1(x) / x)
    return np.where((cosines[0] > 0) & (cosines[1] > 0), (along * disc) ** 2, 0.0) / _plate_mean(size)


def facet_radius_m(points: np.ndarray) -> float:
    """Return the radius (m) of one point's share of a surface sampled by `points` (L, 3), L > 1.

    Evenly spread points stand in a hexagonal lattice, each with sqrt(3)/2 of its spacing squared.
    """
    spacing = cKDTree(points).query(points, k=2)[0][:, 1].mean()
    return float(np.sqrt(np.sqrt(3.0) / 2.0 / np.pi) * spacing)


def aspect_cosine(view: View) -> np.ndarray:
    """Return the cosine (N, L) between every point's normal and its line of sight, NaN without a normal."""
    normals, places = (np.ascontiguousarray(np.swapaxes(one, 1, 2)) for one in (view.normals, view.places))
    result = np.empty((len(places), places.shape[2]))
    _cosines(normals, places, np.asarray(view.station.position_m, np.float64), result)
    return result


@LEAN
def _cosines(normals, places, station, out):
    """Fill out (N, L) with the cosines between normals and the ways from places to the station, both (N, 3, L)."""
    for n in range(len(places)):
        x, y, z, u, v, w = places[n, 0], places[n, 1], places[n, 2], normals[n, 0], normals[n, 1], normals[n, 2]
        for l in range(np.uint64(out.shape[1])):  # noqa: E741
            a, b, c = station[0] - x[l], station[1] - y[l], station[2] - z[l]
            out[n, l] = (u[l] * a + v[l] * b + w[l] * c) / math.sqrt(a * a + b * b + c * c)


@LEAN
def _lambert(cosines, known, strength, out):
    """Fill out (N, L) with the factors of `visible` of diffuse points with power 1, in one pass; known (L,)."""
    # The order of the operations is that of `diffuse` and `visible`.
    largest, rest = 2.0 * (1.0 + 1.0), 1.0 - strength
    for n in range(len(cosines)):
        cosine, row = cosines[n], out[n]
        for l in range(np.uint64(len(known))):  # noqa: E741
            lobe = largest * cosine[l] if cosine[l] > 0.0 else 0.0
            factor = math.sqrt(rest + strength * lobe)
            row[l] = factor if known[l] else 1.0


def _blades(cloud: Cloud) -> list[tuple[np.ndarray, float]]:
    """Points (indices) of each rotor with more than one point, and their facets' radius (m)."""
    rotors = cloud.parts_of("rotor")

    def facets() -> list[tuple[np.ndarray, float]]:
        """The same, worked out."""
        found = [np.flatnonzero(cloud.part == part) for part in rotors]
        return [(mine, facet_radius_m(cloud.points[mine])) for mine in found if len(mine) > 1]

    return _FACETS.of([cloud.points, cloud.part], facets, *rotors)


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude: the root of its relative cross section at this aspect.

    On a link a diffuse point's lobe is the geometric mean of those toward both ends, exact for a Lambert surface (power
    2). A facet's is that at the bisector, at the frequency times cos(beta / 2), beta the angle of both ways.
    """
    known = np.isfinite(view.cloud.normals).all(axis=1)
    if not known.any():
        return np.ones(view.places.shape[:2])
    cosines = [aspect_cosine(end) for end in view.ends()]
    strength, power = settings["strength"], settings["power"]
    if len(cosines) == 1 and power == 1.0:
        result = np.empty(cosines[0].shape)
        _lambert(cosines[0], known, strength, result)
    else:
        lobes = [diffuse(cosine, power) for cosine in cosines]
        lobe = lobes[0] if len(lobes) == 1 else np.sqrt(lobes[0] * lobes[1])
        result = np.where(known, np.sqrt(1.0 - strength + strength * lobe), 1.0)
    if settings["blades"] == "facet":
        wave = 2 * np.pi * radar(view.network, view.station).centre_hz / SPEED_OF_LIGHT
        for mine, radius in _blades(view.cloud):
            if len(cosines) == 1:
                lobe = facet(cosines[0][:, mine], wave * radius)
            else:
                lobe = bistatic_facet(view, mine, [cosine[:, mine] for cosine in cosines], wave * radius)
            result[:, mine] = np.where(known[mine], np.sqrt(1.0 - strength + strength * lobe), 1.0)
    return result
