"""Exact values round to complex64 as the true values do.

Tested are the double-double sums, the decision and the strongest cell.
"""

from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from test_echo import cloud_in_motion, network
from test_echo_hard import CASES

import reference
from lowalt.echo import api, echo_signal, refine
from lowalt.echo.rounding import nearest, sums
from lowalt.machine.jit import LEAN
from lowalt.numerics.exact import sines

sine_cosine = LEAN(sines.sine_cosine.function)
dirichlet = LEAN(sines.dirichlet.function)
to_odd = LEAN(nearest.to_odd.function)
same_double = LEAN(nearest.same_double.function)


def exact(pair) -> mpmath.mpf:
    """The value of a double-double."""
    return mpmath.mpf(pair[0]) + mpmath.mpf(pair[1])


def nearest_single(value: mpmath.mpf) -> np.float32:
    """The float32 nearest to a number of many digits, ties to even.

    Its neighbours are compared exactly.
    """
    guess = np.float32(float(value))
    near = [np.nextafter(guess, np.float32(way)) for way in (-np.inf, np.inf)] + [guess]
    return min(near, key=lambda x: (abs(mpmath.mpf(float(x)) - value), int(x.view(np.int32)) & 1))


@pytest.mark.parametrize("size", [0.1, 0.5, 40.0, 1e6])
def test_sines_hold_twenty_digits(size):
    rng = np.random.default_rng(1)
    with mpmath.workdps(50):
        for x in (*rng.uniform(-size, size, 60), 0.0, 0.25, 0.5, -0.125):
            turn = (float(x), float(x) * 2.0**-54)
            s, c = sine_cosine(turn)
            angle = 2 * mpmath.pi * exact(turn)
            assert (
                abs(exact(s) - mpmath.sin(angle)) < 2.0**-69
                and abs(exact(c) - mpmath.cos(angle)) < 2.0**-69
            )
    assert [sine_cosine((x, 0.0)) for x in (0.25, 0.5)] == [((1, 0), (0, 0)), ((0, 0), (-1, 0))]


@pytest.mark.parametrize("count", [1, 3, 16, 256])
def test_array_sums_hold_twenty_digits_and_their_limits(count):
    rng = np.random.default_rng(2)
    with mpmath.workdps(60):
        for x in (*rng.uniform(-2, 2, 60), 1e-9, 1 + 1e-12):
            angle = mpmath.pi * mpmath.mpf(float(x))
            truth = mpmath.sin(count * angle) / mpmath.sin(angle)
            assert abs(exact(dirichlet((float(x), 0.0), float(count))) - truth) < count * 2.0**-66
    for whole in range(-3, 4):
        assert dirichlet((float(whole), 0.0), float(count)) == (
            (-1.0) ** (whole * (count - 1)) * count,
            0.0,
        )


def prepared(net, station, motion, rcs, aim):
    """The arguments of `nearest.correct` in an `echo_signal`: all before values are rounded."""
    scene, radio, refs, aims = api.prepared(net, station, motion, rcs, aim, "")
    found, _, method, sample = refine.compute(scene, radio, refs, aims, None)
    return sample, refs, found, method.pointwise_bound


@pytest.mark.parametrize("name", CASES)
def test_double_double_sums_keep_their_error(name):
    _, net, station, points, aim = CASES[name]
    rcs = np.linspace(0.5, 1.5, len(points)) if len(points) != 2 else np.ones(2)
    result = echo_signal(net, station, points[None], rcs, aim)
    sample, *_ = prepared(net, station, points[None], rcs, aim)
    cell = int(result.cell[0])
    work = np.empty((sums.ROWS, len(sample.lay.root) + 4))
    real, imag = sums.cell_value(sample, 0, cell, work)
    with mpmath.workdps(50):
        truth = reference.cells_mp(net, station, points.tolist(), rcs.tolist(), aim, [cell])[0]
        wrong = abs(mpmath.mpc(exact(real), exact(imag)) - truth)
        assert wrong < nearest.ERROR * result.totals[0]
        stored = result.signal.astype(np.complex64)[0]
        assert stored.real == nearest_single(truth.real) and stored.imag == nearest_single(
            truth.imag
        )


