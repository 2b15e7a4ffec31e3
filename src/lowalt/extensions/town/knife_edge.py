"""Diffraction of the direct ray over roofs and around vertical edges: knife edges and screens of
finite width.

A building near or across a ray is a screen with a top and two upright edges. Its outline (4, 3) m
holds the ends of the top edge, then a place each on the left and the right edge. By Babinet's
principle the field behind it is 1 - (1 - F(left) - F(right)) (1 - F(top)) of that in free space,
where F is Fresnel's integral of an edge's parameter nu, which is positive in the shadow: the wave
passes over the top and around both sides. Of several buildings the one that blocks most counts in
full, and on each side of it the next one as seen from its edge (Deygout's construction). A choice
between buildings would make the field jump where a target moves on, so buildings that block nearly
as much share the weight, and edges near which a ray passes begin to count gradually. The field
still jumps where a ray enters a gateway, which an outline does not know, and at few places of long
streets: along 134 m of street in `studies/town/blocks.geojson`, in steps of 1 cm, five times by
more than 3 % of itself.
"""

import math

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly
from scipy.special import erfcx

from lowalt.extensions.town import shadow_loops
from lowalt.extensions.town.facets import Town
from lowalt.machine.jit import INNER, PLAIN
from lowalt.numerics import portable
from lowalt.numerics.chebyshev_series import chebyshev_points, to_terms
from lowalt.scene.response_loops import phasor

CLEAR = -0.78
"""Below this nu an edge may be neglected. Source: ITU-R P.526-15, section 4.1."""
FREE = 2.0 * CLEAR
"""Below this nu an edge leaves a wave as it is; from here to CLEAR its effect grows from none to
all of it.
"""
ALIKE = 0.8
"""Buildings whose nu is more than this share of the way from FREE to the largest nu count with it.
"""
SURE = 0.1
"""Where the nu of all edges of a screen lies beyond this, its outline and the traced rays must
agree.
"""


PIECES = 64
DEGREE = 7
"""Number and degree of the polynomials that stand for Fresnel's integral."""


def _pieces() -> np.ndarray:
    """Real and imaginary parts (PIECES, 2, DEGREE + 1) of polynomials of (1 + nu) erfcx(nu (1 + j)
    sqrt(pi) / 2) / 2.

    Each interpolates at Chebyshev points of one piece of nu / (nu + 1), in which the function is
    smooth.
    """
    nodes = chebyshev_points(DEGREE + 1)
    shares = (np.arange(PIECES)[:, None] + 0.5 * (nodes + 1.0)) / PIECES
    nu = shares / (1.0 - shares)
    values = 0.5 * (1.0 + nu) * erfcx(nu * (0.5 + 0.5j) * np.sqrt(np.pi))
    parts = np.stack([values.real, values.imag], axis=1)
    series = portable.product(parts, to_terms(DEGREE + 1, DEGREE + 1))
    powers = np.zeros((DEGREE + 1, DEGREE + 1))
    for order in range(DEGREE + 1):
        powers[order, : order + 1] = cheb2poly([*[0.0] * order, 1.0])
    return portable.product(series, powers)


_PIECES = _pieces()


@INNER
def _edge(nu):
    """The field behind a knife edge over that in free space, for its parameter nu: its real and
    imaginary part.

    (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from nu on, for waves exp(-j k r); -20 lg
    of its magnitude is J(nu). Source: ITU-R P.526-15, equations 7, 28 and 30; complementary error
    function: DLMF 7.7.
    """
    size = abs(nu)
    at = PIECES * size / (size + 1.0)
    piece = min(int(at), PIECES - 1)
    x = 2.0 * (at - piece) - 1.0
    real = _PIECES[piece, 0]
    imag = _PIECES[piece, 1]
    a = real[DEGREE]
    b = imag[DEGREE]
    for k in range(DEGREE - 1, -1, -1):
        a = a * x + real[k]
        b = b * x + imag[k]
    c, s = phasor(-0.25 * size * size)
    a, b = (a * c - b * s) / (1.0 + size), (a * s + b * c) / (1.0 + size)
    return (1.0 - a, -b) if nu < 0.0 else (a, b)


