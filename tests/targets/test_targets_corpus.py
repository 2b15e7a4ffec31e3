"""Awkward meshes become the right clouds, through the command line's functions and through the workflow's rule."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from awkward import CASES, HUBS, written
from lowalt.config.layers import canonical, load
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.make import make
from lowalt.targets.records import records_of

ROOT = Path(__file__).parents[2]
QUICK = ("up -y front -x", "names that grow", "units by part", "groups", "instances in GLB", "Box car", "Box bird")


def overlay(folder, names):
    """The path of a configuration whose only targets are these, with their meshes below `folder`/inputs."""
    own = folder / "own.yaml"
    own.write_text(yaml.safe_dump(written(folder / "inputs", names)))
    path = folder / "overlay.yaml"
    path.write_text(yaml.safe_dump({"run": "corpus", "targets": {"own": {"corpus": str(own)}, "select": list(names)}}))
    return path


def check_one(name: str, cloud: Cloud) -> None:
    """Compare a cloud with the craft, the car or the bird that all its files describe."""
    if name == "Box car":
        assert np.ptp(cloud.points, axis=0) == pytest.approx([1.7, 4.0, 1.3], rel=0.02)
        assert sorted(cloud.names) == ["ahead left", "ahead right", "back left", "back right", "coachwork"]
        left = [index for index, word in enumerate(cloud.names) if "left" in word]
        assert (cloud.hinges[left, 0] < 0).all() and np.abs(cloud.axes[1:, 0]) == pytest.approx(1)
        return
    if name == "Box bird":
        parents = {cloud.names[part]: cloud.names[parent] for part, parent in enumerate(cloud.parents) if parent >= 0}
        assert parents == {f"a {side} tip": f"z {side} shoulder" for side in ("left", "right")}
        assert np.ptp(cloud.points[cloud.part == 0][:, 1]) == pytest.approx(0.4, rel=0.01)
        return
    assert cloud.kinds == ("body", *("rotor",) * 4) and len(cloud.points) == 120
    # Hinges are found from points on the blades, to half a millimetre.
    found = np.array(sorted(np.round(cloud.hinges[1:, :2], 2).tolist()))
    # The craft's x is the front, so its y is the left.
    assert np.allclose(found, sorted([-y, x] for x, y in HUBS.values()))
    assert np.abs(cloud.axes[1:, 2]) == pytest.approx(1, abs=1e-3)
    body = np.ptp(cloud.points[cloud.part == 0], axis=0)
    assert body == pytest.approx([0.12, 0.22, 0.06], rel=0.03)
    assert (cloud.points[cloud.part > 0, 2] > cloud.points[cloud.part == 0, 2].max()).all()


@pytest.mark.parametrize("name", QUICK)
def test_an_awkward_mesh_becomes_its_cloud_by_the_settings_of_the_workflow(tmp_path, name):
    path = overlay(tmp_path, (name,))
    config = load([ROOT / "config/default.yaml", path], ROOT / "workflow/schemas/config.schema.yaml")
    # The workflow hands records on as JSON with sorted keys.
    record = json.loads(canonical(records_of(config["targets"])[name]))
    check_one(name, make(record, tmp_path / "inputs", 1))


@pytest.mark.slow
def test_the_workflow_s_rule_makes_all_of_them_in_one_run(tmp_path):
    path = overlay(tmp_path, tuple(CASES))
    copy = tmp_path / "checkout"
    copy.mkdir()
    for name in ("Snakefile", "workflow", "config", "src", "profiles", "envs"):
        (copy / name).symlink_to(ROOT / name)
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, copy / name)
    environment = {**os.environ, "LOWALT_INPUTS": str(tmp_path / "inputs"), "PYTHONPATH": str(ROOT / "src")}
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile", str(path), "--", "clouds"]
    done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    (told,) = re.findall(r"targets: 0 built-in; from files: (.*)", done.stderr)
    assert sorted(told.split(", ")) == sorted(CASES)
    clouds = {cloud.subtype: cloud for cloud in map(read, (copy / "results/corpus/clouds").glob("*.npz"))}
    assert set(clouds) == set(CASES)
    for name, cloud in clouds.items():
        check_one(name, cloud)
