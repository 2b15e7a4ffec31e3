"""Diffraction of the direct ray over roofs and around vertical edges: knife edges and screens of finite width.

A building near or across a ray is a screen with a top and two upright edges. Its outline (4, 3) m holds the ends of the
top edge, then a place each on the left and the right edge. By Babinet's principle the field
behind it is 1 - (1 - F(left) - F(right)) (1 - F(top)) of that in free space, where F is Fresnel's integral of an edge's
parameter nu, which is positive in the shadow: the wave passes over the top and around both sides.
Of several buildings the one that weakens most counts in full, and on each side of it the next one as seen from its
edge (Deygout's construction). The field changes smoothly across the border of the shadow.
"""

import math

import numpy as np
from scipy.special import erfcx

from lowalt.extensions.town import shadow_loops
from lowalt.extensions.town.facets import Town
from lowalt.machine.jit import INNER, PLAIN
from lowalt.scene.response_loops import phasor

CLEAR = -0.78
"""Below this nu an edge leaves a wave as it is. Source: ITU-R P.526-15, section 4.1."""
SURE = 0.1
"""Where the nu of all edges of a screen lies beyond this, its outline and the traced rays must agree."""


PIECES, DEGREE = 64, 7
"""Number and degree of the polynomials that stand for Fresnel's integral."""


def _pieces() -> np.ndarray:
    """Real and imaginary parts (PIECES, 2, DEGREE + 1) of polynomials of (1 + nu) erfcx(nu (1 + j) sqrt(pi) / 2) / 2.

    Each interpolates at Chebyshev points of one piece of nu / (nu + 1), in which the function is smooth.
    """
    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    shares = (np.arange(PIECES)[:, None] + 0.5 * (nodes + 1.0)) / PIECES
    nu = shares / (1.0 - shares)
    values = 0.5 * (1.0 + nu) * erfcx(nu * (0.5 + 0.5j) * np.sqrt(np.pi))
    terms = np.linalg.solve(np.vander(nodes, increasing=True), values.T).T
    return np.ascontiguousarray(np.stack([terms.real, terms.imag], axis=1))


_PIECES = _pieces()


@INNER
def _edge(nu):
    """The field behind a knife edge over that in free space, for its parameter nu: its real and imaginary part.

    (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from nu on, for waves exp(-j k r); -20 lg of its magnitude is
    J(nu). Source: ITU-R P.526-15, equations 7, 28 and 30; complementary error function: DLMF 7.7.
    """
    size = abs(nu)
    at = PIECES * size / (size + 1.0)
    piece = min(int(at), PIECES - 1)
    x, real, imag = 2.0 * (at - piece) - 1.0, _PIECES[piece, 0], _PIECES[piece, 1]
    a, b = real[DEGREE], imag[DEGREE]
    for k in range(DEGREE - 1, -1, -1):
        a, b = a * x + real[k], b * x + imag[k]
    c, s = phasor(-0.25 * size * size)
    a, b = (a * c - b * s) / (1.0 + size), (a * s + b * c) / (1.0 + size)
    return (1.0 - a, -b) if nu < 0.0 else (a, b)


@PLAIN
def fields(nu, result):
    """Fill result (R,) complex with the fields behind screens over those in free space.

    nu (3, R): parameters of their top, left and right edges, see the head of this file.
    """
    for r in range(len(result)):
        top, left, right = _edge(nu[0, r]), _edge(nu[1, r]), _edge(nu[2, r])
        a, b, c, d = 1.0 - left[0] - right[0], -left[1] - right[1], 1.0 - top[0], -top[1]
        result[r] = complex(1.0 - (a * c - b * d), -(a * d + b * c))


FAR_M = 1e5
"""Distance of an edge around which no wave passes."""


@INNER
def _along(start, way, place):
    """Project a place onto a way (3,) from a start (3,) in the plan: share of the way, and distance to its left (m)."""
    x, y, length = place[0] - start[0], place[1] - start[1], math.sqrt(way[0] * way[0] + way[1] * way[1])
    return (way[0] * x + way[1] * y) / length**2, (way[0] * y - way[1] * x) / length


@INNER
def _nu(off_m, share, length_m, wavelength_m):
    """The parameter nu of an edge `off_m` beyond a ray, at this share of its length. Source: P.526-15, equation 26."""
    share = min(max(share, 1e-4), 1.0 - 1e-4)
    return off_m * math.sqrt(2.0 / (wavelength_m * length_m * share * (1.0 - share)))


