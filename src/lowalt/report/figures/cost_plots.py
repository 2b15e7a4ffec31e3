"""Plots of accuracy against computing time, for networks and the echo.

python -m lowalt.report.figures.cost_plots echo --table cost.csv --figure cost.svg
"""

import argparse
import math

from matplotlib.figure import Figure

from lowalt.config.command import run
from lowalt.files.atomic import write_file
from lowalt.files.csv_tables import read_csv
from lowalt.report.figures.style import COLOURS, plain
from lowalt.report.plots import NARROW_IN, Plot, drawn

RECOGNITION = (
    "scheme",
    "preset",
    "kind",
    "unseen_percent",
    "low",
    "high",
    "core_s_data",
    "core_s_training",
    "front",
)
PRESET = ("command", "macro_f1_low", "macro_f1_high")
ECHO = ("method", "tolerance", "points", "seconds", "relative_error")
STORED = 2.0**-24
"""Relative rounding error of a stored value (complex64): half a unit in the last place."""


def _rows(rows: list[dict[str, str]]) -> list[dict]:
    """The trained rows of accuracy_cost.csv as numbers, sorted by time.

    The first row of the table is the default.
    """
    base = next(row for row in rows if row["kind"] == "trained")
    first = float(base["unseen_percent"])
    data = []
    for row in sorted((row for row in rows if row["kind"] == "trained"), key=seconds):
        low = float(row["low"])
        high = float(row["high"])
        data.append(
            {
                "scheme": row["scheme"],
                "name": row["preset"] or row["scheme"],
                "core_s": seconds(row),
                "accuracy_percent": float(row["unseen_percent"]),
                "low": first + low,
                "high": min(first + high, 100.0),
                "front": row["front"],
                "same": low <= 0 <= high,
                "first": row is base,
            }
        )
    return data


def recognition(rows: list[dict[str, str]], narrow: bool = False) -> Plot:
    """Plot unseen accuracy against the time for data and training, with its Pareto front.

    rows: of accuracy_cost.csv (keys RECOGNITION); trained ones are drawn, the first scheme with a
    ring. Bars are 95 % intervals
    of the difference to the first scheme; if they contain zero the point is grey. The band spans
    all points not significantly different. narrow: for telephones.
    """
    data = _rows(rows)
    figure = Figure(figsize=(NARROW_IN, 5) if narrow else (9.4, 6), layout="constrained")
    (panel,) = plain(figure.subplots(squeeze=False))
    same = [row["accuracy_percent"] for row in data if row["same"]]
    panel.axhspan(min(same), max(same), color="0.5", alpha=0.2, linewidth=0)
    base = next(row for row in data if row["first"])
    for apart, colour, label in (
        (False, "#6e7781", f"cannot be told apart from {base['name']}"),
        (True, COLOURS[1], "differs"),
    ):
        some = [row for row in data if row["same"] != apart]
        times = [row["core_s"] for row in some]
        low = [row["low"] for row in some]
        high = [row["high"] for row in some]
        panel.vlines(times, low, high, color=colour, alpha=0.5)
        values = [row["accuracy_percent"] for row in some]
        panel.plot(times, values, "o", color=colour, label=label)
    panel.plot(
        base["core_s"],
        base["accuracy_percent"],
        "o",
        markersize=13,
        fillstyle="none",
        color=COLOURS[0],
    )
    front = [row for row in data if row["front"] == "yes"]
    panel.step(
        [row["core_s"] for row in front],
        [row["accuracy_percent"] for row in front],
        where="post",
        color="0.5",
    )
    # There is no point to the upper left of a front point, so names placed there do not overlap
    # points.
    least = min(row["low"] for row in data)
    level = 0.0
    for row in front:
        level = max(row["accuracy_percent"], level) + (100 - least) / 18
        panel.annotate(
            row["name"],
            (row["core_s"], row["accuracy_percent"]),
            (row["core_s"], level),
            ha="right",
            arrowprops={"arrowstyle": "-", "color": "0.5", "linewidth": 0.5},
        )
    for row in data:
        if row["front"] != "yes":
            panel.annotate(
                row["name"],
                (row["core_s"], row["accuracy_percent"]),
                (7, -7),
                textcoords="offset points",
                va="top",
            )
    panel.set(
        xscale="log",
        ylim=(math.floor(least), max(100.0, level) + 1),
        ylabel="accuracy, unseen subtypes (%)",
        xlabel="processor-seconds of data and training",
    )
    for axis in (panel.xaxis.set_major_formatter, panel.xaxis.set_minor_formatter):
        axis("{x:g}")
    panel.tick_params(
        axis="x", which="both", length=3.5, pad=3.5, labelrotation=90 if narrow else 0
    )
    panel.margins(x=0.15)
    panel.legend(loc="lower right", frameon=False)
    words = (
        "accuracy on unseen subtypes over the processor-seconds of data and training, with 95 % "
        "intervals"
    )
    return drawn("accuracy_cost", words, figure, data)


