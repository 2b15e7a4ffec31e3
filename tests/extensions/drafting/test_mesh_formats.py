"""GLB and PLY files are read as viewers show them: strips, instances, quantised and skinned surfaces."""

import base64

import numpy as np
import pytest

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.mesh_files import pieces, read_mesh
from lowalt.workflow.sources import sources
from real_inputs import FOLDER
from shown_meshes import (
    CORNERS,
    FACES,
    STRIP,
    TETRAHEDRON,
    check_as_viewers_show,
    glb,
    measures,
    ply,
    prism,
    skinned,
)

FAULTS = FOLDER / "faults" / "meshes"


@pytest.mark.skipif(not FAULTS.is_dir(), reason=f"no real inputs: {FOLDER} lacks faults/")
@pytest.mark.parametrize(
    ("name", "extent", "area", "volume", "unit"),
    [
        ("quant.glb", [1, 1, 1], 2.366, 1 / 6, 1.0),
        ("skin.glb", [2, 2, 2], 4 * 2.366, 8 / 6, 1.0),
        ("strip.ply", [1, 1, 1], 6, 1, None),
        ("mixed.ply", [1, 1, 1], 6 + 2.366, 1 + 1 / 6, None),
    ],
)
def test_small_files_made_for_readers_are_read_as_a_viewer_shows_them(
    name, extent, area, volume, unit
):
    check_as_viewers_show(FAULTS / name, extent, area, volume, unit)


@pytest.mark.parametrize("kind", ["ascii", "little", "big"])
def test_a_polygon_with_a_dent_covers_its_own_area(kind, tmp_path):
    vertices, faces = prism()
    path = tmp_path / "a.ply"
    path.write_bytes(ply(vertices, faces, kind))
    extent, area, volume = measures(path)
    assert extent == pytest.approx([2, 2, 0.1])
    assert (area, volume) == pytest.approx((2 * 0.76 + 8 * 0.1, 0.076), rel=1e-6)
    assert len(read_mesh(path, "m").faces) == 20


@pytest.mark.parametrize("name", ["bytes.ply", "bytes.glb"])
def test_bytes_without_a_surface_are_refused_by_name(name, tmp_path):
    (tmp_path / name).write_bytes(bytes(range(256)) * 4)
    with pytest.raises(InputError, match=rf"{name}: .*(no triangle|not a readable)"):
        read_mesh(tmp_path / name, "m")


def test_a_glb_is_in_metres(tmp_path):
    path = glb_of_a_tetrahedron(tmp_path / "a.glb")
    with pytest.warns(
        InputWarning, match=r"a\.glb: the file states a unit of 1 m, the record says in"
    ):
        read_mesh(path, "in")


def glb_of_a_tetrahedron(path):
    """A file of one tetrahedron."""
    corners = np.array(TETRAHEDRON, "<f4")
    return glb(path, {}, POSITION=corners, indices=FACES.ravel().astype("<u2"))


def test_the_readers_are_source_files_of_the_clouds():
    assert {"mesh_glb.py", "mesh_ply.py"} <= {path.name for path in sources("lowalt.targets")}


@pytest.mark.parametrize("kind", ["ascii", "little", "big"])
def test_triangle_strips_of_a_ply_count_alone_and_beside_faces(kind, tmp_path):
    (tmp_path / "alone.ply").write_bytes(ply(CORNERS, [], kind, [STRIP]))
    assert measures(tmp_path / "alone.ply")[1:] == pytest.approx((6, 1))
    moved = [*CORNERS, *(TETRAHEDRON + 5).tolist()]
    restarted = [*STRIP, -1, *(8 + np.array([0, 2, 1]))]
    (tmp_path / "beside.ply").write_bytes(ply(moved, (FACES[1:] + 8).tolist(), kind, [restarted]))
    assert measures(tmp_path / "beside.ply")[1:] == pytest.approx((6 + 2.366, 1 + 1 / 6), rel=1e-3)


