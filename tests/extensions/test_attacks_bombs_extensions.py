"""Recordings, towns, meshes and robots that would fill the memory or never end.

Those that would take minutes are among them. Each is refused in one sentence before it does.
"""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import bombs
import towns
from lowalt.__main__ import main
from lowalt.extensions.drafting.robot_files import read_robot
from lowalt.extensions.recordings.file_inspection import inspect_recording
from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.record import record
from lowalt.extensions.town import facets, footprints
from lowalt.extensions.town.buildings import files_of
from lowalt.extensions.town.buildings import read as read_town
from lowalt.extensions.town.town import DEFAULTS
from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import read_mesh


def recording(path: Path) -> object:
    """Read a recording of one real channel."""
    block = {"carrier_hz": 24e9, "channel": "real", "source": "test", "licence": "none"}
    block |= {"rate_hz": 8000.0, "file": path.name}
    return read(record(block, path.parent, "record"))


def buildings(path: Path) -> object:
    """Read a town."""
    origin = [11.5, 48.1] if path.suffix == ".geojson" else None
    return read_town(DEFAULTS | {"buildings": str(path), "origin": origin})


def mesh(path: Path) -> object:
    """Read a mesh in metres."""
    return read_mesh(path, "m")


def robot(path: Path) -> object:
    """Read a robot's description."""
    return read_robot(path, path.parent)


