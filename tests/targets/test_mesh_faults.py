"""Users' meshes that cannot be read or used are refused by file, key and reason.

Order means nothing.
"""

import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.make import make
from lowalt.targets.mesh_files import read_mesh
from lowalt.targets.records import merge
from meshes import TABLE, box, car_record, made, plain, quad_record
from tables import rows

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("empty.stl", b"", "no triangle|not a readable"),
        ("one.obj", TRIANGLE, "1 triangles with an area"),
        ("nan.obj", TRIANGLE.replace("v 0 1 0", "v 0 nan 0") * 4, "NaN"),
        ("inf.obj", TRIANGLE.replace("v 0 1 0", "v 0 inf 0") * 4, "NaN, infinite"),
        (
            "flat.obj",
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n" * 5,
            "0 triangles with an area|no triangle",
        ),
        ("text.stl", "this is no mesh at all", "no triangle|not a readable"),
        ("bytes.dae", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("mesh.fbx", b"Kaydara FBX", "format '.fbx', expected one of"),
        ("gone.stl", None, "no file"),
        (
            "cut.stl",
            bytes(80) + (60).to_bytes(4, "little") + bytes(50 * 10),
            "states 60 triangles .* ends after 10",
        ),
    ],
)
def test_bad_files_are_refused_by_name_and_reason(name, text, reason, tmp_path):
    if text is not None:
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=reason) as error:
        made("DJI Mini 2", tmp_path, **plain(name))
    assert name in str(error.value)


def test_a_machine_without_pymeshlab_is_told_what_to_install(quad, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(InputError, match=r"mesh records need pymeshlab.*libgl1"):
        read_mesh(quad / "body.stl", "m")


@pytest.mark.parametrize(
    ("path", "value", "names"),
    rows("meshes", "records"),
)
def test_bad_records_are_refused_by_key_and_value(path, value, names, quad):
    record = quad_record()
    at = record
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    with pytest.raises(InputError, match=names) as error:
        made("DJI Mini 2", quad, **record)
    place = quad / "body.stl" if path[-1] == "geometry" else "DJI Mini 2"
    assert str(error.value).startswith(f"{place}: ")


@pytest.mark.parametrize(("low", "words"), [(5, "holds nothing"), (-5, "leave nothing of body")])
def test_regions_that_hold_nothing_or_everything_are_refused(low, words, quad):
    record = plain("body.stl")
    region = {"box": [[low] * 3, [6] * 3]}
    record["parts"]["r"] = {
        "kind": "rotor",
        "region": region,
        "hinge": [0, 0, 0],
        "axis": [0, 0, 1],
    }
    with pytest.raises(InputError, match=words):
        made("DJI Mini 2", quad, **record)


@pytest.mark.slow
def test_two_million_triangles_take_bounded_memory(tmp_path):
    side = 1000
    x, y = np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(-1, 1, side + 1))
    vertices = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(9 * x * y).ravel()], axis=1)
    at = np.arange(side * (side + 1)).reshape(side, side + 1)[:, :-1].ravel()
    faces = np.concatenate(
        [np.stack([at, at + 1, at + side + 2], 1), np.stack([at, at + side + 2, at + side + 1], 1)]
    )
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "big.stl")
    code = """
import re, sys
from pathlib import Path
from lowalt.targets.mesh import check_record, mesh_cloud
extra = {"unit": "m", "up": "z", "front": "y", "size_is": "length",
         "parts": {"body": {"kind": "body", "meshes": [{"file": "big.stl"}]}}}
record = {"source": "mesh", "subtype": "Crow", "category": "Bird", "published": {"size_m": 2.0}, "points": 169,
          "rcs_m2_per_point": 1.0, **extra}
cloud = mesh_cloud(check_record(record, "Crow"), sys.argv[1], 1)
# Not ru_maxrss, which begins with the memory of the process that started this one.
print(len(cloud.points), int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) // 1024)
"""
    run = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True
    )
    points, peak_mib = map(int, run.stdout.split())
    assert points == 169 and peak_mib < 1500


