"""Range cells from a target's moments: kernels in tables, and the bound on cells left out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_echo import network, relative

import pointwise_echo
from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import Rigid, echo_signal
from lowalt.echo.fast.cell_kernel import POSITIONS, SIDE, cell_polynomials
from lowalt.echo.fast.polynomials import CELL_REACH
from lowalt.echo.fast.strongest_cell import far_limit, far_moments


def kernel(x, count):
    """The range-cell kernel's real part as the plain mean of cosines."""
    m = np.arange(count) - (count - 1) / 2
    return np.cos(2 * np.pi * np.multiply.outer(x, m) / count).mean(axis=-1)


@pytest.mark.parametrize("count", [11, 64, 256])
@pytest.mark.parametrize("deep, error", [(0.02, 1e-3), (0.4, 1e-6), (1.3, 1e-9), (2.0, 1e-14)])
def test_tabulated_kernels_keep_their_error(count, deep, error):
    table = cell_polynomials(count, deep, error)
    assert table.error <= error
    v = np.linspace(-1, 1, 31)
    powers = v[:, None] ** np.arange(table.kernels.shape[2])
    for place in (0, 7, POSITIONS):
        u = place / POSITIONS - 0.5 + table.half * v
        for j in range(-SIDE, SIDE + 1):
            found = powers @ table.kernels[place, j + SIDE]
            assert abs(found - kernel(j - u, count)).max() <= table.error + 1e-13
        assert abs(powers @ table.sines[place] - np.sin(np.pi * u)).max() <= table.error + 1e-13
    assert np.abs(table.kernels[..., 0]).max() <= table.sizes[0] <= 1.01


def test_targets_too_deep_and_too_few_cells_are_left_to_the_general_kernel():
    # A cell SIDE and a half away, seen from the deepest point, is as far as the rule of its kernel
    # holds.
    deepest = CELL_REACH - SIDE - 0.5 - 0.5 / POSITIONS
    assert (
        cell_polynomials(256, deepest, 1e-6) is not None
        and cell_polynomials(256, deepest + 1e-9, 1e-6) is None
    )
    assert (
        cell_polynomials(2 * SIDE + 3, 0.2, 1e-6) is not None
        and cell_polynomials(2 * SIDE + 2, 0.2, 1e-6) is None
    )


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    points=st.integers(1, 60),
    deep=st.floats(0.01, 1.5),
    count=st.integers(20, 300),
    place=st.integers(0, POSITIONS),
    side=st.integers(2, SIDE),
    error=st.sampled_from([1e-4, 1e-12]),
)
def test_no_cell_beyond_the_bound_is_stronger(seed, points, deep, count, place, side, error):
    rng = np.random.default_rng(seed)
    table = cell_polynomials(count, deep, error)
    v = rng.uniform(-deep, deep, points) / table.half
    z = rng.normal(size=points) + 1j * rng.normal(size=points)
    # Half of the cases all but cancel, where a bound by the sum of amplitudes would decide nothing.
    z -= z.mean() * (seed % 2)
    powers = v[:, None] ** np.arange(table.kernels.shape[2])
    sums = z @ powers
    far = np.empty(4)
    centre = place / POSITIONS - 0.5
    total = abs(z).sum()
    second = (abs(z) * v**2).sum()
    far_moments(
        table.sines,
        place,
        np.stack([sums.real, sums.imag]),
        table.half,
        total,
        second,
        table.error,
        far,
    )
    gap = min(centre + side + 1, side + 1 - centre, 0.5 * count)
    limit = far_limit(far, gap, table.half, count)
    beyond = np.arange(side + 1, count - side)
    truth = abs(kernel(beyond[:, None] - (centre + table.half * v), count) @ z)
    assert (truth <= limit * (1 + 1e-9) + 1e-13 * total).all()
    # The bound is not too loose: for a shallow target it is close to the value in the nearest cell
    # beyond.
    assert deep > 0.3 or limit <= 1.6 * truth.max() + 1e-3 * total


def test_moments_of_far_cells_are_bounded_with_the_orders_that_the_series_of_the_sine_lacks():
    """Sums of points at one end of the stretch, where a sine of few orders is cut most.

    Each is |sum z sin(pi u) y^k|.
    """
    table = cell_polynomials(64, 0.3, 1e-2)
    for place, v in ((3, 1.0), (16, -1.0), (29, 0.9)):
        powers = v ** np.arange(table.kernels.shape[2])
        far = np.empty(4)
        y = table.half * v
        far_moments(
            table.sines,
            place,
            np.stack([2 * powers, -powers]),
            table.half,
            2.3,
            2.3 * v * v,
            table.error,
            far,
        )
        sine = abs(2 - 1j) * np.sin(np.pi * (place / POSITIONS - 0.5 + y))
        assert (far >= abs(sine) * abs(y) ** np.arange(4)).all()


def test_parts_that_do_not_turn_are_placed_as_if_turned_by_zero():
    net = network(symbols=30)
    rng = np.random.default_rng(3)
    nodes = np.array([120.0, -30.0, 40.0]) + rng.normal(scale=0.4, size=(30, 7, 3))
    part = np.sort(rng.integers(0, 7, 50))
    points = rng.normal(size=(50, 3))
    still = Rigid(np.zeros((30, 7, 3, 3)), nodes, points, part)
    together = echo_signal(net, net.stations[0], still, 1.0, nodes[0, 0])
    plain = echo_signal(net, net.stations[0], nodes[:, part], 1.0, nodes[0, 0])
    assert relative(together.signal, plain.signal) < 1e-12 and (together.cell == plain.cell).all()
    # A matrix with one entry is no longer still.
    turned = np.zeros((30, 7, 3, 3))
    turned[:, 3, 2, 1] = 0.5
    moved = echo_signal(net, net.stations[0], Rigid(turned, nodes, points, part), 1.0, nodes[0, 0])
    places = nodes[:, part] + np.einsum("nlij,lj->nli", turned[:, part], points)
    truth = pointwise_echo.signal(net, net.stations[0], places, 1.0, nodes[0, 0])
    assert (
        relative(moved.signal, truth.signal) < 1e-11 and relative(moved.signal, plain.signal) > 1e-3
    )


def test_a_point_half_way_between_two_cells_is_counted_as_a_tie_and_one_off_it_is_not():
    """Both neighbours hold equal amplitudes there.

    A hundredth of a cell away they differ by more than a percent.
    """
    station = Station("A", (0.0, 0.0, 0.0), 0.0, 4.9e9)
    net = Network(4.9e9, 120e3, 256, 10, 2.5e-3, 400, (1, 1), (1, 1), 1.0, (station,))
    cell_m = SPEED_OF_LIGHT / (2 * 256 * 120e3)
    for offset, ties in ((0.5, 3), (0.51, 0)):
        place = np.full((3, 1, 3), (0.0, (20 + offset) * cell_m, 0.0))
        found = echo_signal(net, station, place, 1.0, place[0, 0])
        assert found.near_ties == ties
        assert set(found.cell) <= ({20, 21} if ties else {21})
