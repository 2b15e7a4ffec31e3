"""Disk and memory: needs follow from measured lines, what is there already is not counted, a full disk is named."""

import errno
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError, SpaceError
from lowalt.common.files import replacing
from lowalt.common.plan import Plan
from lowalt.targets.records import load_records
from lowalt.workflow import space, space_check
from lowalt.workflow.space_measured import largest, line

ROOT = Path(__file__).parent.parent
CONFIG = load_yaml(ROOT / "config/default.yaml") | {"run": "space"}
PUBLISHED = {name: {"unseen_protocol": group} for name, group in [("Crow", "seen"), ("Owl", "seen"), ("Car", "unseen")]}
PLAN = Plan.of(CONFIG, PUBLISHED)
CHUNK = {"group": "seen", "part": "00001"}
FIGURES = {
    "noise": space.Figures(100.0, 8.0, 50e6, 10.0, False),
    "tiles": space.Figures(0.0, 0.5, 300e6, 0.0, True),
    "train": space.Figures(2e6, 0.0, 900e6, 0.0, False),
}


def default_plan():
    records = load_records(CONFIG["targets"]["table"], CONFIG["targets"]["records"])
    return Plan.of(CONFIG, {name: record["published"] for name, record in records.items()})


def test_units_are_what_a_job_s_arrays_consist_of():
    models, snrs, symbols = 50, 6, 400
    assert space.units("noise", CHUNK, PLAN, CONFIG) == models * 2 * snrs * 3 * symbols
    assert space.units("echo", CHUNK | {"station": "A"}, PLAN, CONFIG) == models * 2 * symbols
    assert space.units("echo", CHUNK, PLAN, CONFIG) == models * 2 * 3 * symbols
    assert space.units("shard", CHUNK | {"fold": "train"}, PLAN, CONFIG) == models * 2 * snrs * 0.8 * 768**2
    signals = CONFIG | {"shards": {"kind": "signal"}}
    assert space.units("shard", CHUNK | {"fold": "val"}, PLAN, signals) == models * 2 * snrs * 0.1 * 3 * symbols
    assert (
        space.units("views", CHUNK | {"fold": "val", "size": "24"}, PLAN, CONFIG) == models * 2 * snrs * 0.1 * 9 * 24**2
    )
    assert space.units("index", {}, PLAN, CONFIG) == 100 * 3 * snrs


def test_needs_are_sums_by_hand_and_what_is_there_is_not_counted():
    values = 50 * 2 * 6 * 3 * 400
    whole = 100 + 8 * values
    fresh = space.need([space.PlannedJob("noise", CHUNK)] * 3, FIGURES, PLAN, CONFIG, 2)
    assert (fresh.disk, fresh.jobs, fresh.unknown) == (3 * whole, 3, ())
    assert fresh.memory == 2 * fresh.largest_job == 2 * (50e6 + 10 * values)
    # Made again in place: nothing is added except one new file next to the file that it replaces.
    again = space.need([space.PlannedJob("noise", CHUNK, existing=whole)] * 3, FIGURES, PLAN, CONFIG, 2)
    assert again.disk == whole
    # Temporary files: two for each core, however many there are in the run.
    many = space.need([space.PlannedJob("tiles", CHUNK)] * 50, FIGURES, PLAN, CONFIG, 2)
    assert many.disk == 4 * 0.5 * 50 * 2 * 6 * 768**2
    # A job that takes both cores runs alone; the smaller jobs of one thread do not run meanwhile.
    jobs = [space.PlannedJob("train", {}, threads=2), space.PlannedJob("noise", CHUNK)]
    wide = space.need(jobs, FIGURES, PLAN, CONFIG, 2)
    assert wide.memory == wide.largest_job == 900e6 and wide.largest_rule == "train"
    assert space.need([space.PlannedJob("gallery", {})], FIGURES, PLAN, CONFIG, 1).unknown == ("gallery",)


