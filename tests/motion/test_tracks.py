"""Tracks: state goes on from look to look, and a flight log comes back from the records.

A fold takes a track whole.
"""

import itertools
import json
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from builtin_records import TABLE
from configured import run_of
from lowalt.config.blocks import motion_block
from lowalt.config.layers import check, merge
from lowalt.config.network import masts_m
from lowalt.config.splits import FOLDS
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.motion import positions, read_table, write_table
from lowalt.motion.__main__ import main as motion
from lowalt.motion.drawing import region_polygon
from lowalt.motion.table import SCALE
from lowalt.motion.track_files import path_of
from lowalt.motion.tracks import TURN_RADPS, Cell, drawn_path, model_rows
from lowalt.shards.build import rows_of
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import record, row_of
from lowalt.shards.write import select
from lowalt.targets.cloud import write as write_cloud
from lowalt.workflow.stages.motion import MotionStage
from options import words
from tables import rows

SUBTYPES = ["DJI Mini 2", "Owl", "NIO ET5T 2023", "Walking Pedestrian 5"]
LOOKS = 12
OVERLAY = {
    "targets": {"select": SUBTYPES},
    "motion": {"models": 4, "models_per_chunk": 4, "looks": LOOKS, "cadence": "tied"},
    "split": {"train": 2, "val": 1, "test": 1},
    "noise": {"snr_db": [3, float("inf")]},
}
LOG = "time_s,x_m,y_m,z_m\n"


def configuration(**motion) -> dict:
    """The default with four subtypes that are looked at again and again."""
    config = merge(load_yaml("config/default.yaml"), merge(OVERLAY, {"motion": motion}))
    return check(config, "workflow/schemas/config.schema.yaml")


@pytest.fixture(scope="module")
def dataset():
    return Dataset(configuration())


def flight(time_s: np.ndarray) -> np.ndarray:
    """A parabola in the middle of the cell.

    Differences of second order and cubics have no error on it.
    """
    return np.stack([200 + 3 * time_s, 100 + 0.5 * time_s + 0.2 * time_s**2, 50 + time_s], axis=-1)


def written(path, times_s, header=LOG, places=flight) -> str:
    """A log of a path, a row each of the times."""
    rows = (
        "{},{},{},{}\n".format(*map(repr, map(float, (time, *place))))
        for time, place in zip(times_s, places(times_s), strict=True)
    )
    path.write_text(header + "".join(rows))
    return str(path)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """Tracks along a log of uneven rows that begins at 7 s."""
    times = np.concatenate(
        [[7.0], 7 + np.sort(np.random.default_rng(3).uniform(0.2, 11.9, 40)), [19.5]]
    )
    log = written(tmp_path_factory.mktemp("log") / "log.csv", times)
    return Dataset(configuration(track=log))


def looks_of(dataset: Dataset, subtype: str, track: int) -> list[dict]:
    """The rows of a track."""
    group = TABLE[subtype]["unseen_protocol"]
    return [dataset.row(Place(group, subtype, track * LOOKS + look, 3.0)) for look in range(LOOKS)]


def places_of(config: dict) -> tuple[np.ndarray, np.ndarray, dict]:
    """Masts (S, 2) m, corners (K, 2) m of the region, and the settings of the motion.

    They are those of a configuration.
    """
    masts = np.array(masts_m(config["network"]), float)
    return masts, region_polygon(masts, None), motion_block(config)


def goes_on(cloud, rows: list[dict]):
    """Assert that all points end a look where they begin the next.

    That is place, heading, phases of parts and gait at once.
    """
    for row, after in itertools.pairwise(rows):
        ends = positions(cloud, row, np.array([1.0]))
        starts = positions(cloud, after, np.array([0.0]))
        np.testing.assert_allclose(ends, starts, rtol=0, atol=1e-9)


