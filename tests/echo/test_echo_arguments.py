"""What the echo is given and what it tells, at the limits: parts, cross sections, places, bounds and gaps."""

import dataclasses

import numpy as np
import pytest
from test_echo import network

from lowalt.config.network import Station
from lowalt.echo import Path, Rigid, echo_matrix, echo_signal, echo_signals, method_text, scene
from lowalt.echo.api import EchoResult
from lowalt.echo.refine import Method
from lowalt.files.errors import InputError

NET = network(symbols=2)
SEEN = NET.stations[0]
AIM = np.array([150.0, 30.0, 40.0])


def nodes(count: int) -> np.ndarray:
    """Places (2, count, 3) about the aim, all different."""
    return AIM + np.random.default_rng(4).normal(scale=2.0, size=(2, count, 3))


@pytest.mark.parametrize(("part", "told"), [([-1, 0, 1], "-1..1, expected 0..1"), ([0, 1, 2], "0..2, expected 0..1")])
def test_a_point_on_a_part_that_the_motion_lacks_is_refused(part, told):
    motion = Rigid(np.zeros((2, 2, 3, 3)), nodes(2), np.zeros((3, 3)), np.array(part))
    with pytest.raises(InputError, match=f"crow: motion.part spans {told}"):
        echo_signal(NET, SEEN, motion, 1.0, AIM, sample="crow")
    with pytest.raises(InputError, match=r"motion.part has shape \(3,\) and type float64, expected \(3,\) integers"):
        echo_signal(NET, SEEN, motion._replace(part=np.zeros(3)), 1.0, AIM)
    with pytest.raises(InputError, match=r"motion.part has shape \(2,\)"):
        echo_signal(NET, SEEN, motion._replace(part=np.zeros(2, int)), 1.0, AIM)


def test_each_point_stands_on_the_part_it_names_even_if_every_part_has_one_and_none_turns():
    places, order, rcs = nodes(3), np.array([2, 0, 1]), np.array([1.0, 4.0, 9.0])
    motion = Rigid(np.zeros((2, 3, 3, 3)), places, np.ones((3, 3)), order)
    found = echo_signal(NET, SEEN, motion, rcs, AIM)
    truth = echo_signal(NET, SEEN, places[:, order], rcs, AIM)
    assert np.allclose(found.signal, truth.signal, rtol=1e-12, atol=0)


def test_a_point_of_no_cross_section_is_not_seen_and_a_target_of_such_points_has_no_bound():
    places = nodes(2)
    with_it = echo_signal(NET, SEEN, places, np.array([1.0, 0.0]), AIM)
    alone = echo_signal(NET, SEEN, places[:, :1], 1.0, AIM)
    assert np.allclose(with_it.signal, alone.signal, rtol=1e-12, atol=0)
    nothing = echo_signal(NET, SEEN, places, 0.0, AIM)
    assert not nothing.signal.any() and not nothing.totals.any() and nothing.bound == np.inf


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"normal_rad": float("nan")}, "position_m .* or normal_rad nan is not finite"),
        ({"position_m": (0.0, float("inf"), 25.0)}, "position_m .*inf.* is not finite"),
        ({"frequency_hz": float("inf")}, "frequency_hz is inf, expected a positive number"),
        ({"frequency_hz": 0.0}, "frequency_hz is 0.0, expected a positive number"),
    ],
)
def test_a_station_whose_numbers_are_not_finite_is_refused(change, told):
    with pytest.raises(InputError, match=f"station A: {told}"):
        echo_signal(NET, dataclasses.replace(SEEN, **change), nodes(1), 1.0, AIM)


def test_the_refused_value_and_the_sample_are_named_by_every_function():
    with pytest.raises(InputError, match="columns is 'pixels', expected 'cells' or 'subcarriers'"):
        echo_matrix(NET, SEEN, nodes(1), 1.0, AIM, "pixels")
    with pytest.raises(InputError, match=r"owl: tolerance is 2\.0"):
        echo_signals(NET, nodes(1), 1.0, AIM, 2.0, "owl")


