"""Checked inputs of the echo, field by field: motions, cross sections, paths, and what a refusal says."""

import dataclasses

import numpy as np
import pytest

from lowalt.echo import Path, Rigid, api, echo_matrix, echo_signal
from lowalt.echo.scene import EchoScene, Target, _float, check, target
from lowalt.files.errors import InputError
from small_echo import NETWORK, pieces

SEEN = NETWORK.stations[0]
PLACES = np.random.default_rng(1).normal(50, 3, (2, 3, 3))


def still(parts=3, points=3, part=None, rotation=None) -> Rigid:
    """Points on parts that do not turn; by default each point is a part of its own."""
    rotation = np.zeros((2, parts, 3, 3)) if rotation is None else rotation
    translation = np.random.default_rng(2).normal(50, 3, (2, parts, 3))
    return Rigid(rotation, translation, np.ones((points, 3)), np.arange(points) if part is None else np.asarray(part))


def test_places_become_a_target_without_parts():
    seen = target(PLACES, 2.25)
    assert isinstance(seen, Target) and seen.rotation.shape == (0, 0, 3, 3) and seen.points.shape == (0, 3)
    assert seen.part.shape == (0,) and seen.part.dtype == np.int64
    np.testing.assert_array_equal(seen.translation, PLACES)
    assert seen.rcs_m2.tolist() == [2.25] * 3 and seen.root_rcs.tolist() == [1.5] * 3


def test_points_that_are_parts_of_their_own_and_do_not_turn_are_places():
    """Each of the conditions alone decides: as many parts, in order, and no matrix but zero."""
    for motion in (still(), still(rotation=np.broadcast_to(0.0, (2, 3, 3, 3)))):
        seen = target(motion, 1.0)
        assert seen.rotation.shape == (0, 0, 3, 3) and seen.points.shape == (0, 3) and seen.part.shape == (0,)
        np.testing.assert_array_equal(seen.translation, motion.translation)
    turned = np.zeros((2, 3, 3, 3))
    turned[1, 2, 2, 0] = 1e-3
    for motion in (still(points=2), still(part=[0, 2, 1]), still(rotation=turned), still(parts=4)):
        seen = target(motion, 1.0)
        assert seen.rotation.shape == motion.rotation.shape and (seen.part == motion.part).all()
        np.testing.assert_array_equal(seen.points, motion.points)
    for zero in (np.broadcast_to(0.0, (2, 3, 3, 3)), np.zeros((2, 3, 3, 3))):
        seen = target(still(points=2, rotation=zero), 1.0)
        assert seen.rotation.flags.c_contiguous and seen.rotation.shape == (2, 3, 3, 3) and not seen.rotation.any()


def test_a_motion_keeps_its_numbers_as_contiguous_doubles():
    motion = pieces(symbols=2)
    seen = target(
        motion._replace(part=motion.part.astype(np.uint8), points=np.asfortranarray(motion.points)), np.ones(28)
    )
    for name in ("rotation", "translation", "points", "part"):
        np.testing.assert_array_equal(getattr(seen, name), getattr(motion, name))
        assert getattr(seen, name).flags.c_contiguous
    assert seen.part.dtype == np.int64 and seen.points.dtype == np.float64


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"rotation": np.zeros((2, 3, 3, 2))}, r"motion.rotation has shape \(2, 3, 3, 2\), expected \(N, P, 3, 3\)"),
        ({"rotation": np.zeros((2, 3, 3))}, r"motion.rotation has shape \(2, 3, 3\), expected \(N, P, 3, 3\)"),
        ({"rotation": np.zeros((0, 3, 3, 3))}, r"motion.rotation has shape \(0, 3, 3, 3\), expected \(N, P, 3, 3\)"),
        ({"rotation": np.broadcast_to(np.nan, (2, 3, 3, 3))}, r"motion.rotation\[0, 0, 0, 0\] is nan"),
        ({"translation": np.zeros((2, 4, 3))}, r"motion.translation has shape \(2, 4, 3\), expected \(2, 3, 3\)"),
        ({"points": np.zeros((3, 2))}, r"motion.points has shape \(3, 2\), expected \(L, 3\)"),
        ({"part": np.array([0, 1])}, r"motion.part has shape \(2,\) and type int64, expected \(3,\) integers"),
        ({"part": np.array([0, 1, 3])}, r"motion.part spans 0..3, expected 0..2"),
        ({"part": np.array([2, -1, 1])}, r"motion.part spans -1..2, expected 0..2"),
    ],
)
def test_a_motion_s_wrong_part_is_named(change, told):
    with pytest.raises(InputError, match=f"^heron: {told}"):
        target(still()._replace(**change), 1.0, "heron")


