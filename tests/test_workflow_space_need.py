"""What a run needs at the limits: what just fits is no fault, and jobs run together as far as the cores reach."""

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from lowalt.common.errors import InputError, SpaceError
from lowalt.workflow import space, space_check, space_measured
from test_workflow_space import (
    CHUNK,
    CONFIG,
    FIGURES,
    PLAN,
    small_disk,  # noqa: F401
)


def test_a_verdict_changes_where_more_is_needed_than_there_is_and_not_before():
    """Exactly what is free suffices; a disk warns beyond nine tenths; a refused job is not warned about as well."""

    def told(disk=0.0, largest=0.0, memory=0.0):
        found = space.Need(disk, largest, "train", memory, 1, ())
        return [[text.split(",")[0] for text in part] for part in space.verdicts(found, 10e9, 2e9, 4e9)]

    assert told(disk=9e9) == told(largest=4e9) == told(memory=2e9) == [[], []]
    assert told(disk=10e9) == [[], ["the run will write 10.0 GB"]] and told(disk=9.01e9)[1]
    assert told(disk=10.01e9) == [["the run will write 10.0 GB"], []]
    assert told(largest=4.01e9, memory=9e9) == [["a job of the rule train will need 4.0 GB of memory"], []]
    assert told(memory=2.01e9) == [[], ["jobs that run at the same time may need 2.0 GB of memory"]]
    assert [space._size(size) for size in (1e9, 999_949_000.0, 0.0)] == ["1.0 GB", "999.9 MB", "0.0 MB"]


def test_the_largest_jobs_that_fit_the_cores_run_together():
    """Three jobs of two threads on five cores: the two largest, and a small one of a thread."""
    figures = {name: space.Figures(0.0, 0.0, size, 0.0, False) for name, size in
               (("a", 5.0), ("b", 7.0), ("c", 6.0), ("d", 1.0), ("e", 0.5))}  # fmt: skip
    jobs = [space.PlannedJob(name, {}, threads=threads) for name, threads in zip("abcde", (2, 2, 2, 1, 1), strict=True)]
    found = space.need(jobs, figures, PLAN, CONFIG, 5)
    assert (found.memory, found.largest_job, found.largest_rule) == (14.0, 7.0, "b")
    assert space.need([], figures, PLAN, CONFIG, 5) == space.Need(0.0, 0.0, "", 0.0, 0, ())


def test_temporary_files_count_as_the_two_largest_a_core():
    figures = {name: space.Figures(size, 0.0, 0.0, 0.0, True) for name, size in (("a", 5.0), ("b", 7.0), ("c", 6.0))}
    jobs = [space.PlannedJob(name, {}) for name in "abcab"]
    assert [space.need(jobs, figures, PLAN, CONFIG, cores).disk for cores in (1, 2, 3)] == [14.0, 25.0, 30.0]


@pytest.mark.parametrize(("share", "disk"), [(0.25, 1.0), (1.0, 1.0), (2.0, 1.0)])
def test_a_file_made_anew_needs_what_it_grows_by_and_room_for_the_old_one_until_then(share, disk):
    """A smaller file than the one that is there adds nothing, and stands next to it while it is written."""
    whole = FIGURES["noise"].disk(space.units("noise", CHUNK, PLAN, CONFIG))
    again = space.PlannedJob("noise", CHUNK, existing=share * whole)
    assert space.need([again], FIGURES, PLAN, CONFIG, 2).disk == disk * whole
    figures = {"a": space.Figures(5.0, 0.0, 0.0, 0.0, True)}
    assert space.need([space.PlannedJob("a", {})], figures, PLAN, CONFIG, 2).disk == 5.0


