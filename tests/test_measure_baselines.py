"""Other methods for the echo and its hard cases (`lowalt.measure`), each against a sum of another kind."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import echo_signal
from lowalt.echo.scene import Rigid
from lowalt.files.yaml_files import load_yaml
from lowalt.measure import echo_baselines, fifty_digits, hard_cases

ROOT = Path(__file__).parent.parent
STATION = Station("B", (30.0, -12.0, 21.0), 0.7, 4.93e9)


def small(subcarriers):
    """A radar of odd sizes. Its station faces 0.7 rad from the x axis and has another carrier than the network."""
    return Network(4.9e9, 120e3, subcarriers, 10, 2.5e-3, 3, (3, 2), (2, 5), 1.7, (STATION,))


def turning():
    """Two parts that turn and move between three symbols: motion, cross sections (m^2) and aim (m)."""
    angles = np.array([[0.0, 0.4], [0.3, 0.1], [0.9, -0.2]])
    rotation = np.zeros((3, 2, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(angles)
    rotation[..., 1, 0], rotation[..., 0, 1], rotation[..., 2, 2] = np.sin(angles), -np.sin(angles), 1
    translation = np.array([90.0, 35.0, 40.0]) + np.arange(18).reshape(3, 2, 3) / 3
    points = np.array([[0.4, 0.1, -0.2], [-0.3, 0.8, 0.1], [0.2, -0.5, 0.6], [700.0, 9.0, 1.0]])
    motion = Rigid(rotation, translation, points, np.array([0, 0, 1, 1]))
    return motion, np.array([0.5, 1.0, 0.2, 300.0]), np.array([95.0, 36.0, 44.0])


def places(motion):
    """Positions (N, L, 3) m, a point at a time."""
    return np.array([
        [motion.rotation[n, part] @ point + motion.translation[n, part]
         for point, part in zip(motion.points, motion.part, strict=True)]
        for n in range(len(motion.rotation))
    ])  # fmt: skip


@pytest.mark.parametrize("count", [37, 16, 33, 1])
def test_every_method_has_the_strongest_of_the_cells_in_fifty_digits(count):
    """Subcarriers that sixteen divides and does not divide; the last point lies many unambiguous ranges away."""
    network, given = small(count), turning()
    motion, rcs, aim = given
    np.testing.assert_allclose(echo_baselines.positions(motion), places(motion), rtol=1e-13)
    truth = np.array([
        [complex(cell) for cell in fifty_digits.cells_mp(network, STATION, one, rcs.tolist(), aim, range(count))]
        for one in places(motion).tolist()
    ])  # fmt: skip
    for n in range(3):
        np.testing.assert_allclose(echo_baselines.judge(network, STATION, *given, n), truth[n],
                                   atol=1e-11 * abs(truth).max(), rtol=0)  # fmt: skip
    wanted = truth[np.arange(3), abs(truth).argmax(1)]
    methods = [echo_baselines.direct, echo_baselines.factored]
    for method in methods:
        np.testing.assert_allclose(method(network, STATION, *given), wanted, rtol=1e-9)


def test_the_closed_form_and_the_non_uniform_transform_are_the_direct_sum():
    network, (motion, rcs, aim) = small(37), turning()
    wanted = echo_baselines.direct(network, STATION, motion, rcs, aim)
    np.testing.assert_allclose(echo_baselines.closed(network, STATION, motion, rcs, aim), wanted, rtol=1e-9)
    np.testing.assert_allclose(echo_signal(network, STATION, motion, rcs, aim).signal, wanted, rtol=1e-9)
    pytest.importorskip("finufft")
    found = echo_baselines.finufft(network, STATION, motion, rcs, aim, 1e-12)
    np.testing.assert_allclose(found, wanted, rtol=1e-8)


def test_ratios_of_sines_have_their_limit_at_multiples_of_pi():
    x = np.array([0.0, 1e-14, 1e-6, 0.3, -2.0])
    wanted = [7, 7, 7, *(np.sin(7 * x[3:]) / np.sin(x[3:]))]
    np.testing.assert_allclose(echo_baselines._ratio(x, 7), wanted, rtol=1e-9)


def test_the_cases_radar_is_the_default_s_with_one_station_at_the_origin():
    default = Network.from_settings(load_yaml(ROOT / "config/default.yaml")["network"])
    station = Station("A", (0.0, 0.0, 25.0), 0.0, 4.9e9)
    wanted = dataclasses.replace(default, stations=(station,), guard_subcarriers=hard_cases.NET.guard_subcarriers)
    assert wanted == hard_cases.NET
    cases = hard_cases.CASES
    arrays = cases["arrays of 7 x 3 and 25 x 1"].network
    assert (arrays.transmit, arrays.receive) == ((7, 3), (25, 1))
    assert cases["arrays of 256"].network.transmit == (256, 1)
    for count in (1, 2, 3300):
        assert cases[f"M = {count}"].network.subcarriers == count
    np.testing.assert_array_equal(hard_cases.cluster(90), hard_cases.cluster(90, 5, 0.5, 3))
    assert [len(case.points_m) for case in cases.values()].count(5) == 10


def test_beams_aim_as_far_and_as_high_as_the_cases_are_to_test():
    """Distance of the aim from the station (m), and how far it lies across for each metre ahead."""
    aims = {
        "at the unambiguous range": (1200, 0.31), "past the unambiguous range": (2000, 0.3), "at 1 cm": (0.02, 0.2),
        "at 100 km": (1e5, 0.3), "100 km at 77 GHz": (1e5, 0.3), "one point": (77, 0.32), "arrays of 256": (299, 0.3),
        "arrays of 7 x 3 and 25 x 1": (88, 0.3), "M = 1": (88, 0.3), "M = 2": (88, 0.3), "M = 3300": (88, 0.3),
        "larger than its range": (3, 0.3), "at the beam's centre": (150, 0.3), "straight above": (55, None),
        "at a cell's edge": (np.hypot(30.5 * hard_cases.CELL, np.sqrt(2)), 1 / (30.5 * hard_cases.CELL)),
        "at a cell's centre": (np.hypot(30 * hard_cases.CELL, np.sqrt(2)), 1 / (30 * hard_cases.CELL)),
        "deep fade": (np.hypot(150, 1), 1 / 150), "behind the array": (np.sqrt(90**2 + 40**2 + 5**2), -4 / 9),
    }  # fmt: skip
    for name, (distance, across) in aims.items():
        way = np.asarray(hard_cases.CASES[name].aim_m, float) - [0, 0, 25]
        assert np.linalg.norm(way) == pytest.approx(distance), name
        assert across is None or way[1] / way[0] == pytest.approx(across), name
    sizes = {"past the unambiguous range": 0.5, "M = 3300": 0.1, "larger than its range": 4, "100 km at 77 GHz": 0.01}
    for name, size in sizes.items():
        points = hard_cases.CASES[name].points_m
        spread = np.random.default_rng(3).normal(scale=size, size=(5, 3))
        np.testing.assert_allclose(points - points[0], spread - spread[0], atol=1e-9)
    ranges = {
        "M = 1": 90, "M = 2": 90, "arrays of 256": 300, "M = 3300": 90, "arrays of 7 x 3 and 25 x 1": 90,
        "larger than its range": 3, "at 100 km": 1e5, "100 km at 77 GHz": 1e5,
        "past the unambiguous range": 1.7 * hard_cases.MAX,
    }  # fmt: skip
    for name, distance in ranges.items():
        points = hard_cases.CASES[name].points_m
        centre = (points - np.random.default_rng(3).normal(scale=sizes.get(name, 0.5), size=points.shape))[0]
        assert np.linalg.norm(centre - [0, 0, 25]) == pytest.approx(distance), name
    mirrored = hard_cases.CASES["behind the array"].points_m
    np.testing.assert_allclose(mirrored, hard_cases.cluster(120) * [-1, 1, 1])


def test_the_naive_formula_holds_for_a_station_that_does_not_face_along_an_axis():
    network = dataclasses.replace(small(37), symbols=1)
    points = np.array([[95.0, 36.0, 44.0], [96.0, 35.0, 43.0], [94.0, 37.5, 44.5]])
    rcs, aim = np.array([0.5, 1.0, 2.0]), np.array([95.5, 36.5, 43.0])
    wanted = echo_signal(network, STATION, points[None], rcs, aim).signal[0]
    assert abs(hard_cases.naive(network, STATION, points, rcs, aim) / wanted - 1) < 1e-9


@pytest.mark.parametrize(("better", "right"), [({}, True), ({"all": 5e-12}, True), ({"all": 1e-10}, False),
                                               ({2: 1.0}, False), ({-2: 1.0}, False), ({36 * 3: 1.0}, False),
                                               ({3: 1.0}, True)])  # fmt: skip
def test_a_cell_is_right_that_no_cell_about_it_nor_any_listed_one_exceeds(better, right, monkeypatch):
    """256 cells: those within two of the engine's choice, 30, are looked at, and every 36th."""
    pytest.importorskip("mpmath")
    asked = {}

    def cells(network, station, points, rcs, aim, listed):
        asked.update(rcs=rcs, listed=listed, points=points)
        return [3 * (1 + better.get("all", 0.0) + better.get(cell - 30, better.get(cell, 0.0))) if cell != 30 else 3
                for cell in listed]  # fmt: skip

    monkeypatch.setattr(fifty_digits, "cells_mp", cells)
    monkeypatch.setattr(hard_cases, "echo_signal", lambda *given: SimpleNamespace(
        signal=np.array([2j, 9]), cell=np.array([30, 7]), bound=0.125))  # fmt: skip
    found = hard_cases.judged("past the unambiguous range")
    assert (found.ours, found.truth, found.right, found.bound) == (2j, 3, right, 0.125)
    assert asked["listed"] == sorted({28, 29, 30, 31, 32, *range(0, 256, 36)})
    assert asked["rcs"] == [0.5, 0.75, 1.0, 1.25, 1.5] and np.shape(asked["points"]) == (5, 3)
    hard_cases.judged("deep fade")
    assert asked["rcs"] == [1.0, 1.0]


def test_a_row_tells_errors_relative_to_the_truth(monkeypatch):
    made = iter([hard_cases.Judged(1.1, 3.0, 2.0, True, 3e-9), hard_cases.Judged(2.0, np.nan, 2.0, False, 0.5)])
    monkeypatch.setattr(hard_cases, "CASES", {"a": SimpleNamespace(why="x"), "b": SimpleNamespace(why="y")})
    monkeypatch.setattr(hard_cases, "judged", lambda name: next(made))
    assert [row[:-1] for row in hard_cases.rows()] == [
        ["a", "x", "5e-01", "4e-01", "3e-09", "yes"], ["b", "y", "not a number", "0e+00", "5e-01", "no"]]  # fmt: skip


def test_light_is_as_fast_in_fifty_digits():
    assert fifty_digits.C == SPEED_OF_LIGHT == hard_cases.C
