"""Primitive surfaces: closed, outward, of the volume geometry says, and the inside test against formulas."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.targets.surfaces import (
    Surface,
    airfoil,
    box,
    cylinder,
    ellipsoid,
    foil,
    hull,
    inside,
    loft,
    merged,
    ring,
    superellipse,
    tube,
    volume,
)  # fmt: skip

LENGTH = st.floats(0.01, 10)


def assert_closed(surface: Surface) -> None:
    """Assert by trimesh that the surface is one closed shell with consistent outward faces."""
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume > 0
    assert volume(surface) == pytest.approx(mesh.volume, rel=1e-9)


@pytest.mark.parametrize(
    "surface",
    [
        ellipsoid((1, 2, 3)),
        cylinder(0.3, (0, 0, 0), (1, 2, -1)),
        tube([(0, 0, 0), (0, 1, 0.2), (0, 2, 0)], [0.3, 0.2, 0.1]),
        tube([(0, 0, 1), (0, 0, 0)], 0.1),
        hull([(1, 0.3, -0.1, 0.2), (0, 0.5, -0.2, 0.4), (-1, 0.2, 0, 0.1)], bow=0.1),
        hull([(-1, 0.3, -0.1, 0.2), (1, 0.5, -0.2, 0.4)], bow=0.1),
        box((1, 2, 3), (4, 5, 6)),
        ring(superellipse(0.1, 0.2) + np.array([1, 0])),
        foil([(0, 0, 0, 0.2, 0.3), (1, 0.1, 0, 0.1, 0.1)]),
    ],
    ids=lambda surface: len(surface.faces),
)
def test_primitives_are_closed_and_outward(surface):
    assert_closed(surface)
    assert_closed(surface.mapped(np.diag([-1.0, 1, 1])).moved((1, 2, 3)))


@settings(max_examples=30, deadline=None)
@given(LENGTH, LENGTH, LENGTH, st.integers(0, 2**32 - 1))
def test_inside_agrees_with_the_ellipsoid_formula(a, b, c, seed):
    radii = np.array([a, b, c])
    points = np.random.default_rng(seed).uniform(-1.3, 1.3, (60, 3))
    scaled = np.linalg.norm(points, axis=1)
    # The polyhedron lies within the ellipsoid, but by less than 8 % at 16 sides.
    clear = (scaled < 0.9) | (scaled > 1.0)
    found = inside(ellipsoid(radii), points * radii)
    np.testing.assert_array_equal(found[clear], scaled[clear] < 0.9)


def test_volumes_tend_to_the_formulas():
    assert volume(ellipsoid((1, 2, 3), sides=128)) == pytest.approx(4 / 3 * np.pi * 6, rel=2e-3)
    assert volume(cylinder(0.5, (0, 0, 0), (3, 4, 0), sides=200)) == pytest.approx(np.pi * 0.25 * 5, rel=1e-3)
    # Pappus: area of the section times the way of its centroid.
    torus = ring(superellipse(0.1, 0.1, sides=200) + np.array([2, 0]), sides=200)
    assert volume(torus) == pytest.approx(np.pi * 0.01 * 2 * np.pi * 2, rel=1e-3)


def test_a_unit_cube_from_a_loft():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    cube = loft(np.stack([square, square + np.array([0, 0, 1])]))
    assert volume(cube) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_array_equal(
        inside(cube, np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [0.9, 0.1, 0.2]])), [1, 0, 1]
    )


def test_merging_keeps_volumes_and_hollows():
    torus, ball = ring(superellipse(0.1, 0.1) + np.array([2, 0])), ellipsoid((1, 1, 1))
    both = merged([torus, ball])
    assert volume(both) == pytest.approx(volume(torus) + volume(ball), rel=1e-12)
    assert inside(both, np.array([[2.0, 0, 0], [0, 0, 0], [1.5, 0, 0]])).tolist() == [True, True, False]


def test_airfoil_is_as_thick_as_asked():
    loop = airfoil(2.0, 0.12, 30)
    assert np.ptp(loop[:, 0]) == pytest.approx(2.0)
    assert loop[:, 0].max() == pytest.approx(0.5)
    assert np.ptp(loop[:, 1]) == pytest.approx(0.24, rel=0.01)