@PLAIN
def fields(nu, result):
    """Fill result (R,) complex with the fields behind screens over those in free space.

    nu (3, R): parameters of their top, left and right edges, see the head of this file.
    """
    for r in range(len(result)):
        top = _edge(nu[0, r])
        left = _edge(nu[1, r])
        right = _edge(nu[2, r])
        a = 1.0 - left[0] - right[0]
        b = -left[1] - right[1]
        c = 1.0 - top[0]
        d = -top[1]
        result[r] = complex(1.0 - (a * c - b * d), -(a * d + b * c))


FAR_M = 1e5
"""Distance of an edge around which no wave passes."""


@INNER
def _along(start, way, place):
    """Project a place onto a way (3,) from a start (3,) in the plan: share of the way, and distance
    to its left (m).
    """
    x = place[0] - start[0]
    y = place[1] - start[1]
    length = math.sqrt(way[0] * way[0] + way[1] * way[1])
    return (way[0] * x + way[1] * y) / length**2, (way[0] * y - way[1] * x) / length


@INNER
def _longer(along_m, off_m):
    """How much longer (m) a way is that ends `off_m` beside another one of `along_m`, without
    cancellation.
    """
    length = math.sqrt(along_m * along_m + off_m * off_m)
    return off_m * off_m / (length + along_m) if along_m > 0.0 else length - along_m


@INNER
def _nu(off_m, share, length_m, wavelength_m):
    """The parameter nu of an edge `off_m` beyond a ray, at this share of its length: 2 sqrt(detour
    / wavelength).

    Equation 26 of P.526-15 has the first term of the detour alone, which is too long for a steep
    one.
    """
    share = min(max(share, 1e-4), 1.0 - 1e-4)
    detour_m = _longer(share * length_m, off_m) + _longer((1.0 - share) * length_m, off_m)
    return math.copysign(2.0 * math.sqrt(detour_m / wavelength_m), off_m)


@INNER
def _top_nu(rise_m, share, way, length_m, wavelength_m):
    """The parameter nu of a place `rise_m` straight above a way (3,), at this share of it."""
    slope = way[2] / length_m
    off_m = rise_m * math.sqrt(max(1.0 - slope * slope, 0.0))
    return _nu(off_m, share + rise_m * slope / length_m, length_m, wavelength_m)


@INNER
def _over(outline, start, way):
    """Height (m) of a screen's top edge above a way (3,) from a start (3,), and the shares of way
    and edge there.
    """
    low = outline[0]
    high = outline[1]
    near = _along(start, way, low)[1]
    far = _along(start, way, high)[1]
    part = near / (near - far if abs(near - far) > 1e-9 else 1e-9)
    share = _along(
        start, way, (low[0] + part * (high[0] - low[0]), low[1] + part * (high[1] - low[1]))
    )[0]
    return low[2] + part * (high[2] - low[2]) - start[2] - share * way[2], share, part


@PLAIN
def _edges_nu(outline, start, ends, wavelength_m, result):
    """Fill result (3, R) with the nu of the top, left and right edge for rays from a start (3,) to
    ends (R, 3).
    """
    way = np.empty(3)
    for r in range(len(ends)):
        for i in range(3):
            way[i] = ends[r, i] - start[i]
        length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        rise, share, _ = _over(outline, start, way)
        result[0, r] = _top_nu(rise, share, way, length, wavelength_m)
        for side in range(1, 3):
            share, left = _along(start, way, outline[1 + side])
            result[side, r] = _nu(left if side == 1 else -left, share, length, wavelength_m)