def test_a_wrong_cross_section_is_named_by_its_point():
    for rcs, told in (
        (np.array([1.0, -2.0, -3.0]), r"rcs_m2\[2\] is -3.0, expected square metres >= 0"),
        (np.ones((3, 1)), r"rcs_m2 has shape \(3, 1\), expected \(3,\)"),
        (np.array([1.0, np.inf, 1.0]), r"rcs_m2\[1\] is inf, expected a finite number"),
        ("much", "rcs_m2 is .*much.*, expected real numbers"),
    ):
        with pytest.raises(InputError, match=f"^{told}"):
            target(PLACES, rcs)
    assert target(PLACES, np.array([0.0, 1.0, 4.0])).root_rcs.tolist() == [0.0, 1.0, 2.0]


def test_numbers_whose_sum_overflows_are_finite_all_the_same():
    """Only where the sum is not finite are all numbers tested, and the first one that is not finite is named."""
    large = np.full((2, 2), 1e308)
    with np.errstate(over="ignore", invalid="ignore"):
        assert _float("x", large, (2, "N"), "") is large
    large[1, 0] = -np.inf
    with np.errstate(over="ignore", invalid="ignore"), pytest.raises(InputError, match=r"^owl: x\[1, 0\] is -inf"):
        _float("x", large, (2, "N"), "owl: ")
    fixed = np.ones(3)
    fixed.setflags(write=False)
    copied = _float("x", fixed, (3,), "")
    assert copied.flags.writeable and copied.tolist() == [1.0] * 3


def test_a_scene_is_a_target_and_an_aim():
    seen = target(PLACES, 1.0)
    scene = check(NETWORK, SEEN, seen, None, (1.0, 2.0, 3.0))
    assert (
        isinstance(scene, EchoScene) and scene.translation is seen.translation and scene.aim.tolist() == [1.0, 2.0, 3.0]
    )
    with pytest.raises(InputError, match=r"^kite: rcs_m2 is 1.0, expected None: a Target holds its cross sections"):
        check(NETWORK, SEEN, seen, 1.0, (1.0, 2.0, 3.0), "kite")
    with pytest.raises(InputError, match=r"^kite: aim_m is .*the place of station A: no direction to aim at"):
        check(NETWORK, SEEN, seen, None, (4.0, -7.0, 25.0), "kite")
    for change in ({"position_m": (1.0, 2.0)}, {"position_m": (1.0, 2.0, np.nan)}, {"normal_rad": np.inf}):
        with pytest.raises(InputError, match=r"^station A: position_m .* is not finite"):
            check(NETWORK, dataclasses.replace(SEEN, **change), seen, None, (1.0, 2.0, 3.0))
    for hertz in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match=f"^station A: frequency_hz is {hertz}, expected a positive number"):
            check(NETWORK, dataclasses.replace(SEEN, frequency_hz=hertz), seen, None, (1.0, 2.0, 3.0))


def test_paths_are_stacked_at_the_widest_of_their_shapes():
    paths = [Path(1e-7, np.ones((2, 1))), Path(np.full((1, 3), 2e-7), 0.5j)]
    found = api._paths(paths, (2, 3), "")
    assert found.delays.shape == (2, 1, 3) and found.gains.shape == (2, 2, 1)
    assert found.delays[:, 0, 0].tolist() == [1e-7, 2e-7] and found.gains[1].tolist() == [[0.5j], [0.5j]]
    none = api._paths(None, (2, 3), "")
    assert none.delays.shape == none.gains.shape == (0, 1, 1) and none.gains.dtype == np.complex128
    assert api._paths([Path()], (2, 3), "").delays.shape == (1, 1, 1)