@pytest.mark.parametrize("rigid", [True, False])
def test_a_point_in_the_station_is_named_with_its_symbol(rigid):
    """Point 2, of four nodes or of five points on four parts, stands there at the last of two symbols."""
    places = nodes(4)
    places[1, 2] = SEEN.position_m
    motion = Rigid(np.zeros((2, 4, 3, 3)), places, np.zeros((5, 3)), np.array([0, 1, 2, 1, 3])) if rigid else places
    calls = [
        lambda: echo_signal(NET, SEEN, motion, 1.0, AIM),
        lambda: echo_signal(NET, SEEN, motion, 1.0, AIM, paths=[Path(), Path(1e-7)]),
        lambda: echo_matrix(NET, SEEN, motion, 1.0, AIM, "subcarriers"),
    ]
    for call in calls:
        with pytest.raises(InputError, match="position of point 2 at symbol 1 is "):
            call()


def test_rotations_that_are_one_zero_repeated_are_not_copied():
    repeated = np.broadcast_to(0.0, (2, 3, 3, 3))
    kept, known = scene._rotation(repeated, "")
    assert known and kept is repeated
    for other in (np.zeros((2, 3, 3, 3)), np.broadcast_to(1.0, (2, 3, 3, 3))):
        made, known = scene._rotation(other, "")
        assert not known and made.flags.c_contiguous and (made == other).all()


@pytest.mark.parametrize(("apart_m", "held"), [(1.0, True), (60.0, False)])
def test_a_target_too_deep_for_cell_kernels_has_none_in_its_record(apart_m, held):
    """Cells of 4.9 m are kept for targets within 2.5 of them."""
    places = AIM + np.array([[[0.0, 0.0, 0.0], [apart_m, 0.0, 0.0]]]) + np.zeros((2, 1, 1))
    orders = echo_signal(NET, SEEN, places, 1.0, AIM, 1e-3).method.orders
    assert min(orders[:2]) > 0 and (orders[2] > 0) == held and orders[2] >= 0


def on_axis(cells: float) -> tuple[Station, np.ndarray]:
    """A station at the origin that looks along x, and one point there so many range cells away, (1, 1, 3)."""
    station = dataclasses.replace(SEEN, position_m=(0.0, 0.0, 0.0), normal_rad=0.0)
    return station, np.array([[[cells * NET.cell_m, 0.0, 0.0]]])


def test_the_pointwise_bound_of_one_point_in_the_beam_is_that_of_its_sum_and_of_its_direction():
    """At a whole cell the value is the amplitude, and on the axis the peak one, so both parts count once."""
    station, place = on_axis(30.0)
    found = echo_signal(NET, station, place, 1.0, place[0, 0], paths=[Path()])
    share, direction = found.method.pointwise_bound
    assert share > 0 and direction > 0 and found.bound == pytest.approx(share + direction, rel=1e-6)
    assert (found.method.cheap, found.method.exact, found.method.general) == (0, 0, 1)


def test_a_proved_lead_is_the_computed_one_less_the_bounds_of_both_cells():
    """A point so near the middle between two cells that the bounds are a good part of what they differ by."""
    station, place = on_axis(30.5 + 4e-13)
    arguments = (NET, station, place, 1.0, place[0, 0])
    strengths = np.sort(abs(echo_matrix(*arguments, "cells", paths=[Path()])[0]))
    lead, found = strengths[-1] - strengths[-2], echo_signal(*arguments, paths=[Path()])
    bound = found.bound * abs(found.signal[0])
    assert 0.05 * lead < bound < 0.4 * lead
    assert found.gap[0] == pytest.approx(lead - 2 * bound, rel=0.01)


def test_the_words_on_a_signal_give_each_number_its_own_place():
    method = Method(1.5e-4, True, (5, 7, 11), True, 21, 22, 23, 0.125, 2.5, (0.0, 0.0), (41, 42, 43))
    result = EchoResult(np.ones(1), np.ones(1), 51, 6.1e-7, method, np.ones(1), np.ones(1))
    assert method_text(result).splitlines() == [
        "target radius 2.5 m, at most 0.125 of the range",
        "plan for 1.5e-04 of the sum of amplitudes: float32 after the phase, ranges by polynomials, "
        "orders of cosine 5, sine 7, cell kernel 11",
        "symbols: 21 by that plan, 22 by the exact one, 23 by the pointwise kernel",
        "symbols computed again so that complex64 is rounded correctly: 41",
        "error proved below 6.1e-07 of the largest value; near-ties 51",
    ]
    plain = result._replace(method=method._replace(error=None, single=False, near=False))
    assert "exact mode: float64, ranges by roots, " in method_text(plain)
