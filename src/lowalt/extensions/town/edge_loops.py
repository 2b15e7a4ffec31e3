"""The compiled loops of `knife_edge`: a screen across a ray, and the field behind it.

They find the screen's outline and the parameters nu of its edges.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly
from scipy.special import erfcx

from lowalt.machine.jit import INNER, PLAIN
from lowalt.numerics import portable
from lowalt.numerics.chebyshev_series import chebyshev_points, to_terms
from lowalt.scene.response_loops import phasor

CLEAR = -0.78
"""Below this nu an edge may be neglected. Source: ITU-R P.526-15, section 4.1."""
FREE = 2.0 * CLEAR
"""Below this nu an edge leaves a wave as it is.

From here to CLEAR its effect grows from none to all of it.
"""
FAR_M = 1e5
"""Distance of an edge around which no wave passes."""

TOP = 0
LEFT = 1
RIGHT = 2
"""Rows of the edges' parameters nu (3, R)."""

PIECES = 64
DEGREE = 7
"""Number and degree of the polynomials that stand for Fresnel's integral."""


def _pieces() -> np.ndarray:
    """Return polynomials (PIECES, 2, DEGREE + 1) that stand for Fresnel's integral.

    They are real and imaginary parts of (1 + nu) erfcx(nu (1 + j) sqrt(pi) / 2) / 2.

    Each interpolates at Chebyshev points of one piece of nu / (nu + 1), in which the function is
    smooth.
    """
    nodes = chebyshev_points(DEGREE + 1)
    shares = (np.arange(PIECES)[:, None] + 0.5 * (nodes + 1.0)) / PIECES
    nu = shares / (1.0 - shares)
    values = 0.5 * (1.0 + nu) * erfcx(nu * (0.5 + 0.5j) * np.sqrt(np.pi))
    both = np.stack([values.real, values.imag], axis=1)
    series = portable.product(both, to_terms(DEGREE + 1, DEGREE + 1))
    powers = np.zeros((DEGREE + 1, DEGREE + 1))
    for order in range(DEGREE + 1):
        powers[order, : order + 1] = cheb2poly([*[0.0] * order, 1.0])
    return portable.product(series, powers)


_PIECES = _pieces()


@INNER
def _edge(nu):
    """The field behind a knife edge over that in free space, for its parameter nu.

    The result is its real and imaginary part.

    (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from nu on, for waves exp(-j k r); -20 lg
    of its magnitude is J(nu). Source: ITU-R P.526-15, equations 7, 28 and 30; complementary error
    function: DLMF 7.7.
    """
    size = abs(nu)
    at = PIECES * size / (size + 1.0)
    piece = min(int(at), PIECES - 1)
    x = 2.0 * (at - piece) - 1.0
    real_terms = _PIECES[piece, 0]
    imag_terms = _PIECES[piece, 1]
    a = real_terms[DEGREE]
    b = imag_terms[DEGREE]
    for k in range(DEGREE - 1, -1, -1):
        a = a * x + real_terms[k]
        b = b * x + imag_terms[k]
    c, s = phasor(-0.25 * size * size)
    real = (a * c - b * s) / (1.0 + size)
    imag = (a * s + b * c) / (1.0 + size)
    if nu < 0.0:
        return 1.0 - real, -imag
    return real, imag


@PLAIN
def fields(nu, result):
    """Fill result (R,) complex with the fields behind screens over those in free space.

    nu (3, R): parameters of their edges TOP, LEFT and RIGHT, see the head of this file.
    """
    for r in range(len(result)):
        top = _edge(nu[TOP, r])
        left = _edge(nu[LEFT, r])
        right = _edge(nu[RIGHT, r])
        # The field is 1 - (a + j b) (c + j d).
        a = 1.0 - left[0] - right[0]
        b = -left[1] - right[1]
        c = 1.0 - top[0]
        d = -top[1]
        result[r] = complex(1.0 - (a * c - b * d), -(a * d + b * c))


