"""Diffraction of the direct ray over roofs and around vertical edges: knife edges and screens of finite width.

A building near or across a ray is a screen with a top and two upright edges. By Babinet's principle the field
behind it is 1 - (1 - F(left) - F(right)) (1 - F(top)) of that in free space, where F is Fresnel's integral of an edge's
parameter nu, which is positive in the shadow: the wave passes over the top and around both sides.
Of several buildings the one that weakens most counts in full, and on each side of it the next one as seen from its
edge (Deygout's construction). The field changes smoothly across the border of the shadow.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import fresnel

from lowalt.scene.town import shadow_loops
from lowalt.scene.town.facets import Town

CLEAR = -0.78
"""Below this nu an edge leaves a wave as it is. Source: ITU-R P.526-15, section 4.1."""
SURE = 0.1
"""Where all edges of a screen have a nu beyond this, its outline and what rays say must agree."""


def field(nu: np.ndarray) -> np.ndarray:
    """Return the field behind a knife edge over that in free space, complex, for parameters nu of any shape.

    (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from nu on, for waves exp(-j k r); -20 lg of its magnitude is
    J(nu). Source: ITU-R P.526-15, equations 7, 28 and 30.
    """
    sine, cosine = fresnel(nu)
    return 0.5 * (1.0 + 1.0j) * ((0.5 - cosine) - 1.0j * (0.5 - sine))


class Screen(NamedTuple):
    """The outline of a building across a ray: its top edge (2, 3) m, None for none, and the places (2,) m, in the plan,
    of its left and right edges."""

    top: np.ndarray
    left: np.ndarray
    right: np.ndarray


def _along(start: np.ndarray, ends: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where places (..., 2 or 3) project onto the ways from a start (3,) to ends (..., 3) in the plan, as shares of the
    ways, and how far to the left of them the places are (m)."""
    way, off = (ends - start)[..., :2], places[..., :2] - start[:2]
    length = np.sqrt((way * way).sum(axis=-1))
    left = (way[..., 0] * off[..., 1] - way[..., 1] * off[..., 0]) / length
    return (way * off).sum(axis=-1) / length**2, left


def _nu(off_m: np.ndarray, share: np.ndarray, length_m: np.ndarray, wavelength_m: float) -> np.ndarray:
    """The parameter nu of an edge `off_m` beyond a ray, at this share of its length. Source: P.526-15, equation 26."""
    share = np.clip(share, 1e-4, 1.0 - 1e-4)
    return off_m * np.sqrt(2.0 / (wavelength_m * length_m * share * (1.0 - share)))


def _edges_nu(
    screen: Screen, start: np.ndarray, ends: np.ndarray, wavelength_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nu of the top, the left and the right edge for rays from a start (3,) to ends (..., 3)."""
    length = np.linalg.norm(ends - start, axis=-1)
    (_, left_p), (_, left_q) = _along(start, ends, screen.top[0]), _along(start, ends, screen.top[1])
    apart = left_p - left_q
    part = left_p / np.where(abs(apart) > 1e-9, apart, 1e-9)
    crossing = screen.top[0] + part[..., None] * (screen.top[1] - screen.top[0])
    share, _ = _along(start, ends, crossing)
    rise = (ends - start)[..., 2]
    over = (crossing[..., 2] - start[2] - share * rise) * np.sqrt(np.maximum(1.0 - (rise / length) ** 2, 0.0))
    result = [_nu(over, share, length, wavelength_m)]
    for place, sign in ((screen.left, 1.0), (screen.right, -1.0)):
        share, left = _along(start, ends, place)
        result.append(_nu(sign * left, share, length, wavelength_m))
    return tuple(result)


def screen(edges: np.ndarray, start: np.ndarray, end: np.ndarray, wavelength_m: float) -> Screen | None:
    """Return the screen that a building's edges (E, 2, 3) m are to the ray from start to end, (3,) m each.

    None where no edge crosses the upright plane through the ray between its ends.
    """
    share, left = _along(start, end, edges)
    across = left[:, 0] * left[:, 1] < 0.0
    between = (share > 0.0) & (share < 1.0)
    if not (across & between.any(axis=1)).any() or not between.any():
        return None
    cut = np.flatnonzero(across & between.any(axis=1))
    part = left[cut, 0] / (left[cut, 0] - left[cut, 1])
    crossing = edges[cut, 0] + part[:, None] * (edges[cut, 1] - edges[cut, 0])
    at, _ = _along(start, end, crossing)
    length = np.linalg.norm(end - start)
    over = np.where((at > 0.0) & (at < 1.0), crossing[:, 2] - start[2] - at * (end[2] - start[2]), -np.inf)
    top = edges[cut[_nu(over, at, length, wavelength_m).argmax()]]
    sides = np.where(between, _nu(left, share, length, wavelength_m), np.nan)
    plan = edges[..., :2].reshape(-1, 2)
    return Screen(top, plan[np.nanargmax(sides)], plan[np.nanargmin(sides)])


def behind(shape: Screen, start: np.ndarray, ends: np.ndarray, wavelength_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the field at ends (..., 3) m behind a screen over that in free space, and the least nu of its edges."""
    top, left, right = _edges_nu(shape, start, ends, wavelength_m)
    dark = (1.0 - field(left) - field(right)) * (1.0 - field(top))
    return 1.0 - dark, np.minimum(np.minimum(left, right), top)


def _detour(shape: Screen, start: np.ndarray, end: np.ndarray, wavelength_m: float) -> np.ndarray:
    """The point (3,) m of a screen's outline by which the strongest wave passes from start to end."""
    top, left, right = _edges_nu(shape, start, end, wavelength_m)
    if top <= min(left, right):
        share, _ = _along(start, end, shape.top.mean(axis=0))
        (_, left_p), (_, left_q) = (_along(start, end, corner) for corner in shape.top)
        return shape.top[0] + left_p / (left_p - left_q) * (shape.top[1] - shape.top[0])
    side = shape.left if left < right else shape.right
    share, _ = _along(start, end, side)
    return np.array([*side, start[2] + share * (end[2] - start[2])])


def _block(
    town: Town, buildings: np.ndarray, station_m: np.ndarray, places: np.ndarray, lit: np.ndarray, wavelength_m: float
) -> np.ndarray:
    """The direct ray's field (n, L) at places (n, L, 3) of a few symbols, past some buildings; lit: (n, L) bool."""
    middle, found = places.mean(axis=(0, 1)), []
    for building in buildings:
        edges = town.edges[town.of_building == building]
        shape = screen(edges, station_m, middle, wavelength_m)
        if shape is None:
            continue
        behind_it, least = behind(shape, station_m, places, wavelength_m)
        if least.max() > CLEAR:
            # An outline knows no gateways: where a ray passes through one, the building is no screen.
            behind_it = np.where(lit & (least > SURE), 1.0, behind_it)
            found.append((float(abs(behind_it).mean()), shape, edges, behind_it, least))
    if not found:
        return lit.astype(np.complex128)
    found.sort(key=lambda each: each[0])
    _, shape, _, result, least = found[0]
    top = _detour(shape, station_m, middle, wavelength_m)
    before, after = [np.ones(())], [np.ones(result.shape)]
    for _, _, edges, _, _ in found[1:] if abs(result).mean() < 1.0 and least.max() > 0.0 else ():
        for start, end, seen, factors in ((station_m, top, top, before), (top, middle, places, after)):
            other = screen(edges, start, end, wavelength_m)
            if other is not None:
                factors.append(behind(other, start, seen, wavelength_m)[0])
    sides = [min(factors, key=lambda factor: float(abs(factor).mean())) for factors in (before, after)]
    result = result * sides[0] * sides[1]
    # A dark point that no outline covers gets nothing.
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
