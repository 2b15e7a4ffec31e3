"""Targets of drawn sizes, and other runs' samples in a training.

Tested are laws of scaling, and what is refused.
"""

import json

import numpy as np
import pytest

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.motion import read_table, write_table
from lowalt.motion.drawing import draw, region_polygon
from lowalt.motion.poses import positions
from lowalt.numerics.streams import stream
from lowalt.shards.sample_record import record, row_of
from lowalt.targets.cloud import cloud_of, extent, scaled
from lowalt.targets.make import make
from lowalt.targets.records import load_records

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
    return {
        name: (make(records[name], None, CONFIG["seed"]), records[name]["published"])
        for name in names
    }


def drawn(targets, name, model, sizes=None):
    cloud, published = targets[name]
    more = {"sizes_m": sizes} if sizes else {}
    row = draw(
        stream(3, "motion", name, model),
        cloud,
        published,
        MASTS,
        CORNERS,
        {**CONFIG["motion"], **more},
    )
    return {**row, "group": "seen", "model": model}


@pytest.mark.parametrize(
    "name", ["DJI Mini 2", "Crow", "Tesla Roadster 2020", "Walking Pedestrian 1"]
)
def test_only_size_rate_and_height_of_the_ground_change(targets, name):
    plain_row = drawn(targets, name, 5)
    row = drawn(targets, name, 5, SIZES)
    scale = row.pop("scale")
    assert (scale == 1) == (name == "Walking Pedestrian 1")
    np.testing.assert_allclose(row["rate_hz"] * scale, plain_row["rate_hz"], rtol=1e-15)
    ground = plain_row["z_m"] if name in ("DJI Mini 2", "Crow") else plain_row["z_m"] * scale
    assert row["z_m"] == pytest.approx(ground, rel=1e-15)
    for key in set(row) - {"rate_hz", "z_m"}:
        np.testing.assert_equal(row[key], plain_row[key])


@pytest.mark.parametrize("name", ["DJI Mini 2", "Crow", "Walking Pedestrian 1"])
def test_every_point_of_a_scaled_target_lies_as_many_times_as_far_from_its_origin(targets, name):
    row = drawn(targets, name, 7)
    times_s = np.arange(6) * 2.5e-3
    cloud = targets[name][0]
    start, velocity = (
        np.array([row[f"{kind}{axis}{unit}"] for axis in "xyz"])
        for kind, unit in (("", "_m"), ("v", "_mps"))
    )
    origin = start + times_s[:, None, None] * velocity
    small = positions(cloud, row, times_s) - origin
    large = positions(cloud_of({name: cloud}, {**row, "scale": 3.0}), row, times_s) - origin
    np.testing.assert_allclose(large, 3 * small, atol=1e-9)
    assert extent(scaled(cloud, 3.0)) == pytest.approx(3 * extent(cloud), rel=1e-14)


def test_table_and_record_carry_the_size_and_other_tables_have_no_such_column(targets, tmp_path):
    rows = [drawn(targets, name, 1, SIZES) for name in targets]
    write_table(tmp_path / "sized.csv", rows)
    assert [row["scale"] for row in read_table(tmp_path / "sized.csv")] == [
        row["scale"] for row in rows
    ]
    again, _ = row_of(json.loads(record(rows[0], 3.0, "train", 1, NETWORK)))
    assert again["scale"] == rows[0]["scale"]
    write_table(tmp_path / "plain.csv", [drawn(targets, "Crow", 1)])
    assert "scale" not in read_table(tmp_path / "plain.csv")[0]
    text = (tmp_path / "sized.csv").read_text().splitlines()
    (tmp_path / "bad.csv").write_text(
        "\n".join([text[0], text[1].rpartition(",")[0] + ",-1.0"]) + "\n"
    )
    with pytest.raises(
        InputError, match=r"bad.csv, line 2, column scale: -1.0, expected a positive number"
    ):
        read_table(tmp_path / "bad.csv")
