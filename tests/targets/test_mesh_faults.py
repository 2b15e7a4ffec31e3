"""Users' meshes that cannot be read or used: each is refused by file, key and reason."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh

from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import read_mesh
from meshes import made, plain, quad_record

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("empty.stl", b"", "no triangle|not a readable"),
        ("empty.obj", "", "no triangle|not a readable"),
        ("points.obj", "v 0 0 0\nv 1 0 0\n", "no triangle|not a readable"),
        ("one.obj", TRIANGLE, "1 triangles with an area"),
        ("nan.obj", TRIANGLE.replace("v 0 1 0", "v 0 nan 0") * 4, "NaN"),
        ("inf.obj", TRIANGLE.replace("v 0 1 0", "v 0 inf 0") * 4, "NaN, infinite"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n" * 5, "0 triangles with an area|no triangle"),
        ("text.stl", "this is no mesh at all", "no triangle|not a readable"),
        ("bytes.ply", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("bytes.glb", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("bytes.dae", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("mesh.fbx", b"Kaydara FBX", "format '.fbx', expected one of"),
        ("gone.stl", None, "no file"),
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
    [
        (["unit"], "inch", "unit"), (["up"], "up", "up"), (["front"], "-z", "two different axes"),
        (["size_is"], "tall", "size_is"),
        (["colour"], "red", "colour"), (["scale"], 2, "scale"), (["moving_share"], 1, "moving_share"),
        (["parts", "front right", "hinge"], [0, 0], "front right"),
        (["parts", "front right", "kind"], "wheel", "expected rotor"),
        (["parts", "front right", "axis"], [0, 0, 0], "axis is zero"),
        (["parts", "front right", "parent"], "body", "parent"),
        (["parts", "front right", "region"], {"box": [[0, 0, 0], [1, 1, 1]]}, "front right"),
        (["parts", "body", "meshes", 0, "file"], "/etc/body.stl", "inside the folder"),
        (["parts", "body", "meshes", 0, "file"], "../body.stl", "inside the folder"),
        (["parts", "body", "meshes", 0, "geometry"], ["seat"], "geometry .'seat'. is not in it"),
        (["parts", "body", "meshes", 0, "unit"], "furlong", "furlong"), (["points"], 4, "leave none for the body"),
        (["unit"], "in", "part front left measures 0.00508 m in a mesh of 0.205 m.* is the unit"),
        (["parts", "front right", "meshes", 0, "unit"], "in", "part front right measures .* is the unit"),
        (["parts", "front right"], {"kind": "body"}, "front right"),
    ],
)  # fmt: skip
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
    record["parts"]["r"] = {"kind": "rotor", "region": region, "hinge": [0, 0, 0], "axis": [0, 0, 1]}
    with pytest.raises(InputError, match=words):
        made("DJI Mini 2", quad, **record)


@pytest.mark.slow
def test_two_million_triangles_take_bounded_memory(tmp_path):
    side = 1000
    x, y = np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(-1, 1, side + 1))
    vertices = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(9 * x * y).ravel()], axis=1)
    at = np.arange(side * (side + 1)).reshape(side, side + 1)[:, :-1].ravel()
    faces = np.concatenate([np.stack([at, at + 1, at + side + 2], 1), np.stack([at, at + side + 2, at + side + 1], 1)])
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
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    points, peak_mib = map(int, run.stdout.split())
    assert points == 169 and peak_mib < 1500