def _shares(nu: np.ndarray) -> np.ndarray:
    """Weights (B, ...), of sum 1, of B edges or buildings with parameters nu (B, ...): that of the
    largest nu, and of those that come near it. They change smoothly with nu, and are 0 where
    another nu is much larger."""
    blocking = np.maximum(nu - FREE, 0.0)
    most = blocking.max(axis=0)
    relative = np.divide(blocking, most, out=np.ones_like(blocking), where=most > 0.0)
    weight = np.square(np.maximum(relative - ALIKE, 0.0))
    return weight / weight.sum(axis=0)


@PLAIN
def _passed(outline, start, end, wavelength_m, point):
    """Set point (3,) m to that of a screen's outline by which the strongest wave passes from start
    to end; where two edges are passed by waves about as strong, to one between them."""
    way = end - start
    nu = np.empty((3, 1))
    total = 0.0
    _edges_nu(outline, start, end.reshape(1, 3), wavelength_m, nu)
    place = np.empty(3)
    point[:] = 0.0
    for side in range(3):
        if side == 0:
            part = _over(outline, start, way)[2]
            for i in range(3):
                place[i] = outline[0, i] + part * (outline[1, i] - outline[0, i])
        else:
            share = _along(start, way, outline[1 + side])[0]
            place[0], place[1] = outline[1 + side, 0], outline[1 + side, 1]
            place[2] = start[2] + share * way[2]
        weight = max(nu[side, 0] - FREE, 1e-3) ** -4
        total += weight
        for i in range(3):
            point[i] += weight * place[i]
    for i in range(3):
        point[i] /= total


@INNER
def _beside(edge, k, start, way, other, corner):
    """Set corner (3,) to end k of an edge (2, 3); return whether it projects onto the way (3,) from
    a start (3,), and its share of the way and distance to the left (`_along`).

    other: share of the way at which the other end projects. Where end k projects outside the way,
    the edge is cut at the way's nearer end, and the corner moved FAR_M to its side, because the
    building goes on there.
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
    """Fill outline (4, 3), m, of the screen that a building's edges (E, 2, 3) form across the ray
    from start to end; return whether any edge projects onto the ray."""
    way = end - start
    corner = np.empty(3)
    crossing = np.empty(3)
    length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    most = -np.inf
    least = np.inf
    highest = -np.inf
    crossed = False
    any_edge = False
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
                most = side
                outline[2] = corner
            if side < least:
                least = side
                outline[3] = corner
            over = _top_nu(corner[2] - start[2] - share * way[2], share, way, length, wavelength_m)
            if inside and not crossed and over > highest:
                # Beside the ray a screen is as high as its highest corner.
                highest, outline[0], outline[1] = over, corner, corner
                outline[1, 0], outline[1, 1] = corner[0] - way[1], corner[1] + way[0]
        if left * right < 0.0:
            for i in range(3):
                crossing[i] = edge[0, i] + left / (left - right) * (edge[1, i] - edge[0, i])
            share = _along(start, way, crossing)[0]
            over = _top_nu(
                crossing[2] - start[2] - share * way[2], share, way, length, wavelength_m
            )
            if 0.0 < share < 1.0 and (not crossed or over > highest):
                crossed, highest, outline[0], outline[1] = True, over, edge[0], edge[1]
    return any_edge


def behind(
    edges: np.ndarray, start: np.ndarray, ends: np.ndarray, wavelength_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return the outline of the screen that a building's edges (E, 2, 3) m are to rays from start
    to ends (..., 3) m, the field there over that in free space, and the least nu of its edges; None
    where no ray comes near an edge."""
    outline = np.empty((4, 3))
    rays = np.ascontiguousarray(ends).reshape(-1, 3)
    if not _outline(edges, start, rays.mean(axis=0), wavelength_m, outline):
        return None
    nu = np.empty((3, len(rays)))
    _edges_nu(outline, start, rays, wavelength_m, nu)
    least = nu.min(axis=0)
    result = np.empty(len(rays), np.complex128)
    if least.max() <= FREE:
        return None
    fields(nu, result)
    begun = np.clip((least - FREE) / (CLEAR - FREE), 0.0, 1.0)
    result = 1.0 + begun * begun * (3.0 - 2.0 * begun) * (result - 1.0)
    return outline, result.reshape(ends.shape[:-1]), least.reshape(ends.shape[:-1])


