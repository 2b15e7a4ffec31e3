"""Plots of what accuracy costs in time: of the networks and of the echo.

python -m lowalt.report.figures.cost_plots echo --table cost.csv --figure cost.svg
"""

import argparse
import math

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import read_csv
from lowalt.report.plots import Plot, svg

RECOGNITION = ("scheme", "kind", "unseen_percent", "low", "high", "core_s_data", "core_s_training", "front")
PRESET = ("preset", "command", "macro_f1_low", "macro_f1_high")
ECHO = ("method", "tolerance", "points", "seconds", "relative_error")
STORED = 2.0**-24
"""Half a unit of the last place of a stored value (complex64), relative to it."""
COLOURS = ["#bc4c00", "#8250df", "#6e7781", "#0969da"]
_PER_NAME = {"content": "data"}
_TEXT = {"type": "text", "align": "right", "baseline": "middle"}


def _log(field: str, title: str, values: list[float], room: float, **further) -> dict:
    """A logarithmic axis of a field from half the least of its values to `room` times the largest."""
    scale = {"type": "log", "domain": [min(values) / 2, room * max(values)], "nice": False}
    return {"field": field, "type": "quantitative", "title": title, "scale": scale, **further}


def recognition(rows: list[dict[str, str]]) -> Plot:
    """Return unseen accuracy over the time of data and training, the front joined and named, the first scheme ringed.

    rows: of accuracy_cost.csv (keys RECOGNITION), trained ones are drawn. Bars are 95 % intervals of the difference to
    the first; where they hold zero the point is grey. The band spans all points that cannot be told apart from it.
    """
    known = sorted((row for row in rows if row["kind"] == "trained"), key=seconds)
    base = next(row for row in rows if row["kind"] == "trained")
    first, data = float(base["unseen_percent"]), []
    kinds, level = (f"cannot be told apart from {base['scheme']}", "differs"), 0.0
    for row in known:
        low, high = float(row["low"]), float(row["high"])
        data.append({
            "scheme": row["scheme"], "core_s": seconds(row), "accuracy_percent": float(row["unseen_percent"]),
            "low": first + low, "high": min(first + high, 100.0), "front": row["front"],
            "told": kinds[not low <= 0 <= high], "first": row is base,
        })  # fmt: skip
    least = min(row["low"] for row in data)
    # Left of a point of the front and above it no point lies, so that names that rise from left to right meet nothing.
    for row in data:
        if row["front"] == "yes":
            level = row["level"] = max(row["accuracy_percent"], level) + (100 - least) / 18
    same = [row["accuracy_percent"] for row in data if row["told"] == kinds[0]]
    band = {"values": [{"low": min(same), "high": max(same)}]}
    x = _log("core_s", "processor-seconds of data and training", [row["core_s"] for row in data], 1.3)
    y = {"field": "accuracy_percent", "type": "quantitative", "title": "accuracy, unseen subtypes (%)",
         "scale": {"domain": [math.floor(least), max(100.0, level + 1)], "nice": False}}  # fmt: skip
    colour = {"field": "told", "type": "nominal", "scale": {"domain": list(kinds), "range": ["#6e7781", "#bc4c00"]},
              "legend": {"orient": "bottom", "title": None, "columns": 1}}  # fmt: skip
    span = {"y": {**y, "field": "low"}, "y2": {"field": "high"}}
    front = {"transform": [{"filter": "datum.front == 'yes'"}]}
    layers = [
        {"data": band, "mark": {"type": "rect", "color": "gray", "opacity": 0.2}, "encoding": {"x": None, **span}},
        {**front, "mark": {"type": "line", "interpolate": "step-after", "color": "gray", "strokeWidth": 1}},
        {**front, "mark": {"type": "rule", "color": "gray", "strokeWidth": 0.5},
         "encoding": {"y": y, "y2": {"field": "level"}}},
        {"mark": {"type": "rule", "opacity": 0.5}, "encoding": {**span, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 60, "opacity": 1, "tooltip": _PER_NAME},
         "encoding": {"color": colour}},
        {"transform": [{"filter": "datum.first"}],
         "mark": {"type": "point", "size": 260, "color": "#0969da", "strokeWidth": 2, "opacity": 1}},
        {**front, "mark": {**_TEXT, "dx": 2, "dy": -6},
         "encoding": {"text": {"field": "scheme"}, "y": {**y, "field": "level"}}},
    ]  # fmt: skip
    words = "accuracy on unseen subtypes over the processor-seconds of data and training, with 95 % intervals"
    spec = {"width": 620, "height": 380, "encoding": {"x": x, "y": y}, "layer": layers}
    return Plot("accuracy_cost", words, spec, data)


