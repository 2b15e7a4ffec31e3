"""Fluctuation on links: TR 38.901's bistatic cross section by hand, its limit at one place, and one draw for a pair."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.effects.catalogue import called
from lowalt.effects.channel import fluctuation
from lowalt.effects.received import Scene, observe, received_signal
from test_effects_links import A, B, link, linked
from test_effects_links_points import seen

FIXED = fluctuation.DEFAULTS | {"spread_db": 0.0}
ANGLES = np.radians([0.0, 60.0, 120.0, 180.0])


@pytest.mark.parametrize(
    ("faces", "expected"),
    [
        # 3 sin(beta / 2).
        (None, [0.0, 1.5, 2.598, 3.0]),
        # 6 sin(1.65 beta / 2) - 5 lg cos(beta / 2), 30 degrees times 1.65 being 49.5.
        (fluctuation.VEHICLE, [0.0, 4.562 + 0.312, 5.926 + 1.505, np.inf]),
        # 6.05 sin(1.33 beta / 2) - 5 lg cos(beta / 2), 30 degrees times 1.33 being 39.9.
        (fluctuation.LARGE_UAV, [0.0, 3.881 + 0.312, 5.955 + 1.505, np.inf]),
    ],
    ids=["none", "vehicle", "large UAV"],
)
def test_the_loss_by_the_bistatic_angle_is_that_worked_by_hand(faces, expected):
    found = fluctuation.bistatic_loss_db(faces, ANGLES)
    assert found[:3] == pytest.approx(expected[:3], abs=2e-3)
    assert found[3] > 50 if faces else found[3] == pytest.approx(3.0)


def body(station, size_m, like="UAV", **pose):
    """The box of `seen`, as a large or small UAV or a vehicle, turned."""
    view = seen(station, size_m=size_m)
    cloud = replace(view.cloud, record=view.cloud.record | {"like": like, "category": like})
    return observe(Scene(view.network, 5, None, ()), station, cloud, view.row | pose)


def by_hand(view, faces, mean):
    """B1 in dB at the first symbol, of the face that the bisector meets, and whether it is above that face's floor."""
    ways = [np.asarray(end.position_m) - view.motion.translation[0, 0] for end in (A, B)]
    one, two = (way / np.linalg.norm(way) for way in ways)
    angle, bisector = np.arccos(one @ two), view.motion.rotation[0, 0].T @ (one + two)
    zenith = np.degrees(np.arccos(bisector[2] / np.linalg.norm(bisector)))
    azimuth = np.degrees(np.arctan2(-bisector[0], bisector[1])) % 360
    shone, floor = fluctuation.pattern_dbsm(faces, np.array([azimuth]), np.array([zenith]))
    k1, k2 = (6.0, 1.65) if faces is fluctuation.VEHICLE else (6.05, 1.33)
    loss = k1 * np.sin(k2 * angle / 2) - 5 * np.log10(np.cos(angle / 2))
    return max(shone[0] - loss, floor[0]) - mean, shone[0] - loss > floor[0]


@pytest.mark.parametrize(("like", "faces", "mean"), [("Vehicle", fluctuation.VEHICLE, 11.25),
                                                     ("UAV", fluctuation.LARGE_UAV, -5.85)])  # fmt: skip
def test_a_large_target_shines_as_its_face_at_the_bisector(like, faces, mean):
    above = set()
    for yaw in np.radians([0.0, 40.0, 77.0, 90.0, 180.0, 230.0, 270.0, 300.0]):
        view = body(link(), 2.0, like, yaw_rad=yaw, y_m=320.0, z_m=12.0)
        expected, over = by_hand(view, faces, mean)
        assert 10 * np.log10(fluctuation.pattern(view)[0, 0]) == pytest.approx(expected, abs=1e-9)
        above.add(bool(over))
    assert above == {True, False}


@pytest.mark.parametrize("size_m", [0.1, 2.0])
def test_a_link_back_to_its_own_place_fluctuates_as_the_station(size_m):
    own, back = (fluctuation.visible(FIXED, body(end, size_m), np.random.default_rng(1)) for end in (A, link(A, A)))
    assert own == pytest.approx(back, rel=1e-12)
    small = fluctuation.visible(FIXED, body(link(), 0.1), np.random.default_rng(1))
    assert (small < 1).all() and (small > 10 ** (-3 / 20)).all()


def test_both_directions_of_a_link_share_one_draw_and_other_stations_none():
    radio, own = linked(symbols=6, subcarriers=32, transmit=(4, 2), receive=(4, 2)), seen(A)
    there = replace(B, frequency_hz=A.frequency_hz)
    signals = [
        [
            received_signal(Scene(radio, 5, None, tuple(called(effects))), end, own.cloud, own.row).signal
            for end in (link(A, there), link(there, A), A)
        ]
        for effects in ({}, {"fluctuation": {"pattern": False}})
    ]
    gains = [abs(two).max() / abs(one).max() for one, two in zip(*signals, strict=True)]
    assert gains[0] == pytest.approx(gains[1], rel=1e-9) and abs(gains[0] - gains[2]) > 1e-3
