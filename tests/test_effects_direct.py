"""The direct echo from places to moments: as from kept factors and as the slow truth; bounds of its ranges."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import jv

import reference_effects
from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import interpolation, moment_loops, response_tables, spread_loops
from lowalt.effects.one_way import OneWay
from lowalt.effects.response import ImagePath, OneWayFactors, response
from test_effects import network


def places_of(rng, away_m, symbols=5, points=19, spread_m=0.7):
    """Points (N, L, 3) m that drift along, about a place ahead of the network's station and to its side."""
    middle = np.array([0.0, 0.0, 10.0]) + away_m
    drift = np.linspace(0.0, 1.0, symbols)[:, None, None] * [0.3, -0.2, 0.1]
    return middle + rng.uniform(-spread_m, spread_m, (1, points, 3)) + drift


def strengths(rng, kind):
    """Amplitudes of 19 points in 5 symbols: the same in all, or with dark points and a dark symbol."""
    if kind == "same":
        return rng.uniform(0.5, 2.0, (1, 19))
    own = rng.uniform(0.5, 2.0, (5, 19)) * (rng.random((5, 19)) < 0.6)
    own[3] = 0.0
    return own


@pytest.mark.parametrize("shape", [(16, 4), (1, 1), (2, 8), (3, 5), (32, 2)])
@pytest.mark.parametrize("squint", [False, True])
@pytest.mark.parametrize("kind", ["same", "dark"])
@pytest.mark.parametrize("away_m", [(60.0, 20.0, 15.0), (5.0, 70.0, -3.0)])
def test_moments_of_places_are_those_of_kept_factors(shape, squint, kind, away_m):
    rng = np.random.default_rng(1)
    radio = network(transmit=shape, receive=shape, subcarriers=64)
    places, strength = places_of(rng, away_m), strengths(rng, kind)
    # The beam points elsewhere, so that directions are in the side lobes too.
    given = radio, radio.stations[0], places, np.array([60.0, 25.0, 30.0])
    asked = {"squint": squint, "wavefront": False, "error": 1e-13}
    rays, kept = OneWayFactors(*given, **asked), OneWayFactors(*given, **asked, once=False)
    assert rays.direct is not None and kept.direct is None
    peak = strength.sum() * np.prod(shape) ** 2 * rays.radio.scale / np.min(np.linalg.norm(places, axis=2)) ** 2
    found, truth = (one.summed(strength) for one in (rays, kept))
    assert abs(found - truth).max() < 1e-12 * peak
    assert kind == "same" or (found[3] == 0).all()


@pytest.mark.parametrize("squint", [False, True])
@pytest.mark.parametrize(
    "away_m, aim_m", [((40, 10, 5), (42, 9, 16)), ((40, 10, 5), (42, 25, 30)), ((5, 40, 5), (7, 39, 16))]
)
@pytest.mark.parametrize("spacing_hz", [2e7, 3e6])
@pytest.mark.parametrize("shape", [(16, 4), (32, 2), (8, 1)])
def test_a_direct_echo_is_the_sum_over_elements_and_points(squint, away_m, aim_m, spacing_hz, shape):
    radio, rng = network(subcarriers=8, subcarrier_spacing_hz=spacing_hz, transmit=shape), np.random.default_rng(2)
    radio = replace(radio, receive=radio.transmit)
    places, rcs = places_of(rng, np.array(away_m, float)), rng.uniform(0.1, 2.0, 19)
    given = radio, radio.stations[0], places, rcs, np.array(aim_m, float)
    truth = reference_effects.subcarriers(*given, squint=squint)
    assert abs(response(*given, squint=squint) - truth).max() < 1e-9 * abs(truth).max()


