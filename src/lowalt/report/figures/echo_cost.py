"""The figure of the echo's accuracy over its time, and of the pixels that change at each tolerance.

python -m lowalt.report.figures.echo_cost --table cost.csv --pixels cost_pixels.csv --figure cost.png
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import read_csv
from lowalt.numerics.picture_layout import settle

DPI = 110
"""Dots per inch."""
MEASURED = ("method", "category", "points", "range_m", "tolerance", "seconds", "relative_error")
PIXELS = ("category", "range_m", "tolerance", "changed_share")


def _time_panel(panel, measured: list[dict[str, str]], methods: list[str], distances: list[float]) -> None:
    """Time a sample over its error for one category: colour says the method, marker the distance."""
    for distance in distances:
        curve = [line for line in measured if line["method"] == "engine" and float(line["range_m"]) == distance]
        steps = sorted((float(line["relative_error"]), 1e3 * float(line["seconds"])) for line in curve)
        panel.plot(*np.reshape(steps, (-1, 2)).T, color=f"C{methods.index('engine')}", lw=0.7, alpha=0.5)
    for line in measured:
        error = max(float(line["relative_error"]), 1e-17)
        engine = line["method"] == "engine"
        panel.plot(
            error, 1e3 * float(line["seconds"]), marker="osD^v"[distances.index(float(line["range_m"])) % 5],
            color=f"C{methods.index(line['method'])}", markersize=7 if line["tolerance"] == "exact" else 4.5,
            fillstyle="none" if engine and line["tolerance"] != "exact" else "full", linestyle="none",
        )  # fmt: skip
    panel.set(xscale="log", yscale="log", xlabel="measured error / largest value")
    panel.xaxis.set_major_locator(LogLocator(numticks=6))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(alpha=0.3)


def _pixel_panel(panel, rows: list[dict], distances: list[float]) -> None:
    """Share of pixels that change over the tolerance for one category, a line a distance."""
    for index, distance in enumerate(distances):
        chosen = sorted((row["tolerance"], 100 * row["changed_share"]) for row in rows if row["range_m"] == distance)
        panel.plot(*zip(*chosen, strict=True), "osD^v"[index % 5] + "-", color=str(0.6 * index / len(distances)),
                   markersize=4, linewidth=1)  # fmt: skip
    panel.set(xscale="log", xlabel="tolerance asked for")
    panel.set_yscale("symlog", linthresh=1e-3)
    panel.grid(alpha=0.3)


def figure(measured: list[dict[str, str]], pixels: list[dict[str, str]]) -> Figure:
    """Return the figure, a column a category: time over error above, a row a number of points, and changed pixels over
    tolerance below.

    measured, pixels: rows of the two tables, as text (columns MEASURED and PIXELS).
    """
    numbers = ("range_m", "tolerance", "changed_share")
    rows = [{**row, **{name: float(row[name]) for name in numbers}} for row in pixels]
    categories = list(dict.fromkeys(row["category"] for row in rows))
    distances = sorted({float(row["range_m"]) for row in [*rows, *measured]})
    methods = list(dict.fromkeys(line["method"] for line in measured))
    by_category = {name: [line for line in measured if line["category"] == name] for name in categories}
    counts = {name: sorted({int(line["points"]) for line in mine}) for name, mine in by_category.items()}
    tall = max(map(len, counts.values()))
    result = Figure(figsize=(3.6 * len(categories) + 0.6, 3.3 * tall + 4), dpi=DPI, layout="constrained")
    panels = result.subplots(tall + 1, len(categories), sharey="row", squeeze=False)
    for column, category in enumerate(categories):
        for row in range(tall):
            if row >= len(counts[category]):
                panels[row, column].set_visible(False)
                continue
            points = counts[category][row]
            mine = [line for line in by_category[category] if int(line["points"]) == points]
            _time_panel(panels[row, column], mine, methods, distances)
            panels[row, column].set_title(f"{category}, {points} points", fontsize=10)
        _pixel_panel(panels[tall, column], [row for row in rows if row["category"] == category], distances)
    top = 100 * max(row["changed_share"] for row in rows)
    panels[tall, 0].set_ylim(-2e-4, max(2 * top, 1e-2))
    for row in range(tall):
        panels[row, 0].set_ylabel("time a signal (ms), one core")
    panels[tall, 0].set_ylabel("8-bit pixels that change (%)")
    keys = [Line2D([], [], color=f"C{index}", marker=".", linestyle="none", markersize=10, label=method)
            for index, method in enumerate(methods)]  # fmt: skip
    keys += [Line2D([], [], color="0.3", marker="osD^v"[index % 5], linestyle="none", label=f"{distance:g} m")
             for index, distance in enumerate(distances)]  # fmt: skip
    note = Line2D([], [], color="none", label="engine: filled exact, open at tolerances")
    result.legend(handles=[*keys, note], loc="outside upper center", ncols=len(keys) // 2 + 1, fontsize=9)
    return result


def main(arguments: list[str]) -> None:
    """Write the figure."""
    options = argparse.ArgumentParser(prog="python -m lowalt.report.figures.echo_cost", description=__doc__)
    options.add_argument("--table", required=True, help="table of lowalt.measure.echo_cost (.csv)")
    options.add_argument("--pixels", required=True, help="table of lowalt.measure.echo_pixels (.csv)")
    options.add_argument("--figure", required=True, type=Path, help="figure to write (.png)")
    given = options.parse_args(arguments)
    drawn = figure(read_csv(given.table, *MEASURED), read_csv(given.pixels, *PIXELS))
    settle(drawn, DPI)
    with replacing(given.figure) as temporary:
        drawn.savefig(temporary, metadata={"Software": None})


if __name__ == "__main__":
    run(main)
