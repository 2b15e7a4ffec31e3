"""The built-in models: published sizes, exact counts and closed surfaces.

Parts turn the right way.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from builtin_records import BIRDS, CARS, NAMES, RECORDS, TABLE, UAVS, WRITTEN
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.targets import bird
from lowalt.targets.__main__ import main as command
from lowalt.targets.assemble import allot, turn
from lowalt.targets.builtin import MODULES, builtin_cloud
from lowalt.targets.cloud import check, read, write
from lowalt.targets.gallery import main as gallery
from lowalt.targets.make import make
from lowalt.targets.records import merge, read_records
from lowalt.targets.surfaces import inside
from options import words

ROOT = Path(__file__).parents[2]
SEED = load_yaml("config/default.yaml")["seed"]


@pytest.fixture(scope="module")
def clouds():
    """All thirty clouds of the default's seed, by name."""
    return {name: builtin_cloud(RECORDS[name], SEED) for name in NAMES}


def rotated(cloud, part, angle):
    """The points of one part turned by `angle` about its hinge, by scipy."""
    points = cloud.points[cloud.part == part] - cloud.hinges[part]
    return Rotation.from_rotvec(angle * cloud.axes[part]).apply(points) + cloud.hinges[part]


def variant(name, **changes):
    """The cloud of a record with some keys changed as a user's file would."""
    return builtin_cloud(merge(TABLE[name], WRITTEN[name] | changes, name), 1)


@pytest.mark.parametrize("name", NAMES)
def test_counts_are_the_published_ones_and_moving_parts_get_their_share_in_whole_blades(
    clouds, name
):
    cloud = check(clouds[name], name)
    record = RECORDS[name]
    counts = np.bincount(cloud.part)
    assert len(cloud.points) == TABLE[name]["points_in_published_cloud_approx"]
    assert cloud.record["points_by_part"] == dict(zip(cloud.names, counts, strict=True))
    parts, _ = MODULES[record["category"]].parts(record)
    blades = sum(part.copies for part in parts if part.kind != "body")
    assert abs(counts[1:].sum() - record["moving_share"] * record["points"]) <= blades / 2 + 4
    assert all(
        count % part.copies == 0 and count >= part.copies
        for part, count in zip(parts, counts, strict=True)
    )


def test_any_count_that_leaves_the_body_a_point_is_met():
    parts, _ = MODULES["UAV"].parts(RECORDS["DJI Mini 2"])
    assert allot(parts, 9, 0.4, "mini") == [1, 2, 2, 2, 2]
    assert [len(variant("Wild goose", points=points).points) for points in (20, 1000)] == [20, 1000]


@pytest.mark.parametrize("name", UAVS)
def test_craft_have_their_published_size(clouds, name):
    cloud = clouds[name]
    size = TABLE[name]["size_m"]
    rotors = cloud.parts_of("rotor")
    places = cloud.hinges[rotors]
    across = np.linalg.norm(places[:, None] - places[None], axis=2).max()
    meaning = cloud.record["size_is"]
    if meaning == "body diagonal":
        assert across == pytest.approx(RECORDS[name]["figures"]["motor_diagonal"]["si"], rel=1e-12)
    elif meaning == "span over rotors":
        reach = [
            np.linalg.norm(cloud.points[cloud.part == p] - cloud.hinges[p], axis=1).max()
            for p in rotors
        ]
        assert across + 2 * max(reach) == pytest.approx(size, rel=0.02)
    else:
        plan = cloud.points[:, :2]
        diagonal = max(np.ptp(plan @ [1, 1]), np.ptp(plan @ [1, -1])) / np.sqrt(2)
        assert diagonal == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("name", BIRDS)
def test_birds_have_their_published_length_and_their_species_span(clouds, name):
    cloud = clouds[name]
    figure = WRITTEN[name]["figures"]
    width, length, _ = np.ptp(cloud.points, axis=0)
    body = np.ptp(cloud.points[cloud.part == 0], axis=0)[1]
    assert body == pytest.approx(TABLE[name]["size_m"], rel=0.02) and length < 1.25 * body
    assert width / body == pytest.approx(figure["span"][0] / figure["length"][0], rel=0.02)


