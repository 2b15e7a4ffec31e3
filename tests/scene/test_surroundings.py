"""The surroundings' echoes: path losses by hand, the tables' moments, rays and their sum.

Of rays, powers and delays are tested.
"""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.scene.antenna import gain
from lowalt.scene.effects.channel import background_channel
from lowalt.scene.laws import fast_fading
from lowalt.scene.laws.fast_fading import Large, Link
from lowalt.scene.observe import observe
from scenes import A, network, scene, target

STATION = replace(A, position_m=(0.0, 0.0, 25.0))
NEAR = Link(100.0, 25.0, 5.0, 4.9)
USUAL = Large(1e-7, 12.0, 2.0, 0.0)


@pytest.mark.parametrize("environment", ["UMa", "UMi"])
def test_reference_points_have_the_tables_moments_and_are_a_third_of_a_turn_apart(environment):
    rng = np.random.default_rng(1)
    points = np.array([background_channel.reference_points(environment, rng) for _ in range(3000)])
    for column, (shape, rate, offset) in enumerate(background_channel.POSITION_LAWS[environment]):
        error = np.sqrt(shape) / rate / np.sqrt(9000)
        assert points[:, :, column].mean() == pytest.approx(shape / rate + offset, abs=4 * error)
    np.testing.assert_allclose(np.diff(points[:, :, 2], axis=1), 2 * np.pi / 3)


@pytest.mark.parametrize(
    ("environment", "link", "expected"),
    [
        # Worked by hand from Table 7.4.1-1: 13.54 + 39.08 lg 150.65 + 13.804 - 0.6 x 9.5, and so
        # on.
        ("UMa", Link(150.0, 25.0, 11.0, 4.9), 106.759),
        ("UMi", Link(55.0, 10.0, 5.2, 4.9), 97.484),
        # So near that the formula with line of sight is the larger one: 28 + 22 lg 15.13 + 13.804.
        ("UMa", Link(10.0, 25.0, 13.65, 4.9), 67.758),
    ],
)
def test_path_losses_are_those_worked_by_hand(environment, link, expected):
    assert fast_fading.path_loss_db(environment, link) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("environment", ["UMa", "UMi"])
def test_spreads_have_the_tables_medians_and_correlations(environment):
    rng = np.random.default_rng(2)
    table = fast_fading.ENVIRONMENTS[environment]
    link = NEAR._replace(ghz=6.5)
    drawn = np.array([fast_fading.large_scale(environment, link, rng) for _ in range(6000)])
    logs = np.column_stack([drawn[:, 3], *np.log10(drawn[:, :3]).T])
    zenith = fast_fading.zenith_spread(environment, link)[0], table.zenith_deviation
    laws = ((0.0, table.shadow_db), table.delay_spread(6.5), table.azimuth_spread(6.5), zenith)
    for column, (mean, deviation) in zip(logs.T, laws, strict=True):
        assert np.median(column) == pytest.approx(mean, abs=0.06 * deviation)
    found = np.corrcoef(logs.T)
    # Spreads are capped, which the correlation feels a little.
    pairs = [(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)]
    assert [found[pair] for pair in pairs] == pytest.approx(list(table.correlation), abs=0.06)


@pytest.mark.parametrize("environment", ["UMa", "UMi"])
def test_clusters_have_about_the_spreads_asked_for_about_the_link_s_direction(environment):
    rng = np.random.default_rng(3)
    moments = []
    for _ in range(300):
        rays = fast_fading.rays(environment, NEAR, USUAL, rng)
        share = rays.power / rays.power.sum()
        assert 0.93 < rays.power.sum() <= 1 + 1e-12 and rays.delay_s.min() == 0
        spreads = [
            np.sqrt(share @ part**2 - (share @ part) ** 2)
            for part in (rays.delay_s, rays.azimuth_deg)
        ]
        moments.append([*spreads, share @ rays.zenith_deg])
    delay_s, azimuth_deg, zenith_deg = np.mean(moments, axis=0)
    # The rays' own spread adds to the clusters'.
    wide = np.hypot(USUAL.azimuth_deg, fast_fading.ENVIRONMENTS[environment].cluster_azimuth_deg)
    assert (delay_s, azimuth_deg) == pytest.approx((USUAL.delay_s, wide), rel=0.25)
    # The point lies 20 m below the station and 100 m away: 90 + atan(0.2) degrees from the zenith.
    assert zenith_deg == pytest.approx(
        101.310 + fast_fading.zenith_spread(environment, NEAR)[1], abs=0.3
    )


