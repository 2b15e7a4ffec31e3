"""What Snakemake itself takes of a run: its processor time, and the time in which its cores have no job.

    python benchmarks/workflow.py --out results/benchmarks/scheduling.csv [--jobs 1000 10000] [--slots 20] [--seconds 1]

Runs `benchmarks/workflow/Snakefile`, whose jobs only sleep, with the rounds mended by `lowalt.workflow.scheduling`, and
the smallest number of jobs also as Snakemake does it. Sleeping jobs leave the processor to Snakemake, so more of them
run at a time than there are cores (`--slots`), and 10 000 jobs do not take hours. Columns:

    what                what ran: sleeping jobs with mended rounds or as installed; the parts of a real run
    jobs, slots         number of jobs; jobs at a time
    job_s               sum of the jobs' own durations (s)
    wall_s              duration of the whole command (s), with the start of Snakemake and the graph of jobs
    snakemake_s         processor time of Snakemake's own process (s)
    snakemake_percent   snakemake_s in percent of job_s
    start_s             time from the command to the first job (s): modules, rules, graph of jobs
    empty_s             time in which no job ran (s)
    unused_percent      time of the slots in which they had no job, in percent of slots x wall_s
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from lowalt.common.csv_tables import short, write_csv
from lowalt.common.hardware import describe

FOLDER = Path(__file__).parent / "workflow"
SOURCE = Path(__file__).parents[1] / "src"
COLUMNS = (
    "what", "jobs", "slots", "job_s", "wall_s", "snakemake_s", "snakemake_percent", "start_s", "empty_s",
    "unused_percent", "hardware",
)  # fmt: skip
PROGRAM = """
import atexit, pathlib, sys, time
begin = time.time()
note = lambda: pathlib.Path("times").write_text(f"{begin} {time.time()} {time.process_time()}")
atexit.register(note)
from snakemake.cli import main
main(sys.argv[1:])
"""


def union(intervals: list[tuple[float, float]]) -> float:
    """Return the time that at least one of the intervals (begin, end) covers."""
    covered, until = 0.0, float("-inf")
    for begin, end in sorted(intervals):
        covered += max(0.0, end - max(begin, until))
        until = max(until, end)
    return covered


def row(
    what: str, intervals: list[tuple[float, float]], slots: int, command: tuple[float, float], own_s: float
) -> dict:
    """Return a line of the table from the intervals (begin, end) of jobs and command, and its own time (s)."""
    wall_s = command[1] - command[0]
    job_s = sum(end - begin for begin, end in intervals)
    return {
        "what": what, "jobs": len(intervals), "slots": slots, "job_s": short(job_s), "wall_s": short(wall_s),
        "snakemake_s": short(own_s), "snakemake_percent": short(100 * own_s / job_s),
        "start_s": short(min(begin for begin, _ in intervals) - command[0]),
        "empty_s": short(wall_s - union(intervals)),
        "unused_percent": short(100 * (1 - job_s / (slots * wall_s))), "hardware": describe(),
    }  # fmt: skip


def sleeping(jobs: int, slots: int, seconds: float, mended: bool) -> dict:
    """Return the line of a run of sleeping jobs in an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", PROGRAM, "--snakefile", FOLDER / "Snakefile", "--cores", slots]
        command += ["--scheduler", "greedy", "--benchmark-extended", "--workflow-profile", "none"]
        command += ["--config", f"jobs={jobs}", f"seconds={seconds}", f"mended={mended}", "--", "all"]
        environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
        run = subprocess.run(list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True)
        if run.returncode:
            raise SystemExit(run.stderr[-3000:])
        begin, end, own = map(float, (Path(folder) / "times").read_text().split())
        files = [path for stage in ("first", "second") for path in (Path(folder) / stage).iterdir()]
        intervals = [tuple(map(float, path.read_text().split())) for path in files]
    rounds = "mended rounds" if mended else "rounds as installed"
    return row(f"sleeping jobs of {seconds:g} s; {rounds}", intervals, slots, (begin, end), own)


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(description="Measure what Snakemake itself takes of a run.")
    options.add_argument("--out", required=True)
    options.add_argument("--jobs", type=int, nargs="+", default=[1000, 10000])
    options.add_argument("--slots", type=int, default=20)
    options.add_argument("--seconds", type=float, default=1.0)
    given = options.parse_args()
    cases = [(min(given.jobs), False), *((jobs, True) for jobs in sorted(given.jobs))]
    rows = []
    for jobs, mended in cases:
        rows.append(sleeping(jobs, given.slots, given.seconds, mended))
        print(rows[-1], file=sys.stderr, flush=True)
        write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
