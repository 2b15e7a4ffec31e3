"""Sums of spherical waves from a box's nodes, held against the sum over every element at every point."""

from itertools import pairwise

import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.network import SPEED_OF_LIGHT, Network
from lowalt.effects import near_field, near_field_loops, near_field_sizes, near_field_terms, waves

NETWORK = Network.from_settings(load_yaml("config/default.yaml")["network"])
SPACING = SPEED_OF_LIGHT / (2 * NETWORK.carrier_hz)


def given(shape: tuple[int, int]) -> near_field.Arrays:
    turn = 0.7
    return near_field.Arrays(
        np.array([3.0, -4.0, 25.0]), (np.sin(turn), np.cos(turn)), SPACING, 0.5 / SPACING, 1.0, (0.3, 0.1), shape,
        np.ones((1, 1), np.complex128), waves.waves(1e-16), 0.505 / SPACING,
    )  # fmt: skip


def direct(places: np.ndarray, array: near_field.Arrays) -> np.ndarray:
    """The sum over elements with NumPy, relative to the path of the array's middle."""
    sine, cosine = array.axes
    d = places - array.station
    wide, high = array.shape
    elements = np.array([
        [-sine * i * SPACING, cosine * i * SPACING, j * SPACING] for i in range(wide) for j in range(high)
    ])  # fmt: skip
    middle = elements.mean(axis=0)
    weights = np.array([
        np.exp(-1j * np.pi * ((i - 0.5 * (wide - 1)) * array.aims[0] + (j - 0.5 * (high - 1)) * array.aims[1]))
        for i in range(wide) for j in range(high)
    ])  # fmt: skip
    r, reference = np.linalg.norm(d, axis=2), np.linalg.norm(d - middle, axis=2)
    total = np.zeros(r.shape, np.complex128)
    for element, weight in zip(elements, weights, strict=True):
        own = np.linalg.norm(d - element, axis=2)
        total += weight * r / own * np.exp(-2j * np.pi * array.wave * (own - reference))
    return total


@pytest.mark.parametrize("shape", [(16, 4), (8, 8), (5, 3)])
@pytest.mark.parametrize("range_m", [25.0, 60.0, 400.0])
@pytest.mark.parametrize("error", [1e-13, 1e-8, 1e-4])
def test_sums_of_a_box_keep_their_error(shape, range_m, error, monkeypatch):
    rng = np.random.default_rng(int(range_m) + shape[0])
    array, used = given(shape), []
    evaluated = near_field.evaluated
    monkeypatch.setattr(near_field, "evaluated", lambda *values: (used.append(1), evaluated(*values)))
    monkeypatch.setattr(near_field, "WORK", 0)
    # The second box holds fewer symbols.
    monkeypatch.setattr(near_field, "SYMBOLS", 100)
    way = np.array([0.8, 0.5, 0.33])
    course = np.linspace(-1.5, 1.5, 120)[:, None, None] * rng.normal(size=3)
    places = array.station + range_m * way + course + rng.uniform(-0.6, 0.6, (150, 3))
    out = np.empty((1, 120, 150), np.complex128)
    near_field.sums(places, array, error, out)
    truth = direct(places, array)
    # The plain difference of two ranges in the truth loses digits with range.
    assert abs(out[0] - truth).max() <= max(error, 1e-14 * range_m) * np.prod(shape)
    # Coarse errors and far targets must have gone through the box.
    assert used or error < 1e-4 or range_m < 60


def test_close_points_and_small_targets_are_summed_one_by_one(monkeypatch):
    monkeypatch.setattr(near_field, "evaluated", lambda *values: pytest.fail("a box was used"))
    array = given((16, 4))
    rng = np.random.default_rng(3)
    for range_m, points in ((4.0, 400), (200.0, 3)):
        places = array.station + np.array([range_m, 0.0, 1.0]) + rng.uniform(-0.5, 0.5, (100, points, 3))
        out = np.empty((1, 100, points), np.complex128)
        near_field.sums(places, array, 1e-6, out)
        assert abs(out[0] - direct(places, array)).max() <= 1e-6 * 64


