"""Users' real meshes: each becomes a cloud of the published size; a wrong unit is caught."""

from pathlib import Path

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.targets.record_schema import record_files
from lowalt.targets.records import read_records
from meshes import TABLE, made, plain
from real_inputs import FOLDER, needs_inputs

ROOT = Path(__file__).parents[2]
REAL = read_records(ROOT / "config/targets/real.yaml")
UNITS = {"hatchback.obj": "in", "prius_hybrid.obj": "cm", "prius_body.obj": "cm", "prius_wheel.obj": "cm",
         "cowbird_fly.obj": "cm"}  # fmt: skip


@needs_inputs
@pytest.mark.parametrize("subtype", [name for name, record in REAL.items() if record["source"] == "mesh"])
def test_real_records_give_clouds_of_the_published_size(subtype):
    published = TABLE[subtype]
    cloud = made(subtype, FOLDER, **REAL[subtype])
    assert len(cloud.points) == published["points_in_published_cloud_approx"]
    assert np.isfinite(cloud.normals).all()
    moving = [kind for kind in cloud.kinds if kind != "body"]
    assert np.bincount(cloud.part).min() >= 8
    extent = np.ptp(cloud.points, axis=0)
    if cloud.category == "Vehicle":
        wanted = [published["wid_m"], published["len_m"], published["hgt_m"]]
        assert np.abs(extent / wanted - 1).max() < 0.02
        assert moving == ["wheel"] * 4
        assert cloud.record["wheel_diameter_m"] == published["wheel_diam_m"]
        # The wheels stand on the ground, two of them left and two ahead, and roll to the front.
        assert np.allclose(cloud.hinges[1:, 2] + cloud.record["origin_height_m"], published["wheel_diam_m"] / 2)
        assert sorted(np.sign(cloud.hinges[1:, 0])) == sorted(np.sign(cloud.hinges[1:, 1])) == [-1, -1, 1, 1]
        assert np.allclose(cloud.axes[1:], [-1, 0, 0], atol=0.02)
        # A car is lower over its bonnet than over its boot or hatch.
        ahead, behind = (
            cloud.points[np.abs(cloud.points[:, 1] - y * extent[1]) < 0.1 * extent[1], 2] for y in (0.4, -0.4)
        )
        assert ahead.max() < behind.max()
    elif cloud.category == "Bird":
        assert extent[1] == pytest.approx(published["size_m"], rel=0.02)
        assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]
    else:
        hubs = cloud.hinges[1:, :2]
        assert np.linalg.norm(hubs[:, None] - hubs, axis=2).max() == pytest.approx(published["size_m"], rel=1e-9)
        assert moving == ["rotor"] * 4
        # Blades lie about their hub, in one plane, and neighbours turn in opposite senses.
        order = np.argsort(np.arctan2(hubs[:, 1], hubs[:, 0]))
        assert np.sign(cloud.axes[1:, 2])[order].tolist() in ([1, -1, 1, -1], [-1, 1, -1, 1])
        for part in range(1, 5):
            away = (cloud.points - cloud.hinges[part])[cloud.part == part]
            assert np.linalg.norm(away[:, :2].mean(axis=0)) < 0.25 * np.linalg.norm(away, axis=1).max()


@needs_inputs
def test_every_real_mesh_is_used_and_alone_becomes_a_valid_cloud():
    files = {str(path.relative_to(FOLDER)) for path in (FOLDER / "meshes").rglob("*.*")}
    assert len(files) >= 18 and files <= {file for record in REAL.values() for file in record_files(record)}
    for name in files:
        cloud = made("DJI Mini 2", FOLDER, **plain(name, unit=UNITS.get(Path(name).name, "m")))
        assert len(cloud.points) == 171 and np.ptp(cloud.points, axis=0).max() < 5.0


@needs_inputs
def test_inches_given_as_metres_are_caught_by_the_published_size():
    record = REAL["BYD Song L EV 2024"] | {"unit": "m"}
    with pytest.raises(InputError, match=r"parts.front left wheel.region .* 65\.2, 61\.3\] m; is the unit 'm'"):
        made("BYD Song L EV 2024", FOLDER, **record)