class Outline(NamedTuple):
    """A screen across a ray.

    top: (2, 3) m, the ends of its top edge; sides: (2, 3) m, a point each of its left and its right
    edge.
    """

    top: np.ndarray
    sides: np.ndarray


@INNER
def _along(start, way, point):
    """Project a point onto a way (3,) from a start (3,) in the plan.

    Returns the share of the way, and the distance to its left (m).
    """
    x = point[0] - start[0]
    y = point[1] - start[1]
    length = math.sqrt(way[0] * way[0] + way[1] * way[1])
    share = (way[0] * x + way[1] * y) / length**2
    left_m = (way[0] * y - way[1] * x) / length
    return share, left_m


@INNER
def _longer(along_m, off_m):
    """How much longer (m) a way is that ends `off_m` beside another one of `along_m`.

    Nothing cancels.
    """
    length = math.sqrt(along_m * along_m + off_m * off_m)
    if along_m > 0.0:
        return off_m * off_m / (length + along_m)
    return length - along_m


@INNER
def _nu(off_m, share, length_m, wavelength_m):
    """The parameter nu of an edge `off_m` beyond a ray, at this share of its length.

    It is 2 sqrt(detour / wavelength).

    Equation 26 of P.526-15 has the first term of the detour alone, which is too long for a steep
    one.
    """
    share = min(max(share, 1e-4), 1.0 - 1e-4)
    detour_m = _longer(share * length_m, off_m) + _longer((1.0 - share) * length_m, off_m)
    return math.copysign(2.0 * math.sqrt(detour_m / wavelength_m), off_m)


@INNER
def _top_nu(rise_m, share, way, length_m, wavelength_m):
    """The parameter nu of a point `rise_m` straight above a way (3,), at this share of it."""
    slope = way[2] / length_m
    off_m = rise_m * math.sqrt(max(1.0 - slope * slope, 0.0))
    return _nu(off_m, share + rise_m * slope / length_m, length_m, wavelength_m)


@INNER
def _over(outline, start, way):
    """Height (m) of a screen's top edge above a way (3,) from a start (3,).

    The shares of way and edge there come second and third.
    """
    first = outline.top[0]
    last = outline.top[1]
    first_left = _along(start, way, first)[1]
    last_left = _along(start, way, last)[1]
    between = first_left - last_left
    if abs(between) <= 1e-9:
        between = 1e-9
    of_edge = first_left / between
    x = first[0] + of_edge * (last[0] - first[0])
    y = first[1] + of_edge * (last[1] - first[1])
    of_way = _along(start, way, (x, y))[0]
    rise = first[2] + of_edge * (last[2] - first[2]) - start[2] - of_way * way[2]
    return rise, of_way, of_edge


@PLAIN
def edges_nu(outline, start, ends, wavelength_m, result):
    """Fill result (3, R) with the nu of the edges TOP, LEFT and RIGHT.

    Rays go from a start (3,) to ends (R, 3).
    """
    way = np.empty(3)
    for r in range(len(ends)):
        for i in range(3):
            way[i] = ends[r, i] - start[i]
        length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        rise, share, _ = _over(outline, start, way)
        result[TOP, r] = _top_nu(rise, share, way, length, wavelength_m)
        share, left = _along(start, way, outline.sides[0])
        result[LEFT, r] = _nu(left, share, length, wavelength_m)
        share, left = _along(start, way, outline.sides[1])
        result[RIGHT, r] = _nu(-left, share, length, wavelength_m)


@PLAIN
def pass_point(outline, start, end, wavelength_m, point):
    """Set point (3,) m to where the strongest wave passes a screen's outline from start to end.

    Where two edges are passed by waves about as strong, the point lies between them.
    """
    way = end - start
    nu = np.empty((3, 1))
    edges_nu(outline, start, end.reshape(1, 3), wavelength_m, nu)
    crossing = np.empty(3)
    total = 0.0
    point[:] = 0.0
    for edge in range(3):
        if edge == TOP:
            of_edge = _over(outline, start, way)[2]
            for i in range(3):
                crossing[i] = outline.top[0, i] + of_edge * (outline.top[1, i] - outline.top[0, i])
        else:
            side = outline.sides[edge - LEFT]
            share = _along(start, way, side)[0]
            crossing[0] = side[0]
            crossing[1] = side[1]
            crossing[2] = start[2] + share * way[2]
        weight = max(nu[edge, 0] - FREE, 1e-3) ** -4
        total += weight
        for i in range(3):
            point[i] += weight * crossing[i]
    for i in range(3):
        point[i] /= total