@pytest.mark.parametrize("squint", [False, True])
@pytest.mark.parametrize("away_m", [(60.0, 20.0, 15.0), (3.0, 1.0, -2.0), (0.5, 0.2, 0.1)])
@pytest.mark.parametrize("spread_m", [0.7, 0.03])
def test_spans_hold_every_range_and_little_more(squint, away_m, spread_m):
    radio, rng = network(transmit=(16, 4), receive=(16, 4)), np.random.default_rng(3)
    places = places_of(rng, away_m, spread_m=spread_m)
    # All at one distance, so that the ranges to the array's middle differ by direction alone.
    off = places - [0.0, 0.0, 10.0]
    flat = np.linalg.norm(off[:, :1], axis=2, keepdims=True) / np.linalg.norm(off, axis=2, keepdims=True)
    places = places if spread_m > 0.1 else places - off + off * flat
    given = radio, radio.stations[0], places, np.array([60.0, 25.0, 30.0])
    rays = OneWayFactors(*given, squint=squint, wavefront=False, error=1e-13)
    low, high, longest = rays.direct.spans((16, 4), squint)
    excess = OneWayFactors(*given, squint=squint, wavefront=False, error=1e-13, once=False).out[0].excess
    assert (low <= excess.min(axis=1)).all() and (excess.max(axis=1) <= high).all()
    off = np.einsum("nli,ki->nlk", places - [0.0, 0.0, 10.0], [radio.stations[0].horizontal, [0.0, 0.0, 1.0]])
    cosines = abs(off / np.linalg.norm(places - [0.0, 0.0, 10.0], axis=2, keepdims=True)).reshape(-1, 2)
    truth = np.minimum(cosines @ [7.5, 1.5], np.hypot(7.5, 1.5)).max()
    assert truth <= longest < truth + 0.5 + 9.0 * (away_m[0] < 50) if squint else longest == 0.0
    if away_m[0] > 50 and spread_m > 0.1:
        assert (high - low <= 1.05 * np.ptp(excess, axis=1)).all()


@pytest.mark.parametrize("wavefront", [False, True])
@pytest.mark.parametrize("away_m", [(300.0, 20.0, 15.0), (60.0, 200.0, -10.0), (0.5, 0.2, 0.1)])
@pytest.mark.parametrize("moved_m", [0.0, 0.2])
def test_no_element_has_a_longer_path_than_the_bound_and_most_bounds_are_near(wavefront, away_m, moved_m):
    shape, rng = (16, 4), np.random.default_rng(4)
    radio = network(transmit=shape, receive=shape)
    station, places = radio.stations[0], places_of(rng, away_m, spread_m=0.3)
    given = radio, station, places, np.array([60.0, 25.0, 30.0])
    rays = OneWayFactors(*given, squint=True, wavefront=False, error=1e-6)
    bound = rays.direct.longest(shape, wavefront, moved_m)
    step = rng.normal(size=places.shape)
    later = places + moved_m * step / np.linalg.norm(step, axis=2, keepdims=True)
    spacing = SPEED_OF_LIGHT / (2 * radio.carrier_hz)
    across, up = np.meshgrid(np.arange(16) - 7.5, np.arange(4) - 1.5, indexing="ij")
    offsets = spacing * (across[..., None] * np.array(station.horizontal) + up[..., None] * [0.0, 0.0, 1.0])
    corner = np.array(station.position_m)
    middle = corner - offsets[0, 0]
    paths = []
    for here in (places, later):
        if wavefront:
            ways = np.linalg.norm(here[..., None, None, :] - middle - offsets, axis=-1)
            ways = ways - np.linalg.norm(here - middle, axis=-1)[..., None, None]
        else:
            toward = (here - corner) / np.linalg.norm(here - corner, axis=-1, keepdims=True)
            ways = -np.einsum("nli,abi->nlab", toward, offsets)
        paths.append(abs(ways).max() / spacing)
    half = response_tables.half_diagonal(shape)
    assert max(paths) <= bound <= half
    if away_m[0] > 1:
        assert bound < 1.03 * paths[0] + 0.02 * half and bound < 0.9 * half


@pytest.mark.parametrize("wavefront", [False, True])
def test_frequencies_follow_from_the_directions_to_all_paths(wavefront):
    radio, rng = network(transmit=(16, 4), receive=(16, 4), subcarriers=64), np.random.default_rng(5)
    ahead = np.array([np.cos(radio.stations[0].normal_rad), np.sin(radio.stations[0].normal_rad), 0.0])
    side, counts = np.array(radio.stations[0].horizontal), []
    for toward in (ahead, side):
        places = np.array([0.0, 0.0, 10.0]) + 300.0 * ahead + rng.uniform(-0.5, 0.5, (3, 9, 3))
        image = np.array([0.0, 0.0, 10.0]) + 300.0 * toward + rng.uniform(-0.5, 0.5, (3, 9, 3))
        given = radio, radio.stations[0], places, np.array([60.0, 25.0, 30.0]), [ImagePath(image)]
        asked = {"squint": True, "wavefront": wavefront, "error": 1e-6}
        counts.append(len(OneWayFactors(*given, **asked).nodes))
        later = OneWayFactors(*given, **asked, farther_m=1.0)
        assert len(OneWayFactors(*given, **asked, farther_m=1.0, like=later).nodes) == len(later.nodes)
    assert counts[0] < counts[1]


