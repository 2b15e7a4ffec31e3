"""Closer values of a cell by the interpreter, each step of both ways to them, against fifty digits."""

from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from driven_echo import weights
from interpreted import interpreted
from lowalt.echo.radar import constants
from lowalt.echo.rounding import double, sums
from small_echo import NETWORK, pieces, places, prepared

SPLIT = 2.0**-60
"""Relative size of a low half's neighbour: far above double-double's error, far below a double's."""


def number(high, low=0.0):
    """The exact value of a double-double."""
    return mpmath.mpf(float(high)) + mpmath.mpf(float(low))


def pairs(work, row, count):
    """The exact values of a row and the one below it."""
    return [number(work[row, i], work[row + 1, i]) for i in range(count)]


@pytest.fixture(autouse=True)
def digits():
    """Fifty digits in every test here."""
    with mpmath.workdps(50):
        yield


MOTIONS = {"parts": pieces((5, 3, 6), symbols=2), "points": places(pieces((5, 3, 6), symbols=2)).astype(float)}


def seen(kind):
    """A scene, and a work array filled by `sums.seen` for symbol 1 and cell 9."""
    there = prepared(MOTIONS[kind], weights(14))
    work = np.full((sums.ROWS, len(there.lay.root) + 4), np.nan)
    interpreted(sums.seen)(there.scene, there.lay, there.radio, 1, 9, work)
    return there, work


def exact_points(motion, station):
    """Vectors from the station to all points of symbol 1, of doubles taken as exact."""
    if isinstance(motion, np.ndarray):
        return [[mpmath.mpf(float(c)) - s for c, s in zip(point, station, strict=True)] for point in motion[1]]
    result = []
    for point, part in zip(motion.points, motion.part, strict=True):
        matrix, origin = motion.rotation[1, part], motion.translation[1, part]
        result.append([
            sum(mpmath.mpf(float(matrix[i, j])) * mpmath.mpf(float(point[j])) for j in range(3))
            + mpmath.mpf(float(origin[i])) - station[i] for i in range(3)
        ])  # fmt: skip
    return result


def quantities(kind):
    """Of symbol 1's points, exactly: vectors, half turns an element, turns, distance from cell 9 over M, amplitudes."""
    station = (4, -7, 25)
    points = exact_points(MOTIONS[kind], station)
    aim = prepared(MOTIONS[kind]).scene.aim
    sine, cosine = mpmath.sin(mpmath.mpf(0.7)), mpmath.cos(mpmath.mpf(0.7))

    def cosines(vector):
        r = mpmath.sqrt(sum(c * c for c in vector))
        return r, (cosine * vector[1] - sine * vector[0]) / r, vector[2] / r

    _, psi0, omega0 = cosines([mpmath.mpf(float(a)) - s for a, s in zip(aim, station, strict=True)])
    kappa, middle = mpmath.mpf(5.2e9) / mpmath.mpf(4.9e9), mpmath.mpf(5.2e9) + mpmath.mpf(63) / 2 * 120000
    rows = []
    for vector, rcs in zip(points, weights(14), strict=True):
        r, psi, omega = cosines(vector)
        psi, omega = psi - psi0, omega - omega0
        turn = kappa / 4 * ((3 + 2 - 2) * psi + (2 + 5 - 2) * omega) - 2 * middle / 299792458 * r
        cells = 2 * 64 * mpmath.mpf(120000) / 299792458 * r
        rows.append(
            (
                *vector,
                kappa / 2 * psi,
                kappa / 2 * omega,
                turn,
                (9 - cells) / 64,
                mpmath.sqrt(mpmath.mpf(float(rcs))) / r**2,
            )
        )
    return [list(column) for column in zip(*rows, strict=True)]


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_point_is_seen_to_twenty_five_digits(kind):
    """Eight pairs of rows: vector, half turns an element, turns of phase, distance from the cell, and amplitude."""
    there, work = seen(kind)
    assert list(range(0, 16, 2)) == [
        sums.X, sums.Y, sums.Z, sums.SIDE, sums.UP, sums.TURN, sums.CELL, sums.AMPLITUDE
    ]  # fmt: skip
    for row, wanted in zip(range(0, 16, 2), quantities(kind), strict=True):
        for found, truth in zip(pairs(work, row, 14), wanted, strict=True):
            assert abs(found - truth) < mpmath.mpf(10) ** -25 * max(1, abs(truth)), row
    # The padding stands a metre away and has no amplitude.
    assert len(there.lay.root) == 16 and not work[sums.AMPLITUDE, 14:16].any()
    if kind == "points":
        assert (work[sums.X, 14:] == 1.0).all() and not work[sums.X + 1 : 6, 14:].any()


