"""A data set that grows: what exists is not made again, or is made again with the same bytes."""

import shutil

import numpy as np
import pytest
import yaml
from test_workflow import checksums, snakemake, workplace

from lowalt.shards import ShardSet
from lowalt.shards.verify import faults

pytest.importorskip("snakemake")
pytestmark = [pytest.mark.workflow, pytest.mark.slow]

SELECT = ["DJI Mini 2", "Crow", "Walking Pedestrian 5"]
# Region and clearance are given, so that they do not follow from the stations.
BASE = {
    "run": "test",
    "targets": {"select": SELECT},
    "motion": {
        "models": 10,
        "models_per_chunk": 10,
        "region": {"polygon_m": [[100, 60], [400, 60], [250, 300]], "mast_clearance_m": 10.0},
    },
    "noise": {"snr_db": [8, float("inf")]},
    "shards": {"kind": "signal"},
    "echo": {"job": "station"},
}
STATION = {"D": {"position_m": [800.0, 800.0, 25.0], "normal_deg": 225.0}}


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    folder = workplace(tmp_path_factory.mktemp("base"))
    (folder / "overlay.yaml").write_text(yaml.safe_dump(BASE))
    snakemake(folder, "--", "data")
    return folder


def extended(base, folder, change):
    """A copy of the finished workplace, run again with an overlay; the rules that it ran, and what
    it made.
    """
    shutil.copytree(base, folder, dirs_exist_ok=True, symlinks=True)
    before = checksums(folder)
    times = {name: (folder / "results/test" / name).stat().st_mtime_ns for name in before}
    (folder / "change.yaml").write_text(yaml.safe_dump(change))
    snakemake(folder, "--configfile", "overlay.yaml", "change.yaml", "--", "data")
    after = checksums(folder)
    made = {
        name
        for name in after
        if times.get(name) != (folder / "results/test" / name).stat().st_mtime_ns
    }
    assert list(faults(folder / "results/test/shards/index.json")) == []
    return before, after, made


def samples(folder):
    """Record and signals of every sample of a data set, by its key."""
    shards = ShardSet(folder / "results/test/shards/index.json")
    return {
        shards.keys[n].decode(): (shards.record(n), shards.signal(n).tobytes())
        for n in range(len(shards))
    }


DESCRIBED = {
    f"shards/{name}"
    for name in ("index.json", "README.md", "samples.csv", "croissant.json", "SHA256SUMS")
}
"""Files that list or describe all samples."""


def test_more_motion_models_add_chunks_and_touch_no_other(base, tmp_path):
    before, after, made = extended(base, tmp_path, {"motion": {"models": 20}})
    assert made & set(before) == DESCRIBED
    assert all(after[name] == before[name] for name in set(before) - DESCRIBED)
    assert {name for name in after if "00001" in name} == made - DESCRIBED
    assert samples(base).items() <= samples(tmp_path).items()


def test_snrs_and_subtypes_that_are_added_get_shards_of_their_own_and_touch_no_other(
    base, tmp_path
):
    added = [{"snr_db": [13]}, {"subtypes": ["AITO M9 2024"]}]
    before, after, made = extended(base, tmp_path, {"added": added})
    assert made & set(before) == DESCRIBED
    assert all(after[name] == before[name] for name in set(before) - DESCRIBED)
    new = made - DESCRIBED
    assert {name.partition("/")[0] for name in new} == {
        "clouds",
        "motion",
        "echo",
        "noisy",
        "shards",
    }
    assert {name for name in new if "s1" in name} == {
        name for name in new if "t2" not in name
    } - CLOUD
    # The same samples as where all is made at once, in other shards.
    whole = {
        "noise": {"snr_db": [8, float("inf"), 13]},
        "targets": {"select": [*SELECT, "AITO M9 2024"]},
    }
    at_once = workplace(tmp_path / "at-once")
    (at_once / "overlay.yaml").write_text(yaml.safe_dump(BASE | whole))
    snakemake(at_once, "--", "data")
    assert samples(tmp_path) == samples(at_once)


CLOUD = {"clouds/aito-m9-2024.npz"}


def test_more_stations_keep_clouds_motion_and_the_echoes_of_the_old_ones(base, tmp_path):
    """A sample holds the signals of all stations, so noise and shards are made again; old signals
    stay in them.
    """
    network = yaml.safe_load((base / "config/default.yaml").read_text())["network"]["stations"]
    before, after, made = extended(base, tmp_path, {"network": {"stations": network | STATION}})
    same = {name for name in before if name.startswith(("clouds/", "motion/", "echo/"))}
    assert not same & made and all(after[name] == before[name] for name in same)
    assert {name for name in made if name.startswith("echo/")} == {
        f"echo/{group}-00000/D.npy" for group in ("seen", "unseen")
    }
    old = np.load(base / "results/test/noisy/seen-00000.npy")
    new = np.load(tmp_path / "results/test/noisy/seen-00000.npy")
    assert old.shape[2] == 3 and new.shape[2] == 4
    np.testing.assert_array_equal(new[:, :, :3], old)