@pytest.mark.parametrize("name", CARS)
def test_cars_have_their_published_sizes_and_stand_on_the_ground(clouds, name):
    cloud = clouds[name]
    row = TABLE[name]
    np.testing.assert_allclose(
        np.ptp(cloud.points, axis=0), [row["wid_m"], row["len_m"], row["hgt_m"]], rtol=0.02
    )
    figure = RECORDS[name]["figures"]
    wheels = cloud.parts_of("wheel")
    assert len(wheels) == 4
    axle = cloud.hinges[cloud.names.index("front left wheel"), 1]
    assert row["len_m"] / 2 - axle == pytest.approx(figure["front_overhang"]["si"])
    base = np.ptp(cloud.hinges[wheels, 1])
    assert base == pytest.approx(figure["wheel_base"]["si"], rel=1e-12)
    assert np.ptp(cloud.hinges[wheels, 0]) == pytest.approx(figure["track"]["si"], rel=0.02)
    for wheel in wheels:
        end, side, _ = cloud.names[wheel].split()
        assert ((cloud.hinges[wheel, 1] > 0) == (end == "front")) and (
            (cloud.hinges[wheel, 0] > 0) == (side == "right")
        )
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
        points = cloud.points[mine]
        normals = cloud.normals[mine]
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
    around = sorted(
        rotors, key=lambda part: np.arctan2(cloud.hinges[part, 1], cloud.hinges[part, 0])
    )
    diameter = RECORDS[name]["figures"]["propeller_diameter"]["si"]
    for part, following in zip(around, [*around[1:], around[0]], strict=True):
        assert cloud.axes[part] @ cloud.axes[following] == -1
        assert np.linalg.norm(cloud.hinges[part] - cloud.hinges[following]) > diameter
        away = np.linalg.norm(
            (cloud.points[cloud.part == part] - cloud.hinges[part])[:, :2], axis=1
        )
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
        for part in (inner, outer):
            rest = cloud.points[cloud.part == part]
            tip = np.argmax(abs(rest[:, 0]))
            assert rotated(cloud, part, 0.2)[tip, 2] > rest[tip, 2]
        # The segments meet at the second hinge, and the first is nearer the body.
        reach = abs(cloud.points[cloud.part == inner][:, 0]).max()
        assert reach == pytest.approx(abs(cloud.hinges[outer, 0]), rel=1e-3)
        assert abs(cloud.hinges[inner, 0]) < abs(cloud.hinges[outer, 0])
        assert cloud.names[inner].startswith(
            "right" if cloud.points[cloud.part == outer][:, 0].min() > 0 else "left"
        )
    assert cloud.record["flap"] == bird.FLAP | WRITTEN[name]["flap"]


@pytest.mark.parametrize("name", CARS)
def test_a_positive_angle_rolls_the_car_forward(clouds, name):
    cloud = clouds[name]
    radius = cloud.record["wheel_diameter_m"] / 2
    for wheel in cloud.parts_of("wheel"):
        contact = cloud.hinges[wheel] - [0, 0, radius]
        angle = 1e-6
        moved = (
            turn(cloud.axes[wheel], angle) @ (contact - cloud.hinges[wheel]) + cloud.hinges[wheel]
        )
        # Rolling forward by radius * angle, the point on the ground stands still.
        assert moved[1] - contact[1] + radius * angle == pytest.approx(0, abs=1e-12)


def test_clouds_are_the_default_s_to_the_byte_and_another_seed_gives_others(tmp_path, clouds):
    """Each length, angle, count, time and draw of a built-in model or gait is that of the kept run."""
    kept = dict(
        line.split()[::-1]
        for line in (ROOT / "results/reference/default.sha256").read_text().splitlines()
    )
    people = read_records(ROOT / "config/targets/pedestrian.yaml")
    walkers = {
        name: make(merge(TABLE[name], record, name), None, SEED) for name, record in people.items()
    }
    for name, cloud in {**clouds, **walkers}.items():
        write(tmp_path / "cloud.npz", cloud)
        found = hashlib.sha256((tmp_path / "cloud.npz").read_bytes()).hexdigest()
        assert found == kept[f"clouds/{slug(name)}.npz"], name
    assert not np.array_equal(builtin_cloud(RECORDS["Owl"], 2).points, clouds["Owl"].points)


