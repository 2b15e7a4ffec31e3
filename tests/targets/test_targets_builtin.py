"""The built-in models: published sizes, exact counts, closed surfaces, and parts that turn the right way."""

import hashlib
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from builtin_records import BIRDS, CARS, NAMES, RECORDS, TABLE, UAVS, WRITTEN
from lowalt.files.atomic import slug
from lowalt.files.yaml_files import load_yaml
from lowalt.targets import bird
from lowalt.targets.assemble import turn
from lowalt.targets.builtin import MODULES, builtin_cloud
from lowalt.targets.cloud import check, write
from lowalt.targets.surfaces import inside

REFERENCE = Path(__file__).parents[2] / "results/reference/default.sha256"
SEED = load_yaml("config/default.yaml")["seed"]


@pytest.fixture(scope="module")
def clouds():
    """All thirty clouds of the default's seed, by name."""
    return {name: builtin_cloud(RECORDS[name], SEED) for name in NAMES}


def rotated(cloud, part, angle):
    """The points of one part turned by `angle` about its hinge, by scipy."""
    points = cloud.points[cloud.part == part] - cloud.hinges[part]
    return Rotation.from_rotvec(angle * cloud.axes[part]).apply(points) + cloud.hinges[part]


def test_every_published_craft_bird_and_car_has_a_record():
    assert list(WRITTEN) == NAMES and len(NAMES) == 30


@pytest.mark.parametrize("name", NAMES)
def test_counts_are_the_published_ones_and_the_cloud_keeps_the_contract(clouds, name):
    cloud = check(clouds[name], name)
    assert len(cloud.points) == TABLE[name]["points_in_published_cloud_approx"]
    assert (
        cloud.record["checksum"]
        == hashlib.sha256(json.dumps(RECORDS[name], sort_keys=True, separators=(",", ":")).encode()).hexdigest()
    )
    assert set(np.unique(cloud.part)) == set(range(len(cloud.kinds)))
    assert (cloud.rcs_m2 == 1).all()
    for part, count in enumerate(np.bincount(cloud.part)):
        assert cloud.record["points_by_part"][cloud.names[part]] == count


@pytest.mark.parametrize("name", UAVS)
def test_craft_have_their_published_size(clouds, name):
    cloud, size = clouds[name], TABLE[name]["size_m"]
    rotors = cloud.parts_of("rotor")
    places = cloud.hinges[rotors]
    across = np.linalg.norm(places[:, None] - places[None], axis=2).max()
    meaning = cloud.record["size_is"]
    if meaning == "body diagonal":
        assert across == pytest.approx(RECORDS[name]["figures"]["motor_diagonal"]["si"], rel=1e-12)
    elif meaning == "span over rotors":
        reach = [np.linalg.norm(cloud.points[cloud.part == p] - cloud.hinges[p], axis=1).max() for p in rotors]
        assert across + 2 * max(reach) == pytest.approx(size, rel=0.02)
    else:
        plan = cloud.points[:, :2]
        diagonal = max(np.ptp(plan @ [1, 1]), np.ptp(plan @ [1, -1])) / np.sqrt(2)
        assert diagonal == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("name", BIRDS)
def test_birds_have_their_published_length_and_their_species_span(clouds, name):
    cloud, figure = clouds[name], WRITTEN[name]["figures"]
    width, length, _ = np.ptp(cloud.points, axis=0)
    body = np.ptp(cloud.points[cloud.part == 0], axis=0)[1]
    assert body == pytest.approx(TABLE[name]["size_m"], rel=0.02) and length < 1.25 * body
    assert width / body == pytest.approx(figure["span"][0] / figure["length"][0], rel=0.02)


