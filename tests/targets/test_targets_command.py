"""The commands of the targets stage: one record to its cloud, and the picture of all clouds."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from lowalt.files.atomic import slug
from lowalt.targets.builtin import builtin_cloud
from lowalt.targets.cloud import read, write
from lowalt.targets.gallery import main as gallery
from lowalt.targets.records import load_records

CONFIG = Path(__file__).parents[2] / "config"
RECORDS = load_records(
    CONFIG / "targets.csv", [CONFIG / "targets" / f"{name}.yaml" for name in ("uav", "bird", "vehicle", "pedestrian")]
)


def cloud_of(name):
    return builtin_cloud(RECORDS[name], 1)


def test_command_line_makes_the_same_cloud(tmp_path):
    settings = tmp_path / "settings.json"
    settings.write_text(json.dumps({"seed": 1, "record": RECORDS["Seagull"]}))
    out = tmp_path / "seagull.npz"
    command = [sys.executable, "-m", "lowalt.targets", "--settings", f"@{settings}", "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    np.testing.assert_array_equal(read(out).points, cloud_of("Seagull").points)
    settings.write_text(json.dumps({"seed": 1, "record": RECORDS["Seagull"] | {"source": "clay"}}))
    refused = subprocess.run(command, capture_output=True, text=True)
    assert refused.returncode == 2 and "record.source is 'clay'" in refused.stderr


def test_gallery_draws_every_cloud(tmp_path):
    names = ["DJI Mini 2", "EH 216 S", "Crow", "Xiaomi SU7 2024"]
    for name in names:
        write(tmp_path / f"{slug(name)}.npz", cloud_of(name))
    out = tmp_path / "gallery.png"
    gallery(["--clouds", *(str(tmp_path / f"{slug(name)}.npz") for name in names), "--out", str(out)])
    picture = np.asarray(Image.open(out).convert("RGB"))
    assert picture.shape[1] > 1000 and len({tuple(pixel) for pixel in picture[::7, ::7].reshape(-1, 3)}) > 20
