"""Cross sections that follow the aspect.

A point shines along its normal, and a turning blade flashes.

Bodies are diffuse: a point's cross section goes with a power of the cosine between its normal and
the line of sight. Blades are flat facets in physical optics, as large as a point's share of its
part. Each lobe's mean over all directions is one, so that a target keeps its mean cross section;
points without a normal stay isotropic.
"""

from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import j1

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.numerics import portable
from lowalt.numerics.quadrature import gauss_legendre
from lowalt.scene.view import View

SOURCE = (
    "diffuse: Phong-type cosine lobes, Lafortune & Willems 1994; flat circular plate in physical "
    "optics, sigma = 4 pi A^2 / lambda^2 (cos 2 J1(x) / x)^2, x = 2 k a sin: Knott, Shaeffer & "
    "Tuley, Radar Cross Section, 2nd ed. 1993, chapter 6; on links: R. E. Kell, On the derivation "
    "of bistatic RCS from monostatic measurements, Proc. IEEE 53(8), 1965; blade flash: Chen, The "
    "Micro-Doppler Effect in Radar, 2011, chapter 3"
)
DEFAULTS = {"power": 1.0, "blades": "facet"}
ONE_SIDED = True


def diffuse(cosine: np.ndarray, power: float) -> np.ndarray:
    """Return the one-sided lobe 2 (p + 1) max(cosine, 0)^p of mean 1 over the sphere; any shape."""
    lobe = 2.0 * (power + 1.0) * portable.power(np.maximum(cosine, 0.0), power)
    return np.where(cosine > 0, lobe, 0.0)


def _plate(cosine: np.ndarray, sine: np.ndarray, size: float) -> np.ndarray:
    """Lobe of a circular plate of k a = `size`, one at its normal.

    cosine, sine: of the angle to the normal.
    """
    x = np.maximum(2.0 * size * sine, 1e-9)
    return (cosine * 2.0 * j1(x) / x) ** 2


@lru_cache(maxsize=256)
def _plate_mean(size: float) -> float:
    """Mean of a plate's lobe over the sphere.

    It is found by Gauss-Legendre quadrature fine enough for its side lobes.
    """
    node, weight = gauss_legendre(32 + int(2 * size))
    sine, cosine = portable.sine_cosine(0.25 * np.pi * (node + 1.0))
    return float(0.25 * np.pi * portable.dot(weight, _plate(cosine, sine, size) * sine) / 2.0)


def facet(cosine: np.ndarray, size: float, half_angle: np.ndarray | float = 1.0) -> np.ndarray:
    """Return the lobe of a flat circular facet, of mean 1 over the sphere.

    It is dark where the cosine is not above 0.

    cosine: of the angle between its normal and the line of sight, on a link the mean of both ends'
    cosines; size: k a, its radius in rad; half_angle: on a link cos(beta / 2), half the length of
    the sum of the unit vectors toward both ends. Source: Kell 1965; Crispin and Siegel 1968.
    """
    sine = np.sqrt(np.maximum(half_angle * half_angle - cosine * cosine, 0.0))
    return np.where(cosine > 0, _plate(cosine, sine, size), 0.0) / _plate_mean(size)


def facet_radius_m(points: np.ndarray) -> float:
    """Return the radius (m) of one point's share of a surface sampled by `points` (L, 3), L > 1.

    Evenly spread points stand in a hexagonal lattice, each with sqrt(3)/2 of its spacing squared.
    """
    distances, _ = cKDTree(points).query(points, k=2)
    spacing = np.asarray(distances)[:, 1].mean()
    return float(np.sqrt(np.sqrt(3.0) / 2.0 / np.pi) * spacing)


def aspect_cosine(view: View, place_m: np.ndarray) -> np.ndarray:
    """Return the cosine (N, L) between every point's normal and its way to a place (3,) m.

    It is NaN without a normal.
    """
    way = place_m - view.places
    return portable.dot(view.normals, way) / portable.norm(way)


def blade(
    view: View, mine: np.ndarray, cosines: list[np.ndarray], places_m: list[np.ndarray]
) -> np.ndarray:
    """Return the facets' lobe (N, points) of a rotor's points `mine`.

    cosines: (N, L), toward both ends at places_m.
    """
    wave = 2 * np.pi * radar(view.network, view.station).centre_hz / SPEED_OF_LIGHT
    size = wave * facet_radius_m(view.cloud.points[mine])
    seen = [cosine[:, mine] for cosine in cosines]
    if len(seen) == 1:
        return facet(seen[0], size)
    ways = [place_m - view.places[:, mine] for place_m in places_m]
    bisector = sum(way / portable.norm(way)[..., None] for way in ways)
    both = np.where((seen[0] > 0) & (seen[1] > 0), 0.5 * (seen[0] + seen[1]), 0.0)
    return facet(both, size, 0.5 * portable.norm(bisector))


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude.

    It is the root of its relative cross section at this aspect.

    On a link a diffuse point has the geometric mean of the lobes toward both ends, exact for a
    Lambert surface (power 2). A facet has its lobe at the bisector and at the frequency times
    cos(beta / 2), where beta is the angle between the directions toward both ends.
    """
    cloud = view.cloud
    known = np.isfinite(cloud.normals).all(axis=1)
    if not known.any():
        return np.ones(view.places.shape[:2])
    sender_m, receiver_m = view.masts_m
    places_m = [receiver_m]
    if view.station.transmitter:
        places_m = [sender_m, receiver_m]
    cosines = [aspect_cosine(view, place_m) for place_m in places_m]
    lobes = [diffuse(cosine, settings["power"]) for cosine in cosines]
    lobe = lobes[0]
    if len(lobes) == 2:
        lobe = np.sqrt(lobes[0] * lobes[1])
    if settings["blades"] == "facet":
        for rotor in cloud.parts_of("rotor"):
            mine = np.flatnonzero(cloud.part == rotor)
            if len(mine) > 1:
                lobe[:, mine] = blade(view, mine, cosines, places_m)
    return np.where(known, np.sqrt(lobe), 1.0)
