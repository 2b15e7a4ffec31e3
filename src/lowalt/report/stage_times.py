"""The table of the time of each rule's jobs, stages.csv."""

from collections.abc import Iterable
from pathlib import Path

from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.machine.job_times import job_times
from lowalt.report.reported_run import ReportedRun

COLUMNS = ("rule", "jobs", "wall_s", "cpu_s", "peak_mib", "samples", "sample_bytes", "hardware")


def stage_times(paths: Iterable[str | Path]) -> list[dict]:
    """Return the time and memory of each rule, from Snakemake's benchmark files.

    One dict per rule: rule, jobs, wall_s and cpu_s (sums over jobs), peak_mib (largest job;
    sampled, so a short peak can be missed).
    Raises: InputError for a file that is no benchmark.
    """
    rules: dict[str, dict] = {}
    for job in map(job_times, paths):
        entry = rules.setdefault(
            job.rule, {"rule": job.rule, "jobs": 0, "wall_s": 0.0, "cpu_s": 0.0, "peak_mib": 0.0}
        )
        entry["jobs"] += 1
        entry["wall_s"] += job.wall_s
        entry["cpu_s"] += job.processor_s
        entry["peak_mib"] = max(entry["peak_mib"], job.peak_mib)
    return list(rules.values())


def write_stages(path: str | Path, run: ReportedRun) -> None:
    """Write the times of the rules as CSV, with samples, bytes per sample and the hardware."""
    samples = len(run.shards)
    sample_bytes = f"{run.sample_bytes:.0f}"
    hardware = describe()
    rows = []
    for entry in stage_times(run.inputs.paths("benchmarks")):
        wall_s = f"{entry['wall_s']:.2f}"
        cpu_s = f"{entry['cpu_s']:.2f}"
        peak_mib = f"{entry['peak_mib']:.0f}"
        figures = (wall_s, cpu_s, peak_mib, samples, sample_bytes, hardware)
        rows.append([entry["rule"], entry["jobs"], *figures])
    write_csv(path, COLUMNS, rows)