def test_the_two_strongest_clusters_arrive_in_three_parts():
    rays = fast_fading.rays("UMi", NEAR, USUAL, np.random.default_rng(4))
    delay = rays.delay_s.reshape(-1, 20)
    power = rays.power.reshape(-1, 20)
    order = np.argsort(-power[:, 0])
    assert [len(np.unique(row)) for row in delay[order]] == [3, 3] + [1] * (len(delay) - 2)
    late, size = np.unique(delay[order[0]] - delay[order[0]].min(), return_counts=True)
    assert late == pytest.approx([0, 1.28 * 11e-9, 2.56 * 11e-9], abs=1e-15) and size.tolist() == [
        10,
        6,
        4,
    ]


def test_rays_carry_the_path_losses_power_and_come_after_the_distance_s_delay():
    rng = np.random.default_rng(5)
    twin = np.random.default_rng(5)
    delay, amplitude, direction = background_channel.drawn(
        background_channel.DEFAULTS, STATION, 4.9, rng
    )
    powers = []
    firsts = []
    ways = []
    for flat, height, azimuth in background_channel.reference_points("UMa", twin):
        link = Link(flat, 25.0, height, 4.9)
        large = fast_fading.large_scale("UMa", link, twin)
        firsts.append(
            np.hypot(flat, 25.0 - height) / SPEED_OF_LIGHT + fast_fading.later_s("UMa", twin)
        )
        rays = fast_fading.rays("UMa", link, large, twin)
        twin.random(len(rays.power))
        turn = azimuth + np.pi / 180 * rays.azimuth_deg
        fall = np.pi / 180 * rays.zenith_deg
        ways.append(
            np.stack(
                [np.sin(fall) * np.cos(turn), np.sin(fall) * np.sin(turn), np.cos(fall)], axis=1
            )
        )
        powers.append(
            rays.power.sum()
            * 10 ** ((large.shadow_db - fast_fading.path_loss_db("UMa", link)) / 10)
        )
    np.testing.assert_allclose(direction, np.concatenate(ways), atol=1e-12)
    assert (abs(amplitude) ** 2).sum() == pytest.approx(
        sum(powers)
    ) and delay.min() == pytest.approx(min(firsts))


def test_the_response_is_the_sum_over_rays_and_elements():
    radio = network(transmit=(4, 2), receive=(3, 1), subcarriers=16, symbols=3)
    asked = scene({"element_pattern": {}}, radio)
    view = observe(asked, A, *target(np.random.default_rng(1)))
    found = background_channel.scatter(
        background_channel.DEFAULTS, view, np.random.default_rng(7)
    ).response
    ghz = 4.9 + 7.5 * 120e3 / 1e9
    rays = background_channel.drawn(background_channel.DEFAULTS, A, ghz, np.random.default_rng(7))
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    aim = view.aim_m - np.asarray(A.position_m)
    aim /= np.linalg.norm(aim)
    spacing = SPEED_OF_LIGHT / (2 * radio.carrier_hz)
    wave = 2 * np.pi * A.frequency_hz / SPEED_OF_LIGHT
    truth = np.zeros(16, complex)
    for late_s, strength, way in zip(*rays, strict=True):
        total = strength * np.sqrt(radio.power / 24)
        for shape in ((4, 2), (3, 1)):
            places = [
                spacing * (i * across + j * up) for i in range(shape[0]) for j in range(shape[1])
            ]
            total *= sum(np.exp(1j * wave * (place @ (way - aim))) for place in places)
        total *= gain(view.element, A, np.asarray(A.position_m) + way)
        truth += total * np.exp(-2j * np.pi * late_s * np.arange(16) * 120e3)
    np.testing.assert_allclose(
        found, np.broadcast_to(truth, (3, 16)), atol=1e-10 * abs(truth).max()
    )


def test_weak_clusters_have_their_share_of_the_strongest_cluster_s_power(monkeypatch):
    monkeypatch.setattr(background_channel, "POINTS", 1)
    plain, more = (
        background_channel.drawn(
            background_channel.DEFAULTS | {"weak_clusters": weak},
            STATION,
            4.9,
            np.random.default_rng(6),
        )[1]
        for weak in (False, True)
    )
    strongest = 20 * (abs(plain) ** 2).max()
    weak = (abs(more[len(plain) :]) ** 2).sum()
    assert (more[: len(plain)] == plain).all() and 10 * np.log10(weak / strongest) == pytest.approx(
        -25.0, abs=0.3
    )
