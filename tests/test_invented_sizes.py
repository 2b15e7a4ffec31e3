"""Targets of drawn sizes, and other runs' samples in a training: laws of scaling, and what is refused."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from lowalt.recognition.extra import with_extra

from lowalt.common.config import merge, plain
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.common.streams import stream
from lowalt.common.yaml_files import load_yaml
from lowalt.motion import poses, read_table, write_table
from lowalt.motion.poses import positions
from lowalt.motion.sample import draw, region_polygon
from lowalt.recognition.__main__ import main
from lowalt.recognition.freeze import freeze
from lowalt.recognition.samples import Facts, ViewSamples, write
from lowalt.shards.record import record, row_of
from lowalt.targets.cloud import cloud_of, extent, scaled
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from lowalt.workflow import options
from lowalt.workflow.effect_calls import EffectCalls
from lowalt.workflow.products import Products
from lowalt.workflow.run import Run
from trainings import SETTINGS, TRAINING

CONFIG = load_yaml("config/default.yaml")
SCHEMA = "workflow/schemas/config.schema.yaml"
SIZES = {"UAV": [0.15, 8.0], "Bird": [0.1, 2.5], "Vehicle": [2.0, 9.0]}
NETWORK = Network.from_settings(CONFIG["network"])
MASTS = np.array([place["position_m"][:2] for place in CONFIG["network"]["stations"].values()])
CORNERS = region_polygon(MASTS, None)


@pytest.fixture(scope="module")
def targets():
    """Cloud and published ranges of one subtype a category."""
    records = load_records(CONFIG["targets"]["table"], CONFIG["targets"]["records"])
    names = ("DJI Mini 2", "Crow", "Tesla Roadster 2020", "Walking Pedestrian 1")
    return {name: (make(records[name], None, CONFIG["seed"]), records[name]["published"]) for name in names}


def drawn(targets, name, model, sizes=None):
    cloud, published = targets[name]
    more = {"sizes_m": sizes} if sizes else {}
    row = draw(stream(3, "motion", name, model), cloud, published, MASTS, CORNERS, {**CONFIG["motion"], **more})
    return {**row, "group": "seen", "model": model}


def test_longest_sides_fill_their_range_evenly_on_a_logarithmic_scale(targets):
    cloud, _ = targets["DJI Mini 2"]
    found = np.array([drawn(targets, "DJI Mini 2", model, SIZES)["scale"] for model in range(400)]) * extent(cloud)
    low, high = SIZES["UAV"]
    share = np.sort(np.log(found / low) / math.log(high / low))
    assert share[0] >= 0 and share[-1] <= 1
    # Kolmogorov's statistic of 400 uniform draws passes 1.95 / sqrt(400) once in a thousand seeds.
    assert np.abs(share - (np.arange(400) + 0.5) / 400).max() < 1.95 / 20


@pytest.mark.parametrize("name", ["DJI Mini 2", "Crow", "Tesla Roadster 2020", "Walking Pedestrian 1"])
def test_only_size_rate_and_height_of_the_ground_change(targets, name):
    plain_row, row = drawn(targets, name, 5), drawn(targets, name, 5, SIZES)
    scale = row.pop("scale")
    assert (scale == 1) == (name == "Walking Pedestrian 1")
    np.testing.assert_allclose(row["rate_hz"] * scale, plain_row["rate_hz"], rtol=1e-15)
    ground = plain_row["z_m"] if name in ("DJI Mini 2", "Crow") else plain_row["z_m"] * scale
    assert row["z_m"] == pytest.approx(ground, rel=1e-15)
    for key in set(row) - {"rate_hz", "z_m"}:
        np.testing.assert_equal(row[key], plain_row[key])


@pytest.mark.parametrize("name", ["DJI Mini 2", "Crow", "Walking Pedestrian 1"])
def test_every_point_of_a_scaled_target_lies_as_many_times_as_far_from_its_origin(targets, name):
    row, times_s = drawn(targets, name, 7), np.arange(6) * 2.5e-3
    cloud = targets[name][0]
    origin = np.array([row["x_m"], row["y_m"], row["z_m"]]) + times_s[:, None, None] * np.array(
        [row["vx_mps"], row["vy_mps"], row["vz_mps"]]
    )
    small = positions(cloud, row, times_s) - origin
    large = positions(cloud_of({name: cloud}, {**row, "scale": 3.0}), row, times_s) - origin
    np.testing.assert_allclose(large, 3 * small, atol=1e-9)
    assert extent(scaled(cloud, 3.0)) == pytest.approx(3 * extent(cloud), rel=1e-14)


def test_blade_tips_keep_their_speed_whatever_the_size(targets):
    """The largest distance that a rotor's point moves in a short time, less the craft's own, is the tip's speed."""
    cloud = targets["DJI Mini 2"][0]
    still = {"vx_mps": 0.0, "vy_mps": 0.0, "vz_mps": 0.0}
    times_s = np.array([0.0, 1e-5])
    speeds = []
    for sizes in (None, {"UAV": [4.0, 4.0]}):
        row = drawn(targets, "DJI Mini 2", 2, sizes) | still
        now, later = positions(cloud_of({"DJI Mini 2": cloud}, row), row, times_s)
        speeds.append(np.linalg.norm(later - now, axis=1).max() / 1e-5)
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-3)


