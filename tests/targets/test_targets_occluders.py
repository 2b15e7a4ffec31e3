"""Opaque surfaces of targets, and the files of them.

These are divided triangles, pieces cut away, and capsules along bones.
"""

import json

import numpy as np
import pytest

from builtin_records import RECORDS
from lowalt.files.errors import InputError
from lowalt.targets import occluders
from lowalt.targets.builtin import MODULES
from lowalt.targets.skeleton import NODES, PARENTS
from lowalt.targets.surfaces import Surface, hull, longest_edge, quartered
from tables import rows


def areas(corners):
    """Areas (F,) of triangles (F, 3, 3)."""
    return (
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        / 2
    )


def test_a_quartered_triangle_is_four_like_it_of_half_its_size_and_together_it():
    corners = np.random.default_rng(1).normal(size=(5, 3, 3))
    pieces = quartered(corners).reshape(4, 5, 3, 3)
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    for place, piece in enumerate(pieces):
        np.testing.assert_allclose(longest_edge(piece), longest / 2)
        np.testing.assert_allclose(areas(piece), areas(corners) / 4)
        # Three keep a corner, the fourth lies in the middle.
        kept = (
            piece[:, place] == corners[:, place]
            if place < 3
            else abs((piece - corners).mean(axis=1)) < 1e-15
        )
        assert kept.all()


def test_a_cut_takes_the_area_inside_it_to_a_triangle_s_size():
    square = Surface(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    sharp = hull([(0.25, 0.25, -0.5, 0.5), (0.75, 0.25, -0.5, 0.5)], 200.0).moved([0.5, 0, 0])
    left = occluders.cut_away(square, (sharp,))
    corners = left.vertices[left.faces]
    assert areas(corners).sum() == pytest.approx(0.75, abs=0.02)
    inner = corners.mean(1)
    assert (
        not (abs(inner[:, :2] - 0.5) < 0.22).all(1).any()
        and (abs(inner[:, :2] - 0.5) < 0.28).all(1).any()
    )


def test_every_bone_of_a_person_has_a_capsule_that_grows_with_the_stature():
    found = occluders.from_bones(1.756)
    assert [tuple(pair) for pair in found["bones"]] == [
        (PARENTS[node], node) for node in range(1, len(NODES))
    ]
    radius = dict(zip(NODES[1:], found["radius_m"], strict=True))
    assert (radius["lfemur"], radius["rfemur"], radius["head"], radius["rthumb"]) == (
        0.09,
        0.09,
        0.09,
        0.015,
    )
    np.testing.assert_allclose(occluders.from_bones(3.512)["radius_m"], 2 * found["radius_m"])
    assert not found["closed"].any() and not found["offset_m"].any() and not len(found["faces"])


def test_a_craft_s_surfaces_move_with_their_parts_and_come_back_from_a_file(tmp_path):
    record = RECORDS["DJI Mini 2"]
    parts = MODULES["UAV"].parts(record)[0]
    settings = {"seed": 1, "record": record}
    out = tmp_path / "mini.npz"
    occluders.main(["--settings", json.dumps(settings), "--out", str(out)])
    found = occluders.read_all([out])["DJI Mini 2"]
    made = occluders.make(record, None, 1)
    assert all((found[name] == made[name]).all() for name in occluders.ARRAYS)
    assert (
        found["vertex_part"][found["faces"]] == found["vertex_part"][found["faces"][:, :1]]
    ).all()
    assert sorted(set(found["vertex_part"].tolist())) == list(range(len(parts)))
    assert len(found["offset_m"]) == record["points"] and len(set(found["offset_m"].tolist())) == 1
    assert found["offset_m"][0] == pytest.approx(1e-9 * np.ptp(found["vertices"], axis=0).max())
    out.write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"mini\.npz: not a surfaces file"):
        occluders.read(out)


@pytest.mark.parametrize(
    ("change", "words"),
    rows("occluders", "records"),
)
def test_a_target_without_surfaces_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        occluders.make(RECORDS["DJI Mini 2"] | change, None, 1)
