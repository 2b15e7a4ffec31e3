"""The table of the time of each rule's jobs, stages.csv."""

import json
from collections.abc import Iterable
from pathlib import Path

from lowalt.files.atomic import text_of
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.machine.hardware import describe
from lowalt.report.reported_run import ReportedRun

COLUMNS = ("rule", "jobs", "wall_s", "cpu_s", "peak_mib", "samples", "sample_bytes", "hardware")


def _job(path: str | Path) -> dict:
    """One job's measurement from Snakemake's benchmark file, whose last run counts.

    The file is extended JSON lines.
    """
    try:
        last = json.loads(text_of(path, "benchmark").splitlines()[-1])
        return {name: last[name] for name in ("rule_name", "s", "cpu_time", "max_rss")}
    except (ValueError, IndexError, KeyError) as error:
        raise InputError(f"{path}: not an extended benchmark file ({error!r})") from error


def stage_times(paths: Iterable[str | Path]) -> list[dict]:
    """Return the time and memory of each rule, from Snakemake's benchmark files.

    One dict per rule: rule, jobs, wall_s and cpu_s (sums over jobs), peak_mib (largest job;
    sampled, so a short peak can be missed).
    Raises: InputError for a file that is no benchmark.
    """
    rules: dict[str, dict] = {}
    for job in map(_job, paths):
        name = job["rule_name"]
        cpu = job["cpu_time"]
        memory = job["max_rss"]
        entry = rules.setdefault(
            name, {"rule": name, "jobs": 0, "wall_s": 0.0, "cpu_s": 0.0, "peak_mib": 0.0}
        )
        entry["jobs"] += 1
        entry["wall_s"] += float(job["s"])
        # Jobs under Snakemake's sampling interval have no CPU or memory reading; it writes null or
        # "NA".
        if isinstance(cpu, (int, float)):
            entry["cpu_s"] += float(cpu)
        if isinstance(memory, (int, float)):
            entry["peak_mib"] = max(entry["peak_mib"], float(memory))
    return list(rules.values())


def write_stages(path: str | Path, run: ReportedRun) -> None:
    """Write the times of the rules as CSV, with samples, bytes per sample and the hardware."""
    about = len(run.shards), f"{run.sample_bytes:.0f}", describe()
    write_csv(
        path,
        COLUMNS,
        [
            [
                entry["rule"],
                entry["jobs"],
                f"{entry['wall_s']:.2f}",
                f"{entry['cpu_s']:.2f}",
                f"{entry['peak_mib']:.0f}",
                *about,
            ]
            for entry in stage_times(run.inputs.paths("benchmarks"))
        ],
    )