def test_table_and_record_carry_the_size_and_other_tables_have_no_such_column(targets, tmp_path):
    rows = [drawn(targets, name, 1, SIZES) for name in targets]
    write_table(tmp_path / "sized.csv", rows)
    assert [row["scale"] for row in read_table(tmp_path / "sized.csv")] == [row["scale"] for row in rows]
    again, _ = row_of(json.loads(record(rows[0], 3.0, "train", 1, NETWORK)))
    assert again["scale"] == rows[0]["scale"]
    write_table(tmp_path / "plain.csv", [drawn(targets, "Crow", 1)])
    assert "scale" not in read_table(tmp_path / "plain.csv")[0]
    text = (tmp_path / "sized.csv").read_text().splitlines()
    (tmp_path / "bad.csv").write_text("\n".join([text[0], text[1].rpartition(",")[0] + ",-1.0"]) + "\n")
    with pytest.raises(InputError, match=r"bad.csv, line 2, column scale: -1.0, expected a positive number"):
        read_table(tmp_path / "bad.csv")


def test_poses_of_a_row_do_not_depend_on_its_scale_column(targets):
    """Sizes are the cloud's alone: who passes another cloud with the row gets that cloud's points."""
    cloud, row = targets["Crow"][0], drawn(targets, "Crow", 4, SIZES)
    bare = {key: value for key, value in row.items() if key != "scale"}
    for one, other in zip(poses(cloud, row, np.zeros(1)), poses(cloud, bare, np.zeros(1)), strict=True):
        np.testing.assert_array_equal(one, other)


def views(path, run, models, value):
    keys = np.array([f"Crow-{model}" for model in models])
    count = len(models)
    facts = Facts(
        keys, np.full(count, "Crow"), np.array(models), np.full(count, 3.0), np.full(count, "seen"),
        np.full(count, "train"), np.arange(count) % 4, np.ones((count, 3)), np.ones((count, 3)),
    )  # fmt: skip
    (path / run).mkdir()
    write(path / run / "seen-train-00000.npz", np.full((count, 9, 16, 16), value, np.uint8), facts)
    return ViewSamples([path / run / "seen-train-00000.npz"], [0, 4], {("seen", "train")})


def test_joined_samples_keep_images_and_labels_and_share_no_motion_model(tmp_path):
    first, second = views(tmp_path, "a", [0, 0, 3], 10), views(tmp_path, "b", [0, 2], 20)
    both = with_extra(first, second)
    np.testing.assert_array_equal(both.views(np.arange(5))[:, 1, 0, 0], [10, 10, 10, 20, 20])
    assert both.facts.model.tolist() == [0, 0, 3, 4, 6]
    assert len(first.facts) == 3 and second.facts.model.tolist() == [0, 2]
    second.size = 24
    with pytest.raises(InputError, match="samples: sizes 16 and 24, expected one size"):
        with_extra(first, second)


