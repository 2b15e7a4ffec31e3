"""The table of the time of each rule's jobs."""

from pathlib import Path

from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.report.run import ReportedRun

COLUMNS = ("rule", "jobs", "wall_s", "cpu_s", "peak_mib", "samples", "sample_bytes", "hardware")


def write_stages(path: str | Path, run: ReportedRun) -> None:
    """Write the times of the rules as CSV, with the number of samples, bytes a sample and the hardware."""
    hardware = describe()
    rows = []
    for entry in run.stage_times:
        seconds = (f"{entry['wall_s']:.2f}", f"{entry['cpu_s']:.2f}", f"{entry['peak_mib']:.0f}")
        size = f"{run.sample_bytes:.0f}"
        rows.append([entry["rule"], entry["jobs"], *seconds, len(run.shards), size, hardware])
    write_csv(path, COLUMNS, rows)