@INNER
def _beside(edge, k, start, way, other, corner):
    """Set corner (3,) to end k of an edge (2, 3), and project it onto a way (3,).

    The way begins at a start (3,). Returns whether it projects onto the way, and its share of the
    way and distance to the left (`_along`).

    other: share of the way at which the other end projects. Where end k projects outside the way,
    the edge is cut at the way's nearer end, and the corner moved FAR_M to its side, because the
    building goes on there.
    """
    for i in range(3):
        corner[i] = edge[k, i]
    share, off = _along(start, way, corner)
    if 0.0 < share < 1.0:
        return True, share, off
    cut = (share - min(max(share, 0.0), 1.0)) / (share - other)
    for i in range(3):
        corner[i] += cut * (edge[1 - k, i] - edge[k, i])
    share, off = _along(start, way, corner)
    further = math.copysign(FAR_M, off)
    flat = math.sqrt(way[0] * way[0] + way[1] * way[1])
    corner[0] = corner[0] - further * way[1] / flat
    corner[1] = corner[1] + further * way[0] / flat
    return False, share, off + further


@INNER
def _level_top(outline, corner, way):
    """Let the top edge of an outline begin at a corner (3,) and run level, across a way (3,)."""
    for i in range(3):
        outline.top[0, i] = corner[i]
    outline.top[1, 0] = corner[0] - way[1]
    outline.top[1, 1] = corner[1] + way[0]
    outline.top[1, 2] = corner[2]


@PLAIN
def draw_outline(edges, start, end, wavelength_m, outline):
    """Fill the outline of the screen that a building's edges (E, 2, 3) form across a ray.

    The ray goes from start to end. Returns whether any edge projects onto it.
    """
    way = end - start
    corner = np.empty(3)
    crossing = np.empty(3)
    length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    most_left = -np.inf
    least_left = np.inf
    highest = -np.inf
    crossed = False
    any_edge = False
    # Until an edge is found, the screen's top lies far below the ray.
    _level_top(outline, start, way)
    outline.top[0, 2] = -FAR_M
    outline.top[1, 2] = -FAR_M
    for edge in edges:
        first, left = _along(start, way, edge[0])
        last, right = _along(start, way, edge[1])
        if (first <= 0.0 and last <= 0.0) or (first >= 1.0 and last >= 1.0):
            continue
        any_edge = True
        for k in range(2):
            other = first if k == 1 else last
            inside, share, off = _beside(edge, k, start, way, other, corner)
            nu = _nu(off, share, length, wavelength_m)
            if nu > most_left:
                most_left = nu
                outline.sides[0] = corner
            if nu < least_left:
                least_left = nu
                outline.sides[1] = corner
            rise = corner[2] - start[2] - share * way[2]
            nu = _top_nu(rise, share, way, length, wavelength_m)
            if inside and not crossed and nu > highest:
                # Beside the ray a screen is as high as its highest corner.
                highest = nu
                _level_top(outline, corner, way)
        if left * right < 0.0:
            for i in range(3):
                crossing[i] = edge[0, i] + left / (left - right) * (edge[1, i] - edge[0, i])
            share = _along(start, way, crossing)[0]
            rise = crossing[2] - start[2] - share * way[2]
            nu = _top_nu(rise, share, way, length, wavelength_m)
            if 0.0 < share < 1.0 and (not crossed or nu > highest):
                crossed = True
                highest = nu
                outline.top[0] = edge[0]
                outline.top[1] = edge[1]
    return any_edge