@pytest.mark.parametrize("name", CARS)
def test_cars_have_their_published_sizes_and_stand_on_the_ground(clouds, name):
    cloud, row = clouds[name], TABLE[name]
    np.testing.assert_allclose(np.ptp(cloud.points, axis=0), [row["wid_m"], row["len_m"], row["hgt_m"]], rtol=0.02)
    figure = RECORDS[name]["figures"]
    wheels = cloud.parts_of("wheel")
    assert len(wheels) == 4
    axle = cloud.hinges[cloud.names.index("front left wheel"), 1]
    assert row["len_m"] / 2 - axle == pytest.approx(figure["front_overhang"]["si"])
    base = np.ptp(cloud.hinges[wheels, 1])
    assert base == pytest.approx(figure["wheel_base"]["si"], rel=1e-12)
    assert np.ptp(cloud.hinges[wheels, 0]) == pytest.approx(figure["track"]["si"], rel=0.02)
    for wheel in wheels:
        points = cloud.points[cloud.part == wheel]
        assert points[:, 2].min() == pytest.approx(-cloud.record["origin_height_m"], abs=1e-5)
        away = np.linalg.norm((points - cloud.hinges[wheel])[:, 1:], axis=1)
        assert 2 * away.max() == pytest.approx(row["wheel_diam_m"], rel=1e-5)
    assert cloud.record["wheel_diameter_m"] == row["wheel_diam_m"]