@pytest.mark.parametrize("point", [0, 7, 18])
def test_a_point_in_the_station_is_refused(point):
    radio, places = network(), places_of(np.random.default_rng(4), (60.0, 0.0, 0.0))
    places[2, point] = radio.stations[0].position_m
    with pytest.raises(InputError, match=r"symbol 2 .*station A"):
        response(radio, radio.stations[0], places, np.ones(19), places[0, 1])


def test_rows_are_filled_to_whole_vectors():
    assert [moment_loops.padded(count) for count in (1, 16, 17)] == [16, 16, 32]
    assert response_tables.round_up(1.0) >= 1.0


@pytest.mark.parametrize("points", [1, 4, 19])
def test_the_least_and_the_largest_of_each_symbol_are_found(points):
    values, found = np.random.default_rng(5).normal(size=(7, points)), np.empty((2, 7))
    moment_loops.extremes(values, *found)
    np.testing.assert_array_equal(found, [values.min(axis=1), values.max(axis=1)])


def test_the_largest_subcarrier_is_bounded_by_the_largest_value_of_each_function():
    planes, peaks = np.random.default_rng(6).normal(size=(5, 2, 9)), np.linspace(0.1, 1.0, 9)
    wanted = (np.hypot(planes[:, 0], planes[:, 1]) @ peaks).max()
    assert spread_loops.largest(planes, peaks) == pytest.approx(wanted, rel=1e-14)
    assert spread_loops.largest(planes[:0], peaks) == 0.0


@pytest.mark.parametrize("nodes", [1, 4])
def test_peaks_are_the_largest_values_of_the_functions_in_use(nodes):
    reach, *given = 3.0, 64, 1e-12
    functions = response_tables.table(reach, *given) if nodes == 1 else response_tables.joined(reach, nodes, *given)[1]
    found = response_tables.peaks(reach, nodes, *given)
    np.testing.assert_array_equal(found, np.maximum(functions.max(axis=1), -functions.min(axis=1)))


@pytest.mark.parametrize("lit", [0.55, 0.65, 1.0])
def test_moments_of_few_and_of_many_points_with_strength_are_sums_over_all_points(lit):
    rng, nodes, symbols, count, orders = np.random.default_rng(6), 2, 3, 33, 8
    strength = rng.uniform(0.5, 2.0, (symbols, count)) * (rng.permuted(np.arange(count) < lit * count))
    out, back = rng.normal(size=(2, 2, nodes, symbols, count))
    ranges, middle, found = rng.uniform(-0.4, 0.4, (2, symbols, count)), np.zeros(symbols), np.empty((3, 2, 2, orders))
    rows = np.empty((moment_loops.SUM_ROWS + orders, moment_loops.padded(count)))
    moment_loops.moments(
        strength, out, back, 2.0, *ranges, middle, 1.0, 0.9, rows, np.empty(count, np.int64), found
    )  # fmt: skip
    z = 2.0 * strength * (out[0] + 1j * out[1]) * (back[0] + 1j * back[1])
    order = np.arange(orders)
    waves = (-1j) ** order[:, None, None] * np.cos(order[:, None, None] * np.arccos(ranges.sum(axis=0) / 0.9))
    truth = np.einsum("qnl,pnl->nqp", z, waves)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], truth, rtol=0, atol=1e-13 * abs(truth).max())


def test_a_span_holds_all_excess_ranges_of_a_symbol():
    excess = np.array([[1.0, 4.0, 2.0], [-3.0, -1.0, 5.0]])
    middle, reach = OneWay(np.empty((2, 1, 2, 3)), excess).span()
    assert middle.tolist() == [2.5, 1.0] and reach == 4.0


@pytest.mark.parametrize("reach, nodes", [(0.04, 7), (0.7, 2), (20.0, 5), (0.03, 30)])
def test_a_table_joins_frequencies_by_its_least_orders_even_at_rounding(reach, nodes):
    mix, values = response_tables.joined(reach, nodes, 64, 1e-14)
    orders, x = mix.shape[0] // nodes, np.linspace(-1.0, 1.0, 64)
    bessel = np.array([(1 + (p > 0)) * jv(p, np.pi * reach * 63 / 64 * x) for p in range(orders)])
    expected = interpolation.weights(nodes, x).T[:, None] * bessel
    assert abs(mix @ values - expected.reshape(mix.shape[0], -1)).max() < 1e-13
    # The orders of a product of functions of so many orders.
    assert mix.shape[1] <= nodes + orders