def test_a_line_of_the_table_gives_bytes_and_mebibytes_as_bytes(tmp_path):
    table = tmp_path / "space.csv"
    table.write_text(",".join(space.COLUMNS) + "\necho,x,3,5,7,11,no\ntiles,x,0,0,0.5,0,yes\n")
    assert space.read(table) == {
        "echo": space.Figures(3.0, 5.0, 7.0 * 1_048_576, 11.0, False),
        "tiles": space.Figures(0.0, 0.0, 524_288.0, 0.0, True),
    }
    assert (space.read(table)["echo"].disk(2), space.read(table)["echo"].memory(2)) == (13.0, 7.0 * 1_048_576 + 22)


def test_a_shard_of_clean_echoes_holds_one_signal_for_all_levels():
    recipe = CONFIG | {"shards": {"kind": "recipe"}}
    values = 50 * 2 * 3 * 400
    assert space.units("shard", CHUNK | {"fold": "train"}, PLAN, recipe) == 0.8 * values
    assert space.units("noise", CHUNK, PLAN, recipe) == 6 * values


@pytest.fixture
def machine(tmp_path):
    """The files of a machine with 8000 KiB of memory, of which 6000 are free, in control groups of the first kind."""
    (tmp_path / "proc").mkdir()
    (tmp_path / "proc/meminfo").write_text("MemTotal:  8000 kB\nMemAvailable:  6000 kB\n")
    (tmp_path / "sys/fs/cgroup/memory").mkdir(parents=True)
    return tmp_path


@pytest.mark.parametrize(
    ("limit", "used", "found"),
    [(7000, 2000, (5000, 7000)), (7000, 500, (6000, 7000)), (8000, 5000, (6000, 8000)), (9000, 5000, (6000, 8000))],
)
def test_a_control_group_of_the_first_kind_limits_memory_where_it_has_less_than_the_machine(
    machine, limit, used, found
):
    folder = machine / "sys/fs/cgroup/memory"
    (folder / "memory.limit_in_bytes").write_text(f"{1024 * limit}\n")
    (folder / "memory.usage_in_bytes").write_text(f"{1024 * used}\n")
    assert space.memory(machine) == tuple(1024 * size for size in found)


def test_jobs_on_other_machines_need_no_memory_here_and_no_table_no_check(tmp_path, monkeypatch):
    monkeypatch.delenv(space_check.VARIABLE, raising=False)
    table = tmp_path / "space.csv"
    jobs = [space.PlannedJob("noise", CHUNK)]
    assert space_check.check(jobs, PLAN, CONFIG, 1, table, tmp_path) == []
    table.write_text(",".join(space.COLUMNS) + "\nnoise,x,0,0,1e12,0,no\n")
    assert space_check.check(jobs, PLAN, CONFIG, None, table, tmp_path) == []
    with pytest.raises(SpaceError, match="rule noise will need"):
        space_check.check(jobs, PLAN, CONFIG, 1, table, tmp_path)


@pytest.mark.parametrize(("local", "cores"), [(True, 3), (False, None)])
def test_planned_jobs_come_with_what_is_there_of_their_files_and_like_the_rule_that_was_measured(
    local, cores, tmp_path, monkeypatch, caplog
):
    from snakemake.logging import logger

    monkeypatch.setattr(logger, "propagate", True)
    (tmp_path / "a").write_bytes(bytes(5))
    (tmp_path / "b").write_bytes(bytes(7))
    output = [tmp_path / name for name in ("a", "missing", "b")]
    jobs = [SimpleNamespace(rule=SimpleNamespace(name=name), wildcards_dict={"part": "1"}, output=output, threads=2)
            for name in ("echo_in_scene", "tiles")]  # fmt: skip
    workflow = SimpleNamespace(
        dag=SimpleNamespace(needrun_jobs=lambda: jobs), cores=3, local_exec=local, basedir="base"
    )
    asked = []
    monkeypatch.setattr(space_check, "check", lambda *given: asked.append(given) or ["it is narrow"])
    space_check.before(workflow, PLAN, CONFIG)
    ((planned, *_, found_cores, table, folder),) = asked
    assert planned == [space.PlannedJob(name, {"part": "1"}, 12, 2) for name in ("echo", "tiles")]
    assert (found_cores, table, folder) == (cores, Path("base") / space_check.TABLE, Path.cwd() / "results")
    assert "warning: it is narrow" in caplog.text

    def refuse(*given):
        raise InputError("too much")

    monkeypatch.setattr(space_check, "check", refuse)
    with pytest.raises(InputError, match="too much"):
        space_check.before(workflow, PLAN, CONFIG)