@pytest.mark.parametrize("name", NAMES)
def test_models_are_closed_surfaces(name):
    parts, _ = MODULES[RECORDS[name]["category"]].parts(RECORDS[name])
    for name_of, shell in ((part.name, shell) for part in parts for shell in part.shells):
        mesh = trimesh.Trimesh(shell.vertices, shell.faces, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, name_of


@pytest.mark.parametrize("name", NAMES)
def test_points_lie_on_the_outer_skin_and_normals_point_out(clouds, name):
    cloud = clouds[name]
    parts, _ = MODULES[cloud.category].parts(RECORDS[name])
    step = 1e-8 * np.ptp(cloud.points)
    for index, part in enumerate(parts):
        # Of equal copies the first lies on the shells as modelled.
        mine = np.flatnonzero(cloud.part == index)[: (cloud.part == index).sum() // part.copies]
        points, normals = cloud.points[mine], cloud.normals[mine]
        behind = np.zeros(len(mine), bool)
        for shell in part.shells:
            assert not inside(shell, points + step * normals).any()
            behind |= inside(shell, points - step * normals)
        assert behind.all()


@pytest.mark.parametrize("name", UAVS)
def test_neighbouring_rotors_turn_against_each_other_and_clear_each_other(clouds, name):
    cloud = clouds[name]
    rotors = cloud.parts_of("rotor")
    assert len(rotors) == TABLE[name]["n_rotors_or_wings"]
    around = sorted(rotors, key=lambda part: np.arctan2(cloud.hinges[part, 1], cloud.hinges[part, 0]))
    diameter = RECORDS[name]["figures"]["propeller_diameter"]["si"]
    for part, following in zip(around, [*around[1:], around[0]], strict=True):
        assert cloud.axes[part] @ cloud.axes[following] == -1
        assert np.linalg.norm(cloud.hinges[part] - cloud.hinges[following]) > diameter
        away = np.linalg.norm((cloud.points[cloud.part == part] - cloud.hinges[part])[:, :2], axis=1)
        assert 2 * away.max() == pytest.approx(diameter, rel=0.02)


@pytest.mark.parametrize("name", UAVS)
def test_blades_are_equal_and_lead_with_their_raised_edge(clouds, name):
    cloud = clouds[name]
    blades = RECORDS[name]["figures"]["blade_count"]["value"]
    parts, _ = MODULES["UAV"].parts(RECORDS[name])
    for part in cloud.parts_of("rotor"):
        points = cloud.points[cloud.part == part]
        turned = rotated(cloud, part, 2 * np.pi / blades)
        gaps = np.linalg.norm(points[:, None] - turned[None], axis=2).min(1)
        assert gaps.max() < 1e-12
        # Where the blade moves to, its surface is higher than where it comes from: the rotor lifts.
        vertices = parts[part].shells[0].vertices - cloud.hinges[part]
        out = vertices[np.argmax(np.linalg.norm(vertices, axis=1))]
        ahead = np.cross(cloud.axes[part], out)
        slope = np.cov(vertices @ ahead, vertices[:, 2])[0, 1]
        assert slope > 0


@pytest.mark.parametrize("name", BIRDS)
def test_a_positive_angle_raises_both_wing_tips(clouds, name):
    cloud = clouds[name]
    wings = cloud.parts_of("wing")
    assert [cloud.kinds[p] for p in range(5)] == ["body", "wing", "wing", "wing", "wing"]
    for inner, outer in zip(wings[::2], wings[1::2], strict=True):
        assert cloud.parents[inner] == -1 and cloud.parents[outer] == inner
        tip = np.argmax(abs(cloud.points[cloud.part == outer][:, 0]))
        rest = cloud.points[cloud.part == outer][tip]
        assert rotated(cloud, outer, 0.2)[tip, 2] > rest[2]
        side = np.argmax(abs(cloud.points[cloud.part == inner][:, 0]))
        assert rotated(cloud, inner, 0.2)[side, 2] > cloud.points[cloud.part == inner][side, 2]
        # The segments meet at the second hinge, and the first is nearer the body.
        reach = abs(cloud.points[cloud.part == inner][:, 0]).max()
        assert reach == pytest.approx(abs(cloud.hinges[outer, 0]), rel=1e-3)
        assert abs(cloud.hinges[inner, 0]) < abs(cloud.hinges[outer, 0])
    left, right = (cloud.points[cloud.part == p][:, 0] for p in (wings[3], wings[1]))
    assert left.max() < 0 < right.min()
    assert cloud.record["flap"] == bird.FLAP | WRITTEN[name]["flap"]


@pytest.mark.parametrize("name", CARS)
def test_a_positive_angle_rolls_the_car_forward(clouds, name):
    cloud = clouds[name]
    radius = cloud.record["wheel_diameter_m"] / 2
    for wheel in cloud.parts_of("wheel"):
        contact = cloud.hinges[wheel] - [0, 0, radius]
        angle = 1e-6
        moved = turn(cloud.axes[wheel], angle) @ (contact - cloud.hinges[wheel]) + cloud.hinges[wheel]
        # Rolling forward by radius * angle, the point on the ground stands still.
        assert moved[1] - contact[1] + radius * angle == pytest.approx(0, abs=1e-12)


def test_names_and_hinges_are_where_they_belong(clouds):
    for name in CARS:
        cloud = clouds[name]
        for wheel in cloud.parts_of("wheel"):
            end, side, _ = cloud.names[wheel].split()
            assert (cloud.hinges[wheel, 1] > 0) == (end == "front")
            assert (cloud.hinges[wheel, 0] > 0) == (side == "right")
    for name in BIRDS:
        cloud = clouds[name]
        assert all((cloud.hinges[p, 0] > 0) == cloud.names[p].startswith("right") for p in cloud.parts_of("wing"))


def test_equal_seeds_give_equal_bytes_and_other_seeds_other_points(tmp_path, clouds):
    for name in ("DJI Avata", "Owl", "NIO ET5T 2023"):
        write(tmp_path / "first.npz", clouds[name])
        write(tmp_path / "again.npz", builtin_cloud(RECORDS[name], SEED))
        assert (tmp_path / "first.npz").read_bytes() == (tmp_path / "again.npz").read_bytes()
        assert not np.array_equal(builtin_cloud(RECORDS[name], 2).points, clouds[name].points)


def test_clouds_are_the_default_s_to_the_byte(tmp_path, clouds):
    """Each length, angle and count of a built-in model, and each draw, is that of the kept run."""
    kept = dict(line.split()[::-1] for line in REFERENCE.read_text().splitlines())
    for name, cloud in clouds.items():
        write(tmp_path / "cloud.npz", cloud)
        found = hashlib.sha256((tmp_path / "cloud.npz").read_bytes()).hexdigest()
        assert found == kept[f"clouds/{slug(name)}.npz"], name


def test_subtypes_differ_physically():
    def signature(name):
        figures = {figure: entry["si"] for figure, entry in RECORDS[name]["figures"].items()}
        table = {key: TABLE[name][key] for key in ("size_m", "n_rotors_or_wings", "len_m", "wid_m", "hgt_m")}
        return RECORDS[name]["model"], *sorted((figures | table).items())

    for first, second in itertools.combinations(NAMES, 2):
        if TABLE[first]["category"] == TABLE[second]["category"]:
            differing = set(signature(first)) ^ set(signature(second))
            assert len(differing) >= 8, (first, second)


def test_every_figure_has_a_source_or_the_mark_estimate():
    for record in RECORDS.values():
        sources = {entry["source"] for entry in record["figures"].values()} - {"estimate"}
        assert all(len(record["sources"][source]) > 12 for source in sources)
