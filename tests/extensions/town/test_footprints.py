"""Buildings as people tag and draw them.

Each is read as its tags say, or counted, or refused by its place.
"""

import json

import numpy as np
import pytest

from lowalt.__main__ import main
from lowalt.extensions.town import town, town_plan
from lowalt.extensions.town.building_tags import height_of, low_of, metres
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.footprints import middle_of
from lowalt.files.errors import InputError
from towns import BOXES, ORIGIN, SIDES, corners_of, mitsuba, ply

M = 1e-5
"""Degrees of about a metre."""


def ring(x, y, width, depth):
    """The closed outline of a rectangle whose corner stands at x, y, in steps of M."""
    corners = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth), (x, y)]
    return [[ORIGIN[0] + a * M, ORIGIN[1] + b * M] for a, b in corners]


def feature(tags, *rings):
    """A feature of one polygon for each ring."""
    geometry = {"type": "MultiPolygon", "coordinates": [[each] for each in rings]}
    return {"type": "Feature", "properties": tags, "geometry": geometry}


def write(path, features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def found_in(path, **settings):
    return read(town.DEFAULTS | {"buildings": str(path), "origin": ORIGIN} | settings)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (12, 12.0),
        (12.5, 12.5),
        ("12.5 m", 12.5),
        ("12m", 12.0),
        ("12,5", 12.5),
        ("~15", 15.0),
        ("40'", 12.192),
        ("40 ft", 12.192),
        ("40'6\"", 12.3444),
        ("5 ft 3 in", 1.6002),
        ("3 storeys", 9.0),
        ("10 Metres", 10.0),
        ("1,200", None),
        ("-1", None),
        ("12.5;13", None),
        ("tall", None),
        ("nan", None),
        ("1e3", None),
        (True, None),
        ("12 miles", None),
    ],
)
def test_a_height_is_read_in_the_units_that_people_write(text, expected):
    assert metres(text) == (None if expected is None else pytest.approx(expected, rel=1e-12))


def test_a_height_that_cannot_be_read_is_counted_and_the_next_tag_stands_for_it():
    assert height_of({"height": "-1", "building:levels": "2"}) == (6.0, ("-1",))
    assert height_of({"height": "0", "building:height": "7 m"}) == (7.0, ("0",))
    assert height_of({"height": "tall"}) == (None, ("tall",))
    assert low_of({"min_height": "0"}) == (0.0, ())
    assert low_of({"building:min_level": "2"}) == (6.0, ())
    assert low_of({"min_height": "high"}) == (None, ("high",))


def test_what_is_read_otherwise_than_stated_is_said(tmp_path):
    tags = [
        {"building": "yes", "height": "tall", "building:levels": 2},
        {"building": "yes", "height": 9, "min_height": "-3"},
        {"building": "yes", "height": 9, "building:material": "cheese"},
        {"building": "yes", "height": 9, "building:material": "brick"},
    ]
    squares = [ring(30 * k, 0, 10, 10) for k in range(4)]
    path = write(tmp_path / "town.geojson", list(map(feature, tags, squares)))
    found = found_in(path)
    assert found.facts["notes"] == {
        "heights that cannot be read, such as 'tall': building:levels or --height stands for "
        "them": 1,
        "least heights that cannot be read, such as '-3': the ground stands for them": 1,
        "surfaces of materials that no table has, such as 'cheese': concrete stands for them": 1,
    }
    assert set(found.facts["materials"]) == {"concrete", "brick"}
    assert (
        sum(line.startswith("read otherwise: 1 ") for line in town_plan.described(path, found)) == 3
    )


def test_parts_of_a_building_stand_in_the_place_of_its_outline(tmp_path):
    outline = feature({"building": "yes", "height": 368}, ring(0, 0, 60, 60))
    podium = feature({"building:part": "yes", "height": 12}, ring(0, 0, 30, 30))
    mast = feature({"building:part": "yes", "height": 368, "min_height": 12}, ring(35, 35, 5, 5))
    other = feature({"building": "yes", "height": 20}, ring(90, 0, 20, 20))
    found = found_in(write(tmp_path / "town.geojson", [outline, podium, mast, other]))
    assert found.facts["notes"] == {"outlines, in whose place their building:parts stand": 1}
    assert found.facts["buildings"] == 3
    corners = found.corners.reshape(-1, 3)
    tall = corners[corners[:, 2] > 30.0]
    assert np.ptp(tall[:, 1]) == pytest.approx(5 * 1.112, rel=0.01)
    assert {round(float(z)) for z in corners[:, 2]} == {0, 12, 20, 368}


def test_polygons_of_one_building_that_adjoin_are_one_outline(tmp_path):
    parts = [ring(0, 0, 10, 20), ring(10, 0, 10, 20), ring(0, 20, 20, 10)]
    adjoining = found_in(
        write(tmp_path / "parts.geojson", [feature({"building": "yes", "height": 9}, *parts)])
    )
    whole = found_in(
        write(
            tmp_path / "one.geojson",
            [feature({"building": "yes", "height": 9}, ring(0, 0, 20, 30))],
        )
    )
    for key in ("buildings", "walls", "roofs", "dropped", "notes"):
        assert adjoining.facts[key] == whole.facts[key]
    np.testing.assert_allclose(adjoining.facts["low_m"], whole.facts["low_m"], atol=2e-3)
    np.testing.assert_allclose(adjoining.facts["high_m"], whole.facts["high_m"], atol=2e-3)