def test_the_eh216_may_fly_sixteen_rotors_in_coaxial_pairs():
    cloud = variant("EH 216 S", coaxial=True)
    rotors = cloud.parts_of("rotor")
    assert len(rotors) == 16 and len(cloud.points) == 396
    for upper, lower in zip(rotors[::2], rotors[1::2], strict=True):
        assert cloud.hinges[upper] - cloud.hinges[lower] == pytest.approx([0, 0, 1.29], abs=1e-12)
        assert cloud.axes[upper] @ cloud.axes[lower] == -1


@pytest.mark.parametrize(
    ("name", "turn"),
    [("EH 216 S", 0.25), ("Type-A Firefighting UAV", 0), ("Type-B Firefighting UAV", 1 / 6)],
)
def test_a_rotor_of_two_layers_turns_as_one_with_its_lower_blades_ahead(name, turn):
    cloud = variant(name, points=3000)
    figures = RECORDS[name]["figures"]
    for rotor in cloud.parts_of("rotor"):
        points = cloud.points[cloud.part == rotor] - cloud.hinges[rotor]
        gap = figures["layer_gap"]["si"]
        upper, lower = (points[abs(points[:, 2] + depth) < gap / 2] for depth in (0, gap))
        assert len(upper) + len(lower) == len(points) and abs(len(upper) - len(lower)) < 0.2 * len(
            points
        )
        # The sums of (x + i y)^n over n equal blades have n times the angle of a blade.
        count = figures["blade_count"]["value"]
        told = [
            np.angle(((layer[:, 0] + 1j * layer[:, 1]) ** count).sum()) for layer in (upper, lower)
        ]
        off = (told[1] - told[0]) / count / (2 * np.pi) - turn
        assert abs(off * count - round(off * count)) < 0.05 * count


def test_rolling_diameter_wing_beat_and_cross_section_may_be_set():
    car = variant("Xiaomi SU7 2024", wheel_size="rolling")
    assert car.record["wheel_diameter_m"] == 0.703
    lowest = [car.points[car.part == wheel][:, 2].min() for wheel in car.parts_of("wheel")]
    assert lowest == pytest.approx([-0.7] * 4, abs=1e-5)
    crow = variant("Crow", flap={"mean_deg": 5.0}, rcs_m2_per_point=0.01)
    assert crow.record["flap"] == bird.FLAP | {"mean_deg": 5.0} and (crow.rcs_m2 == 0.01).all()


def test_the_command_makes_the_same_cloud_and_refuses_an_unknown_source(tmp_path, clouds):
    settings, out = tmp_path / "settings.json", tmp_path / "seagull.npz"
    line = words(settings=f"@{settings}", out=out)
    settings.write_text(json.dumps({"seed": SEED, "record": RECORDS["Seagull"]}))
    command(line)
    np.testing.assert_array_equal(read(out).points, clouds["Seagull"].points)
    settings.write_text(json.dumps({"seed": 1, "record": RECORDS["Seagull"] | {"source": "clay"}}))
    with pytest.raises(InputError, match=r"record\.source is 'clay'"):
        command(line)


def test_the_gallery_draws_every_cloud(tmp_path, clouds):
    files = []
    for name in ("DJI Mini 2", "EH 216 S", "Crow", "Xiaomi SU7 2024"):
        files.append(tmp_path / f"{slug(name)}.npz")
        write(files[-1], clouds[name])
    gallery(words(clouds=files, out=tmp_path / "gallery.png"))
    picture = np.asarray(Image.open(tmp_path / "gallery.png").convert("RGB"))
    assert picture.shape[1] > 1000
    assert len(np.unique(picture[::7, ::7].reshape(-1, 3), axis=0)) > 20
