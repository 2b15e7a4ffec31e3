"""Section: recognition accuracy over time, from a table measured before."""

from lowalt.report.figures.accuracy_cost import FIDELITY, NEEDED, draw
from lowalt.report.figures.style import embedded
from lowalt.report.run import Run


def values(run: Run) -> dict | None:
    """Return the figure; None where the run names no such table."""
    if "accuracy_cost" not in run.inputs:
        return None
    return {"picture": embedded(draw(run.inputs.table("accuracy_cost", *NEEDED, *FIDELITY)))}
