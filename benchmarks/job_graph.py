"""The paper's data set on a cluster: jobs, files, time and file-system calls, from Snakemake's own
job graph.

    python benchmarks/job_graph.py --out results/benchmarks/job_graph.csv

Builds the graph of `config/paper.yaml` with the groups of `profiles/slurm`, and runs no job.
The simulated queue gives each submission one core of a node of its own, and Snakemake notices its
end at the latest after the profile's longest wait. A job takes its stage's time
(results/benchmarks/stages.csv, evenly over the jobs of the stage) and one start of Snakemake,
because the executor for Slurm starts it again for every job of a group. The time of a start is
measured by a dry run, and the calls with a path below the checkout or its environment by strace, in
that dry run and in a real run of one chunk.
"""

import argparse
import csv
import heapq
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import yaml
from snakemake.api import SnakemakeApi
from snakemake.io import is_flagged
from snakemake.settings.types import (
    ConfigSettings,
    DAGSettings,
    GroupSettings,
    OutputSettings,
    Quietness,
    ResourceSettings,
)

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.machine.hardware import describe

ROOT = Path(__file__).parent.parent
COLUMNS = (
    "nodes",
    "most_submitted",
    "models_per_chunk",
    "chunks_per_group",
    "jobs",
    "submissions",
    "most_at_once",
    "files",
    "inodes",
    "minutes",
    "core_hours",
    "starts_percent",
    "calls_millions",
    "calls_per_s",
    "hardware",
)
CASES = ((2, 100, 50, 4), (1000, 100, 50, 4), (1000, 1000, 50, 1), (1000, 1000, 10, 1))
"""Nodes, largest number of submissions at once (--jobs), motion models per chunk, chunks per group.
"""
LONGEST_WAIT_S = 30
"""Of the executor between two looks at the queue."""
SMALL = {
    "run": "small",
    "targets": {"select": ["Crow"]},
    "motion": {"models": 10, "models_per_chunk": 10},
    "shards": {"kind": "signal"},
}


class Graph(NamedTuple):
    """Submissions of a run: the rules of each one's jobs, those it waits for, and all files and
    folders.
    """

    rules: list[list[str]]
    before: list[set[int]]
    files: int
    folders: int


def graph(models_per_chunk: int, chunks: int) -> Graph:
    """Snakemake's graph of the paper's data set, in the profile's groups with `chunks` chunks each."""
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
    given = {"motion": {"models_per_chunk": models_per_chunk}}
    # A dry run prints every job, in spite of `quiet`.
    with (
        Path(os.devnull).open("w") as nothing,
        redirect_stderr(nothing),
        redirect_stdout(nothing),
        SnakemakeApi(OutputSettings(dryrun=True, quiet={Quietness.ALL})) as api,
    ):
        workflow = api.workflow(
            ResourceSettings(cores=1, nodes=100),
            ConfigSettings(config=given, configfiles=[ROOT / "config/paper.yaml"]),
            snakefile=ROOT / "Snakefile",
        )
        made = workflow.dag(DAGSettings(targets={"data"}, forceall=True))
        components = profile["group-components"] | {"chunks": chunks}
        groups = GroupSettings(overwrite_groups=profile["groups"], group_components=components)
        made.execute_workflow(executor="dryrun", group_settings=groups)
        dag = workflow._workflow.dag
        # A dry run takes all jobs for local ones; those that the profile sends to the queue have a
        # group.
        jobs = [job for job in dag.jobs if job.group is not None]
        number = {}
        for place, unit in enumerate(dag.get_jobs_or_groups()):
            number |= dict.fromkeys(unit.jobs if unit.is_group() else [unit], place)
        places = {
            place: new for new, place in enumerate(dict.fromkeys(number[job] for job in jobs))
        }
        rules: list[list[str]] = [[] for _ in places]
        before: list[set[int]] = [set() for _ in places]
        names = set()
        for job in jobs:
            mine = places[number[job]]
            rules[mine].append(job.rule.name)
            waits = {
                places[number[other]] for other in dag.dependencies[job] if other.group is not None
            }
            before[mine] |= waits - {mine}
            kept = [str(path) for path in job.output if not is_flagged(path, "temp")]
            names |= {*kept, *map(str, job.log), *([str(job.benchmark)] if job.benchmark else [])}
            # Snakemake's record of an output.
            names |= {f".snakemake/metadata/{path}" for path in map(str, job.output)}
    names |= {f".snakemake/slurm_logs/{place}.log" for place in range(len(rules))}
    folders = {
        str(folder)
        for name in names
        for folder in Path(name).parents
        if not name.startswith(".snakemake")
    }
    return Graph(rules, before, len(names), len(folders))


