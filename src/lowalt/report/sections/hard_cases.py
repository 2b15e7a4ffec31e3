"""Section: inputs on which a formula written down naively fails, with its error, ours and the proved bound."""

from lowalt.measure.hard_cases import COLUMNS
from lowalt.report.run import ReportedRun


def values(run: ReportedRun) -> dict | None:
    """Return the rows of the table of hard cases; None where neither run nor reference has one."""
    name = run.inputs.own_or_kept("hard_cases")
    if name is None:
        return None
    rows = run.inputs.table(name, *COLUMNS)
    return {"own": name == "hard_cases", "rows": rows, "hardware": rows[0]["hardware"]}
