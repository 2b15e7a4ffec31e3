"""The background channel: its tables' moments, path losses by hand, the sum over elements, and what it may not be."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.common.errors import InputError
from lowalt.common.network import Station
from lowalt.effects.antenna import gain
from lowalt.effects.catalogue import called
from lowalt.effects.channel import background_channel, fast_fading
from lowalt.effects.channel.fast_fading import Large, Link
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from test_effects import network, target

C = 299_792_458.0
ENVIRONMENTS = ("UMa", "UMi", "RMa")


def settings(**change):
    return {**background_channel.DEFAULTS, **change}


def seen(radio, **effects):
    whole = Scene(radio, 5, None, tuple(called(effects)))
    return observe(whole, radio.stations[0], *target(np.random.default_rng(1)))


@pytest.mark.parametrize("environment", ENVIRONMENTS)
def test_reference_points_have_the_tables_moments_and_are_a_third_of_a_turn_apart(environment):
    rng = np.random.default_rng(1)
    given = settings(environment=environment)
    points = np.array([background_channel.reference_points(given, rng) for _ in range(3000)])
    for column, (shape, rate, offset) in enumerate(background_channel.PLACES[environment]):
        error = np.sqrt(shape) / rate / np.sqrt(9000)
        assert points[:, :, column].mean() == pytest.approx(shape / rate + offset, abs=4 * error)
        assert points[:, :, column].std() == pytest.approx(np.sqrt(shape) / rate, rel=0.06 if shape > 0.1 else 1.0)
    turns = np.diff(points[:, :, 2], axis=1)
    assert turns == pytest.approx(np.full(turns.shape, 2 * np.pi / 3))


@pytest.mark.parametrize(
    ("environment", "link", "expected"),
    [
        # Worked by hand from Table 7.4.1-1: 13.54 + 39.08 lg 150.65 + 13.804 - 0.6 x 9.5, and so on.
        ("UMa", Link(150.0, 25.0, 11.0, 4.9), 106.759),
        ("UMi", Link(55.0, 10.0, 5.2, 4.9), 97.484),
        ("RMa", Link(160.0, 35.0, 1.5, 4.9), 102.950),
        # So near that the formula with line of sight is the larger one: 28 + 22 lg 15.13 + 13.804.
        ("UMa", Link(10.0, 25.0, 13.65, 4.9), 67.758),
    ],
)
def test_path_losses_are_those_worked_by_hand(environment, link, expected):
    assert fast_fading.path_loss_db(environment, link) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("environment", ENVIRONMENTS)
def test_spreads_have_the_tables_medians_and_correlations(environment):
    rng = np.random.default_rng(2)
    link, given = Link(100.0, 25.0, 5.0, 6.5), fast_fading.ENVIRONMENTS[environment]
    large = np.array([fast_fading.large_scale(environment, link, rng) for _ in range(6000)])
    logs = np.column_stack([large[:, 3], *np.log10(large[:, :3]).T])
    means = [
        0.0,
        given.delay_spread(6.5)[0],
        given.azimuth_spread(6.5)[0],
        fast_fading.zenith_spread(environment, link)[0],
    ]
    deviations = [given.shadow_db, given.delay_spread(6.5)[1], given.azimuth_spread(6.5)[1], given.zenith_deviation]
    found = np.corrcoef(logs.T)
    for column, deviation in enumerate(deviations):
        assert np.median(logs[:, column]) == pytest.approx(means[column], abs=0.06 * deviation)
    pairs = [(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)]
    # Spreads are capped, which the correlation feels a little.
    assert [found[pair] for pair in pairs] == pytest.approx(list(given.correlation), abs=0.06)


@pytest.mark.parametrize("environment", ENVIRONMENTS)
def test_clusters_keep_their_power_and_have_about_the_spreads_asked_for(environment):
    rng = np.random.default_rng(3)
    link, large = Link(100.0, 25.0, 5.0, 4.9), Large(1e-7, 12.0, 2.0, 0.0)
    delays, angles, zeniths = [], [], []
    for _ in range(400):
        rays = fast_fading.rays(environment, link, large, rng)
        share = rays.power / rays.power.sum()
        assert 0.93 < rays.power.sum() <= 1 + 1e-12 and len(share) % 20 == 0
        assert rays.delay_s.min() == 0
        delays.append(np.sqrt(share @ rays.delay_s**2 - (share @ rays.delay_s) ** 2))
        zeniths.append(share @ rays.zenith_deg)
        angles.append(np.sqrt(share @ rays.azimuth_deg**2 - (share @ rays.azimuth_deg) ** 2))
    assert np.mean(delays) == pytest.approx(large.delay_s, rel=0.25)
    # The point lies 20 m below the station and 100 m away: 90 + atan(0.2) degrees from the zenith.
    below = 101.310 + fast_fading.zenith_spread(environment, link)[1]
    assert np.mean(zeniths) == pytest.approx(below, abs=0.3)
    # The rays' own spread adds to the clusters'.
    wide = np.hypot(large.azimuth_deg, fast_fading.ENVIRONMENTS[environment].cluster_azimuth_deg)
    assert np.mean(angles) == pytest.approx(wide, rel=0.25)


def test_the_two_strongest_clusters_arrive_in_three_parts():
    link, large = Link(100.0, 25.0, 5.0, 4.9), Large(1e-7, 12.0, 2.0, 0.0)
    rays = fast_fading.rays("UMi", link, large, np.random.default_rng(4))
    delay, power = rays.delay_s.reshape(-1, 20), rays.power.reshape(-1, 20)
    order = np.argsort(-power[:, 0])
    assert [len(np.unique(row)) for row in delay[order]] == [3, 3] + [1] * (len(delay) - 2)
    late, size = np.unique(delay[order[0]] - delay[order[0]].min(), return_counts=True)
    assert late == pytest.approx([0, 1.28 * 11e-9, 2.56 * 11e-9], abs=1e-15) and size.tolist() == [10, 6, 4]


def test_rays_carry_the_path_losses_power_and_come_after_the_distances_delay():
    radio = network()
    station = replace(radio.stations[0], position_m=(0.0, 0.0, 25.0))
    rng, twin = np.random.default_rng(5), np.random.default_rng(5)
    delay, amplitude, direction = background_channel.drawn(settings(), station, 4.9, rng)
    assert np.linalg.norm(direction, axis=1) == pytest.approx(np.ones(len(delay)))
    lowest = np.inf
    total = 0.0
    for flat, height, _ in background_channel.reference_points(settings(), twin):
        link = Link(flat, 25.0, height, 4.9)
        large = fast_fading.large_scale("UMa", link, twin)
        lowest = min(lowest, link.range_m / C + fast_fading.later_s("UMa", twin))
        power = fast_fading.rays("UMa", link, large, twin).power
        twin.random(len(power))
        total += power.sum() * 10 ** ((large.shadow_db - fast_fading.path_loss_db("UMa", link)) / 10)
    assert (abs(amplitude) ** 2).sum() == pytest.approx(total, rel=1e-9)
    assert delay.min() == pytest.approx(lowest) and delay.max() < 1e-5


def test_weak_clusters_have_their_share_of_the_strongest_clusters_power():
    station = network().stations[0]
    plain, more = (
        background_channel.drawn(
            settings(reference_points=1, weak_clusters=weak), station, 4.9, np.random.default_rng(6)
        )
        for weak in (False, True)
    )
    count = len(plain[0])
    strongest = 20 * (abs(plain[1]) ** 2).max()
    extra = (abs(more[1][count:]) ** 2).sum()
    assert (more[1][:count] == plain[1]).all() and 100 < len(more[1]) - count <= 360
    assert 10 * np.log10(extra / strongest) == pytest.approx(-25.0, abs=0.3)


def test_the_response_is_the_sum_over_rays_and_elements():
    radio = network(transmit=(4, 2), receive=(3, 1), subcarriers=16, symbols=3)
    view = seen(radio, element_pattern={})
    found = background_channel.scatter(settings(), view, np.random.default_rng(7))
    station = radio.stations[0]
    delay, amplitude, direction = background_channel.drawn(
        settings(), station, 4.9 + 7.5 * 120e3 / 1e9, np.random.default_rng(7)
    )
    across, up = np.array([-np.sin(0.3), np.cos(0.3), 0.0]), np.array([0.0, 0.0, 1.0])
    aim = view.aim_m - np.asarray(station.position_m)
    aim /= np.linalg.norm(aim)
    spacing, wave = C / (2 * radio.carrier_hz), 2 * np.pi * station.frequency_hz / C
    truth = np.zeros(16, complex)
    for late, strength, way in zip(delay, amplitude, direction, strict=True):
        total = strength * np.sqrt(radio.power / 24)
        for shape in ((4, 2), (3, 1)):
            places = [spacing * (i * across + j * up) for i in range(shape[0]) for j in range(shape[1])]
            total *= sum(np.exp(1j * wave * (place @ (way - aim))) for place in places)
        total *= gain(view.element, station, np.asarray(station.position_m) + way)
        truth += total * np.exp(-2j * np.pi * late * np.arange(16) * 120e3)
    assert abs(found[0] - truth).max() < 1e-10 * abs(truth).max()
    assert (found == found[0]).all()


def test_a_canceller_removes_what_stands_still():
    radio = network()
    cloud, row = target(np.random.default_rng(1))
    block = {"background_channel": {}, "canceller": {"kind": "mean"}}
    signals = [
        received_signal(Scene(radio, 5, None, tuple(called(effects))), radio.stations[0], cloud, row).signal
        for effects in (block, {"canceller": {"kind": "mean"}}, {"background_channel": {}})
    ]
    assert abs(signals[2]).mean() > 3 * abs(signals[1]).mean()
    assert abs(signals[0] - signals[1]).max() < 1e-9 * abs(signals[2]).max()


def test_impossible_backgrounds_are_refused():
    with pytest.raises(InputError, match="expected one of"):
        background_channel.check(settings(environment="moon"), CheckedScene(network(), {}, ()))
    with pytest.raises(InputError, match="RMa is known to 7 GHz"):
        background_channel.check(settings(environment="RMa"), CheckedScene(network(carrier_hz=10e9), {}, ()))
    with pytest.raises(InputError, match="stands at z"):
        background_channel.check(settings(), CheckedScene(network(place=(0.0, 0.0, 0.0)), {}, ()))


@pytest.mark.parametrize(("environment", "level_dbm"), [("UMi", -59.0), ("UMa", -69.0), ("RMa", -70.0)])
def test_median_levels_are_those_of_the_design(environment, level_dbm):
    station = Station("A", (0.0, 0.0, 25.0), 0.0, 4.9e9)
    drawn = [
        background_channel.drawn(settings(environment=environment), station, 4.9, np.random.default_rng(k))[1]
        for k in range(300)
    ]
    assert 10 * np.log10(np.median([(abs(one) ** 2).sum() for one in drawn])) + 30 == pytest.approx(level_dbm, abs=1.0)