def truth_of_cell(kind, cell):
    """Cell `cell` of symbol 1 by plain products of sines, exactly."""
    *_, side, up, turn, away, amplitude = quantities(kind)
    total = mpmath.mpc(0)

    def comb(x, count):
        return mpmath.sin(mpmath.pi * count * x) / mpmath.sin(mpmath.pi * x)

    for h, v, t, d, a in zip(side, up, turn, away, amplitude, strict=True):
        gain = comb(h, 3) * comb(h, 2) * comb(v, 2) * comb(v, 5) * comb(d + mpmath.mpf(cell - 9) / 64, 64) / 64
        total += a * gain * mpmath.expjpi(2 * t)
    elements = 3 * 2 * 2 * 5
    scale = mpmath.sqrt(mpmath.mpf(1.7) / elements) * 299792458 / mpmath.mpf(4.9e9) / (4 * mpmath.pi) ** 1.5
    return total * scale * mpmath.expjpi(mpmath.mpf(63 * cell) / 64), scale * elements


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("cell", [9, 70])
def test_a_cell_is_the_sum_of_all_points_in_both_ways_to_it(kind, cell):
    there = prepared(MOTIONS[kind], weights(14))
    work = np.full((sums.ROWS, 20), np.nan)
    truth, scale = truth_of_cell(kind, cell)
    size = scale * sum(quantities(kind)[-1])
    real, imag = interpreted(sums.cell_value)(there.scene, there.lay, there.radio, 1, cell, work)
    assert abs(mpmath.mpc(number(*real), number(*imag)) - truth) < 2.0**-80 * size
    real, imag = interpreted(double.cell_value)(there.scene, there.lay, there.radio, 1, cell, work)
    away = abs(mpmath.mpc(float(real), float(imag)) - truth)
    assert away < 20 * 2.0**-53 * size < interpreted(double.share)(16) * size


def test_the_bound_of_a_sum_in_double_counts_the_units_of_its_steps():
    """Five quotients of sines with their products 110, wave and amplitude 10, a cell's phase 8, additions; doubled."""
    for points in (8, 16, 800):
        assert interpreted(double.share)(points) == 2 * (110 + 10 + 8 + points / 8 + 8) * 2.0**-53


def test_sines_in_double_are_polynomials_that_stop_below_2_to_the_minus_60():
    """In the square of x, highest order first: sin(pi x) / x within 1/2, sin and cos of whole turns within 1/8."""
    cases = (
        (double._HALF, 0.5, lambda x: mpmath.sin(mpmath.pi * x) / x),
        (double._SINE, 0.125, lambda x: mpmath.sin(2 * mpmath.pi * x) / x),
        (double._COSINE, 0.125, lambda x: mpmath.cos(2 * mpmath.pi * x)),
    )
    for coefficients, reach, function in cases:
        for x in reach * np.array([1.0, 0.9, 0.5, 0.01]):
            exact = mpmath.polyval([mpmath.mpf(each) for each in coefficients], mpmath.mpf(float(x)) ** 2)
            wanted = function(mpmath.mpf(float(x)))
            # What is left beside the cut is the coefficients' rounding, of the first one at most half a unit.
            assert abs(exact - wanted) < 1.2 * 2.0**-53 * abs(wanted) + 2.0**-60 * max(1, abs(coefficients[-1]))
            assert interpreted(double.polynomial)(x * x, coefficients) == pytest.approx(float(wanted), rel=1e-15)


@pytest.mark.parametrize("count", [1.0, 2.0, 5.0, 64.0])
def test_an_array_s_sum_in_double_keeps_21_units_and_its_limits(count):
    dirichlet = interpreted(double.dirichlet)
    rng = np.random.default_rng(int(count))
    for x in (*rng.uniform(-3, 3, 40), 1e-9, 1 - 1e-7, 1.5):
        pair = (float(x), float(x) * SPLIT)
        angle = mpmath.pi * number(*pair)
        truth = mpmath.sin(int(count) * angle) / mpmath.sin(angle)
        assert abs(mpmath.mpf(float(dirichlet(pair, count))) - truth) < 21 * 2.0**-53 * count
    for whole in range(-3, 4):
        assert dirichlet((float(whole), 0.0), count) == (-1.0) ** (whole * (int(count) - 1)) * count


def test_a_wave_in_double_has_the_quarter_of_its_turn():
    """Turns within half a one on either side; the low half of a turn counts."""
    turns = np.r_[np.linspace(-0.5, 0.5, 33), 0.124, 0.126, -0.37, -0.38]
    work = np.full((16, len(turns) + 3), np.nan)
    work[sums.TURN, : len(turns)], work[sums.TURN + 1, : len(turns)] = turns, 1e-12
    work[sums.AMPLITUDE, : len(turns)] = 2.5
    interpreted(double.wave)(work, len(turns))
    angle = 2 * np.pi * (turns + 1e-12)
    np.testing.assert_allclose(work[sums.CELL, : len(turns)], 2.5 * np.cos(angle), atol=2e-15)
    np.testing.assert_allclose(work[sums.CELL + 1, : len(turns)], 2.5 * np.sin(angle), atol=2e-15)
    assert np.isnan(work[sums.CELL, len(turns) :]).all()


