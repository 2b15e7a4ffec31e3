"""The pointwise kernel by the interpreter: every point's amplitude and range, cells and paths."""

import math

import mpmath
import numpy as np
import pytest

from driven_echo import truth_of, weights
from interpreted import interpreted
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise import reference_range, results, terms
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST, TURN
from small_echo import TAU, pieces, places, prepared, seen

TERMS = interpreted(terms.terms)
NO_PATHS = results.Paths(np.empty((0, 1, 1)), np.empty((0, 1, 1), np.complex128))
MATRIX, ROOM = interpreted(results.matrix), interpreted(results.room)


def shuffled(motion):
    """The same points in another order, so that parts do not follow each other; the first point stays."""
    order = np.r_[0, 1 + np.random.default_rng(2).permutation(len(motion.points) - 1)]
    return motion._replace(points=motion.points[order], part=motion.part[order])


MOTIONS = {
    "parts": pieces(symbols=2), "mixed parts": shuffled(pieces(symbols=2)),
    "points": places(pieces(symbols=2)).astype(float), "behind": pieces(symbols=2, away=(-70.0, 30.0, 10.0)),
}  # fmt: skip


@pytest.mark.parametrize("kind", MOTIONS)
def test_every_point_s_amplitude_range_and_risk_are_those_of_the_paper(kind):
    """The risk is the peak amplitude times the reference's range and the point's distance from it, over its range."""
    motion = MOTIONS[kind]
    count = places(motion).shape[1]
    there = prepared(motion, weights(count))
    wanted, cells, _ = truth_of(there, motion)
    view = seen(there, motion)
    away = np.linalg.norm((places(motion) - places_of_reference(motion)).astype(float), axis=-1)
    for n in range(2):
        e, z, u, risk = points = ROOM(there.scene, NO_PATHS)
        assert TERMS(there.scene, there.radio, there.refs[n], n, there.aims, points) == 0
        peak = there.peak * np.sqrt(weights(count)) / view.range_m[n].astype(float) ** 2
        assert (abs(z - wanted[n]) < 2e-13 * peak).all()
        assert abs(u - (cells[n] - there.refs[n, CELL])).max() < 1e-14 * 30
        np.testing.assert_allclose(
            risk, peak * (there.refs[n, RANGE] + away[n]) / view.range_m[n].astype(float), rtol=1e-12
        )
        np.testing.assert_allclose(np.linalg.norm(e, axis=1), away[n], atol=1e-13)


def places_of_reference(motion):
    """Where the reference of each symbol stands: the first point's part, or the first point."""
    return motion[:, :1] if isinstance(motion, np.ndarray) else motion.translation[:, motion.part[0]][:, None]


def test_the_first_point_in_the_station_is_named():
    motion = MOTIONS["points"].copy()
    motion[1, [3, 5]] = (4.0, -7.0, 25.0)
    there = prepared(motion)
    points = ROOM(there.scene, NO_PATHS)
    found = [TERMS(there.scene, there.radio, there.refs[n], n, there.aims, points) for n in range(2)]
    assert found == [0, 4]
    for cells, out in ((True, np.empty((2, 64), complex)), (False, np.empty((2, 64), complex))):
        assert MATRIX(there.scene, there.radio, there.refs, there.aims, NO_PATHS, cells, out) == 28 + 4
    risks = np.zeros(2)
    signal = interpreted(results.signal)
    assert (
        signal(there.scene, there.radio, there.refs, np.arange(2), there.aims, NO_PATHS, Found.empty(2), risks)
        == 28 + 4
    )


@pytest.mark.parametrize("count", [1, 2, 3, 16, 25])
def test_an_array_s_sum_is_that_of_its_elements_and_exact_at_whole_numbers(count):
    dirichlet = interpreted(terms.dirichlet)
    for x in np.random.default_rng(count).uniform(-3, 3, 60):
        comb = np.cos(np.pi * x * (2 * np.arange(count) - (count - 1))).sum()
        assert dirichlet(x, count) == pytest.approx(comb, abs=1e-13 * count)
    for whole in range(-3, 4):
        assert dirichlet(float(whole), count) == (-1.0) ** (whole * (count - 1)) * count
        assert interpreted(terms.sin_pi)(float(whole)) == 0.0
    for x in (0.3, -0.3, 1.3, 2.7, -4.4):
        assert interpreted(terms.sin_pi)(x) == pytest.approx(math.sin(math.pi * x), abs=1e-14)