def hdf5_of_nothing(path: Path) -> None:
    """Write an array of 800 MB of which no value is stored."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (100 << 20,), "f8", chunks=(1 << 20,), compression="gzip")


def scene_of_one_mesh(path: Path, shapes: int = 200) -> None:
    """Write a Mitsuba scene that names one mesh of 4000 triangles many times."""
    towns.ply(path.with_name("m.ply"), [(20.0 * k, 0.0, 9.0, 9.0, 9.0) for k in range(400)])
    shape = '<shape type="ply"><string name="filename" value="m.ply"/></shape>'
    path.write_text(f'<scene version="3.0.0">{shape * shapes}</scene>')


def robot_of_one_mesh(path: Path) -> None:
    """Write a URDF that names one mesh of 4000 triangles many times."""
    towns.ply(path.with_name("m.ply"), [(20.0 * k, 0.0, 9.0, 9.0, 9.0) for k in range(400)])
    visual = '<visual><geometry><mesh filename="m.ply"/></geometry></visual>'
    path.write_text(f'<robot name="a"><link name="b">{visual * 700}</link></robot>')


def array_of_axes(path: Path) -> None:
    """Write an array of one long axis and many short ones."""
    rng = np.random.default_rng(1)
    np.save(path, rng.integers(0, 99, (65, 12, 12, 12, 12)).astype(np.int8))


POINTS = {"componentType": 5126, "type": "VEC3", "count": 3_000_000}
SHOWN = {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
PRIMITIVE = {"attributes": {"POSITION": 0}}


def glb_of_nodes() -> bytes:
    """A GLB file of many nodes that show one surface of which no number is stored."""
    meshes = [{"primitives": [PRIMITIVE]}]
    nodes = {"scenes": [{"nodes": [*range(500)]}], "nodes": [{"mesh": 0}] * 500}
    return bombs.glb({**nodes, "meshes": meshes, "accessors": [POINTS]})


def glb_of_morphs() -> bytes:
    """A GLB file of one surface with many morphs."""
    primitive = {**PRIMITIVE, "targets": [{"POSITION": 0}] * 5000}
    meshes = [{"weights": [1] * 5000, "primitives": [primitive]}]
    return bombs.glb({**SHOWN, "meshes": meshes, "accessors": [{**POINTS, "count": 300_000}]})


def glb_of_instances() -> bytes:
    """A GLB file of one surface with a million instances."""
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}
    nodes = [{"mesh": 0, "extensions": extension}]
    accessors = [{**POINTS, "count": 300}, {**POINTS, "count": 1_000_000}]
    meshes = [{"primitives": [PRIMITIVE]}]
    return bombs.glb({**SHOWN, "nodes": nodes, "meshes": meshes, "accessors": accessors})


PLY = (
    "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
)


ROWS = [
    bombs.Bomb(
        "a.mat", lambda: bombs.matlab_zeros(80), recording, "expand to more than 67108864 bytes"
    ),
    bombs.Bomb(
        "b.mat", lambda: bombs.matlab_zeros(20, 5), recording, "expand to more than 67108864"
    ),
    bombs.Bomb(
        "a.h5", hdf5_of_nothing, recording, "x has 838860800 bytes, more than the file", True
    ),
    bombs.Bomb(
        "a.csv", lambda: "1," * 200_000 + "1\n", recording, "200001 columns, expected at most"
    ),
    bombs.Bomb(
        "b.csv", lambda: "1," * 200_000 + "1\n", inspect_recording, "200001 columns, expected"
    ),
    bombs.Bomb(
        "c.csv", lambda: "1" * 3_000_000, recording, "a line of more than 1048576 characters"
    ),
    bombs.Bomb("d.csv", "a\n" + "1" * 30, inspect_recording, "nothing in it reads as a signal"),
    bombs.Bomb("a.npy", array_of_axes, inspect_recording, "nothing in it reads as a signal", True),
    bombs.Bomb("a.wav", bombs.wav(0, b"", 0), recording, "or of no channel"),
    bombs.Bomb("b.wav", bombs.wav(0, b"", 0), inspect_recording, "or of no channel"),
    bombs.Bomb(
        "a.geojson", lambda: bombs.town(bombs.outline(60_000, 1.0)), buildings, "60001 corners"
    ),
    bombs.Bomb(
        "b.geojson", lambda: bombs.town(bombs.outline(20_000, 0.5)), buildings, "20001 corners"
    ),
    bombs.Bomb(
        "a.xml", scene_of_one_mesh, buildings, "504000 triangles, expected at most 500000", True
    ),
    bombs.Bomb(
        "a.urdf", robot_of_one_mesh, robot, "more than 2016000 triangles, expected fewer", True
    ),
    bombs.Bomb("a.glb", glb_of_nodes, mesh, "more than 20.* triangles, expected fewer"),
    bombs.Bomb("b.glb", glb_of_morphs, mesh, "more than 20.* triangles, expected fewer"),
    bombs.Bomb("c.glb", glb_of_instances, mesh, "more than 20.* triangles, expected fewer"),
    bombs.Bomb(
        "a.ply", PLY.format("binary_little_endian", 2**62) + "end_header\n", mesh, "not a readable"
    ),
    bombs.Bomb("b.ply", PLY.format("ascii", 2**62) + "end_header\n1 2 3\n", mesh, "not a readable"),
]


@pytest.mark.parametrize("row", ROWS, ids=[f"{row.name} {row.read.__name__}" for row in ROWS])
def test_a_file_that_asks_for_far_more_than_it_holds_is_refused_in_one_sentence(row, tmp_path):
    bombs.check_refused(row, tmp_path)


def test_a_group_of_hdf5_that_stands_in_itself_is_entered_once(tmp_path):
    h5py = pytest.importorskip("h5py")
    samples = np.random.default_rng(1).standard_normal(4000)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("g")
        for number in range(20):
            group[f"g{number}"] = group
        file["x"] = samples
    assert bombs.refusal_of(partial(recording, tmp_path / "a.h5")) == "accepted"


def test_a_mesh_that_a_scene_names_often_is_read_and_listed_once(tmp_path, monkeypatch):
    scene_of_one_mesh(tmp_path / "a.xml", 3)
    opened = []
    reading = Path.open

    def counted(path, *given, **named):
        opened.append(path.name)
        return reading(path, *given, **named)

    monkeypatch.setattr(Path, "open", counted)
    assert buildings(tmp_path / "a.xml").facts["buildings"] == 400
    assert opened.count("m.ply") == 1
    assert files_of(tmp_path / "a.xml") == [str(tmp_path / "a.xml"), str(tmp_path / "m.ply")]


@pytest.mark.parametrize("name", ["a.wav", "a.csv", "a.mat", "a.npy", "a.iq", "a.geojson", "a.xml"])
def test_pipes_and_devices_are_no_files(name, tmp_path):
    bombs.pipe(tmp_path / name)
    (tmp_path / f"zero-{name}").symlink_to("/dev/zero")
    reads = buildings if name in ("a.geojson", "a.xml") else recording
    for path in (tmp_path / name, tmp_path / f"zero-{name}"):
        # A record of a recording refuses links out of its folder before it looks at the file.
        with pytest.raises(
            InputError,
            match=r"is a pipe, socket or device, expected a regular file|a link to /dev/",
        ):
            reads(path)


def test_an_outline_with_many_dents_is_read_in_the_memory_of_its_corners(tmp_path):
    (tmp_path / "a.geojson").write_text(bombs.town(bombs.outline(3000, 0.5)))
    assert bombs.refusal_of(partial(buildings, tmp_path / "a.geojson")) == "accepted"


def test_facets_are_turned_as_by_a_comparison_of_all_with_all(monkeypatch):
    rng = np.random.default_rng(3)
    planes = np.column_stack([rng.standard_normal((40, 3)), rng.uniform(-3, 3, 40)])
    points = rng.uniform(-1, 1, (500, 3))
    over = planes[:, :3] @ points.T - planes[:, 3:]
    for block in (1, 700, 1 << 20):
        monkeypatch.setattr(facets, "BLOCK", block)
        below, above = facets._one_sided(planes, points)
        assert (below == (over.max(axis=1) <= facets.FLAT_M)).all() and 0 < below.sum() < 40
        assert (above == (over.min(axis=1) >= -facets.FLAT_M)).all() and 0 < above.sum() < 40


def test_the_corners_of_all_outlines_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(footprints, "MOST_PLACES", 100)
    (tmp_path / "a.geojson").write_text(bombs.town(*[bombs.outline(29, 1.0)] * 5))
    with pytest.raises(InputError, match=r"features\[3\]: 30 corners, 120 with those before it"):
        buildings(tmp_path / "a.geojson")


def test_a_building_of_too_many_facets_and_corners_is_refused(tmp_path, monkeypatch):
    (tmp_path / "a.geojson").write_text(bombs.town(bombs.outline(40, 1.0)))
    monkeypatch.setattr(facets, "MOST_COMPARED", 1000)
    with pytest.raises(InputError, match=r"a\.geojson: a building of 4. facets and 80 corners"):
        buildings(tmp_path / "a.geojson")


GOOD = json.loads(bombs.town(bombs.outline(8, 1.0)))["features"][0]
DAMAGED = {
    "null": GOOD | {"geometry": {"type": "Polygon", "coordinates": None}},
    "text": GOOD | {"geometry": {"type": "Polygon", "coordinates": "a"}},
    "number": GOOD | {"geometry": {"type": "Polygon", "coordinates": [[1, 2, 3]]}},
    "two points": GOOD | {"geometry": {"type": "Polygon", "coordinates": [[[1, 2], [3, 4]]]}},
    "mixed": GOOD | {"geometry": {"type": "Polygon", "coordinates": [[[1, 2], [3, "a"], [], [1]]]}},
    "ring of rings": GOOD | {"geometry": {"type": "MultiPolygon", "coordinates": [[1], [[2]]]}},
    "no feature": 3,
    "geometry of text": GOOD | {"geometry": "Polygon"},
    "list of properties": GOOD | {"properties": [1]},
}


@pytest.mark.parametrize("command", ["inspect", "new"])
@pytest.mark.parametrize("name", [*DAMAGED, "latin", "deep"])
def test_damaged_footprints_end_with_one_sentence_without_an_origin(
    command, name, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(Path(__file__).parents[2])
    path = tmp_path / "a.geojson"
    text = json.dumps({"type": "FeatureCollection", "features": [DAMAGED.get(name, GOOD)]})
    if name == "deep":
        text = text.replace("[[[", "[" * 900 + "[[[").replace("]]]", "]]]" + "]" * 900)
    path.write_bytes(text.replace("yes", "\xff").encode("latin-1" if name == "latin" else "utf-8"))
    status = main(["scene", command, str(path), "--out", str(tmp_path / "a.yaml")])
    said = capsys.readouterr().err
    assert status == 2 and said.startswith(f"error: {path}: ") and said.count("\n") == 1