@pytest.mark.parametrize(
    "names", [("front right", "body"), ("arm 1", "zebra"), ("back left wheel", "Aaa"), ("1", "0")]
)
def test_the_order_and_the_names_of_parts_mean_nothing(names, quad):
    """A record gives the same cloud however its parts are sorted.

    Settings reach a job with sorted keys.
    """
    first, body = names
    record = quad_record()
    given_parts = {
        first: record["parts"].pop("front right"),
        body: record["parts"].pop("body"),
        **record.pop("parts"),
    }
    if body != "body":
        given_parts[body] = given_parts[body] | {"kind": "body"}
    merged = merge(TABLE["DJI Mini 2"], {"source": "mesh", **record, "parts": given_parts}, "own")
    found = [
        make(json.loads(json.dumps(settings, sort_keys=keys)), quad, 1)
        for settings, keys in (
            (merged, False),
            (merged, True),
            (merged | {"parts": given_parts}, False),
        )
    ]
    assert found[0].kinds == ("body", "rotor", "rotor", "rotor", "rotor")
    assert found[0].names == (body, *sorted(set(given_parts) - {body}))
    for other in found[1:]:
        assert other.names == found[0].names
        np.testing.assert_array_equal(other.points, found[0].points)


def test_a_child_may_sort_before_its_parent(bird):
    folder, record = bird
    renamed = {"right inner": "right wing", "right outer": "right outer wing"}
    parts = {
        renamed.get(name, name): dict(part) for name, part in reversed(record["parts"].items())
    }
    parts["right outer wing"]["parent"] = "right wing"
    cloud = make(
        json.loads(
            json.dumps(
                merge(TABLE["Crow"], {"source": "mesh", **record, "parts": parts}, "own"),
                sort_keys=True,
            )
        ),
        folder,
        1,
    )
    assert cloud.names == ("body", "left inner", "left outer", "right wing", "right outer wing")
    assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]


@pytest.mark.parametrize(
    ("name", "change", "words"),
    rows("meshes", "parts"),
)
@pytest.mark.parametrize("order", [1, -1])
def test_parts_that_contradict_one_another_are_refused_whatever_their_order(
    name, change, words, order, bird
):
    folder, record = bird
    parts = dict(list(record["parts"].items())[::order])
    with pytest.raises(InputError, match=words):
        made("Crow", folder, **record | {"parts": parts | {name: parts[name] | change}})


def wheeled(tmp_path, axis=0, centre=0.33, count=4, turns=None) -> dict:
    """Write a car with separate wheels whose thin direction is `axis`, and return its record.

    turns: of the last axle.
    """
    box((1.8, 4.5, 1.0), (0, 0, 0.9)).export(tmp_path / "car.obj")
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0] if axis == 0 else [1, 0, 0])
    shape = trimesh.creation.cylinder(radius=0.33, height=0.2, sections=64)
    shape.apply_transform(turn)
    shape.export(tmp_path / "wheel.obj")
    record = car_record()
    places = (("fl", -0.8, 1.4), ("fr", 0.8, 1.4), ("rl", -0.8, -1.4), ("rr", 0.8, -1.4))[:count]
    body = record["parts"]["body"]
    record["parts"] = {
        name: {"kind": "wheel", "meshes": [{"file": "wheel.obj", "move": [x, y, centre]}]}
        for name, x, y in places
    } | {"body": body}
    if turns:
        record["parts"]["rr"]["axis"] = turns
    return record


@pytest.mark.parametrize(
    ("changes", "words"),
    rows("meshes", "wheels"),
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
    with pytest.raises(
        InputError, match=r"front left: its hinge lies 4.9 m from the middle of its surface"
    ):
        made("DJI Mini 2", quad, **record)
    folder, record = bird
    record["parts"]["right inner"]["hinge"] = [0.2, 0, 0]
    with pytest.raises(
        InputError, match=r"right inner: its hinge lies 0.2 m and its surface 0.05 m right"
    ):
        made("Crow", folder, **record)
    box((0.012, 0.002, 0.001)).export(quad / "prop.stl")
    with pytest.raises(
        InputError, match=r"rotor front left has a diameter of 0.0095 m at the final size"
    ):
        made("DJI Mini 2", quad, **quad_record())