def test_beams_point_by_the_direction_cosines_of_their_aim():
    station, aim = np.array([1.0, -2.0, 3.0]), np.array([5.0, 6.0, -4.0])
    across, up = interpreted(terms.aim_cosines)(aim, station, 0.6, 0.8)
    assert (across, up) == pytest.approx(
        (np.array([(-0.6 * 4 + 0.8 * 8), -7.0]) / np.linalg.norm([4, 8, -7])), rel=1e-14
    )


@pytest.mark.parametrize("count", [1, 4, 11])
def test_a_cell_is_the_mean_of_all_subcarriers_turned_to_it(count):
    """sum of z exp(j 2 pi m' (j - u) / M) / M over centred m'; the cell's own phase is that of m' = (M - 1) / 2."""
    numbers = np.arange(count) - (count - 1) / 2
    rng = np.random.default_rng(count)
    z, u = rng.normal(size=5) + 1j * rng.normal(size=5), rng.uniform(-9, 9, 5)
    for j in (-7, 0, 3, 12):
        wanted = (z * np.cos(TAU * np.multiply.outer(j - u, numbers) / count).mean(-1)).sum()
        assert interpreted(terms.cell_sum)(z, u, j, count) == pytest.approx(complex(wanted), abs=1e-13)
        phase = np.exp(1j * np.pi * (count - 1) * j / count)
        assert interpreted(terms.cell_phase)(j, count) == pytest.approx(phase, abs=1e-13)
    weight = interpreted(terms.cell_weight)(0.37, count)
    assert weight == pytest.approx(np.cos(2 * np.pi * 0.37 * numbers / count).mean(), abs=1e-15)


def test_ranges_hold_more_digits_than_a_double():
    there = prepared(MOTIONS["points"])
    for size in (1.0, 1e3, 1e6):
        place = np.array([[0.61, -0.33, 0.17], [-0.2, 0.7, 0.4]]) * size
        out = np.empty((2, 7))
        interpreted(reference_range._fill)(place, there.radio, out)
        with mpmath.workdps(50):
            for row, point in zip(out, place, strict=True):
                apart = [mpmath.mpf(float(a)) - b for a, b in zip(point, (4, -7, 25), strict=True)]
                r = mpmath.sqrt(sum(a * a for a in apart))
                centre = mpmath.mpf(5.2e9) + mpmath.mpf(63) / 2 * 120000
                turn = 2 * centre * r / 299792458 - mpmath.mpf(row[TURN])
                cells = 2 * 64 * mpmath.mpf(120000) * r / 299792458
                assert abs(turn - mpmath.nint(turn)) < 1e-15 and abs(row[TURN]) <= 0.5 + 1e-15
                assert abs(cells - mpmath.mpf(row[CELL]) - mpmath.mpf(row[REST])) < 1e-15
                assert row[CELL] == round(row[CELL]) and abs(row[REST]) <= 0.5 + 1e-15
                assert row[:3].tolist() == [float(a) for a in apart] and row[RANGE] == pytest.approx(
                    float(r), rel=1e-15
                )
    station = np.array([[4.0, -7.0, 25.0]])
    interpreted(reference_range._fill)(station, there.radio, out[:1])
    assert not out[0].any()


PATHS = {
    "one number each": ((2, 1, 1), (2, 1, 1)), "a number a symbol": ((3, 2, 1), (3, 1, 1)),
    "a number a point": ((2, 1, 28), (2, 2, 28)), "the direct one": ((1, 1, 1), (1, 1, 1)),
}  # fmt: skip