def test_the_command_trains_on_other_runs_samples_and_checks_what_they_were_made_of(tmp_path, capsys):
    own = views(tmp_path, "own", range(8), 10)
    paths = [tmp_path / run / "seen-train-00000.npz" for run in ("own", "more")]
    more = views(tmp_path, "more", range(5), 20)
    val = replace(own.facts, fold=np.full(8, "val"))
    write(tmp_path / "own/seen-val-00000.npz", np.full((8, 9, 16, 16), 9, np.uint8), val)
    for run in ("own", "more"):
        (tmp_path / run / "cloud").write_text(run)
        freeze([tmp_path / run / "cloud"], tmp_path / run / "SHA256SUMS")
    settings = {**SETTINGS, "size": 16, "training": {**TRAINING, "steps": 2, "validate_every": 2}}
    line = ["train", "--settings", json.dumps(settings), "--views", str(paths[0]),
            str(tmp_path / "own/seen-val-00000.npz"), "--extra", str(paths[1]), "--frozen",
            *(str(tmp_path / run / "SHA256SUMS") for run in ("own", "more")),
            "--protocol", "unseen", "--stations", *"ABC", "--scheme", "A:VT"]  # fmt: skip
    main([*line, "--out", str(tmp_path / "model")])
    about = json.loads((tmp_path / "model/run.json").read_text())
    assert about["train_samples"] == len(own.facts) + len(more.facts)
    (tmp_path / "more/cloud").write_text("other")
    with pytest.raises(InputError, match=r"more/cloud: has changed since it was frozen"):
        main([*line, "--out", str(tmp_path / "again")])


def run_of(overlay):
    return Run.of(merge(load_yaml("config/default.yaml"), overlay), SCHEMA, None)


def test_sizes_and_extra_runs_that_cannot_be_meant_are_refused_by_name(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"motion.sizes_m: Bird from 2.0 to 1.0 m"):
        run_of({"motion": {"sizes_m": {"Bird": [2.0, 1.0]}}})
    with pytest.raises(InputError, match=r"motion.sizes_m: given together with effects \['adc'\]"):
        run_of({"motion": {"sizes_m": SIZES}, "effects": {"adc": {}}})
    with pytest.raises(InputError, match=r"recognition.extra: 'nowhere', expected another, finished run"):
        run_of({"recognition": {"extra": ["nowhere"]}})


def test_an_extra_run_of_the_same_seed_or_of_other_images_is_refused_and_a_good_one_is_trained_on(
    tmp_path, monkeypatch
):
    from pathlib import Path

    root = Path.cwd()
    for folder in ("config", "workflow"):
        (tmp_path / folder).symlink_to(root / folder)
    monkeypatch.chdir(tmp_path)
    made = tmp_path / "results/other"
    (made / "shards").mkdir(parents=True)
    other = plain(load_yaml("config/default.yaml"))

    def given(**changes):
        (made / "config.yaml").write_text(yaml.safe_dump(merge(other, changes)))

    given()
    with pytest.raises(InputError, match=r"'other' has this run's seed 20260701"):
        run_of({"recognition": {"extra": ["other"]}})
    given(seed=1, images={"gamma": 1.0})
    with pytest.raises(InputError, match=r"'other' has other settings of \['images'\]"):
        run_of({"recognition": {"extra": ["other"]}})
    given(seed=1)
    run = run_of({"recognition": {"extra": ["other"]}})
    products = Products(run, EffectCalls(run))
    job = SimpleNamespace(run="default", scheme="abc-vrp-trp-vt")
    (made / "shards/seen-train-00000.tar").touch()
    (made / "shards/seen-val-00000.tar").touch()
    with pytest.raises(InputError, match=r"no results/other/views/24/seen-train-00000.npz; expected what the target"):
        products.training_samples(job)
    (made / "views/24").mkdir(parents=True)
    (made / "views/24/seen-train-00000.npz").touch()
    found = products.training_samples(job)
    assert found["extra"] == ["results/other/views/24/seen-train-00000.npz"]
    assert found["views"] == products.samples(job)["views"]
    assert "extra" not in products.samples(job)
    assert products.frozen(job) == ["results/default/SHA256SUMS", "results/other/SHA256SUMS"]

    class Input(dict):
        __getattr__ = dict.__getitem__

    assert options.extra(job, Input(extra=["a", "b"])) == ["--extra", "a", "b"]
    assert options.extra(job, Input()) == []