@INNER
def _over(outline, start, way):
    """Height (m) of a screen's top edge above a way (3,) from a start (3,), and the shares of way and edge there."""
    low, high = outline[0], outline[1]
    near, far = _along(start, way, low)[1], _along(start, way, high)[1]
    part = near / (near - far if abs(near - far) > 1e-9 else 1e-9)
    share = _along(start, way, (low[0] + part * (high[0] - low[0]), low[1] + part * (high[1] - low[1])))[0]
    length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    rise_m = low[2] + part * (high[2] - low[2]) - start[2] - share * way[2]
    return rise_m * math.sqrt(max(1.0 - (way[2] / length) ** 2, 0.0)), share, part


@PLAIN
def _edges_nu(outline, start, ends, wavelength_m, result):
    """Fill result (3, R) with the nu of the top, left and right edge for rays from a start (3,) to ends (R, 3)."""
    way = np.empty(3)
    for r in range(len(ends)):
        for i in range(3):
            way[i] = ends[r, i] - start[i]
        length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        over, share, _ = _over(outline, start, way)
        result[0, r] = _nu(over, share, length, wavelength_m)
        for side in range(1, 3):
            share, left = _along(start, way, outline[1 + side])
            result[side, r] = _nu(left if side == 1 else -left, share, length, wavelength_m)


@PLAIN
def _detour(outline, start, end, wavelength_m):
    """The point (3,) m of a screen's outline by which the strongest wave passes from start to end."""
    way, nu = end - start, np.empty((3, 1))
    _edges_nu(outline, start, end.reshape(1, 3), wavelength_m, nu)
    if nu[0, 0] <= nu[1:].min():
        return outline[0] + _over(outline, start, way)[2] * (outline[1] - outline[0])
    side = outline[2] if nu[1, 0] < nu[2, 0] else outline[3]
    return np.array([side[0], side[1], start[2] + _along(start, way, side)[0] * way[2]])


@INNER
def _beside(edge, k, start, way, other, corner):
    """Set corner (3,) to end k of an edge (2, 3); return whether it projects onto the way (3,) from a start (3,), and
    its share of the way and distance to the left (`_along`).

    other: share of the way at which the other end projects. Where end k projects outside the way, the edge is cut at
    the way's nearer end, and the corner moved FAR_M to its side, because the building goes on there.
    """
    for i in range(3):
        corner[i] = edge[k, i]
    share, off = _along(start, way, corner)
    if 0.0 < share < 1.0:
        return True, share, off
    part = (share - min(max(share, 0.0), 1.0)) / (share - other)
    for i in range(3):
        corner[i] += part * (edge[1 - k, i] - edge[k, i])
    share, off = _along(start, way, corner)
    further = math.copysign(FAR_M, off)
    flat = math.sqrt(way[0] * way[0] + way[1] * way[1])
    corner[0], corner[1] = corner[0] - further * way[1] / flat, corner[1] + further * way[0] / flat
    return False, share, off + further


@PLAIN
def _outline(edges, start, end, wavelength_m, outline):
    """Fill outline (4, 3), m, of the screen that a building's edges (E, 2, 3) form across the ray from start to end;
    return whether any edge projects onto the ray."""
    way, corner, crossing = end - start, np.empty(3), np.empty(3)
    length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    most, least, highest, crossed, any_edge = -np.inf, np.inf, -np.inf, False, False
    # Until an edge is found, the screen's top lies far below the ray.
    outline[0], outline[1] = start, start
    outline[1, 0], outline[1, 1] = start[0] - way[1], start[1] + way[0]
    outline[0, 2] = outline[1, 2] = -FAR_M
    for edge in edges:
        first, left = _along(start, way, edge[0])
        last, right = _along(start, way, edge[1])
        if (first <= 0.0 and last <= 0.0) or (first >= 1.0 and last >= 1.0):
            continue
        any_edge = True
        for k in range(2):
            inside, share, off = _beside(edge, k, start, way, first if k else last, corner)
            side = _nu(off, share, length, wavelength_m)
            if side > most:
                most, outline[2] = side, corner
            if side < least:
                least, outline[3] = side, corner
            over = _nu(corner[2] - start[2] - share * way[2], share, length, wavelength_m)
            if inside and not crossed and over > highest:
                # Beside the ray a screen is as high as its highest corner.
                highest, outline[0], outline[1] = over, corner, corner
                outline[1, 0], outline[1, 1] = corner[0] - way[1], corner[1] + way[0]
        if left * right < 0.0:
            for i in range(3):
                crossing[i] = edge[0, i] + left / (left - right) * (edge[1, i] - edge[0, i])
            share = _along(start, way, crossing)[0]
            over = _nu(crossing[2] - start[2] - share * way[2], share, length, wavelength_m)
            if 0.0 < share < 1.0 and (not crossed or over > highest):
                crossed, highest, outline[0], outline[1] = True, over, edge[0], edge[1]
    return any_edge