def seconds(row: dict[str, str]) -> float:
    """Processor-seconds of a row's data and training."""
    return float(row["core_s_data"]) + float(row["core_s_training"])


def echo(measured: list[dict[str, str]], narrow: bool = False) -> Plot:
    """Plot the error of a signal against its time, one line per method and tolerance.

    A line joins the numbers of points. measured: rows of cost.csv (keys ECHO); narrow: for
    telephones.
    """
    rows: list[dict] = [
        {
            "method": row["method"],
            "name": ", ".join(filter(None, (row["method"], row["tolerance"]))),
            "points": int(row["points"]),
            "ms": 1e3 * float(row["seconds"]),
            "error": float(row["relative_error"]),
        }
        for row in measured
    ]
    methods = list(dict.fromkeys(row["method"] for row in rows))
    figure = Figure(figsize=(NARROW_IN, 5) if narrow else (9.4, 6), layout="constrained")
    (panel,) = plain(figure.subplots(squeeze=False))
    panel.axhline(STORED, color="0.5", linestyle="--")
    panel.annotate(
        "float32 rounding of what is stored",
        (0, STORED),
        (4, -11),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        color="0.5",
        fontsize=8,
    )
    sizes = {}
    for order, points in enumerate(sorted({row["points"] for row in rows})):
        sizes[points] = 16 + 28 * order
    for name in dict.fromkeys(row["name"] for row in rows):
        line = sorted((row for row in rows if row["name"] == name), key=lambda row: row["points"])
        colour = COLOURS[methods.index(line[0]["method"])]
        times = [row["ms"] for row in line]
        errors = [row["error"] for row in line]
        panel.plot(times, errors, color=colour, linewidth=1)
        panel.scatter(times, errors, [sizes[row["points"]] for row in line], color=colour)
        panel.annotate(
            name,
            (times[-1], errors[-1]),
            (8, 9),
            textcoords="offset points",
            ha="right",
            color=colour,
        )
    panel.set(
        xscale="log",
        yscale="log",
        xlabel="ms per signal, 1 core",
        ylabel="error / largest value of the signal",
    )
    for points, size in sizes.items():
        panel.scatter([], [], size, color="0.5", label=f"{points} points")
    if narrow:
        figure.legend(loc="outside upper center", ncols=2, frameon=False)
    else:
        panel.legend(frameon=False)
    words = "error of an echo signal over its time, by method, tolerance and number of points"
    return drawn("echo_cost", words, figure, rows)


def main(arguments: list[str]) -> None:
    """Write one of the plots as SVG."""
    line = argparse.ArgumentParser(
        prog="python -m lowalt.report.figures.cost_plots", description=__doc__
    )
    line.add_argument("plot", choices=("echo", "recognition"), help="the echo, or the networks")
    line.add_argument("--table", required=True, help="cost.csv or accuracy_cost.csv")
    line.add_argument("--figure", required=True, help="picture to write (.svg)")
    options = line.parse_args(arguments)
    draw, columns = {"echo": (echo, ECHO), "recognition": (recognition, RECOGNITION)}[options.plot]
    svg = draw(read_csv(options.table, *columns)).svg
    # A document may have any background colour.
    write_file(options.figure, svg.replace("<svg", '<svg style="background: white"', 1))


if __name__ == "__main__":
    run(main)