def test_quantised_places_are_fractions_of_their_type(tmp_path):
    places = np.round(TETRAHEDRON * 32767).astype("<i2")
    node = {
        "mesh": 0,
        "name": "here",
        "scale": [2, 2, 2],
        "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)],
    }
    (piece,) = pieces(
        glb(
            tmp_path / "a.glb",
            {"nodes": [node]},
            POSITION=places,
            indices=FACES.ravel().astype("<u2"),
        )
    )
    assert piece.names == ("here", "shape")
    turned = 2 * TETRAHEDRON[:, [1, 0, 2]] * [-1, 1, 1]  # a quarter turn about z
    np.testing.assert_allclose(piece.vertices, turned, atol=1e-9)
    # The same numbers in the text of the file, and a turn of zeros, which is none.
    text = base64.b64encode(
        places.tobytes() + bytes(-places.nbytes % 4) + FACES.astype("<u2").tobytes()
    ).decode()
    buffer = {"byteLength": 48, "uri": f"data:application/octet-stream;base64,{text}"}
    head = {"buffers": [buffer], "nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}
    (piece,) = pieces(
        glb(tmp_path / "b.glb", head, POSITION=places, indices=FACES.ravel().astype("<u2"))
    )
    np.testing.assert_allclose(piece.vertices, TETRAHEDRON, atol=1e-9)


def test_a_skin_s_joints_place_it_and_its_own_node_does_not(tmp_path):
    (piece,) = pieces(skinned(tmp_path / "a.glb"))
    np.testing.assert_allclose(
        piece.vertices, TETRAHEDRON + np.array([4, 0.75 * 8, 0.75 * -3]), atol=1e-6
    )


@pytest.mark.parametrize(
    ("mode", "order", "area"), [(5, STRIP, 6), (6, [0, 4, 6, 2], 1), (1, [0, 1], None)]
)
def test_strips_and_fans_are_surfaces_and_lines_are_not(mode, order, area, tmp_path):
    path = glb(
        tmp_path / "a.glb",
        {"surface": {"mode": mode}},
        POSITION=np.array(CORNERS, "<f4"),
        indices=np.array(order, "<u2"),
    )
    if area is None:
        assert pieces(path) == []
    else:
        assert measures(path)[1] == pytest.approx(area)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (
            {"extensionsRequired": ["EXT_meshopt_compression"]},
            "compressed by meshopt, .* without compression",
        ),
        (
            {"extensionsRequired": ["KHR_draco_mesh_compression"]},
            "compressed by Draco, .* without compression",
        ),
        (
            {"nodes": [{"mesh": 0, "children": [0]}], "scenes": [{"nodes": [0]}]},
            "hangs on two nodes",
        ),
        (
            {"buffers": [{"uri": "../../etc/passwd", "byteLength": 9}]},
            "its data lies in another file",
        ),
        ({"nodes": [{"mesh": -1}]}, "-1 is no whole number"),
    ],
)
def test_a_glb_that_cannot_be_shown_is_refused_by_its_reason(head, words, tmp_path):
    with pytest.raises(InputError, match=rf"a\.glb: .*{words}"):
        pieces(
            glb(
                tmp_path / "a.glb",
                head,
                POSITION=TETRAHEDRON.astype("<f4"),
                indices=FACES.ravel().astype("<u2"),
            )
        )


def test_every_instance_of_a_glb_is_placed_turned_and_scaled_in_its_node(tmp_path):
    shifts = np.array([[1, 0, 0], [0, 2, 0]], "<f4")
    turns = np.array([[0, 0, 0, 1], [0, 0, 1, 0]], "<f4")
    sizes = np.array([[1, 1, 1], [2, 2, 2]], "<f4")
    attributes = {"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}
    node = {
        "mesh": 0,
        "translation": [0, 0, 5],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}},
    }
    head = {"nodes": [node], "extensionsUsed": ["EXT_mesh_gpu_instancing"]}
    arrays = {"POSITION": TETRAHEDRON.astype("<f4"), "indices": FACES.ravel().astype("<u4")}
    found = pieces(glb(tmp_path / "a.glb", head, **arrays, shifts=shifts, turns=turns, sizes=sizes))
    np.testing.assert_allclose(found[0].vertices, TETRAHEDRON + np.array([1, 0, 5]))
    # Half a turn about z, and twice the size.
    np.testing.assert_allclose(
        found[1].vertices, TETRAHEDRON * [-2, -2, 2] + np.array([0, 2, 5]), atol=1e-6
    )
    assert len(found) == 2 and len({piece.names[0] for piece in found}) == 2
