"""The echo against the direct sum of the paper, the physics read back, and its laws."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pointwise_echo
import reference
from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import Rigid, echo_signal


def network(**changes) -> Network:
    base = Network(
        4.9e9, 120e3, 256, 10, 2.5e-3, 400, (16, 4), (16, 4), 1.0,
        (Station("A", (0.0, 0.0, 25.0), 0.5, 4.9e9), Station("B", (500.0, 0.0, 25.0), 2.6, 4.9e9 + 265 * 120e3)),
    )  # fmt: skip
    return dataclasses.replace(base, **changes)


def cloud_in_motion(rng, symbols, points, centre, size=1.0, speed=10.0):
    """Random points about a moving, turning centre: positions (N, L, 3)."""
    body = rng.normal(scale=size, size=(points, 3))
    angle = np.linspace(0, 3, symbols)
    turn = np.zeros((symbols, 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -np.sin(angle)
    turn[:, 2, 2] = 1
    path = np.asarray(centre) + np.linspace(0, 1, symbols)[:, None] * rng.normal(
        scale=speed, size=3
    )
    return Rigid(turn[:, None], path[:, None], body, np.zeros(points, int))


def positions(motion: Rigid) -> np.ndarray:
    return (
        np.einsum("nlij,lj->nli", motion.rotation[:, motion.part], motion.points)
        + motion.translation[:, motion.part]
    )


def heard(net: Network, motion: Rigid, tolerance: float | None = None):
    """The echo of points of 1 m2 at the first station, whose beam points at their centre."""
    return echo_signal(net, net.stations[0], motion, 1.0, motion.translation[0, 0], tolerance)


def relative(value, truth) -> float:
    return float(np.max(abs(value - truth)) / np.max(abs(truth)))


@pytest.mark.parametrize("station", [0, 1])
@pytest.mark.parametrize("rigid", [True, False])
def test_closed_form_is_the_direct_sum(station, rigid):
    net = network()
    seen = net.stations[station]
    rng = np.random.default_rng(1)
    motion = cloud_in_motion(rng, 6, 30, (180.0, 120.0, 60.0), 1.5, 30.0)
    rcs = rng.uniform(0, 2, 30)
    aim = motion.translation[0, 0]
    truth, cell = reference.echo(net, seen, positions(motion), rcs, aim)
    result = echo_signal(net, seen, motion if rigid else positions(motion), rcs, aim)
    assert relative(result.signal, truth) < 1e-9
    assert (result.cell == cell).all() and result.near_ties == 0


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_any_arrays_and_any_number_of_subcarriers(data):
    counts = st.tuples(st.integers(1, 9), st.integers(1, 9))
    spacing = data.draw(st.sampled_from([15e3, 120e3, 480e3]))
    net = network(
        carrier_hz=data.draw(st.floats(0.5e9, 100e9)),
        subcarrier_spacing_hz=spacing,
        subcarriers=data.draw(st.integers(1, 40)),
        transmit=data.draw(counts),
        receive=data.draw(counts),
        power=data.draw(st.floats(0.1, 100)),
    )
    seen = Station(
        "A",
        (3.0, -2.0, 5.0),
        data.draw(st.floats(0, 7)),
        net.carrier_hz * data.draw(st.floats(0.9, 1.1)),
    )
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    away = 10 ** data.draw(st.floats(0, 3))
    centre = np.array(seen.position_m) + away * rng.normal(size=3)
    motion = cloud_in_motion(rng, 3, data.draw(st.integers(1, 8)), centre, 0.05 * away, 0.1 * away)
    rcs = rng.uniform(0.1, 2, len(motion.points))
    truth = reference.range_cells(net, seen, positions(motion), rcs, motion.translation[0, 0])
    cells = pointwise_echo.range_cells(net, seen, motion, rcs, motion.translation[0, 0])
    # The direct sum's own plain phases are the coarser side: 2e-16 of the largest phase.
    noise = 1e-11 + 1e-14 * 4 * np.pi * 1.2 * net.carrier_hz / SPEED_OF_LIGHT * away
    assert relative(cells, truth) < noise
    result = echo_signal(net, seen, motion, rcs, motion.translation[0, 0])
    strongest = abs(cells).max(axis=1)
    assert np.allclose(abs(result.signal), strongest, rtol=1e-12)
    assert np.allclose(abs(cells[np.arange(3), result.cell]), strongest, rtol=1e-12)


def test_signal_cells_and_subcarriers_agree():
    net = network(subcarriers=24)
    rng = np.random.default_rng(5)
    motion = cloud_in_motion(rng, 4, 7, (90.0, 40.0, 10.0))
    arguments = net, net.stations[0], motion, np.ones(7), motion.translation[0, 0]
    truth = reference.subcarriers(
        net, net.stations[0], positions(motion), np.ones(7), motion.translation[0, 0]
    )
    assert relative(pointwise_echo.subcarriers(*arguments), truth) < 1e-9
    cells = pointwise_echo.range_cells(*arguments)
    result = echo_signal(*arguments)
    assert (result.cell == abs(cells).argmax(axis=1)).all()
    assert relative(pointwise_echo.signal(*arguments).signal, result.signal) < 1e-12


def test_a_moving_point_is_in_its_cell_with_its_doppler():
    net = network()
    seen = net.stations[0]
    speed = 2.0
    start = 30.05 * net.cell_m
    x = start + speed * net.times_s
    path = np.stack([x, 0 * x, np.full_like(x, 25.0)], axis=1)[:, None]
    result = echo_signal(net, seen, path, 1.0, path[0, 0])
    assert (result.cell == np.rint(x / net.cell_m) % 256).all() and set(result.cell) == {30}
    centre = seen.frequency_hz + (net.subcarriers - 1) * net.subcarrier_spacing_hz / 2
    turns = np.unwrap(np.angle(result.signal)) / (2 * np.pi)
    rate = np.polyfit(net.times_s, turns, 1)[0]
    assert rate == pytest.approx(-2 * speed * centre / SPEED_OF_LIGHT, rel=1e-9)


def test_crossing_a_cell_edge_turns_the_phase_by_almost_pi():
    net = network()
    seen = net.stations[0]
    x = (30.5 + np.array([-1e-8, 1e-8])) * net.cell_m
    path = np.stack([x, 0 * x, np.full_like(x, 25.0)], axis=1)[:, None]
    before, after = echo_signal(net, seen, path, 1.0, path[0, 0]).signal
    jump = np.angle(after / before)
    assert abs(jump) == pytest.approx(np.pi * 255 / 256, abs=1e-3)
    assert abs(before) == pytest.approx(abs(after), rel=1e-4)


def test_the_command_s_memory_grows_by_its_output_alone():
    from craft import craft, row
    from lowalt.echo.chunk import clean_signals

    net = network()
    cloud = craft()

    def peak(models: int) -> int:
        rows = [row(model) for model in range(models)]
        tracemalloc.start()
        try:
            clean_signals(net, [net.stations[0].name], {"DJI Mini 2": cloud}, rows, None)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(1)
    # 200 more models: 400 complex64 values of each. Their positions alone would take sixty times as
    # much.
    more = peak(220) - peak(20)
    output = 200 * 400 * 8
    assert output <= more < 1.5 * output
