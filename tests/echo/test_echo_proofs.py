"""What the echo proves of itself.

These are a target's extents, segments of symbols, each part of the bound, and the lead.
"""

import dataclasses

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval
from scipy.spatial.transform import Rotation
from test_echo import cloud_in_motion, heard, network, positions

import pointwise_echo
from lowalt.config.network import Station
from lowalt.echo import Rigid, api, echo_signal, refine
from lowalt.echo.fast import error_model
from lowalt.echo.fast.cell_kernel import POSITIONS
from lowalt.echo.fast.error_model import echo_plan, pointwise_bound
from lowalt.echo.fast.range_bounds import (
    END,
    MEAN,
    OMEGA,
    OMEGA_CENTRE,
    OMEGA_HALF,
    PSI,
    PSI_CENTRE,
    PSI_HALF,
    SIZE,
    SPREAD,
    START,
    cut_segments,
    fill_extents,
)
from lowalt.echo.pointwise.reference_range import RANGE
from lowalt.echo.pointwise.results import far_bound
from lowalt.echo.radar import radar

NET = network(symbols=6)
SEEN = NET.stations[0]


def parts(seed: int, stretched: float = 1.0) -> Rigid:
    """Points of three parts, turned at random and stretched, some 300 m away."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(18, random_state=seed).as_matrix().reshape(6, 3, 3, 3) * stretched
    translation = np.array([300.0, 80.0, 40.0]) + rng.normal(0, 3, (6, 3, 3))
    return Rigid(rotation, translation, rng.normal(0, 1, (40, 3)), np.sort(rng.integers(0, 3, 40)))


@pytest.mark.parametrize("stretched", [1.0, 2.0])
@pytest.mark.parametrize("rigid", [True, False])
def test_no_point_lies_beyond_the_extents_of_its_target(rigid, stretched):
    motion = parts(3, stretched)
    rcs = np.random.default_rng(1).uniform(0.5, 2, 40)
    places = positions(motion)
    first = motion.translation[:, motion.part[0]]
    if not rigid:
        motion = places
        first = places[:, 0]
    scene, radio, refs, aims = api.prepared(NET, SEEN, motion, rcs, places[0, 0], "")
    sample = refine.compute(scene, radio, refs, aims, None)[3]
    out = np.empty((6, 5))
    worst = fill_extents(sample, refs, out)
    away = np.linalg.norm(places - first[:, None], axis=2)
    mean = away @ (np.sqrt(rcs) / np.sqrt(rcs).sum())
    assert (away.max(axis=1) <= out[:, SIZE]).all() and (mean <= out[:, MEAN]).all()
    np.testing.assert_allclose(out[:, SPREAD], out[:, SIZE] / refs[:, RANGE], rtol=1e-12)
    assert worst == out[:, SPREAD].max()
    # A bound that is never near the truth would serve as little: exact for points, within twice for
    # parts.
    assert (out[:, SIZE] <= away.max(axis=1) * (2.0 if rigid else 1 + 1e-11)).all()
    unit = (first - SEEN.position_m) / np.linalg.norm(first - SEEN.position_m, axis=1)[:, None]
    np.testing.assert_allclose(out[:, PSI], unit @ SEEN.horizontal, atol=1e-12)
    np.testing.assert_allclose(out[:, OMEGA], unit[:, 2], atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_segments_hold_their_symbols_directions_and_are_as_long_as_the_first_one_allows(seed):
    """A segment takes symbols while their intervals leave room.

    The union of the intervals, times the rate, is within the first one's room.
    """
    draws = np.random.default_rng(seed)
    extents = np.zeros((60, 5))
    extents[:, SPREAD] = draws.uniform(0.0, 0.1, 60)
    extents[draws.integers(0, 60, 2), SPREAD] = (1.0, 1.7)
    extents[:, [PSI, OMEGA]] = np.cumsum(draws.normal(0, 0.01, (60, 2)), axis=0)
    rates = draws.uniform(10, 60, 2)
    longest = int(draws.integers(4, 20))
    out = np.full((60, 6), np.nan)
    count = cut_segments(extents, *rates, longest, out)
    # Seen from the reference, a point s ranges away from it stands within 2 s / (2 - s) of its
    # direction cosine.
    reach = np.where(extents[:, SPREAD] < 1, 2 * extents[:, SPREAD] / (2 - extents[:, SPREAD]), 2.0)
    low = extents[:, [PSI, OMEGA]] - reach[:, None]
    high = extents[:, [PSI, OMEGA]] + reach[:, None]
    assert (
        out[0, START] == 0
        and out[count - 1, END] == 60
        and (out[1:count, START] == out[: count - 1, END]).all()
    )
    for segment in out[:count]:
        start = int(segment[START])
        end = int(segment[END])
        room = 1.2 * (high[start] - low[start]) * rates + 1.0
        wide = [
            (high[start:last].max(0) - low[start:last].min(0)) * rates for last in (end, end + 1)
        ]
        assert 0 < end - start <= longest and (wide[0] <= room).all()
        assert end == 60 or end - start == longest or (wide[1] > room).any()
        np.testing.assert_allclose(
            segment[[PSI_CENTRE, OMEGA_CENTRE]],
            (high[start:end].max(0) + low[start:end].min(0)) / 2,
        )
        np.testing.assert_allclose(segment[[PSI_HALF, OMEGA_HALF]], wide[0] / rates / 2, atol=1e-8)
        assert (segment[[PSI_HALF, OMEGA_HALF]] > wide[0] / rates / 2).all()


SMALL = 1e-4
"""An error that is far above all roundings, and whose square is far below it."""


def bounded(monkeypatch, plan: dict, cells: dict, array: tuple[int, int] = (16, 4)) -> tuple:
    """A signal of one symbol whose plan and cell kernels have these errors.

    It is (result, its bound, sum of peak amplitudes, the points' distances from the reference).
    """
    net = network(symbols=1, transmit=array, receive=array)
    motion = cloud_in_motion(np.random.default_rng(2), 1, 30, (200.0, 90.0, 60.0), 0.3)
    made = error_model.echo_plan
    tabulated = refine.cell_polynomials
    none = {"share": 0.0, "peak": 0.0, "phase": 0.0}
    with monkeypatch.context() as patch:
        patch.setattr(error_model, "echo_plan", lambda *given: made(*given)._replace(**none | plan))
        patch.setattr(
            refine,
            "cell_polynomials",
            lambda *given: tabulated(*given)._replace(**{"error": 0.0} | cells),
        )
        found = heard(net, motion, SMALL * 100)
    places = positions(motion)[0]
    r = np.linalg.norm(places - net.stations[0].position_m, axis=1)
    # The weights of both arrays have unit norm: a0 G is the number of elements of one.
    peaks = np.prod(array) * 299_792_458 / 4.9e9 / (4 * np.pi) ** 1.5 * (1 / r**2).sum()
    away = np.linalg.norm(places - motion.translation[0, 0], axis=1)
    return found, found.bound * abs(found.signal[0]), peaks, away


def test_each_kind_of_error_adds_its_own_part_to_the_bound(monkeypatch):
    """Errors relative to each of four sums.

    These are of amplitudes, of peak amplitudes, of amplitudes times distances, and of moments.
    """
    found, bound, peaks, away = bounded(monkeypatch, {}, {})
    total = found.totals[0]
    assert bound < 1e-11 * total < peaks
    # Where amplitudes are in error, their sum may be larger by as much.
    found, bound, *_ = bounded(monkeypatch, {"share": SMALL}, {})
    assert (bound, found.totals[0] - total) == pytest.approx(
        (SMALL * total, SMALL * total), rel=1e-3, abs=0
    )
    found, bound, *_ = bounded(monkeypatch, {"peak": SMALL}, {})
    assert SMALL * peaks < bound < 1.1 * SMALL * peaks and found.totals[0] - total == pytest.approx(
        bound, rel=1e-3, abs=0
    )
    assert bounded(monkeypatch, {}, {"error": SMALL})[1] == pytest.approx(
        SMALL * total, rel=1e-3, abs=0
    )
    # Gains may be off by as much as they are fitted to, on either side of the arrays.
    for array in ((16, 1), (1, 16)):
        _, bound, peaks, _ = bounded(monkeypatch, {"fit": SMALL}, {}, array)
        assert 0.02 * SMALL * peaks < bound < 1.1 * SMALL * peaks
    phase = bounded(monkeypatch, {"phase": SMALL}, {})[1] / SMALL
    assert total * away.min() < phase < 1.3 * total * away.max()
    # A moment of order k takes 3 k + 1 roundings of a power, and those of its product and of the
    # sums.
    heavy = bounded(monkeypatch, {}, {"sizes": (1e6, 0.0, 0.0)})[1] / (1e6 * total)
    assert 30 * 2.0**-53 < heavy < 300 * 2.0**-53


def test_roundings_of_higher_moments_count_with_the_points_distances_from_the_place(monkeypatch):
    """v is a point's range in cells beyond the nearest place with a kernel.

    It is divided by the plan's half.
    """
    halves = []
    tabulated = refine.cell_polynomials
    monkeypatch.setattr(
        refine, "cell_polynomials", lambda *given: halves.append(tabulated(*given)) or halves[-1]
    )
    sizes = np.diag([1e9] * 3)
    total, mixed, second = (bounded(monkeypatch, {}, {"sizes": tuple(size)})[1] for size in sizes)
    motion = cloud_in_motion(np.random.default_rng(2), 1, 30, (200.0, 90.0, 60.0), 0.3)
    cells = np.linalg.norm(positions(motion)[0] - SEEN.position_m, axis=1) / NET.cell_m
    centre = np.linalg.norm(motion.translation[0, 0] - SEEN.position_m) / NET.cell_m
    v = (cells - np.rint(centre * POSITIONS) / POSITIONS) / halves[0].half
    assert second / total == pytest.approx(np.average(v**2, weights=cells**-2.0), rel=0.01, abs=0)
    assert mixed / total == pytest.approx(np.sqrt(second / total), rel=1e-6, abs=0)


def test_an_error_of_the_sums_takes_twice_its_size_from_the_lead(monkeypatch):
    plain, worse = (bounded(monkeypatch, {"share": share}, {})[0] for share in (0.0, SMALL))
    assert worse.gap[0] == pytest.approx(
        plain.gap[0] - 2 * SMALL * plain.totals[0], rel=1e-3, abs=0
    )


@pytest.mark.parametrize("error", [0.0, 1e-7, 1e-3])
def test_a_plan_allows_for_what_its_cosine_and_sine_leave_out_and_round(error):
    """Order k of a series in t^2 rounds 2 k + 2 times by Horner's rule.

    It is weighted by its coefficient at half a turn.
    """
    plan = echo_plan(radar(NET, SEEN), 400, error)
    t = np.linspace(0, 0.5, 400).astype(np.longdouble)
    cosine, sine = (polyval(t * t, each.astype(np.longdouble)) for each in (plan.cosine, plan.sine))
    left_out = abs(cosine + 1j * t * sine - np.exp(2j * np.pi * t)).max()
    often = (2 * np.arange(len(plan.cosine)) + 2) * 0.25 ** np.arange(len(plan.cosine))
    rounded = (
        np.hypot(often @ abs(plan.cosine), often @ abs(plan.sine) / 2)
        * np.finfo(plan.cosine.dtype).eps
        / 2
    )
    assert left_out + rounded < plan.share < 3 * left_out + 1.5 * rounded + 1e-12
    assert plan.single == (error == 1e-3) and (error == 0.0 or left_out < error)


def test_the_pointwise_bound_allows_for_roundings_of_the_phase_of_large_targets():
    radio = radar(NET, SEEN)
    small, large = (pointwise_bound(radio, size_m, 40)[0] for size_m in (1.0, 100.0))
    assert large - small > 4 * np.pi * radio.turns * 99.0 * 2.0**-53


def on_axis(cells: float) -> tuple[Station, np.ndarray]:
    """A station at the origin that looks along x, and a point so many cells away.

    Its place has the shape (1, 1, 3).
    """
    station = dataclasses.replace(SEEN, position_m=(0.0, 0.0, 0.0), normal_rad=0.0)
    return station, np.array([[[cells * NET.cell_m, 0.0, 0.0]]])


def test_the_pointwise_bound_of_one_point_in_the_beam_is_that_of_its_sum_and_of_its_direction():
    """At a whole cell the value is the amplitude and on the axis the peak one: both count once."""
    station, place = on_axis(30.0)
    found = pointwise_echo.signal(NET, station, place, 1.0, place[0, 0])
    share, direction = found.method.pointwise_bound
    assert (
        share > 0
        and direction > 0
        and found.bound == pytest.approx(share + direction, rel=1e-6, abs=0)
    )


def test_a_proved_lead_is_the_computed_one_less_the_bounds_of_both_cells():
    """A point so near the middle of two cells that the bounds are a good part of the difference."""
    station, place = on_axis(30.5 + 4e-13)
    arguments = (NET, station, place, 1.0, place[0, 0])
    strengths = np.sort(abs(pointwise_echo.range_cells(*arguments)[0]))
    lead = strengths[-1] - strengths[-2]
    found = pointwise_echo.signal(*arguments)
    bound = found.bound * abs(found.signal[0])
    assert 0.05 * lead < bound < 0.4 * lead
    assert found.gap[0] == pytest.approx(lead - 2 * bound, rel=0.01, abs=0)


@pytest.mark.parametrize("seed", range(8))
def test_no_cell_beyond_the_pointwise_bound_is_stronger(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(12, 80))
    size = int(rng.integers(1, 9))
    u, z = (
        rng.uniform(-2.4, 2.4, size) + rng.integers(-3, 4),
        rng.normal(size=size) + 1j * rng.normal(size=size),
    )
    z -= z.mean() * (seed % 2)
    low = int(np.floor(u.min())) - int(rng.integers(0, 3))
    high = int(np.ceil(u.max())) + int(rng.integers(0, 3))
    beyond = np.arange(high + 1, low + count)
    numbers = np.arange(count) - (count - 1) / 2
    truth = abs(
        np.cos(2 * np.pi * np.multiply.outer(beyond[:, None] - u, numbers) / count).mean(-1) @ z
    ).max()
    bound = far_bound(z, u, low, high, count)
    assert truth <= bound * (1 + 1e-12) and (size > 1 or bound < 1.1 * truth + 1e-12)
    assert far_bound(np.ones(2, complex), np.array([-0.5, 1.5]), 0, 0, 50) == np.inf


def test_the_plan_follows_size_range_and_tolerance(always_approximate):
    """A target that is large against its range, or against a range cell, goes point by point.

    Eight symbols pay for no cheap plan, and all symbols are counted once.
    """
    net = network(symbols=60)
    for away_m, size_m, tolerance, kind in (
        ((200, 30, 60), 0.3, None, "exact"),
        ((200, 30, 60), 0.3, 1e-3, "cheap"),
        ((6, 3, 27), 1.5, 1e-3, "general"),
        ((2000, 30, 60), 30.0, 1e-3, "general"),
    ):
        motion = cloud_in_motion(np.random.default_rng(2), 60, 50, away_m, size_m, 1.0)
        method = heard(net, motion, tolerance).method
        counts = {"cheap": method.cheap, "exact": method.exact, "general": method.general}
        assert (
            sum(counts.values()) == 60
            and max(counts, key=counts.get) == kind
            and method.single == (kind == "cheap")
        )
    few = network(symbols=refine.PROBES)
    motion = cloud_in_motion(np.random.default_rng(2), refine.PROBES, 50, (200, 30, 60), 0.3)
    assert heard(few, motion, 1e-3).method.cheap == 0


def test_a_lead_that_a_cheap_plan_cannot_prove_is_left_to_the_exact_one(always_approximate):
    """A point a millionth of a cell off the middle between two."""
    net = dataclasses.replace(network(symbols=20), transmit=(1, 1), receive=(1, 1))
    station, place = on_axis(30.5 + 1e-6)
    found = echo_signal(net, station, np.tile(place, (20, 40, 1)), 1.0, place[0, 0], 1e-2)
    assert found.method.exact == 20 and (found.cell == 31).all() and (found.gap > 0).all()


def test_a_tolerance_that_saves_little_takes_the_exact_plan():
    net = network(symbols=60)
    motion = cloud_in_motion(np.random.default_rng(2), 60, 50, (200, 30, 60), 0.3)
    assert heard(net, motion, 1e-3).method.exact == 60