@pytest.mark.parametrize("rigid", [True, False])
def test_whatever_errors_the_bounds_allow_the_same_values_are_stored(rigid):
    net = network(symbols=60)
    rng = np.random.default_rng(3)
    motion = cloud_in_motion(rng, 60, 50, (180.0, 120.0, 60.0), 1.5, 30.0)
    shape = (
        motion
        if rigid
        else np.einsum("nlij,lj->nli", motion.rotation[:, motion.part], motion.points)
    )
    if not rigid:
        shape = shape + motion.translation[:, motion.part]
    stored = []
    again = []
    uncorrected = []
    for _ in range(3):
        *before, found, bound = prepared(net, net.stations[0], shape, 1.3, motion.translation[0, 0])
        # As if computed with a thousand times the error: another machine's values anywhere in that
        # circle.
        found.bounds[:] *= 1e3
        found.gaps[:] = np.maximum(found.gaps - 2 * found.bounds, 0.0)
        turn = np.exp(2j * np.pi * rng.uniform(size=60))
        far = rng.uniform(size=60)
        found.values[:] += found.bounds * far * turn
        uncorrected.append(found.values.astype(np.complex64))
        again.append(nearest.correct(*before, found, bound))
        stored.append(found.values.astype(np.complex64))
    assert (uncorrected[0] != uncorrected[1]).any()
    assert (stored[0] == stored[1]).all() and (stored[0] == stored[2]).all()
    assert all(count > 5 and still == 0 for count, still in again)


def test_a_value_is_computed_again_only_where_its_bound_leaves_the_nearest_single_open():
    tie = float(np.float32(1.0)) + 2.0**-24
    real = np.array([tie, tie + 1e-9, tie - 1e-9, 0.3, 0.3, 0.3, 0.0])
    values = real + 1j * np.array([0.2, 0.2, 0.2, tie, 0.2, 0.2, 0.0])
    bounds = np.full(7, 1e-10)
    gaps = np.array([1.0, 1, 1, 1, 1, 0, 0])
    totals = np.array([1.0, 1, 1, 1, 1, 1, 0])
    out = np.empty(7, np.int64)
    count, unproved = nearest.doubtful(values, bounds, totals, gaps, out)
    assert out[:count].tolist() == [0, 3, 5] and unproved == 1
    # Where every value is certain nothing is computed again, and nothing of the scene is asked for.
    certain = SimpleNamespace(
        values=values[4:5], bounds=bounds[4:5], totals=totals[4:5], gaps=gaps[4:5]
    )
    assert nearest.correct(None, np.empty((1, 7)), certain, (0.0, 0.0)) == (0, 0)


def test_a_sum_of_two_doubles_rounds_once():
    bits = np.empty(1, np.int64)
    rng = np.random.default_rng(4)
    singles = rng.normal(size=50).astype(np.float32)
    for single in (*singles, np.float32(1e-42)):
        middle = 0.5 * (float(single) + float(np.nextafter(single, np.float32(9))))
        for high in (middle, np.nextafter(middle, 9), float(single)):
            for low in (0.0, 2.0**-56 * abs(high), -(2.0**-56) * abs(high), 1e-300, -1e-300):
                kept = to_odd(high, low, bits)
                with mpmath.workprec(2200):
                    assert np.float32(kept) == nearest_single(exact((float(high), low)))


def test_near_ties_of_cells_go_to_the_truly_strongest():
    """Points half way between two cells in many directions: their distances round to either side."""
    net = network(symbols=1)
    station = net.stations[0]
    rng = np.random.default_rng(1)
    for _ in range(30):
        way = rng.normal((3.0, 0.0, 0.0))
        edge = (np.array(station.position_m) + 30.5 * net.cell_m * way / np.linalg.norm(way))[
            None, None
        ]
        result = echo_signal(net, station, edge, 1.0, (150.0, 1.0, 26.0))
        with mpmath.workdps(60):
            values = reference.cells_mp(
                net, station, edge[0].tolist(), [1.0], (150.0, 1.0, 26.0), [30, 31]
            )
            strengths = [abs(value) for value in values]
        assert result.gap[0] == 0 and result.cell[0] == 30 + (strengths[1] > strengths[0])


def test_a_tie_between_two_singles_is_seen_in_the_low_half_of_a_double_double():
    """Both ends of the error round to the tie itself as doubles, and to two singles as numbers."""
    tie = 1.0 + 2.0**-24
    bits = np.empty(1, np.int64)
    for low, error, decided in (
        (0.0, 1e-20, False),
        (1e-20, 0.9e-20, True),
        (1e-20, 1.1e-20, False),
        (-1e-20, 0.9e-20, True),
        (-1e-20, 1.1e-20, False),
        (-1e-16, 1.1e-16, False),
        (3e-17, 1e-17, True),
        (0.0, 0.0, True),
    ):
        assert (
            same_double((tie, low), error, bits) == decided == same_double((-tie, low), error, bits)
        )
    assert same_double((0.3, 0.0), 1e-20, bits) and not same_double((0.0, 0.0), 1e-30, bits)
