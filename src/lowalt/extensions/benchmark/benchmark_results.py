"""Section: the kept table of baselines, where the run's data are a benchmark's."""

from lowalt.extensions.benchmark.baseline_table import COLUMNS, tables
from lowalt.report.reported_run import ReportedRun


def values(run: ReportedRun) -> dict | None:
    """Return the benchmark's name, its tables as texts and the hardware; None for other data."""
    if "benchmark" not in run.inputs:
        return None
    rows = run.inputs.table("benchmark", *COLUMNS)
    name = run.inputs.path("benchmark").parent.name
    return {"name": name, "tables": tables(rows), "hardware": rows[0]["hardware"]}