def test_terms_fall_below_their_bounds():
    array = given((16, 4))
    middle, half = np.array([0.5, 0.2, 1 / 40.0]), np.array([0.04, 0.03, 4e-4])
    sizes = near_field_terms.term_bounds(middle, half, array)
    counts = (24, 14, 10)
    terms = near_field._terms(near_field._nodes(counts, middle, half, array), counts, array, 1)
    found = abs(terms[0]) / 64
    bound = sizes[0, :24, None, None] * sizes[1, None, :14, None] * sizes[2, :10]
    assert (found <= bound + 1e-14).all()
    # The bounds are of use: the largest terms of an order are within a hundred times theirs.
    assert found[8].max() > 1e-4 * bound[8].max()


def test_kept_boxes_serve_places_inside_and_are_made_anew_outside(monkeypatch):
    rng = np.random.default_rng(5)
    array, made, kept = given((16, 4)), [], {}
    terms = near_field._terms
    monkeypatch.setattr(near_field, "_terms", lambda *values: (made.append(1), terms(*values))[1])
    monkeypatch.setattr(near_field, "WORK", 0)
    places = array.station + 120.0 * np.array([0.8, 0.5, 0.33]) + rng.uniform(-0.6, 0.6, (40, 150, 3))
    # A symbol later points have moved by a millimetre; a look later the target is somewhere else.
    for move, boxes in ((0.0, 1), (1e-3, 1), (30.0, 2)):
        moved = places + move * np.array([-0.6, 0.7, 0.1])
        out = np.empty((1, 40, 150), np.complex128)
        near_field.sums(moved, array, 1e-7, out, kept)
        assert abs(out[0] - direct(moved, array)).max() <= 1e-7 * 64
        assert len(made) == boxes