def test_a_run_that_cannot_fit_is_refused_and_one_that_barely_fits_warned_about():
    found = space.Need(disk=10e9, largest_job=2e9, largest_rule="train", memory=4e9, jobs=9, unknown=())
    assert space.verdicts(found, 20e9, 8e9, 8e9) == ([], [])
    stop, warn = space.verdicts(found, 10.5e9, 3e9, 8e9)
    assert stop == [] and "10.0 GB" in warn[0] and "10.5 GB" in warn[0] and "4.0 GB of memory, 3.0 GB" in warn[1]
    stop, _ = space.verdicts(found, 9e9, 8e9, 1e9)
    assert "write 10.0 GB, its disk has 9.0 GB" in stop[0] and "rule train will need 2.0 GB" in stop[1]


def test_memory_is_the_machine_s_or_the_control_group_s_where_that_is_less(tmp_path):
    (tmp_path / "proc").mkdir()
    (tmp_path / "proc/meminfo").write_text("MemTotal:  8000 kB\nMemFree: 1 kB\nMemAvailable:  6000 kB\n")
    assert space.memory(tmp_path) == (6000 * 1024, 8000 * 1024)
    group = tmp_path / "sys/fs/cgroup"
    group.mkdir(parents=True)
    (group / "memory.current").write_text("1000\n")
    (group / "memory.max").write_text("max\n")
    assert space.memory(tmp_path) == (6000 * 1024, 8000 * 1024)
    (group / "memory.max").write_text("5000\n")
    assert space.memory(tmp_path) == (4000, 5000)


def test_a_measured_line_lies_above_all_points_and_finds_an_exact_law():
    base, slope = line([(10, 128 + 80), (1000, 128 + 8000), (50, 128 + 400)])
    assert (base, slope) == (pytest.approx(128), pytest.approx(8))
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = list(zip(rng.uniform(1, 9, 12), rng.uniform(0, 5, 12), strict=True))
        base, slope = line(points)
        assert base >= 0 and slope >= 0
        assert all(base + slope * size >= value * (1 - 1e-12) for size, value in points)
    assert line([(7.0, 5.0), (7.0, 3.0)]) == (5.0, 0.0)
    # Jobs of no units that write nothing.
    assert line([(0.0, 0.0), (0.0, 0.0)]) == (0.0, 0.0)
    assert line([(1.0, 5.0), (3.0, 4.9)]) == (5.0, 0.0)
    # A slope that adds less than a millionth of the largest value over all sizes is rounding.
    for whole in (1.0, 4e9):
        assert line([(0.0, whole), (200.0, whole * (1 + 9e-7))]) == (whole * (1 + 9e-7), 0.0)
        base, slope = line([(0.0, whole), (200.0, whole * (1 + 2e-6))])
        assert (base, 200 * slope) == (pytest.approx(whole), pytest.approx(2e-6 * whole, rel=1e-6))


