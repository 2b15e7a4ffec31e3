"""A data set that grows: what exists is not made again, or is made again with the same bytes."""

import shutil

import numpy as np
import pytest
import yaml

from lowalt.shards import ShardSet
from lowalt.shards.verify import faults
from test_workflow import checksums, snakemake, workplace

pytest.importorskip("snakemake")
pytestmark = [pytest.mark.workflow, pytest.mark.slow]

SELECT = ["DJI Mini 2", "Crow", "Walking Pedestrian 5"]
# Region and clearance are given, so that they do not follow from the stations.
BASE = {
    "run": "test",
    "targets": {"select": SELECT},
    "motion": {
        "models": 10, "models_per_chunk": 10,
        "region": {"polygon_m": [[100, 60], [400, 60], [250, 300]], "mast_clearance_m": 10.0},
    },
    "noise": {"snr_db": [8, float("inf")]},
    "shards": {"kind": "signal"},
    "echo": {"job": "station"},
}  # fmt: skip
STATION = {"D": {"position_m": [800.0, 800.0, 25.0], "normal_deg": 225.0}}


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    folder = workplace(tmp_path_factory.mktemp("base"))
    (folder / "overlay.yaml").write_text(yaml.safe_dump(BASE))
    snakemake(folder, "--", "data")
    return folder


def extended(base, folder, change):
    """A copy of the finished workplace, run again with an overlay; the rules that it ran, and what it made."""
    shutil.copytree(base, folder, dirs_exist_ok=True)
    before = checksums(folder)
    times = {name: (folder / "results/test" / name).stat().st_mtime_ns for name in before}
    (folder / "change.yaml").write_text(yaml.safe_dump(change))
    snakemake(folder, "--configfile", "overlay.yaml", "change.yaml", "--", "data")
    after = checksums(folder)
    made = {name for name in after if times.get(name) != (folder / "results/test" / name).stat().st_mtime_ns}
    assert list(faults(folder / "results/test/shards/index.json")) == []
    return before, after, made


def samples(folder):
    """Record and signals of every sample of a data set, by its key."""
    shards = ShardSet(folder / "results/test/shards/index.json")
    return {shards.keys[n].decode(): (shards.record(n), shards.signal(n).tobytes()) for n in range(len(shards))}


def test_more_motion_models_add_chunks_and_touch_no_other(base, tmp_path):
    before, after, made = extended(base, tmp_path, {"motion": {"models": 20}})
    described = {
        "shards/index.json",
        "shards/README.md",
        "shards/samples.csv",
        "shards/croissant.json",
        "shards/SHA256SUMS",
    }
    assert {name for name in made & set(before)} == described
    assert all(after[name] == before[name] for name in set(before) - described)
    assert {name for name in after if "00001" in name} == made - described
    assert samples(base).items() <= samples(tmp_path).items()


def test_more_snrs_keep_clouds_motion_echoes_and_every_old_sample(base, tmp_path):
    before, after, made = extended(base, tmp_path, {"noise": {"snr_db": [8, float("inf"), 13]}})
    assert {name.partition("/")[0] for name in made} == {"noisy", "shards"}
    assert all(after[name] == before[name] for name in before if name.partition("/")[0] in ("clouds", "motion", "echo"))
    assert samples(base).items() <= samples(tmp_path).items()


def test_more_subtypes_keep_the_other_group_and_every_old_sample(base, tmp_path):
    """A chunk holds all subtypes of its group, so the new subtype's group is made again; its old samples are equal."""
    before, after, made = extended(base, tmp_path, {"targets": {"select": [*SELECT, "AITO M9 2024"]}})
    others = {name for name in before if "unseen-" in name or name.startswith("clouds/")}
    assert not others & made and all(after[name] == before[name] for name in others)
    assert "clouds/aito-m9-2024.npz" in made
    assert samples(base).items() <= samples(tmp_path).items()


def test_more_stations_keep_the_signals_of_the_old_ones(base, tmp_path):
    """Motion keeps clear of every mast and echoes name the network, so all is made again, with the same bytes."""
    network = yaml.safe_load((base / "config/default.yaml").read_text())["network"]["stations"]
    before, after, _ = extended(base, tmp_path, {"network": {"stations": network | STATION}})
    same = {name for name in before if name.startswith(("clouds/", "motion/", "echo/"))}
    assert all(after[name] == before[name] for name in same)
    old, new = (
        np.load(base / "results/test/noisy/seen-00000.npy"),
        np.load(tmp_path / "results/test/noisy/seen-00000.npy"),
    )
    assert old.shape[2] == 3 and new.shape[2] == 4
    np.testing.assert_array_equal(new[:, :, :3], old)
