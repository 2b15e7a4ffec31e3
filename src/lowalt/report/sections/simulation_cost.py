"""Section: the echo's error against computing time, from the table of `make cost`."""

from lowalt.report.figures import cost_plots
from lowalt.report.plots import for_every_width
from lowalt.report.reported_run import ReportedRun

USUAL = 300
"""Points of a usual target: most built-in ones have 100 to 400."""


def sentence(rows: list[dict[str, str]]) -> str:
    """Return what a tolerance saves; "" where the exact mode or tolerances were not timed.

    rows: of cost.csv.
    """
    times: dict[int, dict[str, float]] = {}
    for row in rows:
        if row["tolerance"]:
            times.setdefault(int(row["points"]), {})[row["tolerance"]] = 1e3 * float(row["seconds"])
    pairs = {
        points: (of["exact"], max(0.0, of["exact"] - min(of.values())))
        for points, of in times.items()
        if "exact" in of and len(of) > 1
    }
    if not pairs:
        return ""
    usual = min(pairs, key=lambda points: abs(points - USUAL))
    most = max(pairs)
    exact, saved = pairs[usual]
    words = (
        f"Exact costs {exact:.2f} ms per signal of {usual} points, and tolerances save at most "
        f"{saved:.2f} ms of it"
    )
    if most != usual:
        exact_of_most, saved_of_most = pairs[most]
        words += f" ({saved_of_most:.0f} of {exact_of_most:.0f} ms at {most} points)"
    if saved < exact / 2:
        words += ", so use exact"
    return f"{words}."


def values(run: ReportedRun) -> dict | None:
    """Return the plot and what it says; None where neither run nor reference has the table."""
    name = run.inputs.own_or_kept("echo_cost")
    if name is None:
        return None
    rows = run.inputs.table(name, *cost_plots.ECHO, "hardware")
    return {
        "own": name == "echo_cost",
        "hardware": rows[0]["hardware"],
        "plot": for_every_width(cost_plots.echo, rows),
        "sentence": sentence(rows),
    }
