"""Parts of users' meshes: their order means nothing, and parts that cannot be what they are called are refused."""

import json

import numpy as np
import pytest
import trimesh

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.make import make
from lowalt.targets.records import merge
from meshes import TABLE, box, car_record, made, quad_record


@pytest.mark.parametrize("names", [("front right", "body"), ("arm 1", "zebra"), ("back left wheel", "Aaa"), ("1", "0")])
def test_the_order_and_the_names_of_parts_mean_nothing(names, quad):
    """Settings reach a job with sorted keys, so a record must give the same cloud however its parts are sorted."""
    first, body = names
    record = quad_record()
    given_parts = {first: record["parts"].pop("front right"), body: record["parts"].pop("body"), **record.pop("parts")}
    if body != "body":
        given_parts[body] = given_parts[body] | {"kind": "body"}
    merged = merge(TABLE["DJI Mini 2"], {"source": "mesh", **record, "parts": given_parts}, "own")
    found = [
        make(json.loads(json.dumps(settings, sort_keys=keys)), quad, 1)
        for settings, keys in ((merged, False), (merged, True), (merged | {"parts": given_parts}, False))
    ]
    assert found[0].kinds == ("body", "rotor", "rotor", "rotor", "rotor")
    assert found[0].names == (body, *sorted(set(given_parts) - {body}))
    for other in found[1:]:
        assert other.names == found[0].names
        np.testing.assert_array_equal(other.points, found[0].points)


def test_a_child_may_sort_before_its_parent(bird):
    folder, record = bird
    renamed = {"right inner": "right wing", "right outer": "right outer wing"}
    parts = {renamed.get(name, name): dict(part) for name, part in reversed(record["parts"].items())}
    parts["right outer wing"]["parent"] = "right wing"
    cloud = make(json.loads(json.dumps(merge(TABLE["Crow"], {"source": "mesh", **record, "parts": parts}, "own"),
                                       sort_keys=True)), folder, 1)  # fmt: skip
    assert cloud.names == ("body", "left inner", "left outer", "right wing", "right outer wing")
    assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("right inner", {"parent": "right outer"}, "parent is 'right .*', which hangs on 'right .*' itself"),
        ("right inner", {"kind": "body"}, "2 of kind body"),
        ("body", {"kind": "wing"}, "0 of kind body"),
        ("right outer", {"region": {"box": [[0.03, None, -0.01], [None, None, 0.01]]}},
         "parts 'right inner' and 'right outer' take the same surface"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("order", [1, -1])
def test_parts_that_contradict_one_another_are_refused_whatever_their_order(name, change, words, order, bird):
    folder, record = bird
    parts = dict(list(record["parts"].items())[::order])
    with pytest.raises(InputError, match=words):
        made("Crow", folder, **record | {"parts": parts | {name: parts[name] | change}})


def wheeled(tmp_path, axis=0, centre=0.33, count=4, turns=None) -> dict:
    """Write a car with separate wheels whose thin direction is `axis`, and return its record; turns: the last axle."""
    box((1.8, 4.5, 1.0), (0, 0, 0.9)).export(tmp_path / "car.obj")
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0] if axis == 0 else [1, 0, 0])
    shape = trimesh.creation.cylinder(radius=0.33, height=0.2, sections=64)
    shape.apply_transform(turn)
    shape.export(tmp_path / "wheel.obj")
    record = car_record()
    places = (("fl", -0.8, 1.4), ("fr", 0.8, 1.4), ("rl", -0.8, -1.4), ("rr", 0.8, -1.4))[:count]
    body = record["parts"]["body"]
    record["parts"] = {
        name: {"kind": "wheel", "meshes": [{"file": "wheel.obj", "move": [x, y, centre]}]} for name, x, y in places
    } | {"body": body}
    if turns:
        record["parts"]["rr"]["axis"] = turns
    return record


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"centre": 1.3}, "fl: its centre lies 0.9 m above the lowest point of a body 1 m high.*is `up` reversed"),
        ({"axis": 1}, "fl: it measures 0.66 m along its axis and 0.2 x 0.66 m across"),
        ({"turns": [0, 1, 0]}, r"rr: its axis is .*1.0, -?0.0. .right, front, up., expected right or left"),
    ],
)
def test_wheels_that_cannot_roll_are_refused_with_their_measures(changes, words, tmp_path):
    with pytest.raises(InputError, match=words):
        made("Audi A6L 2019", tmp_path, **wheeled(tmp_path, **changes))


def test_a_car_on_two_wheels_is_made_with_a_warning_that_its_cloud_keeps(tmp_path):
    with pytest.warns(InputWarning, match="2 wheels, expected at least 3"):
        cloud = made("Audi A6L 2019", tmp_path, **wheeled(tmp_path, count=2))
    assert cloud.record["warnings"] == ["Audi A6L 2019: 2 wheels, expected at least 3"]
    assert "warnings" not in made("Audi A6L 2019", tmp_path, **wheeled(tmp_path)).record


def test_hinges_far_from_their_part_and_a_rotor_of_a_millimetre_are_refused(quad, bird):
    record = quad_record()
    record["parts"]["front left"]["hinge"] = [5.0, 0.1, 0.04]
    with pytest.raises(InputError, match=r"front left: its hinge lies 4.9 m from the middle of its surface"):
        made("DJI Mini 2", quad, **record)
    folder, record = bird
    record["parts"]["right inner"]["hinge"] = [0.2, 0, 0]
    with pytest.raises(InputError, match=r"right inner: its hinge lies 0.2 m and its surface 0.05 m right"):
        made("Crow", folder, **record)
    box((0.012, 0.002, 0.001)).export(quad / "prop.stl")
    with pytest.raises(InputError, match=r"rotor front left has a diameter of 0.0095 m at the final size"):
        made("DJI Mini 2", quad, **quad_record())
