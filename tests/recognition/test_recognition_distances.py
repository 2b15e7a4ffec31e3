"""How far subtypes lie apart: laws of the distance, and a cloud against itself turned, moved and
scaled.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.motion import positions
from lowalt.numerics.streams import stream
from lowalt.recognition import distances
from lowalt.recognition.distances import cycle_s, energy_distance, form, swept
from moving_clouds import rigid_cloud, row

POINTS = st.integers(0, 10**6).map(lambda seed: stream(seed, "points").normal(size=(12, 3)))


@settings(deadline=None, max_examples=30)
@given(POINTS, POINTS, POINTS)
def test_it_is_a_metric(first, second, third):
    assert energy_distance(first, first) == pytest.approx(0, abs=1e-6)
    assert energy_distance(first, second) == pytest.approx(energy_distance(second, first))
    assert (
        energy_distance(first, third)
        <= energy_distance(first, second) + energy_distance(second, third) + 1e-9
    )


def test_two_points_apart_have_the_distance_that_the_formula_gives():
    assert energy_distance(np.zeros((1, 3)), np.array([[3.0, 4.0, 0.0]])) == pytest.approx(
        np.sqrt(10)
    )
    # One of two points moved by 2: E|X-Y| = (0 + 2 + 1 + 1) / 4, E|X-X'| = 1/2, E|Y-Y'| = 1/2.
    first = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    second = np.array([[0.0, 0, 0], [-1.0, 0, 0]])
    assert energy_distance(first, second) == pytest.approx(np.sqrt(2 * 1.0 - 0.5 - 0.5))


@settings(deadline=None, max_examples=30)
@given(POINTS, st.floats(0.1, 50), st.floats(-100, 100))
def test_form_knows_neither_place_nor_size_and_the_radius_does(points, scale, shift):
    plain, radius = form(points)
    moved, other = form(scale * points + shift)
    np.testing.assert_allclose(moved, plain, atol=1e-9)
    assert other / radius == pytest.approx(scale)
    assert np.sqrt((plain**2).sum(1).mean()) == pytest.approx(1)


def test_points_that_are_all_one_are_refused():
    with pytest.raises(InputError, match="no form"):
        form(np.ones((4, 3)))


def test_a_cycle_is_a_turn_or_the_whole_recording_at_the_speed_of_its_playback():
    cloud = rigid_cloud("rotor", "UAV")
    assert cycle_s(cloud, row(rate_hz=40.0)) == 0.025
    assert cycle_s(cloud, row(rate_hz=0.0)) == 1.0
    recorded = replace(
        cloud, track=np.zeros((60, 1, 3)), record={**cloud.record, "track_rate_hz": 30.0}
    )
    assert cycle_s(recorded, row(playback=1.25, rate_hz=40.0)) == 1.6


def test_swept_points_are_those_of_sixteen_instants_of_a_cycle_without_the_body_s_own_course():
    cloud = rigid_cloud("rotor", "UAV")
    moving = row(
        rate_hz=40.0,
        phase_0_rad=0.3,
        x_m=80.0,
        vx_mps=5.0,
        yaw_rad=1.0,
        pitch_rad=0.2,
        roll_rad=0.1,
    )
    still = row(rate_hz=40.0, phase_0_rad=0.3)
    wanted = positions(cloud, still, np.arange(16) / 640).reshape(-1, 3)
    np.testing.assert_allclose(swept(cloud, moving), wanted, atol=1e-12)
    large = replace(cloud, points=np.repeat(cloud.points, 500, 0), part=np.repeat(cloud.part, 500))
    assert len(swept(large, moving)) == 1200 < 16 * len(large.points)
    # Evenly taken from all, the first and the last included.
    every = positions(large, still, np.arange(16) / 640).reshape(-1, 3)
    np.testing.assert_allclose(swept(large, moving)[[0, -1]], every[[0, -1]], atol=1e-12)


def test_rows_name_the_nearest_of_the_category_and_of_the_trained_with_distance_and_ratio_of_size():
    """Three rotors that differ in form a little, of sizes 1, 2 and 5; a bird alone in its category."""
    plain = rigid_cloud("rotor", "UAV")
    shapes = {"far": 5.0, "near": 2.0, "plain": 1.0}
    bend = {"far": 0.4, "near": 0.05, "plain": 0.0}
    clouds = []
    for name, scale in shapes.items():
        points = scale * (
            plain.points + np.array([[0, 0, bend[name]], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
        )
        clouds.append(
            replace(
                plain,
                points=points,
                hinges=scale * plain.hinges,
                record={**plain.record, "subtype": name},
            )
        )
    clouds.append(replace(plain, record={**plain.record, "subtype": "bird", "category": "Bird"}))
    groups = {"far": "seen", "near": "unseen", "plain": "seen", "bird": "seen"}
    motion = [
        row(rate_hz=40.0, phase_0_rad=0.3, playback=1.0) | {"subtype": name, "group": group}
        for name, group in groups.items()
    ]
    # Of several rows of a subtype the first counts.
    motion.append(motion[0] | {"group": "unseen", "rate_hz": 3.0})
    forms = {cloud.subtype: form(swept(cloud, motion[0])) for cloud in clouds}

    def told(one, other):
        radii = sorted(forms[name][1] for name in (one, other))
        return [
            other,
            f"{energy_distance(forms[one][0], forms[other][0]):.4f}",
            f"{radii[1] / radii[0]:.3f}",
        ]

    assert distances.rows(clouds, motion) == [
        ["UAV", "far", "seen", *told("far", "near"), *told("far", "plain")],
        ["UAV", "near", "unseen", *told("near", "plain"), *told("near", "plain")],
        ["UAV", "plain", "seen", *told("plain", "near"), *told("plain", "far")],
        ["Bird", "bird", "seen", "", "", "", "", "", ""],
    ]
    assert all(
        float(told(one, other)[2]) > 1.5 for one, other in (("far", "near"), ("near", "plain"))
    )
    with pytest.raises(InputError, match=r"no motion row of \['bird'\]"):
        distances.rows(clouds, motion[:3])