def test_a_box_is_made_where_its_terms_at_all_frequencies_are_fewer_than_the_elements():
    """With any number of points, a box whose terms cost more than summing elements never pays."""
    array, points = given((16, 4)), 10**9
    low = np.array([0.1, 0.05, 1 / 410])
    each = np.prod(array.shape) * (near_field.ELEMENT + near_field.ORDER * array.series.shape[1])
    box = near_field._box(low, low + 1e-3 * np.array([1.0, 1.0, 1e-3]), 1.0, array, 1e-6, points, 1)
    aperture = near_field_terms.Aperture(array.shape, array.spacing, array.highest)
    most = int(each // near_field_terms.orders(*near_field._rounded(box.middle, box.half), aperture, 1e-6)[2])
    assert most >= 2
    for frequencies, pays in ((most, True), (most + 1, False)):
        found = near_field._box(low, low + 1e-3 * np.array([1.0, 1.0, 1e-3]), 1.0, array, 1e-6, points, frequencies)
        assert (found is not None) == pays


@pytest.mark.parametrize("half", [0.024, 0.0262])
def test_nodes_stand_on_the_side_of_the_array_that_the_points_are_on(half):
    """A half is rounded up; a box must not reach through infinity to points behind the array."""
    array, middle = given((16, 4)), np.array([0.5, 0.2, 0.025])
    nodes = near_field._nodes((3, 4, 9), middle, np.array([0.01, 0.02, half]), array)
    if half > middle[2]:
        assert nodes is None
        return
    seen, (sine, cosine) = nodes[0] - array.station, array.axes
    inverse = 1.0 / np.linalg.norm(seen, axis=1)
    across, up = (cosine * seen[:, 1] - sine * seen[:, 0]) * inverse, seen[:, 2] * inverse
    for found, count, axis, size in ((across, 3, 0, 0.01), (up, 4, 1, 0.02), (inverse, 9, 2, half)):
        grid = middle[axis] + size * np.cos(np.pi * (np.arange(count) + 0.5) / count)
        shape = [1, 1, 1]
        shape[axis] = count
        np.testing.assert_allclose(found.reshape(3, 4, 9), np.broadcast_to(grid.reshape(shape), (3, 4, 9)), rtol=1e-12)


def test_boxes_of_nearly_equal_sizes_share_their_numbers_of_nodes_and_terms():
    array, low = given((16, 4)), np.array([0.1, 0.05, 1 / 410])
    near_field_terms.orders.cache_clear()
    boxes = []
    for move, width in ((0.0, 1.02e-3), (1e-6, 1.05e-3)):
        size = width * np.array([1.0, 1.0, 2.0**-10])
        boxes.append(near_field._box(low + move, low + move + size, 1.0, array, 1e-6, 10**9, 1))
        assert (boxes[-1].half >= 0.5 * size).all() and (boxes[-1].half <= 0.55 * size).all()
    assert near_field_terms.orders.cache_info().misses == 1 and boxes[0].counts is boxes[1].counts


def test_a_box_shares_the_bounds_of_one_that_is_nearer_and_farther_from_the_beam():
    rng = np.random.default_rng(6)
    for middle, half in zip(rng.uniform([-1, -1, 1e-3], 1, (50, 3)), rng.uniform(1e-4, 1e-2, (50, 3)), strict=True):
        found, halves = near_field._rounded(middle, half)
        assert (np.array(found) >= abs(middle) * (1 - 1e-12)).all() and halves == tuple(half)
        assert (np.array(found[:2]) < abs(middle[:2]) + 1 / 64).all() and found[2] <= middle[2] * 2 ** (1 / 8) * (
            1 + 1e-12
        )


@pytest.mark.parametrize("allowed", [0.0, 1e-6, 1e-2, 1e9])
def test_terms_that_are_left_out_sum_to_no_more_than_is_allowed(allowed):
    rng = np.random.default_rng(4)
    decay = 0.1 ** np.add.outer(np.add.outer(np.arange(3), np.arange(5)), np.add.outer(np.arange(4), np.arange(3)))
    found = decay * np.exp(2j * np.pi * rng.random(decay.shape))
    matters = decay[0] > 1e-7
    pairs, terms, names, ends = near_field_terms.chosen(found, matters, allowed)
    kept = np.zeros_like(found)
    # Rows of the table: five orders across, four up, three in inverse range, then products of the last two.
    rows = {5 + b: (b, 0) for b in range(4)} | {9 + c: (0, c) for c in range(3)}
    rows |= {12 + k: (up - 5, near - 9) for k, (up, near) in enumerate(pairs)}
    rows[0] = 0, 0
    for order, (first, last) in enumerate(pairwise(ends)):
        for (real, imag), (across, row) in zip(terms[first:last], names[first:last], strict=True):
            kept[order, across, *rows[row]] += complex(real, imag)
    wanted = found * matters
    assert ((kept == 0) | (kept == wanted)).all() and abs(wanted - kept).sum() <= allowed
    # A quarter of what is allowed would not do for many fewer.
    assert (kept != 0).sum() <= (abs(wanted) > 0.01 * allowed).sum() or allowed == 0.0
    assert allowed > 0.0 or (kept == wanted).all()


@pytest.mark.parametrize("allowed", [1e-9, 1e-5, 3e-4, 0.02])
def test_the_least_size_that_counts_leaves_out_nearly_as_much_as_may(allowed):
    sizes = np.exp(np.random.default_rng(9).uniform(-25.0, 0.0, 900))
    least = near_field_sizes.least_of(sizes, allowed)
    assert sizes[sizes < least].sum() <= allowed < sizes[sizes < 1.13 * least].sum()
    assert near_field_sizes.least_of(sizes, 0.0) == 0.0 and near_field_sizes.least_of(sizes, 1e9) > sizes.max()


def test_directions_of_some_symbols_are_held_against_a_box_together():
    low = np.random.default_rng(8).uniform(-1.0, 0.0, (3, 9))
    high, bounds = low + 0.5, np.empty((2, 3))
    least, most = low[:, 2:6].min(axis=1), high[:, 2:6].max(axis=1)
    middle, half = 0.5 * (least + most), 0.5 * (most - least) + 1e-9
    assert near_field_loops.held(low, high, 2, 6, middle, half, *bounds)
    np.testing.assert_array_equal(bounds, [least, most])
    for axis in range(3):
        moved = 2e-9 * np.eye(3)[axis]
        assert not near_field_loops.held(low, high, 2, 6, middle + moved, half, *bounds)
        assert not near_field_loops.held(low, high, 2, 6, middle - moved, half, *bounds)
    assert not near_field_loops.held(low, high, 2, 6, *near_field.NOWHERE, *bounds)
