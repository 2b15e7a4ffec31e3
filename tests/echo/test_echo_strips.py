"""A strip of points as the fast kernel sees it, number by number, against the geometry of every single point."""

from types import SimpleNamespace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.echo.fast import segment, vector_loops
from lowalt.echo.fast.polynomials import smooth
from lowalt.echo.fast.strip import MULTIPLE, STRIP, STRIP_ROOM, Geometry, Offsets, PartPose, Placing, Strip, strip_size
from lowalt.echo.pointwise.reference_range import CELL
from small_echo import LONG, pieces, places, prepared, seen

SEGMENT = np.array([0.0, 3.0, 0.61, 0.17, 0.08, 0.23])
"""First symbol and end, then centre and half-width of the horizontal and of the vertical direction cosine."""
CENTRE, HALF = 0.21875, 1.7


def room(kind=np.float64) -> tuple[Offsets, Strip]:
    """Work arrays that hold no number before they are filled."""
    return (
        Offsets(*(np.full(STRIP_ROOM, np.nan) for _ in Offsets._fields)),
        Strip(*(np.full(STRIP_ROOM, np.nan, kind) for _ in Strip._fields)),
    )


def filled(motion, symbol, near=False, first=0, size=None):
    """A strip of a symbol's points, the scene, and how the station truly sees these points."""
    there = prepared(motion)
    count = motion.points.shape[0] if hasattr(motion, "points") else motion.shape[1]
    size = size or -(-count // MULTIPLE) * MULTIPLE
    offsets, strip = room()
    ref = there.refs[symbol]
    geometry, placing = interpreted(segment.constants)(there.radio, ref, SEGMENT, there.aims, CENTRE, HALF)
    fill = interpreted(segment.fill_offsets)
    fill(there.scene, there.lay, there.radio, 0, symbol, ref[3], first, size, placing, offsets)
    if near:
        # Of so high a degree that nothing but rounding is left; the loops take five and four coefficients.
        excess, inverse = smooth("excess", 0.002, 4)[0], smooth("inverse", 0.002, 3)[0]
        interpreted(vector_loops.near_geometry)(offsets, geometry, excess, inverse, size, strip)
    else:
        interpreted(vector_loops.geometry)(offsets, geometry, size, strip)
    return offsets, strip, there, seen(there, motion)


def holds_the_truth(strip, there, truth, symbol, part, error):
    """Compare every array of the strip with the points `part` of a symbol."""
    count = part.stop - part.start
    scaled = {
        "psi": (truth.across[symbol] - SEGMENT[2]) / SEGMENT[3],
        "omega": (truth.up[symbol] - SEGMENT[4]) / SEGMENT[5],
        "cells": (truth.cells[symbol] - there.refs[symbol, CELL] - CENTRE) / HALF,
        "square": (truth.reference_m[symbol] / truth.range_m[symbol]) ** 2,
    }
    for name, wanted in scaled.items():
        found = getattr(strip, name)[:count]
        np.testing.assert_allclose(found, wanted[part].astype(float), rtol=0, atol=error, err_msg=name)
    turns = LONG(1) * strip.turn[:count] - truth.turn[symbol, part]
    assert abs(turns - np.rint(turns)).max() < 40 * error and abs(strip.turn[:count]).max() <= 0.5


@pytest.mark.parametrize("symbol", [0, 2])
def test_a_strip_of_turned_parts_holds_what_the_station_sees(symbol):
    motion = pieces()
    _, strip, there, truth = filled(motion, symbol)
    holds_the_truth(strip, there, truth, symbol, slice(0, 28), 2e-13)
    assert abs(strip.turn[:28]).max() > 0.3


def test_a_strip_of_single_points_holds_what_the_station_sees():
    motion = places(pieces()).astype(float)
    offsets, strip, there, truth = filled(motion, 1)
    holds_the_truth(strip, there, truth, 1, slice(0, 28), 2e-13)
    assert not any(array[28:32].any() for array in offsets)


def test_a_second_strip_begins_where_the_first_one_ends():
    """Groups begin at a strip's first point: the second strip takes its own alone, and what is over is emptied."""
    sizes = (100, 30, 170)
    motion = pieces(sizes, symbols=1)
    length = strip_size(304)
    assert length == 160
    offsets, strip, there, truth = filled(motion, 0, first=length, size=304 - length)
    holds_the_truth(strip, there, truth, 0, slice(length, 300), 2e-13)
    assert not any(array[300 - length : 304 - length].any() for array in offsets)
    _, strip, *_ = filled(motion, 0, first=0, size=length)
    holds_the_truth(strip, there, truth, 0, slice(0, length), 2e-13)
    singles = places(motion).astype(float)
    _, strip, there, truth = filled(singles, 0, first=length, size=304 - length)
    holds_the_truth(strip, there, truth, 0, slice(length, 300), 2e-13)


def test_ranges_by_polynomials_are_those_by_roots():
    """Small eps: polynomials of degree 4 and 3 leave a few 1e-15 within 0.002."""
    motion = pieces(size=0.02, away=(150.0, 120.0, 40.0))
    offsets, strip, there, truth = filled(motion, 0, near=True)
    assert 1e-4 < abs(offsets.eps[:28]).max() < 0.002
    holds_the_truth(strip, there, truth, 0, slice(0, 28), 2e-12)


def test_polynomials_of_ranges_are_evaluated_from_all_their_coefficients():
    """Coefficients that belong to no function, so that each counts: f and d as plain powers of eps."""
    rng = np.random.default_rng(3)
    excess, inverse = rng.normal(size=5), rng.normal(size=4)
    offsets, strip = room()
    offsets.eps[:16], offsets.y[:16], offsets.z[:16] = rng.normal(size=(3, 16))
    geometry = Geometry(*rng.normal(size=8))
    interpreted(vector_loops.near_geometry)(offsets, geometry, excess, inverse, 16, strip)
    eps, y, z = (array[:16] for array in offsets)
    d, f = eps * np.polynomial.polynomial.polyval(eps, excess), np.polynomial.polynomial.polyval(eps, inverse)
    psi, omega = y * f - geometry.psi_shift, z * f - geometry.omega_shift
    turn = geometry.turn_range * d + geometry.turn_psi * psi + geometry.turn_omega * omega + geometry.turn_start
    wanted = {"psi": psi, "omega": omega, "cells": geometry.cell_scale * d + geometry.cell_shift,
              "turn": turn - np.rint(turn), "square": f * f}  # fmt: skip
    for name, values in wanted.items():
        np.testing.assert_allclose(getattr(strip, name)[:16], values, atol=1e-13, err_msg=name)
        assert np.isnan(getattr(strip, name)[16:]).all()


@pytest.mark.parametrize("degree", range(10))
def test_a_gain_is_evaluated_from_all_coefficients_up_to_its_degree(degree):
    rng = np.random.default_rng(degree)
    coefficients, x, out = rng.normal(size=(2, 12)), rng.uniform(-1, 1, 20), np.full(20, np.nan)
    for row in range(2):
        interpreted(vector_loops.horner)(x, coefficients, row, degree, out, 17)
        truth = np.polynomial.polynomial.polyval(x[:17], coefficients[row, : degree + 1])
        np.testing.assert_allclose(out[:17], truth, atol=1e-14)
        assert np.isnan(out[17:]).all()


def pose_and_placing(seed: int) -> tuple[PartPose, Placing]:
    """Constants of both signs, of which none is like another."""
    rng = np.random.default_rng(seed)
    return PartPose(*rng.normal(size=12)), Placing(*rng.normal(size=7))


@pytest.mark.parametrize("size", [1, 15, 16, 17, 33])
def test_a_part_s_points_are_moved_and_scaled_as_matrices_say(size):
    """eps = |place|^2 + 2 u.place; whole vectors of 16 points are written, and nothing beyond them."""
    rng = np.random.default_rng(size)
    pose, placing = pose_and_placing(7)
    points, (offsets, _), low, at = rng.normal(size=(3, 80)), room(), 5, 9
    interpreted(vector_loops.place_part)(*points, low, size, pose, placing, offsets, at)
    whole = -(-size // 16) * 16
    matrix, origin = np.array(pose[:9]).reshape(3, 3), np.array(pose[9:])
    moved = matrix @ points[:, low : low + whole] + origin[:, None]
    eps = (moved**2).sum(0) + np.array(placing[:3]) @ moved
    across, up = moved[1] * placing.y_scale + placing.y_shift, moved[2] * placing.z_scale + placing.z_shift
    for array, wanted in zip(offsets, (eps, across, up), strict=True):
        np.testing.assert_allclose(array[at : at + whole], wanted, atol=1e-13)
        assert np.isnan(array[:at]).all() and np.isnan(array[at + whole :]).all()
    # A part whose matrix is zero has all of its points at its origin.
    still, (others, _) = pose._replace(**dict.fromkeys(PartPose._fields[:9], 0.0)), room()
    interpreted(vector_loops.place_part)(*points, low, size, still, placing, offsets, at)
    interpreted(vector_loops.place_still)(still, placing, size, others, at)
    for array, same in zip(others, offsets, strict=True):
        np.testing.assert_allclose(array[at : at + whole], same[at : at + whole], rtol=1e-13)
        assert np.isnan(array[:at]).all() and np.isnan(array[at + whole :]).all()


@pytest.mark.parametrize("count", [6, 8, 11])
def test_amplitudes_are_products_of_their_factors_turned_by_their_phases(count):
    rng = np.random.default_rng(count)
    _, strip = room()
    for array in strip[:7]:
        array[:24] = rng.uniform(-0.5, 0.5, 24)
    cosine, sine = rng.normal(size=(2, count))
    share = rng.uniform(size=60)
    total, second = interpreted(vector_loops.amplitudes)(strip, share, 20, tuple(cosine), tuple(sine), 22)
    size = share[20:42] * strip.gain_h[:22] * strip.gain_v[:22] * strip.square[:22]
    turn = strip.turn[:22]
    np.testing.assert_allclose(strip.real[:22], size * np.polynomial.polynomial.polyval(turn**2, cosine), atol=1e-15)
    np.testing.assert_allclose(
        strip.imag[:22], size * turn * np.polynomial.polynomial.polyval(turn**2, sine), atol=1e-15
    )
    assert total == pytest.approx(abs(size).sum(), rel=1e-13)
    assert second == pytest.approx((abs(size) * strip.cells[:22] ** 2).sum(), rel=1e-13)
    assert np.isnan(strip.real[22:]).all()


def test_moments_are_sums_of_powers_four_at_a_time():
    rng = np.random.default_rng(1)
    _, strip = room()
    strip.real[:30], strip.imag[:30], strip.cells[:30] = rng.normal(size=(3, 30))
    before = SimpleNamespace(real=strip.real.copy(), imag=strip.imag.copy())
    powers = strip.cells[7:28] ** np.arange(4)[:, None]
    found = interpreted(vector_loops.moments)(strip, 7, 21)
    np.testing.assert_allclose(found[:4], powers @ before.real[7:28], rtol=1e-12)
    np.testing.assert_allclose(found[4:], powers @ before.imag[7:28], rtol=1e-12)
    for now, then in ((strip.real, before.real), (strip.imag, before.imag)):
        np.testing.assert_allclose(now[7:28], then[7:28] * strip.cells[7:28] ** 4, rtol=1e-13)
        assert (now[:7] == then[:7]).all() and (now[28:30] == then[28:30]).all()


def test_strips_are_equal_shares_in_whole_vectors():
    """At most 256 points a strip, as few strips as that allows, and none longer than it must be."""
    for points in range(MULTIPLE, 2000, MULTIPLE):
        size, strips = strip_size.py_func(points), -(-points // STRIP)
        assert size % MULTIPLE == 0 and size <= STRIP
        assert (strips - 1) * size < points <= strips * size and (size - MULTIPLE) * strips < points
