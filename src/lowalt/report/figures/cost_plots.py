"""Plots of what accuracy costs: of the networks, of the echo, of the effects; and the time of each stage."""

import math

from lowalt.report.plots import Plot

_ACCURACIES = {"unseen_percent": "unseen", "seen_percent": "seen"}
_COSTS = {
    "inference_ms_64": "inference, ms a sample on one core (batch of 64)",
    "core_s_training": "training, core-seconds",
    "network_bytes": "bytes a sample that the network reads",
}
_PER_NAME = {"content": "data"}
_BELOW = {"orient": "bottom", "title": None, "columns": 6}


def recognition(rows: list[dict[str, str]]) -> Plot:
    """Return accuracy over inference time, training time and bytes read; the front of the unseen is joined.

    rows: of accuracy_cost.csv, averages over the SNRs, trained rows only are drawn. Each panel zooms.
    """
    known = [row for row in rows if row["kind"] == "trained" and row["snr_db"] == "avg"]
    data = [
        {"scheme": row["scheme"], "cost": cost, "value": float(row[column]), "subtypes": subtypes,
         "accuracy_percent": float(row[accuracy]), "front": row["front"], "backbone": row.get("backbone", ""),
         "pixels": row.get("pixels", "")}
        for column, cost in _COSTS.items() for accuracy, subtypes in _ACCURACIES.items() for row in known
        if row[column] and row[accuracy]
    ]  # fmt: skip
    name = {"field": "scheme", "type": "nominal", "scale": {"scheme": "tableau20"}}
    panels = []
    for number, cost in enumerate(_COSTS.values()):
        zoom = {"name": f"zoom{number}", "select": "interval", "bind": "scales"}
        across = {"field": "value", "type": "quantitative", "title": cost,
                  "scale": {"type": "linear" if cost.startswith("bytes") else "log", "zero": False}}  # fmt: skip
        up = {"field": "accuracy_percent", "type": "quantitative", "title": "accuracy (%)", "scale": {"zero": False}}
        points = {
            "params": [zoom], "mark": {"type": "point", "size": 70, "opacity": 1, "tooltip": _PER_NAME},
            "encoding": {
                "color": {**name, "legend": _BELOW}, "fill": {**name, "legend": None},
                "fillOpacity": {"field": "subtypes", "type": "nominal", "legend": None,
                                "scale": {"domain": ["unseen", "seen"], "range": [1, 0]}},
            },
        }  # fmt: skip
        front = {"transform": [{"filter": "datum.front == 'yes' && datum.subtypes == 'unseen'"}],
                 "mark": {"type": "line", "interpolate": "step-after", "color": "gray", "strokeWidth": 1}}  # fmt: skip
        layers = [front, points] if number == 0 else [points]
        panels.append({"width": 270, "height": 280, "transform": [{"filter": {"field": "cost", "equal": cost}}],
                       "encoding": {"x": across, "y": up}, "layer": layers})  # fmt: skip
    words = "recognition accuracy over inference time, training time and bytes; filled unseen subtypes, hollow seen"
    return Plot("accuracy_cost", words, {"hconcat": panels}, data)


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
            "spec": {"width": 240, "height": 220, "mark": {"type": "point", "tooltip": _PER_NAME}, "encoding": encoding,
                     "params": [{"name": "zoom", "select": "interval", "bind": "scales"}]}}  # fmt: skip
    return Plot("echo_cost", "time of an echo signal over its error, by method, distance and target", spec, rows)


def _decades(values) -> list[float]:
    """Powers of ten around positive values."""
    found = list(values)
    return [10.0 ** math.floor(math.log10(min(found))), 10.0 ** math.ceil(math.log10(max(found)))]