def _next(
    others: list[np.ndarray], start: np.ndarray, ends: np.ndarray, wavelength_m: float
) -> np.ndarray | float:
    """The field (...) behind the building that blocks most on the way from start to ends (..., 3)
    m.

    others: the edges (E, 2, 3) m of each building that may.
    """
    found = [behind(edges, start, ends, wavelength_m) for edges in others]
    found = [near for near in found if near is not None]
    if not found:
        return 1.0
    shares = _shares(np.stack([least for _, _, least in found]))
    return sum(share * field for share, (_, field, _) in zip(shares, found, strict=True))


def _past(
    screens: list[np.ndarray],
    station_m: np.ndarray,
    places: np.ndarray,
    lit: np.ndarray,
    wavelength_m: float,
) -> np.ndarray:
    """The direct ray's field (L,) at places (L, 3) m past buildings, each given by its edges (E, 2,
    3) m; lit: (L,).
    """
    near = []
    outlines = []
    passed = []
    blocking = []
    for edges in screens:
        screen = behind(edges, station_m, places, wavelength_m)
        if screen is None:
            continue
        outline, field, least = screen
        # An outline knows no gateways: where a ray passes through one, the building is no screen.
        through = lit & (least > SURE)
        near.append(edges)
        outlines.append(outline)
        passed.append(np.where(through, 1.0, field))
        blocking.append(np.where(through, FREE, least))
    if not near:
        return lit.astype(np.complex128)
    result = np.zeros(lit.shape, np.complex128)
    point = np.empty(3)
    for k, share in enumerate(_shares(np.stack(blocking))):
        if not share.any():
            continue
        field = passed[k]
        others = near[:k] + near[k + 1 :]
        _passed(outlines[k], station_m, places.mean(axis=0), wavelength_m, point)
        beside = _next(others, station_m, point, wavelength_m) * _next(
            others, point, places, wavelength_m
        )
        # Behind a building that takes J dB, those on its sides have this share of their effect.
        size = np.sqrt(field.real * field.real + field.imag * field.imag)
        loss_db = -20.0 / portable.LN_10 * portable.log(np.clip(size, 1e-20, 1.0))
        result += share * field * (1.0 + (1.0 - portable.exp(-loss_db / 6.0)) * (beside - 1.0))
    # A blocked point behind no outline receives nothing.
    return np.where(~lit & (np.max(blocking, axis=0) < -SURE), 0.0, result)


def direct(
    town: Town, station_m: np.ndarray, places: np.ndarray, lit: np.ndarray, wavelength_m: float
) -> np.ndarray:
    """Return the direct ray's field (N, L) at places (N, L, 3) m over that in free space; lit (N,
    L): what rays say.

    Source: ITU-R P.526-15, sections 4.1 and 4.3; Babinet's principle: Born & Wolf, Principles of
    Optics, section 8.3.2; several edges: Deygout, IEEE Trans. AP-14, 1966; how those on the sides
    begin to count: the factor T of cascaded knife edges in ITU-R P.526-12, section 4.5.2.
    """
    result = lit.astype(np.complex128)
    held = np.empty(len(town.occluders.triangles), np.int64)
    building_of = town.building[town.facets.first[:-2]]
    starts = np.repeat(station_m[None], places.shape[1], axis=0)
    for symbol, ends in enumerate(places):
        length = float(portable.norm(ends - station_m).max())
        room = -FREE * np.sqrt(wavelength_m * length / 8.0)
        count = shadow_loops.near(town.occluders, starts, ends, room, held)
        if count:
            buildings = np.unique(building_of[town.occluders.facet[held[:count]]])
            screens = [town.edges[town.of_building == building] for building in buildings]
            result[symbol] = _past(screens, station_m, ends, lit[symbol], wavelength_m)
    return result