def seconds(row: dict[str, str]) -> float:
    """Processor-seconds of a row's data and training."""
    return float(row["core_s_data"]) + float(row["core_s_training"])


def echo(measured: list[dict[str, str]]) -> Plot:
    """Return the error of a signal over its time, a line a method and tolerance through the numbers of points.

    measured: rows of cost.csv (keys ECHO).
    """
    rows = [
        {"method": row["method"], "name": ", ".join(filter(None, (row["method"], row["tolerance"]))),
         "points": int(row["points"]), "ms": 1e3 * float(row["seconds"]), "error": float(row["relative_error"])}
        for row in measured
    ]  # fmt: skip
    most, methods = max(row["points"] for row in rows), list(dict.fromkeys(row["method"] for row in rows))
    times, errors = ([row[name] for row in rows] for name in ("ms", "error"))
    axes = {"x": _log("ms", "ms a signal, one core", times, 2),
            "y": _log("error", "error / largest value of the signal", errors, 4, axis={"format": ".0e"})}  # fmt: skip
    colour = {"field": "method", "type": "nominal", "scale": {"domain": methods, "range": COLOURS}, "legend": None}
    size = {"field": "points", "type": "ordinal", "scale": {"range": [20, 160]}, "legend": {"orient": "bottom"}}
    stored = {"error": STORED, "ms": min(times) / 2, "name": "float32 rounding of what is stored"}
    layers = [
        {"data": {"values": [stored]}, "mark": {"type": "rule", "strokeDash": [4, 4], "color": "gray"},
         "encoding": {"x": None}},
        {"data": {"values": [stored]}, "mark": {**_TEXT, "align": "left", "dx": 4, "dy": 8, "color": "gray"},
         "encoding": {"text": {"field": "name"}}},
        {"mark": {"type": "line", "strokeWidth": 1},
         "encoding": {"color": colour, "detail": {"field": "name"}, "order": {"field": "points"}}},
        {"mark": {"type": "point", "filled": True, "opacity": 1, "tooltip": _PER_NAME},
         "encoding": {"color": colour, "size": size}},
        {"transform": [{"filter": f"datum.points == {most}"}], "mark": {**_TEXT, "dx": 8, "dy": -13},
         "encoding": {"text": {"field": "name"}, "color": colour}},
    ]  # fmt: skip
    words = "error of an echo signal over its time, by method, tolerance and number of points"
    return Plot("echo_cost", words, {"width": 620, "height": 380, "encoding": axes, "layer": layers}, rows)


def main(arguments: list[str]) -> None:
    """Write one of the plots as SVG."""
    line = argparse.ArgumentParser(prog="python -m lowalt.report.figures.cost_plots", description=__doc__)
    line.add_argument("plot", choices=("echo", "recognition"), help="the echo, or the networks")
    line.add_argument("--table", required=True, help="cost.csv or accuracy_cost.csv")
    line.add_argument("--figure", required=True, help="picture to write (.svg)")
    options = line.parse_args(arguments)
    draw, columns = {"echo": (echo, ECHO), "recognition": (recognition, RECOGNITION)}[options.plot]
    plot = draw(read_csv(options.table, *columns))
    drawn = svg(plot._replace(spec={**plot.spec, "background": "white"}))
    with replacing(options.figure) as temporary:
        temporary.write_text(drawn)


if __name__ == "__main__":
    run(main)