def behind(
    edges: np.ndarray, start: np.ndarray, ends: np.ndarray, wavelength_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return the outline of the screen that a building's edges (E, 2, 3) m are to rays from start to ends (..., 3) m,
    the field there over that in free space, and the least nu of its edges; None where no ray comes near an edge."""
    outline, rays = np.empty((4, 3)), np.ascontiguousarray(ends).reshape(-1, 3)
    if not _outline(edges, start, rays.mean(axis=0), wavelength_m, outline):
        return None
    nu = np.empty((3, len(rays)))
    _edges_nu(outline, start, rays, wavelength_m, nu)
    least, result = nu.min(axis=0), np.empty(len(rays), np.complex128)
    if least.max() <= CLEAR:
        return None
    fields(nu, result)
    return outline, result.reshape(ends.shape[:-1]), least.reshape(ends.shape[:-1])


def _block(
    town: Town, buildings: np.ndarray, station_m: np.ndarray, places: np.ndarray, lit: np.ndarray, wavelength_m: float
) -> np.ndarray:
    """The direct ray's field (n, L) at places (n, L, 3) of a few symbols, past some buildings; lit: (n, L) bool."""
    found = []
    for building in buildings:
        edges = town.edges[town.of_building == building]
        if (near := behind(edges, station_m, places, wavelength_m)) is not None:
            outline, behind_it, least = near
            # An outline knows no gateways: where a ray passes through one, the building is no screen.
            behind_it = np.where(lit & (least > SURE), 1.0, behind_it)
            found.append((float(abs(behind_it).mean()), outline, edges, behind_it, least))
    if not found:
        return lit.astype(np.complex128)
    found.sort(key=lambda each: each[0])
    _, outline, _, result, least = found[0]
    top = _detour(outline, station_m, places.mean(axis=(0, 1)), wavelength_m)
    before, after = [np.ones(())], [np.ones(result.shape)]
    for _, _, edges, _, _ in found[1:] if abs(result).mean() < 1.0 and least.max() > 0.0 else ():
        for start, seen, factors in ((station_m, top, before), (top, places, after)):
            if (other := behind(edges, start, seen, wavelength_m)) is not None:
                factors.append(other[1])
    sides = [min(factors, key=lambda factor: float(abs(factor).mean())) for factors in (before, after)]
    result = result * sides[0] * sides[1]
    # A blocked point behind no outline receives nothing.
    return np.where(~lit & (least < -SURE), 0.0, result)


def direct(
    town: Town, station_m: np.ndarray, places: np.ndarray, lit: np.ndarray, wavelength_m: float, block: int
) -> np.ndarray:
    """Return the direct ray's field (N, L) at places (N, L, 3) m over that in free space; lit (N, L): what rays say.

    block: symbols for which the same edges count. Source: ITU-R P.526-15, sections 4.1 and 4.3; Babinet's principle:
    Born & Wolf, Principles of Optics, section 8.3.2; several edges: Deygout, IEEE Trans. AP-14, 1966.
    """
    result, held = lit.astype(np.complex128), np.empty(len(town.occluders.triangles), np.int64)
    building_of = town.building[town.facets.first[:-2]]
    for first in range(0, len(places), block):
        some = places[first : first + block]
        ends = np.ascontiguousarray(some.reshape(-1, 3))
        length = float(np.linalg.norm(ends - station_m, axis=1).max())
        room = -CLEAR * np.sqrt(wavelength_m * length / 8.0)
        count = shadow_loops.near(town.occluders, np.repeat(station_m[None], len(ends), axis=0), ends, room, held)
        if count:
            buildings = np.unique(building_of[town.occluders.facet[held[:count]]])
            part = lit[first : first + block]
            result[first : first + block] = _block(town, buildings, station_m, some, part, wavelength_m)
    return result
