"""Antenna elements: TR 38.901's pattern in its directions, on points, images and land."""

import numpy as np
import pytest

from lowalt.effects.antenna import Element, gain, local_gain, pattern_db
from lowalt.effects.catalogue import called
from lowalt.effects.channel import clutter
from lowalt.effects.received import Scene, observe, received_signal
from test_effects_bounds import network, target


def scene(radio, effects):
    return Scene(radio, 3, None, tuple(called(effects)))


@pytest.mark.parametrize(
    "azimuth, zenith, expected",
    [(0, 90, 8.0), (32.5, 90, 5.0), (0, 57.5, 5.0), (32.5, 122.5, 2.0), (180, 90, -22.0), (90, 180, -22.0)],
)
def test_the_element_has_the_tables_values(azimuth, zenith, expected):
    assert pattern_db(Element(), np.array(azimuth), np.array(zenith)) == pytest.approx(expected)


def test_downtilt_lowers_the_boresight():
    station = network().stations[0]
    level = [10 * np.log10(gain(Element(downtilt_deg=tilt), station, np.array([100.0, 0.0, 25.0 - drop])))
             for tilt, drop in ((0.0, 0.0), (10.0, 0.0), (10.0, 100 * np.tan(np.radians(10.0))))]  # fmt: skip
    assert level == pytest.approx([8.0, 8.0 - 12 * (10 / 65) ** 2, 8.0])


def test_a_point_gains_the_element_twice_and_an_image_by_its_own_direction():
    radio = network(transmit=(1, 1), receive=(1, 1), subcarriers=1, symbols=2)
    cloud, row = target([[0, 0, 0]], x_m=60.0, y_m=35.0, z_m=80.0)
    station = radio.stations[0]
    ground = {"ground_reflection": {"permittivity": 5.0, "conductivity_s_m": 0.1}}
    shaped = {"element_pattern": {"downtilt_deg": 12.0}}
    plain, with_ground, with_both = (
        received_signal(scene(radio, effects), station, cloud, row).signal[0]
        for effects in ({}, ground, ground | shaped)
    )
    view = observe(scene(radio, {}), station, cloud, row)
    direct, image = (
        np.sqrt(gain(Element(downtilt_deg=12.0), station, view.places[0, 0] * [1, 1, sign])) for sign in (1, -1)
    )
    # Both routes add before squaring: plain is d^2, the two-path echo (d + i)^2.
    d = np.sqrt(plain)
    i = np.sqrt(with_ground) * np.sign((np.sqrt(with_ground) / d).real) - d
    expected = (direct * d + image * i) ** 2
    assert with_both == pytest.approx(expected, rel=1e-9)


def test_land_behind_and_below_the_mast_fades():
    radio = network()
    settings, aim = {**clutter.DEFAULTS, "gamma": 0.5}, np.array([250.0, 20.0, 60.0])
    plain, shaped = (
        clutter.cell_power(settings, radio, radio.stations[0], aim, element) for element in (None, Element())
    )
    near = int(50 / radio.cell_m)
    assert plain[:near].sum() / plain.sum() > 0.6
    relative = shaped / np.maximum(plain, 1e-300) / 10**1.6
    assert relative[7] < relative[40] <= 1
    isotropic = clutter.cell_power(settings, radio, radio.stations[0], aim, Element(gain_dbi=3.0, back_db=0.0))
    assert isotropic == pytest.approx(plain * 10**0.6)
    assert shaped[:near].sum() / shaped.sum() < plain[:near].sum() / plain.sum()


@pytest.mark.parametrize("element", [Element(), Element(5.0, 30.0, 60.0, 6.0), Element(3.0, 90.0, 0.0, -20.0)])
def test_the_loops_give_the_tables_pattern_in_every_direction(element):
    rng = np.random.default_rng(4)
    for station in network().stations:
        place = np.asarray(station.position_m)
        normal = np.array([np.cos(station.normal_rad), np.sin(station.normal_rad), 0.0])
        axes = np.array([normal, station.horizontal, [0, 0, 1.0]])
        # Along the axes and in all directions.
        away = np.concatenate([axes, -axes, rng.normal(0, 300, (700, 3))])
        expected = local_gain(element, *(away @ axes.T).T)
        assert gain(element, station, place + away) == pytest.approx(expected, rel=1e-9)
        assert gain(element, station, place + away[6:]) == pytest.approx(expected[6:], rel=1e-12)