@pytest.mark.parametrize("kind", PATHS)
def test_paths_delay_and_weaken_every_point_s_wave(kind):
    """All cells, all subcarriers and the strongest cell, by sums over points, paths and subcarriers as in Eq. 24."""
    motion, rng = MOTIONS["parts"], np.random.default_rng(4)
    there = prepared(motion, weights(28))
    delays = rng.uniform(0, 3e-7, PATHS[kind][0])
    gains = rng.normal(size=PATHS[kind][1]) + 1j * rng.normal(size=PATHS[kind][1])
    paths = results.Paths(delays, gains)
    z, cells, _ = truth_of(there, motion)
    net, number = there.net, np.arange(64)
    centre = 5.2e9 + 31.5 * 120e3
    later = np.broadcast_to(delays, (len(delays), 2, 28))
    weight = z * np.broadcast_to(gains, (len(gains), 2, 28)) * np.exp(-2j * np.pi * centre * later)
    u = cells + 64 * net.subcarrier_spacing_hz * later
    waves = np.exp(-1j * TAU * np.multiply.outer(number - 31.5, u) / 64)
    wanted = (waves * weight).sum((1, 3)).T
    out = np.full((2, 64), np.nan + 0j)
    arguments = there.scene, there.radio, there.refs, there.aims, paths
    assert MATRIX(*arguments, False, out) == 0
    scale = abs(wanted).max()
    assert abs(out - wanted).max() < 1e-11 * scale
    assert MATRIX(*arguments, True, out) == 0
    inverse = np.exp(2j * np.pi * (np.outer(number, number) % 64) / 64) / 64
    truth = (wanted @ inverse).astype(complex)
    assert abs(out - truth).max() < 1e-11 * scale
    found, risks = Found.empty(2), np.zeros(2)
    signal = interpreted(results.signal)
    assert signal(there.scene, there.radio, there.refs, np.array([1, 0]), there.aims, paths, found, risks) == 0
    best = abs(truth).argmax(1)
    assert (found.cells == best).all() and abs(found.values - truth[[0, 1], best]).max() < 1e-11 * scale
    np.testing.assert_allclose(found.totals, abs(weight).sum((0, 2)).astype(float), rtol=1e-11)
    plain = np.zeros(2)
    signal(there.scene, there.radio, there.refs, np.arange(2), there.aims, NO_PATHS, Found.empty(2), plain)
    if kind != "a number a point":
        np.testing.assert_allclose(
            risks, plain * abs(np.broadcast_to(gains, (len(gains), 2, 1))).sum((0, 2)), rtol=1e-12
        )


def test_a_path_s_gain_weighs_each_point_s_own_risk():
    motion = MOTIONS["points"]
    there = prepared(motion, weights(28))
    gains = np.random.default_rng(1).uniform(1, 2, (2, 1, 28)) * np.array([1, -1j])[:, None, None]
    paths = results.Paths(np.zeros((2, 1, 1)), gains)
    over_paths, alone = ROOM(there.scene, paths), ROOM(there.scene, NO_PATHS)
    interpreted(results.symbol)(there.scene, there.radio, there.refs[1], 1, there.aims, paths, over_paths)
    TERMS(there.scene, there.radio, there.refs[1], 1, there.aims, alone)
    np.testing.assert_allclose(over_paths.risk.reshape(2, 28), alone.risk * abs(gains[:, 0]), rtol=1e-13)


def test_without_paths_all_cells_and_subcarriers_are_those_of_the_direct_one():
    motion = MOTIONS["points"]
    there = prepared(motion, weights(28))
    _, _, wanted = truth_of(there, motion)
    out, other = np.full((2, 64), np.nan + 0j), np.full((2, 64), np.nan + 0j)
    arguments = there.scene, there.radio, there.refs, there.aims, NO_PATHS
    assert MATRIX(*arguments, True, out) == 0 == MATRIX(*arguments, False, other)
    assert abs(out - wanted).max() < 1e-12 * abs(wanted).max()
    assert abs(np.fft.ifft(other, axis=1) - out).max() < 1e-12 * abs(out).max()
    found, risks = Found.empty(2), np.zeros(2)
    interpreted(results.signal)(there.scene, there.radio, there.refs, np.array([1]), there.aims, NO_PATHS, found, risks)
    assert found.values[0] == 0 and found.cells[1] == abs(out[1]).argmax() and risks[0] == 0 < risks[1]
    assert found.values[1] == pytest.approx(out[1, found.cells[1]], rel=1e-12)
    order = np.sort(abs(out[1]))
    assert 0.3 * (order[-1] - order[-2]) < found.gaps[1] <= (order[-1] - order[-2]) * (1 + 1e-12)
