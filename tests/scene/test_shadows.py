"""Shadows: every ray against every triangle and bone, one by one.

They are also tested by closed forms of simple bodies and blades.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from lowalt.files.errors import InputError
from lowalt.scene.effects.channel import occlusion
from lowalt.scene.rays import hidden_by_bones
from lowalt.scene.view import View
from lowalt.targets.surfaces import ellipsoid
from scenes import A, link, linked, network, seen_by, target

KINDS = ("body", "rotor", "rotor")
NAMES = ("body", "rotor 0", "rotor 1")
AXES = np.array([[np.nan] * 3, [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])


def among_triangles(closed: bool, station=A, points: int = 60, count: int = 80, **changes) -> View:
    """Points among loose small triangles of a body and two turning rotors; some have no normal."""
    rng, (cloud, row) = np.random.default_rng(4), target(np.random.default_rng(4), points)
    normals = rng.normal(size=(points, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[::7] = np.nan
    cloud = replace(
        cloud,
        part=np.arange(points) % 3,
        kinds=KINDS,
        names=NAMES,
        parents=np.full(3, -1),
        axes=AXES,
        hinges=np.array([[np.nan] * 3, [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]),
        normals=normals,
    )
    corners = rng.uniform(-0.5, 0.5, (count, 1, 3)) + rng.normal(0, 0.15, (count, 3, 3))
    surfaces = {
        "subtype": "Thing",
        "vertices": corners.reshape(-1, 3),
        "faces": np.arange(3 * count).reshape(-1, 3),
        "vertex_part": np.repeat(np.arange(count) % 3, 3),
        "closed": np.full(3, closed),
        "offset_m": np.full(points, 0.02),
    }
    radio = linked(symbols=37)
    return seen_by(radio, station, cloud, row | {"phase_1_rad": 1.1} | changes, occluders=surfaces)


def one_by_one(view: View, parts) -> np.ndarray:
    """Whether triangles of `parts` hide each point (N, L).

    Each plane is crossed, and the corners hold the crossing.
    """
    held, (rotation, translation, points, part) = view.occluders, view.motion
    place = np.array(view.station.position_m)
    known = np.isfinite(view.cloud.normals).all(axis=1)
    start = points + np.where(known[:, None], 0.02 * view.cloud.normals, 0.0)
    owner = held["vertex_part"]
    mine = np.isin(owner[held["faces"][:, 0]], list(parts))
    result = np.zeros((len(rotation), len(points)), bool)
    for n in range(len(rotation)):
        corners = (
            np.einsum("kij,kj->ki", rotation[n][owner], held["vertices"]) + translation[n][owner]
        )
        corners = corners[held["faces"][mine]]
        closed = held["closed"][owner[held["faces"][mine][:, 0]]]
        begin = np.einsum("kij,kj->ki", rotation[n][part], start) + translation[n][part]
        begin += np.where(known, 0.0, 0.02 / np.linalg.norm(view.aim_m - place))[:, None] * (
            place - begin
        )
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for l, point in enumerate(begin):  # noqa: E741
            ahead = normal @ (place - point)
            share = ((corners[:, 0] - point) * normal).sum(axis=1) / ahead
            crossing = point + share[:, None] * (place - point)
            sides = [
                (
                    np.cross(corners[:, (k + 1) % 3] - corners[:, k], crossing - corners[:, k])
                    * normal
                ).sum(axis=1)
                > 0
                for k in range(3)
            ]
            hit = np.all(sides, axis=0) & (share > 0) & (share < 1) & ((ahead > 0) | ~closed)
            result[n, l] = hit.any()
    return result


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("place", [{}, {"x_m": 2.5, "y_m": 1.0, "z_m": 11.0, "vx_mps": 60.0}])
def test_points_are_hidden_as_by_every_ray_against_every_triangle(closed, place):
    view = among_triangles(closed, **place)
    rest = one_by_one(view, (0,))
    blades = one_by_one(view, (1, 2)) & ~one_by_one(view, (0,))
    assert 0.05 < rest.mean() < 0.9 and blades.mean() > 0.02
    assert len(np.unique(rest, axis=0)) > 15
    behind = occlusion.through_blades(view)
    assert 0.05 < behind < 1
    bent, opaque, clear = (
        occlusion.visible({"blades": kind}, view) for kind in ("bent", "opaque", "transparent")
    )
    np.testing.assert_allclose(bent, np.where(rest, 0.0, np.where(blades, behind, 1.0)), rtol=1e-12)
    np.testing.assert_array_equal(opaque, np.where(rest | blades, 0.0, 1.0))
    np.testing.assert_array_equal(clear, np.where(rest, 0.0, 1.0))


def test_each_way_of_a_link_has_the_root_of_its_ends_factor():
    view = among_triangles(True, link())
    ends = [one_by_one(end, range(3)) for end in view.ends()]
    assert (ends[0] != ends[1]).any()
    found = occlusion.visible({"blades": "opaque"}, view)
    np.testing.assert_array_equal(found, np.where(ends[0] | ends[1], 0.0, 1.0))
    bent, *ways = (occlusion.visible(occlusion.DEFAULTS, end) for end in (view, *view.ends()))
    np.testing.assert_allclose(bent, np.sqrt(ways[0] * ways[1]), rtol=1e-12)


def test_a_convex_body_hides_just_what_looks_away():
    sphere = ellipsoid((0.5, 0.5, 0.5), sides=24)
    middle = sphere.vertices[sphere.faces].mean(axis=1)
    a, b, c = np.moveaxis(sphere.vertices[sphere.faces], 1, 0)
    normals = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a), axis=1, keepdims=True)
    cloud, row = target(np.random.default_rng(1), len(middle))
    cloud = replace(cloud, points=middle, normals=normals, part=np.zeros(len(middle), int))
    surfaces = {
        "subtype": "Thing",
        "vertices": sphere.vertices,
        "faces": sphere.faces,
        "closed": np.ones(2, bool),
        "vertex_part": np.zeros(len(sphere.vertices), int),
        "offset_m": np.full(len(middle), 1e-9),
    }
    view = seen_by(network(), A, cloud, row, np.zeros(1), occluders=surfaces)
    away = np.einsum("nli,nli->nl", view.normals, np.array(A.position_m) - view.places) < 0
    np.testing.assert_array_equal(
        occlusion.visible(occlusion.DEFAULTS, view), np.where(away, 0.0, 1.0)
    )


@pytest.mark.parametrize("width_m", [0.0, 0.02, 0.3])
def test_waves_go_round_a_blade_as_its_slit_lets_them_through(width_m):
    edge = width_m / np.sqrt(2.0 * 0.06 * 0.2)
    real, imaginary = (
        quad(lambda t, f=f: f(np.pi / 2 * t * t), -edge, edge)[0] for f in (np.cos, np.sin)
    )
    # Of the whole plane, whose integral is 1 - j, the slit's part is missing.
    expected = abs(1 - (real - 1j * imaginary) / (1 - 1j)) ** 2
    assert occlusion.passed(width_m, 0.2, 0.06) == pytest.approx(expected, abs=1e-12)


def test_bones_hide_as_points_along_them_say():
    rng = np.random.default_rng(3)
    nodes = rng.uniform(-1, 1, (20, 8, 3))
    place = np.array([4.0, 1.0, 0.5])
    bones = np.array([[0, 1], [2, 3], [4, 5], [6, 6]])
    radius_m = np.array([0.1, 0.2, 0.15, 0.3])
    found = np.zeros((20, 8), bool)
    found[3, 2] = True
    hidden_by_bones({"bones": bones, "radius_m": radius_m}, place, nodes, found)
    assert found[3, 2] and 0.05 < found.mean() < 0.6
    for n, l in np.ndindex(found.shape):  # noqa: E741
        expected = False
        sure = (n, l) != (3, 2)
        for (a, b), radius in zip(bones, radius_m, strict=True):
            along = nodes[n, a] + np.linspace(0, 1, 2001)[:, None] * (nodes[n, b] - nodes[n, a])
            way = (place - nodes[n, l]) / np.linalg.norm(place - nodes[n, l])
            ahead = (along - nodes[n, l]) @ way
            off = np.linalg.norm(
                along - nodes[n, l] - np.maximum(ahead, 0.0)[:, None] * way, axis=1
            )
            own = np.linalg.norm(along - nodes[n, l], axis=1).min()
            if l not in (a, b) and own > radius:
                expected |= off.min() <= radius
                sure &= abs(off.min() - radius) > 1e-3
            sure &= l in (a, b) or abs(own - radius) > 1e-3
        assert found[n, l] == expected or not sure


def test_surfaces_that_are_missing_or_another_targets_are_refused():
    view = among_triangles(True)
    for occluders in (
        None,
        view.occluders | {"subtype": "Other"},
        view.occluders | {"offset_m": np.zeros(3)},
    ):
        with pytest.raises(InputError, match="make them with"):
            occlusion.visible(occlusion.DEFAULTS, replace(view, occluders=occluders))