@pytest.mark.parametrize("subtype", SUBTYPES)
@pytest.mark.parametrize("which", ["dataset", "logged"])
def test_nothing_jumps_between_looks(which, subtype, request):
    tracks = request.getfixturevalue(which)
    rows = looks_of(tracks, subtype, 2)
    goes_on(tracks.clouds[subtype], rows)
    for row, after in itertools.pairwise(rows):
        for axis in "xyz":
            bent = row[f"v{axis}_mps"] + row[f"a{axis}_mps2"] + row[f"j{axis}_mps3"] / 2
            assert bent == pytest.approx(after[f"v{axis}_mps"], abs=1e-9)


@pytest.mark.parametrize("subtype", ["EH 216 S", "Owl", "NIO ET5T 2023"])
def test_a_drawn_path_is_made_of_coordinated_turns_inside_the_cell(dataset, subtype):
    masts, corners, settings = places_of(dataset.config)
    cell = Cell(corners, masts, 10.0)
    cloud = dataset.clouds["NIO ET5T 2023" if "NIO" in subtype else "DJI Mini 2"]
    published = TABLE[subtype]
    times = np.linspace(0, 1, 9)
    rates = []
    for track in range(12):
        rows = model_rows(1, cloud, published, masts, corners, settings, track)
        speeds = [math.hypot(row["vx_mps"], row["vy_mps"]) for row in rows]
        np.testing.assert_allclose(speeds, speeds[0], rtol=1e-12)
        for row in rows:
            place = np.array([row[f"{axis}_m"] for axis in "xyz"]) + sum(
                times[:, None] ** power
                / math.factorial(power)
                * [row[f"{kind}{axis}{unit}"] for axis in "xyz"]
                for power, kind, unit in ((1, "v", "_mps"), (2, "a", "_mps2"), (3, "j", "_mps3"))
            )
            assert (cell.room_m(place[:, :2]) > 0).all()
            assert "NIO" in subtype or ((place[:, 2] >= 20).all() and (place[:, 2] <= 150).all())
            # The same turn as a sum of many short straight steps.
            fine = (np.arange(8000) + 0.5) / 8000
            course = math.atan2(row["vy_mps"], row["vx_mps"]) + row["turn_radps"] * fine
            steps = speeds[0] / 8000 * np.cumsum([np.cos(course), np.sin(course)], axis=1)
            np.testing.assert_allclose(
                place[1:, :2] - place[0, :2], steps[:, 999::1000].T, atol=1e-3 * speeds[0]
            )
            rates.append(row["turn_radps"])
    assert (
        -TURN_RADPS - 1e-9 <= min(rates) < -0.8 * TURN_RADPS
        and 0.8 * TURN_RADPS < max(rates) <= TURN_RADPS + 1e-9
    )


def test_a_target_turns_to_climb_the_other_way_while_it_can_still_go_on_for_a_look():
    cell = Cell(
        np.array([[0.0, 0.0], [600.0, 0.0], [600.0, 600.0], [0.0, 600.0]]), np.zeros((0, 2)), 0.0
    )
    for seed in range(10):
        rng = np.random.default_rng(seed)
        row = {
            "x_m": 300.0,
            "y_m": 300.0,
            "z_m": rng.uniform(41, 45),
            "vx_mps": 3.0,
            "vy_mps": 1.0,
            "yaw_rad": 0.0,
        }
        path = drawn_path(rng, row | {"vz_mps": rng.uniform(-1, 1)}, cell, (40.0, 46.0), 30, 1.0)
        ahead = path.position_m[:, 2] + path.velocity_mps[:, 2]
        assert ahead.min() >= 40 and ahead.max() <= 46


def test_rotors_with_rates_of_their_own_go_on_from_look_to_look(dataset):
    cloud = dataset.clouds["DJI Mini 2"]
    own = replace(
        cloud,
        record=cloud.record | {"rate_factors": {cloud.names[cloud.parts_of("rotor")[1]]: 1.37}},
    )
    rows = model_rows(1, own, TABLE["DJI Mini 2"], *places_of(dataset.config), 0)
    goes_on(own, rows)
    # With the rate of the other rotors, this one jumps.
    with pytest.raises(AssertionError):
        goes_on(cloud, rows)


