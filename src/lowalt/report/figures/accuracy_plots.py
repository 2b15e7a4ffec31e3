"""Plots of what the networks recognise: over SNR, by true and recognised class, over distance and over confidence."""

from lowalt.report.figures.style import SNR_LABELS
from lowalt.report.plots import Plot

PAGE_WIDTH, CELL = 960, 46
"""Width of the page's column, and of a cell of a matrix, in pixels; 100.0 fits into a cell."""
_PICKED = {"name": "picked", "select": {"type": "point", "fields": ["scheme"]}, "bind": "legend"}
_FADE = {"condition": {"param": "picked", "value": 1}, "value": 0.1}
_ACCURACY = {"field": "accuracy_percent", "type": "quantitative", "scale": {"zero": False}, "title": "accuracy (%)"}
_BELOW = {"orient": "bottom", "title": None, "columns": 4}
_SCHEME = {"field": "scheme", "type": "nominal", "legend": _BELOW}


def _lines(across: dict, further: dict | None = None) -> dict:
    """A line and its points over `across`, a colour a scheme; the legend picks schemes."""
    encoding = {"x": across, "y": _ACCURACY, "color": _SCHEME, "opacity": _FADE, **(further or {})}
    return {"encoding": encoding, "layer": [
        {"mark": {"type": "line", "tooltip": {"content": "data"}}, "params": [_PICKED]},
        {"mark": {"type": "point", "filled": True, "size": 45, "tooltip": {"content": "data"}}},
    ]}  # fmt: skip


def over_snr(ours: dict, published: dict) -> Plot:
    """Return accuracy over SNR, a panel a protocol; dashed is the published value on the paper's own data.

    ours, published: protocol -> scheme -> SNR label -> percent. Pointing at an SNR marks it in all panels.
    """
    rows = [
        {"protocol": f"{protocol} subtypes", "scheme": scheme, "snr_db": SNR_LABELS.get(label, label),
         "accuracy_percent": round(value, 3), "source": source}
        for source, table in (("this run", ours), ("paper", published))
        for protocol, schemes in table.items() if protocol in ours
        for scheme, values in schemes.items() if scheme in ours[protocol]
        for label, value in values.items() if label != "avg"
    ]  # fmt: skip
    infinite = set(SNR_LABELS.values())
    order = sorted({row["snr_db"] for row in rows}, key=lambda snr: float("inf" if snr in infinite else snr))
    across = {"field": "snr_db", "type": "ordinal", "sort": order, "title": "SNR (dB)", "axis": {"labelAngle": 0}}
    dash = {
        "field": "source",
        "type": "nominal",
        "sort": ["this run", "paper"],
        "legend": {"orient": "bottom", "title": None},
    }
    shown = _lines(across, {"strokeDash": dash})
    at = {"name": "at", "select": {"type": "point", "encodings": ["x"], "nearest": True, "on": "pointerover",
                                   "clear": "pointerout"}}  # fmt: skip
    # The line under the pointer repeats each SNR; a screen reader passes it over.
    rule = {"mark": {"type": "rule", "color": "gray", "aria": False}, "params": [at], "encoding": {
        "y": {"value": 0}, "y2": {"value": 280}, "strokeDash": {"value": [2, 2]}, "color": {"value": "gray"},
        "opacity": {"condition": {"param": "at", "empty": False, "value": 0.8}, "value": 0},
    }}  # fmt: skip
    spec = {"facet": {"column": {"field": "protocol", "title": None}},
            "spec": {"width": 430, "height": 280, **shown, "layer": [rule, *shown["layer"]]}}  # fmt: skip
    return Plot("accuracy_over_snr", "recognition accuracy over SNR by scheme and protocol", spec, rows)


def confusion(counts: dict, categories: tuple[str, ...]) -> Plot:
    """Return row-normalised confusion matrices, one a (protocol, scheme); counts as `tables.confusion` gives them.

    A class without samples has dashes in its row. The more classes, the fewer matrices stand side by side.
    """
    rows = []
    for (protocol, scheme), cells in counts.items():
        for true in categories:
            total = sum(cells.get((true, guess), 0) for guess in categories)
            for guess in categories:
                samples = cells.get((true, guess), 0)
                percent = 100 * samples / total if total else 0.0
                rows.append({"panel": f"{protocol}: {scheme}", "true": true, "recognised_as": guess, "samples": samples,
                             "percent": round(percent, 2), "shown": f"{percent:.1f}" if total else "-"})  # fmt: skip
    axes = {name: {"field": field, "type": "nominal", "sort": list(categories), "title": title}
            for name, field, title in (("x", "recognised_as", "recognised as (%)"), ("y", "true", "true"))}  # fmt: skip
    shade = {"field": "percent", "type": "quantitative", "scale": {"scheme": "blues", "domain": [0, 100]}}
    ink = {"condition": {"test": "datum.percent > 50", "value": "white"}, "value": "black"}
    text = {"text": {"field": "shown", "type": "nominal"}, "color": ink}
    cells = {"type": "rect", "tooltip": {"content": "data"}}
    layers = [{"mark": cells, "encoding": {"color": {**shade, "legend": None}}},
              {"mark": {"type": "text", "fontSize": 11, "aria": False}, "encoding": text}]  # fmt: skip
    spec = {"facet": {"field": "panel", "title": None, "sort": None},
            "columns": max(1, PAGE_WIDTH // (CELL * len(categories) + 40)),
            "spec": {"width": {"step": CELL}, "height": {"step": CELL}, "encoding": axes, "layer": layers}}  # fmt: skip
    return Plot("confusion", "confusion matrices in percent of the true class", spec, rows)