def test_a_row_is_added_by_eight_lanes():
    work = np.random.default_rng(1).normal(size=(3, 40))
    added = interpreted(double.added)
    lanes = work[1, :32].reshape(4, 8).sum(0)
    wanted = ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))
    assert added(work, 1, 32) == pytest.approx(wanted, rel=1e-15) and added(work, 2, 0) == 0.0
    for lane in range(16):
        assert added(np.eye(16)[[lane]], 0, 16) == 1.0


@pytest.mark.parametrize("module", [sums, double])
@pytest.mark.parametrize("twice", [False, True])
def test_amplitudes_are_multiplied_by_a_pattern_or_its_square(module, twice):
    rng = np.random.default_rng(2)
    work = np.zeros((16, 9))
    work[sums.UP], work[sums.AMPLITUDE] = rng.uniform(0.05, 0.4, 9), rng.uniform(1, 2, 9)
    before = work.copy()
    interpreted(module.times_dirichlet)(work, sums.UP, 5.0, twice, 7)
    comb = np.sin(5 * np.pi * work[sums.UP]) / np.sin(np.pi * work[sums.UP])
    wanted = before[sums.AMPLITUDE] * comb ** (2 if twice else 1)
    np.testing.assert_allclose(work[sums.AMPLITUDE, :7], wanted[:7], rtol=1e-14)
    assert (work[sums.AMPLITUDE, 7:] == before[sums.AMPLITUDE, 7:]).all()
    others = np.delete(np.arange(16), [sums.AMPLITUDE, sums.AMPLITUDE + 1])
    assert (work[others] == before[others]).all()


def test_arrays_that_are_alike_are_counted_once_and_squared():
    def sides(*counts):
        names = ("transmit_h", "receive_h", "transmit_v", "receive_v", "subcarriers")
        radar = SimpleNamespace(**dict(zip(names, (*counts, 64), strict=True)))
        return interpreted(sums.patterns)(radar)

    last = (sums.CELL, 64.0, False)
    assert sides(3, 2, 4, 5) == ((sums.SIDE, 3.0, False), (sums.SIDE, 2.0, False), (sums.UP, 4.0, False),
                                 (sums.UP, 5.0, False), last)  # fmt: skip
    assert sides(3, 3, 4, 4) == ((sums.SIDE, 3.0, True), (sums.SIDE, 1.0, False), (sums.UP, 4.0, True),
                                 (sums.UP, 1.0, False), last)  # fmt: skip


@pytest.mark.parametrize("count", [1, 6, 64])
def test_a_cell_s_own_phase_is_reduced_in_whole_numbers(count):
    for cell in (0, 1, 5, 63, 200):
        s, c = interpreted(sums.phase_of)(cell, count)
        angle = mpmath.pi * (count - 1) * cell / count
        assert abs(number(*s) - mpmath.sin(angle)) < 2.0**-69 and abs(number(*c) - mpmath.cos(angle)) < 2.0**-69


def test_constants_of_a_radar_are_rounded_once_to_pairs_of_doubles():
    """Sine and cosine of the normal, turns and cells a metre, half turns an element, array turns, and the scale."""
    radio = prepared(MOTIONS["points"]).radio
    exact, light, kappa = constants(radio.exact), mpmath.mpf(299792458), mpmath.mpf(5.2e9) / mpmath.mpf(4.9e9)
    middle = mpmath.mpf(5.2e9) + mpmath.mpf(63) / 2 * 120000
    scale = mpmath.sqrt(mpmath.mpf(1.7) / 60) * light / mpmath.mpf(4.9e9) / (4 * mpmath.pi) ** 1.5
    wanted = (mpmath.sin(mpmath.mpf(0.7)), mpmath.cos(mpmath.mpf(0.7)), 2 * middle / light,
              2 * 64 * mpmath.mpf(120000) / light, kappa / 2, kappa * 3 / 4, kappa * 5 / 4, scale)  # fmt: skip
    for found, truth in zip(exact, wanted, strict=True):
        assert abs(number(*found) - truth) < 2.0**-104 * abs(truth)
    plain = (radio.sine, radio.cosine, radio.turns, radio.cells)
    assert plain == tuple(pair[0] for pair in exact[:4]) and radio.scale == exact.scale[0]
    assert (radio.turns_lo, radio.cells_lo) == (exact.turns[1], exact.cells[1])
    assert radio.kappa == 5.2e9 / 4.9e9 and radio.centre_hz == 5.2e9 + 31.5 * 120e3
    assert radio.bandwidth_hz == 64 * 120e3 and radio.station.tolist() == [4.0, -7.0, 25.0]
    counts = (radio.transmit_h, radio.transmit_v, radio.receive_h, radio.receive_v, radio.subcarriers)
    assert counts == (*NETWORK.transmit, *NETWORK.receive, 64)
