"""Sizes that bounds of effects start from: a facet's radius, how far points move in complex time, the largest echo,
room for rounding, and numbers of a table that are equal by symmetry."""

from types import SimpleNamespace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.effects.chain import Chain
from lowalt.effects.channel import fluctuation, ray_lists, still_rays, symbol_motion, turning_rays
from lowalt.effects.channel.cross_sections import facet_radius_m
from lowalt.effects.received import observe
from test_effects import network
from test_effects_reflected import MIRROR, facing, scene


def test_facets_of_a_hexagonal_lattice_cover_the_plane():
    """The area of the discs is that of the lattice: sqrt(3)/2 of the spacing squared a point."""
    spacing = 0.3
    rows, columns = np.meshgrid(np.arange(5), np.arange(6), indexing="ij")
    points = np.stack([spacing * (columns + 0.5 * (rows % 2)), spacing * np.sqrt(0.75) * rows, 0.0 * rows], axis=-1)
    assert np.pi * facet_radius_m(points.reshape(-1, 3)) ** 2 == pytest.approx(np.sqrt(3) / 2 * spacing**2, rel=1e-12)


def test_points_move_by_their_speed_in_real_time_and_by_their_turn_on_both_sides_of_it():
    """Two parts at 5 and 9 m/s, whose turns move them by 0.1 and 0.4 m for each second of imaginary time."""
    radio = network()
    half = 0.5 / radio.subcarrier_spacing_hz
    speeds = SimpleNamespace(
        travel_m=lambda seconds: seconds * np.array([5.0, 9.0]),
        imaginary_m=lambda seconds: np.multiply.outer(seconds, [0.1, 0.4]),
    )
    view = SimpleNamespace(network=radio, speeds=speeds, nearest_m=lambda: np.array([[500.0, 600.0], [550.0, 400.0]]))
    rho, near, moved, beyond = symbol_motion.complex_motion(view)
    assert near.tolist() == [500.0, 400.0] and len(rho) > 3
    wide, high = 0.5 * (rho + 1 / rho), 0.5 * (rho - 1 / rho)
    assert beyond == pytest.approx(np.multiply.outer(high * half, [0.1, 0.4]), rel=1e-14)
    size = symbol_motion.farthest_m(radio)
    speed, turn = np.multiply.outer((1 + wide) * half, [5.0, 9.0]), np.multiply.outer(high * half, [0.1, 0.4])
    assert moved - size == pytest.approx(speed + turn + turn, rel=1e-6)


def test_a_mirror_doubles_the_largest_amplitude_of_each_way():
    radio = network()
    largest = []
    for effects in ({}, {"ground_reflection": MIRROR}):
        whole = scene(effects, radio)
        view = observe(whole, radio.stations[0], *facing([[0.0, 0.0, 1.0]] * 3))
        largest.append(Chain(list(whole.effects), view, lambda name: np.random.default_rng(1)).target.strengths)
    assert largest[1] == pytest.approx(4.0 * largest[0], rel=1e-2) and (largest[0] > 0).any()


def test_a_ray_that_starts_in_the_plane_of_a_triangle_is_left_open(monkeypatch):
    """Rounding may put it on either side of the triangle; a little off the plane the triangle hides it or does not."""
    monkeypatch.setattr(still_rays, "sides", lambda *_: (1, 1))
    tree = SimpleNamespace(faces=np.array([[0, 1, 2]]), closed=np.array([False]))
    for second, third in (((2.0, 1.0, 0.0), (1.0, 2.0, 0.0)), ((1.0, 2.0, 0.0), (0.0, 1.0, 0.0))):
        vertices = np.array([(1.0, 1.0, 0.0), second, third])
        found = [
            still_rays._met.py_func(vertices, tree, 0, 0.0, 0.0, z, 0.0, 0.0, 1.0, 0.0) for z in (-1e-9, 0.0, 1e-9)
        ]
        assert found == [still_rays.HIDDEN, still_rays.OPEN, still_rays.FREE]


def test_a_vehicle_and_a_large_craft_reflect_alike_to_the_left_and_to_the_right():
    for lobes in (fluctuation.VEHICLE, fluctuation.LARGE_UAV):
        assert lobes[1]._replace(azimuth=270) == lobes[3]


def test_a_point_that_reaches_the_station_within_a_symbol_has_no_bound_and_a_nearer_one_a_larger_bound():
    """What counts is the range less the travel and the array's size, not the range at the symbol's start."""
    radio = network()
    station, size = radio.stations[0], symbol_motion.farthest_m(radio)

    def bounds(nearest_m: float, travel_m: float, others: frozenset = frozenset()) -> float:
        speeds = SimpleNamespace(travel_m=lambda seconds: np.array([travel_m]))
        view = SimpleNamespace(
            network=radio, station=station, speeds=speeds, nearest_m=lambda: np.array([[nearest_m]])
        )  # fmt: skip
        return float(symbol_motion.bound({}, view, others)[0, 0])

    wavefront, without = frozenset({"wavefront"}), 1e300
    assert bounds(2.0, 1.9) < without < bounds(2.0, 2.0)
    assert bounds(2.0 + size, 1.9, wavefront) < without < bounds(2.0 + 0.9 * size, 2.0, wavefront)
    left = np.array([bounds(1.0 + room, 1.0) for room in (0.5, 1.0, 4.0)])
    assert (np.diff(left) < 0).all()


@pytest.mark.filterwarnings("ignore:overflow encountered")
def test_slots_of_kept_lists_lie_in_the_table_and_a_key_finds_its_own():
    slot = interpreted(ray_lists._slot)
    for size in (4, 64):
        keys = np.full(size, -1)
        for key in range(3, 3 + 7 * size // 2, 7):
            own = slot(keys, key)
            assert 0 <= own < size and keys[own] == -1
            keys[own] = key
        taken = [slot(keys, key) for key in range(3, 3 + 7 * size // 2, 7)]
        assert len(set(taken)) == len(taken) and keys[taken].tolist() == list(range(3, 3 + 7 * size // 2, 7))


def test_a_vector_is_taken_apart_along_a_part_s_axis_and_across_it():
    axes, vector = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0], np.array([0.3, -2.0, 5.0])
    found = interpreted(turning_rays._in_axes)(axes, *vector)
    assert found == pytest.approx(axes @ vector, rel=1e-14)
