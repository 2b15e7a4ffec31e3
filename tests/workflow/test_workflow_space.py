"""Disk: a run's bytes follow from its arrays, what is there already is not counted, a full disk is
named.
"""

import contextlib
import errno
import os
import re
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from test_workflow import checksums, snakemake, workplace
from test_workflow_extension import BASE

from lowalt.config.layers import load_yaml
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError, SpaceError
from lowalt.shards.plan import Plan
from lowalt.workflow import space

ROOT = Path(__file__).parents[2]
CONFIG = load_yaml(ROOT / "config/default.yaml") | {"run": "space"}
PUBLISHED = {
    name: {"unseen_protocol": group}
    for name, group in [("Crow", "seen"), ("Owl", "seen"), ("Car", "unseen")]
}
PLAN = Plan.of(CONFIG, PUBLISHED)
CHUNK = {"group": "seen", "part": "00001"}
MODELS = 50 * 2
SNRS = 6
SYMBOLS = 400
STATIONS = 3


@pytest.mark.parametrize(
    ("rule", "more", "kind", "expected"),
    [
        ("echo", {"station": "A"}, "image", 8 * MODELS * SYMBOLS),
        ("echo_in_scene", {}, "image", 8 * MODELS * SYMBOLS * STATIONS),
        ("noise", {}, "image", 8 * MODELS * SNRS * SYMBOLS * STATIONS),
        ("shard", {"fold": "train"}, "image", 0.8 * MODELS * SNRS * (2 * 512 + 2048 + 768**2 // 2)),
        ("shard", {"fold": "val"}, "signal", 0.1 * MODELS * SNRS * (2 * 512 + 2048 + 19 * 512)),
        (
            "shard",
            {"fold": "val"},
            "recipe",
            0.1 * MODELS * SNRS * ((2 * 512 + 2048 + 19 * 512) // SNRS),
        ),
        ("views", {"fold": "val", "size": "24"}, "image", 0.1 * MODELS * SNRS * 9 * 24**2),
        ("tiles", {}, "image", 0),
        ("motion", {}, "image", 0),
    ],
)
def test_a_job_leaves_the_bytes_of_its_arrays(rule, more, kind, expected):
    config = CONFIG | {"shards": {"kind": kind}}
    assert space.written(rule, CHUNK | more, PLAN, config) == pytest.approx(expected, rel=1e-12)
    assert space.written("cloud", {"subtype": "crow"}, PLAN, config) == 0


def test_the_shards_of_a_fold_share_its_bytes():
    small = CONFIG | {"shards": {"kind": "image", "largest_mb": 20}}
    plan = Plan.of(small, PUBLISHED)
    wildcards = CHUNK | {"fold": "train"}
    pieces = plan.pieces("seen-00001", "train")
    whole = space.written("shard", wildcards, PLAN, CONFIG)
    assert len(pieces) > 4 and pieces == [f"p{number}" for number in range(len(pieces))]
    assert len(pieces) * space.written("shard", wildcards, plan, small) == pytest.approx(whole)
    assert whole / len(pieces) <= 20e6 < whole / (len(pieces) - 1)
    assert Plan.of(CONFIG | {"shards": {"kind": "image"}}, PUBLISHED).pieces(
        "seen-00001", "train"
    ) == [""]


@pytest.mark.parametrize("there", [0, 1_000_000, 10**9])
def test_a_run_is_refused_where_its_new_bytes_do_not_fit_and_started_when_told(
    there, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(space.VARIABLE, raising=False)
    path = tmp_path / "noisy.npy"
    path.touch()
    os.truncate(path, there)
    job = SimpleNamespace(
        rule=SimpleNamespace(name="noise"), wildcards_dict=CHUNK, output=[str(path)]
    )
    workflow = SimpleNamespace(dag=SimpleNamespace(needrun_jobs=lambda: [job] * 3))
    needed = 3 * max(0, 8 * MODELS * SNRS * SYMBOLS * STATIONS - there)
    monkeypatch.setattr(space, "free_bytes", lambda folder: needed)
    space.before(workflow, PLAN, CONFIG)
    monkeypatch.setattr(space, "free_bytes", lambda folder: needed - 1)
    with pytest.raises(
        SpaceError, match=rf"write {needed / 1e6:.1f} MB, .* free .*LOWALT_SPACE=off"
    ):
        space.before(workflow, PLAN, CONFIG)
    monkeypatch.setenv(space.VARIABLE, "off")
    space.before(workflow, PLAN, CONFIG)
    monkeypatch.setenv(space.VARIABLE, "no")
    with pytest.raises(InputError, match=r"LOWALT_SPACE: 'no', expected off"):
        space.before(workflow, PLAN, CONFIG)


@contextlib.contextmanager
def mounted(folder):
    """Mount a disk of 2 MB at a folder, where this user may."""
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "lowalt", folder], capture_output=True
    ).returncode:
        pytest.skip("mounting a file system needs root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 2 MB of its own."""
    with mounted(tmp_path):
        yield tmp_path


def written(path, size):
    """Write noise in the ways that stages use, through `replacing`."""
    data = np.random.default_rng(0).integers(256, size=size, dtype=np.uint8)
    with replacing(path) as temporary:
        if path.suffix == ".npy":
            np.save(temporary, data)
        elif path.suffix == ".npz":
            np.savez(temporary, data=data)
        elif path.suffix == ".pt":
            torch = pytest.importorskip("torch")
            torch.save({"data": torch.from_numpy(data)}, temporary)
        else:
            temporary.write_bytes(data.tobytes())


@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.pt", "a.tar"])
def test_a_full_disk_names_the_file_the_need_and_what_is_free(small_disk, name):
    path = small_disk / "deep" / name
    written(path, 500_000)
    before = path.read_bytes()
    for size in (2_500_000, 1_600_000):
        with pytest.raises(
            SpaceError, match=rf"{name}: the disk is full; the file needs more than .* MB are free"
        ):
            written(path, size)
        # The old file stays whole, and nothing half-written stays behind.
        assert path.read_bytes() == before and [found.name for found in path.parent.iterdir()] == [
            name
        ]


def test_a_working_directory_that_cannot_be_written_is_refused_by_name_and_reason(small_disk):
    space.writable(small_disk, "a")
    assert list(small_disk.iterdir()) == []
    (small_disk / "other").write_bytes(bytes(2**21 - 2**15))
    with pytest.raises(InputError, match=rf"{small_disk}: .*No space left on device, 0\.0 MB free"):
        space.writable(small_disk, "a")
    (small_disk / "other").unlink()
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(InputError, match="Read-only file system"):
        space.writable(small_disk, "a")


def test_results_on_a_disk_that_is_not_mounted_are_refused(tmp_path):
    (tmp_path / "results").symlink_to(tmp_path / "disk")
    with pytest.raises(
        InputError, match=rf"results: a link to {tmp_path}/disk, which is not there"
    ):
        space.writable(tmp_path, "a")
    (tmp_path / "disk").mkdir()
    space.writable(tmp_path, "a")


def test_a_known_size_is_refused_before_anything_is_written(small_disk):
    words = r"x\.npy: the disk is full; the file needs 3\.0 MB, 2\.1 MB are free"
    with pytest.raises(SpaceError, match=words), replacing(small_disk / "x.npy", 3_000_000):
        raise AssertionError("the block must not run")


def test_a_file_shorter_than_announced_never_takes_its_place(tmp_path):
    with pytest.raises(SpaceError), replacing(tmp_path / "x.npy", 100) as temporary:
        temporary.write_bytes(bytes(99))
    assert list(tmp_path.iterdir()) == []


def test_other_errors_pass_unchanged(tmp_path):
    with pytest.raises(OSError, match="denied") as caught, replacing(tmp_path / "x"):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    assert not isinstance(caught.value, SpaceError)
    with pytest.raises(RuntimeError, match="plain"), replacing(tmp_path / "x"):
        raise RuntimeError("plain")


@pytest.mark.slow
@pytest.mark.workflow
def test_a_run_that_met_a_full_disk_twice_has_the_bytes_of_an_undisturbed_one(
    tmp_path, monkeypatch
):
    """The data set needs three megabytes; the same command continues once there is room."""
    overlay = yaml.safe_dump(BASE | {"motion": BASE["motion"] | {"models": 20}})
    whole = workplace(tmp_path / "whole")
    disturbed = workplace(tmp_path / "disturbed")
    for folder in (whole, disturbed):
        (folder / "overlay.yaml").write_text(overlay)
    snakemake(whole, "--", "data")
    results = disturbed / "results"
    results.mkdir()
    monkeypatch.setenv(space.VARIABLE, "off")
    with mounted(results):
        for size in ("1m", "2m"):
            subprocess.run(["mount", "-o", f"remount,size={size}", results], check=True)
            said = snakemake(disturbed, "--", "data", status=1)
            assert re.search(
                r"^ *error: results/test/\S+: the disk is full; the file needs .* free", said, re.M
            ), said
            assert "Traceback" not in said and not list(results.rglob("*.part*"))
        subprocess.run(["mount", "-o", "remount,size=64m", results], check=True)
        snakemake(disturbed, "--", "data")
        assert checksums(disturbed) == checksums(whole)


@pytest.mark.parametrize("place", ["results", "results/a", "results/a/echo"])
def test_a_folder_of_results_that_cannot_be_written_is_refused(small_disk, tmp_path_factory, place):
    tmp_path = tmp_path_factory.mktemp("large_disk")
    (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / place).symlink_to(small_disk)
    space.writable(tmp_path, "a")
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(
        InputError, match=rf"{small_disk}: cannot write into this folder \(Read-only file system"
    ):
        space.writable(tmp_path, "a")
    if place != "results":
        space.writable(tmp_path, "b")
