"""Primitive surfaces: closed, outward, of the volume geometry says; and points on them.

Points have exact counts, areas, and are even.
"""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.targets.surfaces import (
    airfoil,
    cylinder,
    ellipsoid,
    face_normals,
    inside,
    merged,
    ring,
    sample_faces,
    superellipse,
    thin,
    volume,
)

LENGTH = st.floats(0.01, 10)


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
    assert volume(cylinder(0.5, (0, 0, 0), (3, 4, 0), sides=200)) == pytest.approx(
        np.pi * 0.25 * 5, rel=1e-3
    )
    # Pappus: area of the section times the way of its centroid.
    torus = ring(superellipse(0.1, 0.1, sides=200) + np.array([2, 0]), sides=200)
    assert volume(torus) == pytest.approx(np.pi * 0.01 * 2 * np.pi * 2, rel=1e-3)


def test_merging_keeps_volumes_and_hollows():
    torus = ring(superellipse(0.1, 0.1) + np.array([2, 0]))
    ball = ellipsoid((1, 1, 1))
    both = merged([torus, ball])
    assert volume(both) == pytest.approx(volume(torus) + volume(ball), rel=1e-12)
    assert inside(both, np.array([[2.0, 0, 0], [0, 0, 0], [1.5, 0, 0]])).tolist() == [
        True,
        True,
        False,
    ]


def test_airfoil_is_as_thick_as_asked():
    loop = airfoil(2.0, 0.12, 30)
    assert np.ptp(loop[:, 0]) == pytest.approx(2.0)
    assert loop[:, 0].max() == pytest.approx(0.5)
    assert np.ptp(loop[:, 1]) == pytest.approx(0.24, rel=0.01)


SEEDS = st.integers(0, 2**32 - 1)


def triangles(seed, count):
    """`count` random triangles that share no vertex."""
    vertices = np.random.default_rng(seed).normal(size=(3 * count, 3))
    return vertices, np.arange(3 * count).reshape(count, 3)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(1, 12), st.integers(1, 300))
def test_samples_lie_on_their_triangles_in_number_by_area(seed, faces, count):
    vertices, index = triangles(seed, faces)
    points, owner = sample_faces(vertices, index, count, np.random.default_rng(seed))
    assert points.shape == (count, 3) and owner.shape == (count,)
    _, areas = face_normals(vertices, index)
    for face in range(faces):
        a, b, c = vertices[index[face]]
        mine = points[owner == face]
        # Barycentric coordinates of points on the triangle are within 0..1, and they rebuild the
        # point.
        along, *_ = np.linalg.lstsq(np.stack([b - a, c - a], 1), (mine - a).T, rcond=None)
        assert along.min(initial=0) > -1e-9 and along.sum(0).max(initial=0) < 1 + 1e-9
        np.testing.assert_allclose(a + along.T @ np.stack([b - a, c - a]), mine, atol=1e-9)
        assert abs(len(mine) - count * areas[face] / areas.sum()) < 2


def test_uniform_inside_one_triangle():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    faces = np.array([[0, 1, 2]])
    points, _ = sample_faces(vertices, faces, 40_000, np.random.default_rng(1))
    # The mean of a uniform triangle is its centroid, E[x^2] = 1/6; 5 sigma of 40 000 draws is
    # 0.006.
    np.testing.assert_allclose(points.mean(0), [1 / 3, 1 / 3, 0], atol=0.006)
    np.testing.assert_allclose((points[:, :2] ** 2).mean(0), 1 / 6, atol=0.006)


def test_degenerate_faces_get_no_points():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0.0]])
    faces = np.array([[0, 1, 3], [0, 0, 1], [0, 1, 2], [3, 3, 3]])
    points, face = sample_faces(vertices, faces, 500, np.random.default_rng(0))
    assert set(face.tolist()) == {2}
    assert points.sum(1).max() <= 1 + 1e-12


@pytest.mark.parametrize(
    "vertices", [np.zeros((3, 3)), np.full((3, 3), np.nan), np.full((3, 3), np.inf)]
)
def test_surface_without_area_is_refused(vertices):
    with (
        pytest.raises(InputError, match=r"area .*, expected a positive finite one"),
        np.errstate(invalid="ignore"),
    ):
        sample_faces(vertices, np.array([[0, 1, 2]]), 10, np.random.default_rng(0))
    with pytest.raises(InputError, match="0 triangles"):
        sample_faces(np.zeros((0, 3)), np.zeros((0, 3), int), 10, np.random.default_rng(0))


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(1, 60), st.data())
def test_thinning_is_exact_unique_and_even(seed, size, data):
    # Rounding makes coinciding points common.
    points = np.random.default_rng(seed).normal(size=(size, 3)).round(1)
    count = data.draw(st.integers(1, size))
    keep = data.draw(st.lists(st.integers(0, size - 1), max_size=count, unique=True))
    chosen = thin(points, count, np.random.default_rng(seed), keep)
    assert len(chosen) == len(set(chosen.tolist())) == count
    assert chosen[: len(keep)].tolist() == keep
    assert thin(points, count, np.random.default_rng(seed), keep).tolist() == chosen.tolist()
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    # The law of farthest points: none left out is farther from the chosen than the chosen are from
    # each other.
    covered = distance[:, chosen].min(1).max()
    free = range(max(len(keep), 1), count)
    gaps = [distance[chosen[k], chosen[:k]].min() for k in free]
    assert all(gap >= covered - 1e-12 for gap in gaps)
    assert all(later <= earlier + 1e-12 for earlier, later in itertools.pairwise(gaps))


@pytest.mark.parametrize(("count", "keep"), [(0, ()), (6, ()), (1, (0, 1))])
def test_impossible_counts_are_refused(count, keep):
    with pytest.raises(InputError, match=f"thinning to {count} points, expected"):
        thin(np.zeros((5, 3)), count, np.random.default_rng(0), keep)