def test_a_directory_that_cannot_be_written_tells_what_is_free_to_a_tenth_of_a_megabyte(tmp_path, monkeypatch):
    monkeypatch.setattr(space_check, "free_bytes", lambda folder: 10**12)
    with pytest.raises(InputError, match=r"No such file or directory, 1000000\.0 MB free"):
        space_check.writable(tmp_path / "none", "a")


def test_a_working_directory_needs_room_for_sixty_four_kilobytes(tmp_path, monkeypatch):
    sizes = []

    class File:
        def __enter__(self):
            return SimpleNamespace(write=lambda data: sizes.append(len(data)))

        def __exit__(self, *fault):
            return None

    monkeypatch.setattr(space_check.tempfile, "TemporaryFile", lambda dir: File())
    space_check.writable(tmp_path, "a")
    assert sizes == [65536]


def test_a_rule_without_named_outputs_writes_nothing_and_one_run_s_memory_is_its_largest_job_s(tmp_path, monkeypatch):
    """Two jobs of one run, the smaller of which holds more: no line through them stands for memory."""
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"shards": {}}))
    monkeypatch.setattr(space_measured, "located", lambda config: config)
    monkeypatch.setattr(space_measured, "_plan", lambda config: None)
    monkeypatch.setattr(space_measured, "units", lambda rule, wildcards, plan, config: float(wildcards["size"]))
    for size, held in (("10", 40), ("30", 80)):
        path = tmp_path / f"benchmarks/index/{size}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"rule_name": "index", "wildcards": {"size": size}, "max_rss": held}))
    assert space_measured.jobs(tmp_path) == [("index", 10.0, 0.0, 40 * 2**20), ("index", 30.0, 0.0, 80 * 2**20)]
    (row,) = space_measured.measure([tmp_path])
    assert [row[name] for name in space.COLUMNS[2:]] == ["0", "0", "80", "0", "no"]


def test_a_table_of_stages_counts_an_echo_job_as_one_station_or_as_all(tmp_path, monkeypatch):
    monkeypatch.chdir(Path(__file__).parent.parent)
    (tmp_path / "stages.csv").write_text("rule,peak_mib\necho,300\n")
    sizes = [space_measured.largest(tmp_path / "stages.csv", CONFIG | {"echo": {"job": job}})[0][1]
             for job in ("chunk", "station")]  # fmt: skip
    assert sizes[0] == 3 * sizes[1] and sizes[1] % (50 * 400) == 0


def test_jobs_on_other_machines_share_this_one_s_disk_as_on_one_core_and_none_of_its_memory(tmp_path, monkeypatch):
    """Two temporary files at a time, and jobs of a million GB of memory."""
    table = tmp_path / "space.csv"
    table.write_text(",".join(space.COLUMNS) + "\nnoise,x,1e18,0,1e9,0,yes\n")
    monkeypatch.setenv(space_check.VARIABLE, "warn")
    (told,) = space_check.check([space.PlannedJob("noise", CHUNK)] * 5, PLAN, CONFIG, None, table, tmp_path)
    assert told.startswith("the run will write 2000000000.0 GB, ")


@pytest.mark.parametrize("place", ["results", "results/a", "results/a/echo"])
def test_a_folder_of_results_that_cannot_be_written_is_refused(small_disk, tmp_path_factory, place):  # noqa: F811
    tmp_path = tmp_path_factory.mktemp("large_disk")
    (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / place).symlink_to(small_disk)
    space_check.writable(tmp_path, "a")
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(InputError, match=rf"{small_disk}: cannot write into this folder \(Read-only file system"):
        space_check.writable(tmp_path, "a")
    if place != "results":
        space_check.writable(tmp_path, "b")
