"""Mesh files are read as viewers show them: indices, polygons, strips, quantised and skinned
surfaces, stated units.
"""

import base64
from pathlib import Path

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import pieces, read_mesh, stated_unit_m
from real_inputs import FOLDER
from shown_meshes import CORNERS, FACES, STRIP, TETRAHEDRON, dae, glb, ply, prism, skinned

FAULTS = FOLDER / "faults" / "meshes"


def measures(path: Path) -> tuple[np.ndarray, float, float]:
    """Extents (3,), area and enclosed volume of all pieces of a file, in the file's unit."""
    corners = np.concatenate([piece.vertices[piece.faces] for piece in pieces(path)])
    a, b, c = np.moveaxis(corners, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return np.ptp(corners.reshape(-1, 3), axis=0), area, float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.skipif(not FAULTS.is_dir(), reason=f"no real inputs: {FOLDER} lacks faults/")
@pytest.mark.parametrize(
    ("name", "extent", "area", "volume", "unit"),
    [
        ("neg.obj", [11, 1, 1], 2 * 2.366, 2 / 6, None),
        ("pos.obj", [11, 1, 1], 2 * 2.366, 2 / 6, None),
        ("quant.glb", [1, 1, 1], 2.366, 1 / 6, 1.0),
        ("skin.glb", [2, 2, 2], 4 * 2.366, 8 / 6, 1.0),
        ("concave.obj", [2, 2, 0.1], 2.32, 0.076, None),
        ("strip.ply", [1, 1, 1], 6, 1, None),
        ("mixed.ply", [1, 1, 1], 6 + 2.366, 1 + 1 / 6, None),
        ("box.dae", [100, 100, 20], 28000, 2e5, None),
        ("comment.dae", [100, 100, 20], 28000, 2e5, None),
        ("comment2.dae", [100, 100, 20], 28000, 2e5, 0.0254),
    ],
)
def test_small_files_made_for_readers_are_read_as_a_viewer_shows_them(
    name, extent, area, volume, unit
):
    found = measures(FAULTS / name)
    assert found[0] == pytest.approx(extent, rel=1e-4) and found[1:] == pytest.approx(
        (area, volume), rel=1e-3
    )
    assert stated_unit_m(FAULTS / name) == unit


def test_negative_indices_count_back_from_the_vertices_so_far(tmp_path):
    text = ""
    for name, shift in (("one", 0), ("two", 10)):
        text += f"o {name}\n" + "".join(f"v {x + shift} {y} {z}\n" for x, y, z in TETRAHEDRON)
        text += "".join(
            "f " + " ".join(f"{corner - 4}//1" for corner in face) + "\n" for face in FACES
        )
    (tmp_path / "a.obj").write_text("\ufeff" + text.replace("f -4 ", "f \\\n-4 ", 1))
    first, second = pieces(tmp_path / "a.obj")
    assert (first.names, second.names) == (("one",), ("two",))
    np.testing.assert_array_equal(first.vertices + np.array([10, 0, 0]), second.vertices)


@pytest.mark.parametrize("line", ["f 1 2 9", "f 1 2 -9", "f 0 1 2", "v 1 x 2", "f 1 2 1e5"])
def test_an_obj_with_a_corner_that_is_no_vertex_or_no_number_is_refused(line, tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + line + "\n")
    with pytest.raises(
        InputError, match=r"a\.obj: (line 4: |a face has a corner that is none of the 3 vertices)"
    ):
        pieces(tmp_path / "a.obj")


@pytest.mark.parametrize(
    ("comment", "metres"),
    [
        ("# File units = inches", 0.0254),
        ("# Units: mm", 0.001),
        ("# unit 1 foot", 0.3048),
        ("#units in metres", 1.0),
        ("# Unit: in", 0.0254),
        ("# the unit of all this is love", None),
        ("o unit: mm", None),
    ],
)
def test_a_unit_in_an_obj_s_comment_counts(comment, metres, tmp_path):
    (tmp_path / "a.obj").write_text(comment + "\nv 0 0 0\n")
    assert stated_unit_m(tmp_path / "a.obj") == metres


@pytest.mark.parametrize("kind", ["obj", "dae", "ascii", "little", "big"])
def test_a_polygon_with_a_dent_covers_its_own_area_in_every_format(kind, tmp_path):
    vertices, faces = prism()
    path = tmp_path / f"a.{kind if kind in ('obj', 'dae') else 'ply'}"
    if kind == "obj":
        rows = [f"v {x} {y} {z}" for x, y, z in vertices]
        path.write_text(
            "\n".join(rows + ["f " + " ".join(str(i + 1) for i in face) for face in faces]) + "\n"
        )
    else:
        path.write_bytes(
            dae(vertices, faces).encode() if kind == "dae" else ply(vertices, faces, kind)
        )
    extent, area, volume = measures(path)
    assert extent == pytest.approx([2, 2, 0.1])
    assert (area, volume) == pytest.approx((2 * 0.76 + 8 * 0.1, 0.076), rel=1e-6)
    assert len(read_mesh(path, "in" if kind == "dae" else "m").faces) == 20


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


def test_a_collada_file_states_its_unit_outside_comments_and_has_no_entities_or_skins(tmp_path):
    path = tmp_path / "a.dae"
    path.write_text(dae(*prism()))
    assert stated_unit_m(path) == 0.0254
    path.write_text(dae(*prism(), more='<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>'))
    with pytest.raises(InputError, match=r"a\.dae: not a readable XML file .*document type"):
        pieces(path)
    nameless = (
        dae(*prism())
        .replace("<instance_geometry", "<node><instance_geometry")
        .replace("</node>", "</node></node>")
    )
    path.write_text(nameless.replace('id="n"', 'id="n" name="hull"'))
    (piece,) = pieces(path)
    assert {"n", "hull"} <= set(piece.names)  # those of the nearest node above that has a name
    path.write_text(dae(*prism()).replace("instance_geometry", "instance_controller"))
    with pytest.raises(InputError, match=r"a\.dae: has a skin or morph .*apply it"):
        pieces(path)


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


def test_a_collada_surface_whose_texture_is_missing_is_kept(tmp_path):
    surface = (
        '<newparam sid="s"><surface type="2D"><init_from>gone</init_from></surface></newparam>'
    )
    more = f'<library_effects><effect id="e"><profile_COMMON>{surface}</profile_COMMON></effect></library_effects>'
    more += '<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>'
    bound = '<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="M" target="#m"/>'
    text = dae(*prism()).replace("<library_geometries>", f"{more}<library_geometries>")
    text = text.replace("<polylist ", '<polylist material="M" ')
    text = text.replace(
        '<instance_geometry url="#g"/>',
        f"{bound}</technique_common></bind_material></instance_geometry>",
    )
    (tmp_path / "plain.dae").write_text(dae(*prism()))
    (tmp_path / "bound.dae").write_text(text)
    plain, found = (pieces(tmp_path / f"{name}.dae") for name in ("plain", "bound"))
    assert [len(piece.faces) for piece in found] == [len(piece.faces) for piece in plain] == [20]