@pytest.mark.parametrize(
    ("paths", "told"),
    [
        ([], "paths is empty, expected at least one path"),
        ([Path(), Path(np.inf)], r"paths\[1\].delay_s has a NaN or infinite value, expected finite numbers"),
        ([Path(), Path(0.0, complex(0, np.nan))], r"paths\[1\].gain has a NaN or infinite value"),
        ([Path(np.zeros((3, 1)))], r"paths\[0\].delay_s has shape \(3, 1\), expected to broadcast to \(2, 3\)"),
        ([Path(), Path(0.0, np.ones(4))], r"paths\[1\].gain has shape \(4,\), expected to broadcast to \(2, 3\)"),
    ],
)
def test_a_wrong_path_is_named(paths, told):
    with pytest.raises(InputError, match=f"^tern: {told}"):
        api._paths(paths, (2, 3), "tern")


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -1e-3, float("nan"), "1e-3", 2])
def test_a_tolerance_is_a_number_between_nought_and_one(tolerance):
    with pytest.raises(InputError, match=r"^tern: tolerance is .*, expected null or a number between 0 and 1"):
        api._check_tolerance(tolerance, "tern")
    assert api._check_tolerance(None, "") is api._check_tolerance(0.999, "") is None


def test_a_point_in_the_station_is_named_by_its_number_and_symbol():
    scene = check(NETWORK, SEEN, PLACES, 1.0, (1.0, 2.0, 3.0))
    assert api.check_fault(0, scene, SEEN, "") is None
    for fault, named in ((1, "point 0 at symbol 0"), (3, "point 2 at symbol 0"), (4, "point 0 at symbol 1")):
        with pytest.raises(InputError, match=f"^tern: position of {named} is .*, the place of station A"):
            api.check_fault(fault, scene, SEEN, "tern")


def test_what_kernels_get_is_about_the_first_point_s_part():
    """The reference is the translation of the part that the first point is on, or the first point."""
    motion = pieces(symbols=2)
    moved = motion._replace(part=motion.part[::-1].copy())
    for given, first in ((motion, 0), (moved, 2), (PLACES, 0)):
        *_, refs, aims, paths = api.prepared(NETWORK, SEEN, given, 1.0, (9.0, 4.0, 30.0), None, "")
        places = given if given is PLACES else given.translation
        np.testing.assert_allclose(refs[:, :3], places[:, first] - [4.0, -7.0, 25.0], atol=1e-13)
        apart = np.array([5.0, 11.0, 5.0])
        across = np.cos(0.7) * 11.0 - np.sin(0.7) * 5.0
        assert aims == pytest.approx((across / np.linalg.norm(apart), 5.0 / np.linalg.norm(apart)), rel=1e-13)
        assert len(paths.delays) == 0
    with pytest.raises(InputError, match=r"^tern: station A is a link between two stations"):
        api.prepared(NETWORK, dataclasses.replace(SEEN, transmitter="B"), PLACES, 1.0, (9.0, 4.0, 30.0), None, "tern")


def test_cells_and_subcarriers_are_each_other_s_transform_and_the_signal_is_the_strongest_cell():
    cells = echo_matrix(NETWORK, SEEN, PLACES, 1.0, PLACES[0, 0], "cells")
    tones = echo_matrix(NETWORK, SEEN, PLACES, 1.0, PLACES[0, 0], "subcarriers")
    assert cells.shape == (2, 64) and abs(np.fft.ifft(tones, axis=1) - cells).max() < 1e-12 * abs(cells).max()
    found = echo_signal(NETWORK, SEEN, PLACES, 1.0, PLACES[0, 0])
    assert (found.cell == abs(cells).argmax(1)).all() and found.near_ties == 0
    assert abs(found.signal - cells[[0, 1], found.cell]).max() < 1e-12 * abs(cells).max()
