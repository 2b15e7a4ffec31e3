"""Mesh files are read as viewers show them: indices, polygons, stated units."""

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import pieces, read_mesh, stated_unit_m
from shown_meshes import FACES, TETRAHEDRON, dae, measures, prism
from tables import rows


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
    rows("units", "comments"),
)
def test_a_unit_in_an_obj_s_comment_counts(comment, metres, tmp_path):
    (tmp_path / "a.obj").write_text(comment + "\nv 0 0 0\n")
    assert stated_unit_m(tmp_path / "a.obj") == metres


@pytest.mark.parametrize("kind", ["obj", "dae"])
def test_a_polygon_with_a_dent_covers_its_own_area(kind, tmp_path):
    vertices, faces = prism()
    path = tmp_path / f"a.{kind}"
    if kind == "obj":
        rows = [f"v {x} {y} {z}" for x, y, z in vertices]
        path.write_text(
            "\n".join(rows + ["f " + " ".join(str(i + 1) for i in face) for face in faces]) + "\n"
        )
    else:
        path.write_text(dae(vertices, faces))
    extent, area, volume = measures(path)
    assert extent == pytest.approx([2, 2, 0.1])
    assert (area, volume) == pytest.approx((2 * 0.76 + 8 * 0.1, 0.076), rel=1e-6)
    assert len(read_mesh(path, "in" if kind == "dae" else "m").faces) == 20


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


def test_a_collada_surface_whose_texture_is_missing_is_kept(tmp_path):
    surface = (
        '<newparam sid="s"><surface type="2D"><init_from>gone</init_from></surface></newparam>'
    )
    more = (
        "<library_effects><effect"
        f' id="e"><profile_COMMON>{surface}</profile_COMMON></effect></library_effects>'
    )
    more += (
        '<library_materials><material id="m"><instance_effect'
        ' url="#e"/></material></library_materials>'
    )
    bound = (
        '<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="M"'
        ' target="#m"/>'
    )
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
