"""The long run: its samples and jobs, what processes note of themselves, and that memory that grows is named."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import long_run

from configured import run_of
from lowalt.common.yaml_files import load_yaml
from lowalt.shards import card
from lowalt.shards.build import main as build
from snakemake_runs import run

ROOT = Path(__file__).parents[1]


def entry(words, wall, cpu, peak_mib):
    """A note of one process."""
    return {"words": words.split(), "wall": wall, "cpu": cpu, "peak_kib": 1024 * peak_mib}


def test_the_long_run_has_200_000_samples_in_chunks_of_the_defaults_size():
    plan = run_of(load_yaml(ROOT / long_run.OVERLAY)).plan
    held = [plan.chunk(name) for name in plan.chunks]
    assert sum(chunk.count * len(chunk.members) * len(chunk.snrs) for chunk in held) == 201_600
    assert max(chunk.count for chunk in held) == run_of().plan.models_per_chunk == 50


def test_stages_have_the_sum_of_times_and_the_largest_peak():
    notes = [
        entry("python -m lowalt.echo --settings {}", 3.0, 2.0, 200),
        entry("python -m lowalt.echo --settings {}", 5.0, 4.0, 300),
        entry("python -m snakemake --cores 2", 9.0, 1.0, 150),
        entry("python -m lowalt verify results/long/shards/index.json", 1.0, 0.5, 80),
        entry("python -c pass", 1.0, 0.25, 10),
    ]
    rows = {row.pop("stage"): list(row.values()) for row in long_run.table(notes, 11.0)}
    assert rows == {
        "echo": [2, 8.0, 6.0, 300], "Snakemake": [1, 9.0, 1.0, 150], "verify": [1, 1.0, 0.5, 80],
        "all": [5, 11.0, 7.75, 300],
    }  # fmt: skip


@pytest.mark.parametrize(("stage", "peak", "named"), [
    ("echo", 440.0, []), ("echo", 441.0, ["echo: 441 MiB, in the short run 400 MiB"]), ("Snakemake", 900.0, []),
])  # fmt: skip
def test_a_stage_whose_memory_grows_by_more_than_a_tenth_is_named(stage, peak, named):
    rows, lines = long_run.compared([{"stage": stage, "peak_mib": 400.0}], [{"stage": stage, "peak_mib": peak}])
    assert lines == named and rows[0]["growth"] == peak / 400
    small = long_run.compared([{"stage": stage, "peak_mib": 40.0}], [{"stage": stage, "peak_mib": 56.0}])
    assert small[1] == []


def test_each_process_notes_its_own_peak_and_not_that_of_its_parent(tmp_path):
    child = "bytearray(60 << 20)"
    parent = f"import subprocess, sys; x = bytearray(200 << 20); subprocess.run([sys.executable, '-c', {child!r}])"
    notes, wall_s = long_run.noted([[sys.executable, "-c", parent]], tmp_path)
    peaks = sorted(note["peak_kib"] / 1024 for note in notes)
    assert len(peaks) == 2 and 60 < peaks[0] < 150 and 200 < peaks[1] < 300
    assert all(0 < note["wall"] <= wall_s for note in notes)


def test_a_data_set_with_a_changed_byte_ends_the_run(tmp_path):
    """A handful of motion models, made without a workflow and verified by the same command."""
    overlay = tmp_path / "few.yaml"
    overlay.write_text("targets: {select: [Crow, Owl]}\nmotion: {models: 10, models_per_chunk: 10}\n")
    build(["--config", "config/default.yaml", long_run.OVERLAY, str(overlay), "--out", str(tmp_path / "few")])
    (tmp_path / "few/config.yaml").write_text("run: few\n")
    card.write(tmp_path / "few/shards/index.json", tmp_path / "few/config.yaml")
    line = long_run.commands("few", 1, [])[1]
    line[-1] = str(tmp_path / "few/shards/index.json")
    (tmp_path / "notes").mkdir()
    notes, wall_s = long_run.noted([line], tmp_path / "notes")
    assert [row["stage"] for row in long_run.table(notes, wall_s)] == ["verify", "all"]
    shard = next((tmp_path / "few/shards").glob("*.tar"))
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(data)
    (tmp_path / "again").mkdir()
    with pytest.raises(subprocess.CalledProcessError):
        long_run.noted([line], tmp_path / "again")


@pytest.mark.workflow
def test_the_workflow_plans_the_long_run_without_tiles_and_training(tmp_path):
    overlay = long_run.size_overlay("long-again", 150, tmp_path)
    words = long_run.commands("long-again", 2, [overlay])[0]
    status, text = run(ROOT, ["-n", "--quiet", "rules", *words[3:]], os.environ)
    assert status == 0, text[-3000:]
    lines = [line.split() for line in text.splitlines()]
    jobs = {line[0]: int(line[1]) for line in lines if len(line) == 2 and line[1].isdigit()}
    chosen = ("motion", "echo", "noise", "shard", "index", "tiles", "train")
    assert {name: jobs.get(name, 0) for name in chosen} == {
        "motion": 6, "echo": 18, "noise": 6, "shard": 18, "index": 1, "tiles": 0, "train": 0,
    }  # fmt: skip