def test_a_file_of_which_much_is_left_out_is_refused_unless_the_user_allows_it(tmp_path):
    good = [feature({"building": "yes", "height": 9}, ring(30 * k, 0, 10, 10)) for k in range(9)]
    crossed = ring(0, 40, 10, 10)
    crossed[1], crossed[2] = crossed[2], crossed[1]
    bow = feature({"building": "yes", "height": 9}, crossed)
    road = {"type": "Feature", "properties": {"highway": "service"}, "geometry": None}
    path = write(tmp_path / "town.geojson", [*good, bow, *[road] * 9])
    assert found_in(path).facts["dropped"] == {
        "footprints that cross themselves": 1,
        "features that are no buildings": 9,
    }
    path = write(tmp_path / "worse.geojson", [*good, bow, bow])
    with pytest.raises(
        InputError,
        match=r"2 of 11 buildings are left out \(2 footprints that cross themselves\).*--left-out",
    ):
        found_in(path)
    assert found_in(path, left_out=0.2).facts["buildings"] == 9


def test_polygons_of_a_file_without_tags_are_buildings_where_their_height_is_given(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    plain = [feature({"name": "a"}, ring(30 * k, 0, 10, 10)) for k in range(5)]
    path = write(tmp_path / "plain.geojson", plain)
    assert main(f"scene inspect {path} --height 8".split()) == 0
    said = capsys.readouterr().out
    assert "5 buildings" in said and "up to 8.0 m high" in said
    assert "read otherwise: 5 polygons without a tag of buildings" in said
    assert main(["scene", "inspect", str(path)]) == 2
    assert "or --height" in capsys.readouterr().err
    # Beside buildings, a polygon without a tag is a park or a pond.
    mixed = write(
        tmp_path / "mixed.geojson", [*plain, feature({"building": "yes"}, ring(0, 40, 9, 9))]
    )
    facts = found_in(mixed, height_m=8.0).facts
    assert (
        facts["buildings"] == 1
        and facts["dropped"] == {"features that are no buildings": 5}
        and not facts["notes"]
    )


def test_a_building_without_a_height_is_named_by_its_place_in_the_file(tmp_path):
    low = feature({"building": "yes", "height": 9}, ring(0, 0, 9, 9))
    unknown = feature({"building": "yes"}, ring(30, 0, 9, 9))
    path = write(tmp_path / "town.geojson", [low, unknown | {"id": "way/17"}])
    with pytest.raises(
        InputError, match=r"1 of 2 buildings .* the first is features\[1\] \(way/17\); expected"
    ):
        found_in(path)


def test_a_material_that_no_table_has_is_named_in_a_mesh_and_in_a_mitsuba_scene(tmp_path):
    path = mitsuba(tmp_path / "scene.xml", BOXES)
    assert not read(town.DEFAULTS | {"buildings": str(path)}).facts["notes"]
    text = path.read_text()
    path.write_text(
        text.replace("mat-itu_brick", "itu_regolith").replace('value="brick"', 'value="regolith"')
    )
    count = "surfaces of materials that no table has, such as 'regolith': concrete stands for them"
    assert read(town.DEFAULTS | {"buildings": str(path)}).facts["notes"] == {count: len(BOXES)}
    inner = '<bsdf type="itu-radio-material"><string name="type" value="glass"/></bsdf>'
    path.write_text(text.replace('<ref id="mat-itu_brick" name="bsdf"/>', inner))
    assert set(read(town.DEFAULTS | {"buildings": str(path)}).facts["materials"]) == {"glass"}
    vertices = ["v {} {} {}".format(*corner) for corner in corners_of(*BOXES[0])]
    faces = ["f " + " ".join(str(corner + 1) for corner in side) for side in SIDES]
    mesh = tmp_path / "town.obj"
    mesh.write_text("\n".join([*vertices, "usemtl Material.003", *faces, ""]))
    (note,) = read(town.DEFAULTS | {"buildings": str(mesh)}).facts["notes"]
    assert "'Material.003'" in note
    assert not read(town.DEFAULTS | {"buildings": str(ply(tmp_path / "town.ply", BOXES))}).facts[
        "notes"
    ]


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (7, r"features\[0\] is no object"),
        ({"properties": [1], "geometry": None}, r"features\[0\]: `properties` is no object"),
        (
            {"properties": {"building": "yes"}, "geometry": "Polygon"},
            r"features\[0\]: `geometry` is no object",
        ),
        (
            {
                "properties": {"building": "yes"},
                "geometry": {"type": "Polygon", "coordinates": "abc"},
            },
            r"features\[0\]: its geometry cannot be read",
        ),
        (
            {
                "properties": {"building": "yes"},
                "geometry": {"type": "Polygon", "coordinates": [[[1, 1], [2, 2]]]},
            },
            r"features\[0\]: its geometry cannot be read",
        ),
        (
            {
                "properties": {"building": "yes"},
                "geometry": {"type": "Polygon", "coordinates": None},
            },
            "has no building",
        ),
    ],
)
def test_a_damaged_file_is_refused_in_one_sentence_also_where_its_middle_is_asked(
    tmp_path, broken, message
):
    path = write(tmp_path / "town.geojson", [broken])
    with pytest.raises(InputError, match=rf"town.geojson: {message}"):
        middle_of(path, None)