def test_along_a_log_a_larger_car_s_wheels_turn_at_a_lower_rate_and_a_full_circle_is_one_turn(
    dataset, tmp_path
):
    def circle(time_s):
        angle = 2 * np.pi * time_s / 10
        return np.stack([250 + 20 * np.cos(angle), 144 + 20 * np.sin(angle), 0 * time_s], axis=-1)

    config = configuration(
        track=written(tmp_path / "log.csv", np.linspace(0, 12.5, 500), places=circle)
    )
    masts, corners, settings = places_of(config)
    path = path_of(settings, corners, masts)
    given = 1, dataset.clouds["NIO ET5T 2023"], TABLE["NIO ET5T 2023"], masts, corners
    plain = model_rows(*given, settings, 0, path)
    sized = model_rows(*given, settings | {"sizes_m": {"Vehicle": [6.0, 9.0]}}, 0, path)
    assert [row["turn_radps"] for row in plain] == pytest.approx([2 * np.pi / 10] * LOOKS, rel=1e-3)
    scale = sized[0][SCALE]
    assert scale > 1.2 and [row["rate_hz"] * scale for row in sized] == pytest.approx(
        [row["rate_hz"] for row in plain]
    )


def test_a_track_is_in_one_fold_whole(dataset):
    plan = dataset.plan
    assert len(dataset) == len(SUBTYPES) * 4 * LOOKS * 2
    folds = {}
    for fold in FOLDS:
        part = Dataset(dataset.config, dataset.clouds, folds=[fold])
        for place in map(part.place, range(len(part))):
            folds.setdefault((place.group, place.subtype, place.model // LOOKS), []).append(fold)
    assert all(held == held[:1] * LOOKS * 2 for held in folds.values())
    assert Counter(held[0] for held in folds.values()) == {"train": 8, "val": 4, "test": 4}
    # Shards are dealt by the motion tables; the plan names a shard for each fold that has a sample.
    for chunk in plan.chunks:
        group, _, _ = chunk.partition("-")
        rows = rows_of(dataset, chunk)
        assert plan.folds(chunk) == list(FOLDS)
        chosen = [
            (fold, rows[number])
            for fold in FOLDS
            for number, _ in select(rows, [3.0, math.inf], plan.split, plan.seed, fold)
        ]
        assert len(chosen) == 2 * len(rows)
        assert all(
            folds[group, row["subtype"], row["model"] // LOOKS][0] == fold for fold, row in chosen
        )
    # One track of each subtype is in one fold, however many looks it has.
    few = Dataset(configuration(models=1), dataset.clouds)
    for chunk in few.plan.chunks:
        names = few.plan.chunk(chunk).members
        dealt = {
            held[0] for (_, name, track), held in folds.items() if track == 0 and name in names
        }
        assert {*few.plan.folds(chunk)} == dealt


@pytest.mark.parametrize("which", ["dataset", "logged"])
def test_the_motion_stage_writes_the_rows_of_the_samples(which, request, tmp_path):
    tracks = request.getfixturevalue(which)
    stage = MotionStage(run_of(merge(OVERLAY, {"motion": tracks.config["motion"]})))
    cloud, path, again = (tmp_path / name for name in ("cloud.npz", "motion.csv", "again.csv"))
    write_cloud(cloud, tracks.clouds[SUBTYPES[0]])
    wildcards = type("", (), {"group": "seen", "part": "00000"})()
    settings = stage.settings(wildcards)
    span = {"group": "seen", "first": 0, "count": 4 * LOOKS}
    motion(words(settings=settings, clouds=cloud, **span, out=path))
    numbers = [(row["model"], row["track"], row["look"]) for row in read_table(path)]
    assert numbers == [(number, *divmod(number, LOOKS)) for number in range(4 * LOOKS)]
    write_table(again, [row for track in range(4) for row in looks_of(tracks, SUBTYPES[0], track)])
    assert again.read_bytes() == path.read_bytes()


@pytest.mark.parametrize("subtype", ["DJI Mini 2", "NIO ET5T 2023"])
def test_a_log_comes_back_from_the_records(logged, subtype):
    group = TABLE[subtype]["unseen_protocol"]
    entries = [
        json.loads(logged.made_record(Place(group, subtype, LOOKS + look, 3.0)))
        for look in range(LOOKS)
    ]
    assert [(entry["track"], entry["look"]) for entry in entries] == [
        (1, look) for look in range(LOOKS)
    ]
    place = np.array([[entry["motion"][f"{axis}_m"] for axis in "xyz"] for entry in entries])
    wanted = flight(7.0 + np.arange(LOOKS))
    if subtype.startswith("NIO"):
        wanted[:, 2] = logged.clouds[subtype].record["origin_height_m"]
    np.testing.assert_allclose(place, wanted, atol=1e-9)
    # The front looks along the course, and wheels roll at the speed over ground.
    velocity = np.array([[entry["motion"][f"v{axis}_mps"] for axis in "xy"] for entry in entries])
    yaw = np.array([entry["motion"]["yaw_rad"] for entry in entries])
    speed = np.hypot(*velocity.T)
    np.testing.assert_allclose(
        velocity, speed[:, None] * np.stack([-np.sin(yaw), np.cos(yaw)], axis=1), atol=1e-9
    )
    if subtype.startswith("NIO"):
        rate = [entry["motion"]["rate_hz"] for entry in entries[:-1]]
        np.testing.assert_allclose(
            rate, (speed[:-1] + speed[1:]) / 2 / (math.pi * 0.4826), rtol=1e-3
        )
    # A stored record is enough to make the sample again.
    network = logged.maker.network
    row, snr_db = row_of(entries[3])
    assert (
        json.loads(record(row, snr_db, entries[3]["fold"], entries[3]["seed"], network))
        == entries[3]
    )


def test_degrees_become_metres_about_the_first_row(tmp_path, dataset):
    # At 60 degrees north of WGS 84, a degree of latitude is 111 412.3 m long, one of longitude 55
    # 800.0 m.
    step = np.arange(30)[:, None] * [5.0, -2.0, 0.0]
    log = written(
        tmp_path / "log.csv",
        np.arange(30.0),
        "time_s,lat,lon,alt\n",
        lambda _: np.array([60.0, 179.999, 40.0]) + step[:, [1, 0, 2]] / [111412.3, 55800.0, 1.0],
    )
    tracks = Dataset(configuration(track=log), dataset.clouds)
    rows = looks_of(tracks, "Owl", 0)
    place = np.array([[row[f"{axis}_m"] for axis in "xyz"] for row in rows])
    middle = [250.0, 433.0127018922193 / 3, 40.0]
    np.testing.assert_allclose(place, middle + step[:LOOKS], atol=1e-3)
    assert [row["yaw_rad"] for row in rows] == pytest.approx(
        [math.atan2(-5, -2) + 2 * math.pi] * LOOKS, abs=1e-5
    )


@pytest.mark.parametrize(
    ("text", "words"),
    rows("tracks", "logs"),
)
def test_a_bad_log_is_refused_in_one_sentence(tmp_path, text, words):
    path = tmp_path / "log.csv"
    path.write_text(text)
    masts, corners, settings = places_of(configuration(track=str(path)))
    with pytest.raises(InputError, match=words) as refused:
        path_of(settings, corners, masts)
    assert str(path) in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("overlay", "words"),
    rows("tracks", "overlays"),
)
def test_what_does_not_go_with_tracks_is_refused(overlay, words):
    with pytest.raises(InputError, match=words):
        run_of(merge(OVERLAY, overlay))


def test_a_region_too_small_to_turn_in_is_refused(dataset):
    corners = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]])
    settings = motion_block(dataset.config)
    with pytest.raises(
        InputError, match="region is too small for a turn of 20 degrees a second at"
    ):
        model_rows(
            1, dataset.clouds["Owl"], TABLE["EH 216 S"], np.zeros((0, 2)), corners, settings, 0
        )