def queue(seconds: list[float], before: list[set[int]], slots: int, most: int) -> tuple[float, int]:
    """Seconds until all submissions have ended, and the most that were in the queue at once."""
    after: list[list[int]] = [[] for _ in before]
    for place, others in enumerate(before):
        for other in others:
            after[other].append(place)
    missing = list(map(len, before))
    ready = [place for place, count in enumerate(missing) if not count]
    running: list[tuple[float, int]] = []
    now = 0.0
    largest = 0
    while ready or running:
        largest = max(largest, min(most, len(ready) + len(running)))
        while ready and len(running) < min(slots, most):
            place = ready.pop(0)
            heapq.heappush(running, (now + seconds[place], place))
        now, place = heapq.heappop(running)
        for other in after[place]:
            missing[other] -= 1
            if not missing[other]:
                ready.append(other)
    return now, largest


def traced(folder: Path, *arguments: str) -> int:
    """Calls with a path below the checkout or its environment that Snakemake and all its jobs make."""
    path = folder / "trace"
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *arguments]
    subprocess.run(
        ["strace", "-f", "-qq", "-e", "trace=%file", "-o", path, *command],
        cwd=folder,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    shared = (str(ROOT.resolve()), sys.prefix, str(folder.resolve()))
    named = (re.search(r'"([^"]*)"', line) for line in path.open(errors="replace"))
    return sum(
        1 for found in named if found and (found[1][:1] != "/" or found[1].startswith(shared))
    )


def started() -> tuple[float, float, float]:
    """Core-seconds of one start of Snakemake, its calls, and the calls of one job."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("workflow", "config", "profiles", "src", "envs", "Snakefile"):
            (folder / part).symlink_to(ROOT / part)
        (folder / "small.yaml").write_text(yaml.safe_dump(SMALL))
        arguments = ("--configfile", "small.yaml", "--", "data")
        plan = subprocess.Popen(
            [sys.executable, "-m", "snakemake", "--cores", "1", "-n", *arguments],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        said = plan.stdout.read()
        _, status, used = os.wait4(plan.pid, 0)
        if status:
            raise InputError(f"snakemake -n: {said[-300:]}")
        start = traced(folder, "-n", *arguments)
        whole = traced(folder, *arguments)
        jobs = len(list(folder.glob("results/small/benchmarks/**/*.jsonl")))
    return used.ru_utime + used.ru_stime, start, (whole - start) / jobs


def main() -> None:
    """Measure a start, build the graphs, and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    os.chdir(ROOT)
    start_s, start_calls, job_calls = started()
    print(
        f"a start of Snakemake: {start_s:.1f} core-seconds, {start_calls:.0f} calls; a job:"
        f" {job_calls:.0f} calls"
    )
    with (ROOT / "results/benchmarks/stages.csv").open(newline="") as file:
        measured = {row["stage"]: row for row in csv.DictReader(file) if row["jobs"]}
    graphs = {size: graph(*size) for size in dict.fromkeys(case[2:] for case in CASES)}
    rows = []
    for nodes, most, models_per_chunk, chunks in CASES:
        found = graphs[models_per_chunk, chunks]
        counts = Counter(rule for rules in found.rules for rule in rules)
        # Clouds are made once; every other stage takes as long as its samples.
        scale = {
            rule: 1 if rule == "cloud" else 1_440_000 / float(row["samples"])
            for rule, row in measured.items()
        }
        job_s = {
            rule: scale[rule] * float(row["wall_s"]) / counts[rule]
            for rule, row in measured.items()
            if rule in counts
        }
        seconds = [sum(job_s.get(rule, 0.0) + start_s for rule in rules) for rules in found.rules]
        total_s, largest = queue(
            [one + LONGEST_WAIT_S for one in seconds], found.before, nodes, most
        )
        jobs = sum(counts.values())
        calls = sum(counts.values()) * (start_calls + job_calls)
        sizes = len(found.rules), largest, found.files, found.files + found.folders
        shares = (
            total_s / 60,
            sum(seconds) / 3600,
            100 * jobs * start_s / sum(seconds),
            calls / 1e6,
            calls / total_s,
        )
        rows.append(
            (
                nodes,
                most,
                models_per_chunk,
                chunks,
                jobs,
                *sizes,
                *(f"{share:.3g}" for share in shares),
            )
        )
        print(*rows[-1], sep="  ")
    write_csv(given.out, COLUMNS, [[*row, describe()] for row in rows])


if __name__ == "__main__":
    main()
