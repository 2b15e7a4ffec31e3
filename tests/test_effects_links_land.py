"""Land between two stations: cells against a sum over a fine grid, limits at one place, reciprocity, Doppler, cuts."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.common.network import Station
from lowalt.echo.radar import radar
from lowalt.effects import waveform
from lowalt.effects.antenna import Element, gain
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import clutter, land_between, patches, windblown
from lowalt.effects.levels import levels
from lowalt.effects.received import Scene, observe
from lowalt.effects.response import response
from test_effects_channel import NETWORK, body, seen

TILTED = Element(downtilt_deg=6.0)
AIM = np.array([300.0, 150.0, 40.0])


def between(network=NETWORK, sends="A", hears="B", high_m=25.0):
    """The link between two stations of a network, the first one's mast `high_m` high."""
    a, b = network.station(sends), network.station(hears)
    a = replace(a, position_m=(*a.position_m[:2], high_m))
    return Station(f"{sends}-{hears}", b.position_m, b.normal_rad, a.frequency_hz, a, b)


def settings_of(**change):
    return clutter.DEFAULTS | change


def array_sum(count, x):
    """Sum of `count` elements at direction cosines x off the beam, times kappa."""
    return abs(np.exp(1j * np.pi * np.arange(count)[:, None] * x).sum(axis=0))


@pytest.mark.parametrize("element", [None, TILTED])
def test_cells_of_a_range_sum_hold_the_land_of_a_fine_grid(element):
    link, aims = between(high_m=35.0), np.array([AIM, AIM + 10.0])
    network, radio = NETWORK, radar(NETWORK, link)
    found, slow = land_between.cell_power(settings_of(reach_m=280.0), network, link, aims, element)
    masts, step = np.array([link.transmitter.position_m, link.position_m]), 1.2
    x, y = np.meshgrid(np.arange(-80.0, 580.0, step), np.arange(-140.0, 140.0, step))
    points = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    away = [points - mast for mast in masts]
    r = [np.linalg.norm(one, axis=1) for one in away]
    cell = np.floor(0.5 * (r[0] + r[1]) * radio.cells - patches.OFFSET + 0.5).astype(int)
    power = 0.03 * np.sqrt(35.0 * 25.0 / (r[0] * r[1])) / (r[0] * r[1]) ** 2 * step**2 * radio.scale**2
    ends = (link.transmitter, network.transmit), (link, network.receive)
    for (end, counts), off, length, aim in zip(ends, away, r, aims, strict=True):
        to_aim = (aim - end.position_m) / np.linalg.norm(aim - end.position_m)
        for count, axis in zip(counts, (end.horizontal, np.array([0.0, 0.0, 1.0])), strict=True):
            power *= array_sum(count, radio.kappa * (off @ axis / length - to_aim @ axis)) ** 2
        power *= 1.0 if element is None else gain(element, end, points)
    apart = np.sum((masts[0] - masts[1]) ** 2)
    half = np.sqrt(0.5 + (r[0] ** 2 + r[1] ** 2 - apart) / (4 * r[0] * r[1]))
    truth, slowed = (np.bincount(cell, one, 80) for one in (power, power * half))
    # The grid's own error is that of cells cut by its squares.
    lit = np.flatnonzero(found)[2:-1]
    assert len(lit) > 3 and len(found) == int(np.ceil(280.0 * radio.cells + 0.25))
    np.testing.assert_allclose(found[lit], truth[lit], rtol=0.03)
    np.testing.assert_allclose(slow[lit], slowed[lit] / truth[lit], rtol=0.01)
    assert not found[: int(0.5 * np.sqrt(500.0**2 + 60.0**2) * radio.cells - 0.8)].any()


@pytest.mark.parametrize("element", [None, TILTED])
def test_a_link_back_to_its_own_place_has_the_stations_land(element):
    station = NETWORK.station("B")
    link = between(sends="B")
    own = clutter.cell_power(settings_of(reach_m=600.0), NETWORK, station, AIM, element)
    found, slow = land_between.cell_power(settings_of(reach_m=600.0), NETWORK, link, np.array([AIM, AIM]), element)
    np.testing.assert_allclose(found, own, rtol=1e-11, atol=1e-16 * own.max())
    assert slow[own > 0] == pytest.approx(1.0, abs=1e-12)
    near = replace(link, transmitter=replace(station, position_m=(499.0, 0.0, 25.0)))
    moved, _ = land_between.cell_power(settings_of(reach_m=600.0), NETWORK, near, np.array([AIM, AIM]), element)
    assert moved.sum() == pytest.approx(own.sum(), rel=0.1) and (moved != own).any()


@pytest.mark.parametrize("settings", [{}, {"clutter_to_signal_db": 3.0, "law": "k"}, {"wind_mps": 0.0}])
def test_a_link_back_to_its_own_place_hears_the_stations_land_to_rounding(settings):
    view = replace(seen(body([[0, 0, 0]]), x_m=200.0, y_m=100.0, z_m=60.0), element=TILTED)
    link = Station("A", view.station.position_m, view.station.normal_rad, view.station.frequency_hz,
                   view.station, view.station)  # fmt: skip
    own, back = (
        clutter.scatter(settings_of(reach_m=500.0, **settings), one, np.random.default_rng(4))
        for one in (view, view.of(link))
    )
    assert abs(own - back).max() < 1e-11 * abs(own).max()


