"""Rays against capsules: every symbol of a strip and past it, ends of bones, and rays along a bone."""

import numpy as np

from lowalt.effects.channel.capsules import STRIP, capsules

PLACE = np.array([30.0, 0.0, 0.0])


def between(p, a, b):
    """Least distances of the segment a to b from p, and from the ray from p to PLACE, by many points of both."""
    bone = a + np.linspace(0.0, 1.0, 201)[:, None] * (b - a)
    ray = p + np.linspace(0.0, 3.0, 1501)[:, None] * (PLACE - p) / np.linalg.norm(PLACE - p)
    return np.linalg.norm(bone - p, axis=1).min(), np.linalg.norm(bone[:, None] - ray, axis=2).min()


def test_every_symbol_of_several_strips_is_told_as_by_points_along_ray_and_bone():
    rng = np.random.default_rng(5)
    nodes, bones = rng.uniform(-1.0, 1.0, (2 * STRIP + 7, 5, 3)), np.array([[0, 1], [2, 3], [3, 4]])
    radius, found = np.array([0.3, 0.4, 0.25]), np.zeros(nodes.shape[:2], np.bool_)
    capsules(PLACE, nodes, bones, radius, found)
    counted = []
    for n in (0, 1, STRIP - 1, STRIP, STRIP + 1, 2 * STRIP - 1, 2 * STRIP, 2 * STRIP + 6):
        for node in range(5):
            blocked, sure = False, True
            for (one, other), wide in zip(bones, radius, strict=True):
                own, ray = between(nodes[n, node], nodes[n, one], nodes[n, other])
                ends = node in (one, other)
                blocked |= not ends and own > wide >= ray
                sure &= ends or min(abs(own - wide), abs(ray - wide)) > 0.01
            if sure:
                assert found[n, node] == blocked
                counted.append(blocked)
    assert len(counted) > 25 and 3 < sum(counted) < len(counted) - 3
    # Nothing depends on the strip that a symbol stands in.
    for n in (0, STRIP, 2 * STRIP + 6):
        alone = np.zeros((1, 5), np.bool_)
        capsules(PLACE, nodes[n : n + 1], bones, radius, alone)
        assert (alone[0] == found[n]).all()


def test_a_bone_along_the_ray_and_one_of_no_length_hide_a_node_and_what_was_hidden_stays():
    nodes = np.array([[[0.0, 0.0, 0.0], [2.0, 0.1, 0.0], [4.0, 0.1, 0.0], [-1.0, 3.0, 0.0], [-1.0, 3.0, 0.0]]])
    found = np.zeros((1, 5), np.bool_)
    capsules(PLACE, nodes, np.array([[1, 2]]), np.array([0.2]), found)
    assert found.tolist() == [[True, False, False, False, False]]
    # A capsule of no length is a ball; node 3 lies in it, and nodes 0 to 2 stand before it.
    capsules(PLACE, nodes, np.array([[3, 4]]), np.array([0.2]), found)
    assert found.tolist() == [[True, False, False, False, False]]
    nodes[0, 3:] = [3.0, 0.1, 0.0]
    found[0] = [False, False, False, False, True]
    capsules(PLACE, nodes, np.array([[3, 4]]), np.array([0.15]), found)
    assert found.tolist() == [[True, True, False, False, True]]


def test_a_capsule_hides_no_node_that_lies_in_it():
    # Node 0 lies inside the capsule round the bone from 1 to 2, whose surface its ray crosses; node 3 behind it.
    nodes = np.array([[[0.1, 0.0, 0.0], [0.3, 1.0, 0.0], [0.3, -1.0, 0.0], [-1.0, 0.0, 0.0]]])
    found = np.zeros((1, 4), np.bool_)
    capsules(PLACE, nodes, np.array([[1, 2]]), np.array([0.5]), found)
    assert found.tolist() == [[False, False, False, True]]