def test_a_table_of_stages_tells_the_memory_of_the_largest_jobs(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    (tmp_path / "stages.csv").write_text("rule,peak_mib\nviews,300\nnoise,100\nechoes,1\ntrain,900\n")
    found = {rule: (size, held / 2**20) for rule, size, held in largest(tmp_path / "stages.csv", CONFIG)}
    # The default has 40 subtypes of 100 motion models, and as many seen subtypes as unseen ones, or more.
    samples = max(map(len, default_plan().groups.values())) * 50 * 6
    pixels = CONFIG["recognition"]["size"] ** 2
    assert found["views"] == (samples * 0.8 * 9 * pixels, 300)
    assert found["noise"] == (samples * 3 * 400, 100)
    assert found["train"] == (40 * 100 * 6 * 9 * pixels, 900)


def test_training_that_reads_shards_holds_no_views():
    fresh = CONFIG | {"recognition": CONFIG["recognition"] | {"cache": False}}
    assert space.units("train", {}, PLAN, fresh) == 0 < space.units("train", {}, PLAN, CONFIG)


def test_the_kept_figures_are_exact_for_signals():
    """Signals are complex64 behind a header of 128 bytes, which the measured table must have found."""
    figures = space.read(ROOT / "results/reference/space.csv")
    for rule in ("echo", "noise"):
        assert (figures[rule].disk_base, figures[rule].disk_unit) == (128, 8)
    assert figures["tiles"].temporary and not figures["noise"].temporary


def test_the_check_refuses_warns_or_is_off(tmp_path, monkeypatch):
    table = tmp_path / "space.csv"
    table.write_text(",".join(space.COLUMNS) + "\nnoise,x,1e18,0,1,0,no\n")
    arguments = ([space.PlannedJob("noise", CHUNK)], PLAN, CONFIG, 1, table, tmp_path)
    monkeypatch.delenv(space_check.VARIABLE, raising=False)
    with pytest.raises(SpaceError, match=r"1000000000\.0 GB.*LOWALT_SPACE=warn"):
        space_check.check(*arguments)
    monkeypatch.setenv(space_check.VARIABLE, "warn")
    assert "GB free" in space_check.check(*arguments)[0]
    monkeypatch.setenv(space_check.VARIABLE, "off")
    assert space_check.check(*arguments) == []
    monkeypatch.setenv(space_check.VARIABLE, "no")
    with pytest.raises(InputError, match="LOWALT_SPACE"):
        space_check.check(*arguments)


def test_a_run_that_ends_on_a_full_disk_says_how_much_is_free(tmp_path, monkeypatch, caplog):
    from snakemake.logging import logger

    monkeypatch.setattr(logger, "propagate", True)
    monkeypatch.setattr(space_check, "free_bytes", lambda folder: 500_000)
    space_check.after(tmp_path)
    assert f"the disk of {(tmp_path / 'results').resolve()} is full (0.5 MB free)" in caplog.text
    for free, text in ((2**20 - 1, "1.0"), (250_000, "0.2"), (750_000, "0.8")):
        caplog.clear()
        monkeypatch.setattr(space_check, "free_bytes", lambda folder, free=free: free)
        space_check.after(tmp_path)
        assert f"is full ({text} MB free)" in caplog.text
    caplog.clear()
    monkeypatch.setattr(space_check, "free_bytes", lambda folder: 2**20)
    space_check.after(tmp_path)
    assert not caplog.text


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 2 MB of its own, where this user may mount one."""
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "lowalt", tmp_path], capture_output=True)
    if mounted.returncode:
        pytest.skip("mounting a file system needs root")
    yield tmp_path
    subprocess.run(["umount", tmp_path], check=True)


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
        with pytest.raises(SpaceError, match=rf"{name}: the disk is full; the file needs more than .* MB are free"):
            written(path, size)
        # The old file stays whole, and nothing half-written stays behind.
        assert path.read_bytes() == before and [found.name for found in path.parent.iterdir()] == [name]


def test_a_working_directory_that_cannot_be_written_is_refused_by_name_and_reason(small_disk):
    space_check.writable(small_disk, "a")
    assert list(small_disk.iterdir()) == []
    (small_disk / "other").write_bytes(bytes(2**21 - 2**15))
    with pytest.raises(InputError, match=rf"{small_disk}: .*No space left on device, 0\.0 MB free"):
        space_check.writable(small_disk, "a")
    (small_disk / "other").unlink()
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(InputError, match="Read-only file system"):
        space_check.writable(small_disk, "a")


def test_results_on_a_disk_that_is_not_mounted_are_refused(tmp_path):
    (tmp_path / "results").symlink_to(tmp_path / "disk")
    with pytest.raises(InputError, match=rf"results: a link to {tmp_path}/disk, which is not there"):
        space_check.writable(tmp_path, "a")
    (tmp_path / "disk").mkdir()
    space_check.writable(tmp_path, "a")


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
