"""Plots of what accuracy costs: of the networks, of the echo, of the effects; and the time of each stage."""

import math

from lowalt.report.plots import Plot

NAMES_BELOW = (30, -24, -44, 30, 48, -24)
"""Pixels by which the names of the front's points stand below these, in turn, so that neighbours do not meet."""
_PER_NAME = {"content": "data"}
_BELOW = {"orient": "bottom", "title": None, "columns": 6}


def recognition(rows: list[dict[str, str]]) -> Plot:
    """Return accuracy on unseen subtypes over the time of a training, the front joined and named.

    rows: of accuracy_cost.csv, averages over the SNRs, trained rows only are drawn. Bars are 95 % intervals of the
    difference to the first row; where they hold zero the point is grey: it cannot be told apart from the first.
    """
    known = [row for row in rows if row["kind"] == "trained" and row["snr_db"] == "avg" and row["unseen_percent"]]
    first, kinds = float(known[0]["unseen_percent"]) if known else 0.0, ("the base", "cannot be told apart", "differs")
    data, named = (
        [],
        sorted((row for row in known if row["front"] == "yes"), key=lambda row: float(row["core_s_training"])),
    )
    for row in known:
        held = float(row["low"]) <= 0 <= float(row["high"])
        data.append({
            "scheme": row["scheme"], "core_s": float(row["core_s_training"]), "front": row["front"],
            "accuracy_percent": float(row["unseen_percent"]), "low": first + float(row["low"]),
            "high": first + float(row["high"]), "told": kinds[0] if row is known[0] else kinds[1 if held else 2],
            "side": named.index(row) % len(NAMES_BELOW) if row in named else -1,
        })  # fmt: skip
    x = {"field": "core_s", "type": "quantitative", "title": "core-seconds of a training", "scale": {"type": "log"}}
    y = {"field": "accuracy_percent", "type": "quantitative", "title": "accuracy, unseen subtypes (%)",
         "scale": {"zero": False}}  # fmt: skip
    legend = {"orient": "bottom", "title": None, "columnPadding": 40}
    colour = {"field": "told", "type": "nominal", "legend": legend,
              "scale": {"domain": list(kinds), "range": ["#0550ae", "#8c959f", "#bc4c00"]}}  # fmt: skip
    bar = {"y": {**y, "field": "low"}, "y2": {"field": "high"}, "color": colour}
    layers = [
        {"transform": [{"filter": "datum.front == 'yes'"}],
         "mark": {"type": "line", "interpolate": "step-after", "color": "gray", "strokeWidth": 1}},
        {"mark": {"type": "rule", "opacity": 0.5}, "encoding": bar},
        {"mark": {"type": "point", "filled": True, "size": 70, "opacity": 1, "tooltip": _PER_NAME},
         "encoding": {"color": colour}},
        *({"transform": [{"filter": f"datum.side == {side}"}],
           "mark": {"type": "text", "align": "left", "dx": -6, "dy": below},
           "encoding": {"text": {"field": "scheme", "type": "nominal"}}} for side, below in enumerate(NAMES_BELOW)),
    ]  # fmt: skip
    words = "accuracy on unseen subtypes over the core-seconds of a training, with 95 % intervals of the difference"
    spec = {"width": 720, "height": 340, "encoding": {"x": x, "y": y}, "layer": layers}
    return Plot("accuracy_cost", words, spec, data)


def echo(measured: list[dict[str, str]]) -> Plot:
    """Return time a signal over the measured error, a panel a category and number of points.

    measured: rows of cost.csv. Errors of zero stand at 1e-17.
    """
    rows = [
        {"method": row["method"], "tolerance": row["tolerance"], "target": f"{row['category']}, {row['points']} points",
         "range_m": float(row["range_m"]), "error": max(float(row["relative_error"]), 1e-17),
         "ms": 1e3 * float(row["seconds"])}
        for row in measured
    ]  # fmt: skip
    rows.sort(key=lambda row: (row["target"].partition(",")[0], int(row["target"].split()[-2])))
    bounds = {name: _decades(row[name] for row in rows) for name in ("error", "ms")}
    axes = {
        axis: {"field": field, "type": "quantitative", "title": title, "axis": {"format": ".0e"} if axis == "x" else {},
               "scale": {"type": "log", "domain": bounds[field]}}
        for axis, field, title in (("x", "error", "error / largest value"), ("y", "ms", "ms a signal, one core"))
    }  # fmt: skip
    distance = {"field": "range_m", "type": "nominal", "legend": {**_BELOW, "title": "distance (m)"}}
    encoding = {**axes, "color": {"field": "method", "type": "nominal", "legend": _BELOW}, "shape": distance}
    order = list(dict.fromkeys(row["target"] for row in rows))
    spec = {"facet": {"field": "target", "title": None, "sort": order}, "columns": 4,
            "spec": {"width": 190, "height": 220, "mark": {"type": "point", "tooltip": _PER_NAME}, "encoding": encoding,
                     "params": [{"name": "zoom", "select": "interval", "bind": "scales"}]}}  # fmt: skip
    return Plot("echo_cost", "time of an echo signal over its error, by method, distance and target", spec, rows)


def _decades(values) -> list[float]:
    """Powers of ten around positive values."""
    found = list(values)
    return [10.0 ** math.floor(math.log10(min(found))), 10.0 ** math.ceil(math.log10(max(found)))]