def test_land_is_the_same_in_both_directions_of_a_link():
    network = replace(NETWORK, transmit=(8, 2), receive=(8, 2))
    one, aims = between(network, high_m=40.0), np.array([AIM, AIM + 10.0])
    there = replace(one.receiver, frequency_hz=one.frequency_hz)
    a = one.transmitter
    two = Station("B-A", a.position_m, a.normal_rad, one.frequency_hz, there, a)
    powers = [
        land_between.cell_power(settings_of(), network, way, pointed, TILTED)[0]
        for way, pointed in ((one, aims), (two, aims[::-1]))
    ]
    np.testing.assert_allclose(*powers, rtol=1e-9, atol=1e-14 * powers[0].max())


def test_wind_moves_land_by_the_bisectors_share_of_its_speed():
    rng, given = np.random.default_rng(3), (400, 2.5e-3, 0.0, 6.0, 0.06)
    slow = np.repeat([1.0, 0.5, 0.0], 1500)
    waves = windblown.speckle(rng, len(slow), *given, slow)
    for share, some in zip((1.0, 0.5, 0.0), np.split(waves, 3), strict=True):
        lags = np.arange(0, 60, 6)
        found = [(some[:, lag:] * some[:, : 400 - lag].conj()).mean().real for lag in lags]
        # The spectrum exp(-beta lambda |f| / 2) narrowed by the share has a Lorentzian that is as much wider.
        np.testing.assert_allclose(found, 1 / (1 + (4 * np.pi * share * lags * 2.5e-3 / 0.36) ** 2), atol=0.06)
    plain = windblown.speckle(np.random.default_rng(3), 20, *given)
    assert (plain == windblown.speckle(np.random.default_rng(3), 20, *given, None)).all()


def test_the_prefix_cuts_land_and_direct_path_each_at_its_own_delay():
    network = replace(NETWORK, subcarriers=64, symbols=3, stations=(*NETWORK.stations, between()))
    cloud, row = body([[0, 0, 0]]), {"x_m": 200.0, "y_m": 100.0, "z_m": 60.0}
    view = seen(cloud, network, **row)
    effects = called({"direct_path": {"loss_db": 40.0}, "clutter": {"reach_m": 900.0}, "cyclic_prefix": {}})
    found = []
    for names in ({"direct_path", "clutter"}, {"direct_path"}, {"clutter"}):
        some = [one for one in effects if one.name in names | {"cyclic_prefix"}]
        scene = Scene(network, 5, None, tuple(some))
        link = observe(scene, network.station("A-B"), cloud, view.row)
        chain = Chain(some, link, lambda name: np.random.default_rng(len(name)), 1.0)
        found.append(chain._still(chain.target.by_need["cyclic_prefix"]))
    assert abs(found[0] - found[1] - found[2]).max() < 1e-12 * abs(found[0]).max()
    assert waveform.demodulate(found[0], chain.sending.known).shape == (3, 64)


def test_the_levels_of_a_link_hold_its_land():
    network = replace(NETWORK, stations=(*NETWORK.stations, between()))
    view = seen(body([[0, 0, 0]]), network, x_m=200.0, y_m=100.0, z_m=60.0)
    effects = {one.name: one for one in called({"direct_path": {}, "clutter": {}})}
    link = view.of(network.station("A-B"))
    found = {level.name: level.value for level in levels(link, effects, 1e-12)}
    power = clutter.mean_power(effects["clutter"].settings, link)
    assert found["land, all range cells"] == pytest.approx(10 * np.log10(power.sum()) + 30)
    assert found["land, the target's range cell"] < found["land, all range cells"]
    echo = response(network, link.station, link.places, link.cloud.rcs_m2, link.aim_m)
    # One point in the middle of both beams: its range cells together hold its power.
    assert clutter.target_power(link) == pytest.approx((abs(np.fft.ifft(echo, axis=1)[0]) ** 2).sum(), rel=1e-9)
    asked = settings_of(clutter_to_signal_db=7.0)
    assert clutter.mean_power(asked, link).sum() == pytest.approx(10**0.7 * clutter.target_power(link))


@pytest.mark.parametrize("hears", ["A", "A-B"])
def test_a_targets_power_has_the_element_at_each_end(hears):
    network = replace(NETWORK, stations=(*NETWORK.stations, between(high_m=60.0)))
    plain = seen(body([[0, 0, 0]]), network, x_m=200.0, y_m=100.0, z_m=60.0).of(network.station(hears))
    shaped = replace(plain, element=TILTED)
    gains = [gain(TILTED, end.station, end.aim_m) for end in plain.ends()]
    two_way = gains[0] ** 2 if hears == "A" else gains[0] * gains[1]
    assert abs(10 * np.log10(gains[0] / gains[-1])) > 0.5 or hears == "A"
    assert clutter.target_power(shaped) == pytest.approx(two_way * clutter.target_power(plain), rel=1e-12)
