"""Plots of the page that can be read off by pointing: Vega-Lite specifications and their rows.

A plot is drawn three times from the same rows: as a still picture in the page, for print and for browsers without
scripts; by Vega in the page, with values at the pointer, zoom, and a legend that picks lines; and as SVG and CSV next
to the page. Vega-Lite was chosen since a plot is a table and a mapping, which a test can check; its scripts add 0.9 MB.
"""

import functools
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup, escape

from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv

VEGA_LITE = "6.4"
"""Version of Vega-Lite whose scripts the page holds, one of those that the converter brings."""
_LOOK = {
    "background": None, "font": "system-ui, sans-serif", "axis": {"gridOpacity": 0.4, "labelFontSize": 11},
    "view": {"stroke": None}, "legend": {"labelLimit": 400, "symbolLimit": 60}, "header": {"labelFontSize": 13},
}  # fmt: skip


class Plot(NamedTuple):
    """Name of its files, description for screen readers, specification without data, and rows of the data."""

    name: str
    description: str
    spec: Mapping
    rows: list[dict]


def whole(plot: Plot) -> dict:
    """Return the specification with its data and the look that all plots share."""
    schema = f"https://vega.github.io/schema/vega-lite/v{VEGA_LITE.partition('.')[0]}.json"
    head = {"$schema": schema, "description": plot.description, "config": _LOOK}
    return {**head, "data": {"values": plot.rows}, **plot.spec}


def svg(plot: Plot) -> str:
    """Return the plot as SVG; equal names and rows give equal text. A plot that was drawn before is not drawn again.

    Names inside it begin with the plot's, so that no two plots of a page share one.
    """
    return _drawn(json.dumps(whole(plot)), plot.name)


@functools.lru_cache(maxsize=64)
def _drawn(specification: str, name: str) -> str:
    """The SVG of a whole specification (JSON)."""
    import vl_convert

    text = vl_convert.vegalite_to_svg(json.loads(specification), vl_version=VEGA_LITE)
    # The library counts clip paths through a process, so their numbers tell what else it has drawn.
    numbers: dict[str, int] = {}
    return re.sub(r'(id="|url\(#)clip(\d+)',
                  lambda match: f"{match[1]}{name}-clip{numbers.setdefault(match[2], len(numbers) + 1)}",
                  text)  # fmt: skip


def scripts() -> str:
    """Return the JavaScript of Vega, Vega-Lite and Vega-Embed for one page, with no end of a script or page in it."""
    import vl_convert

    return re.sub("</(script|body)", r"<\\/\1", vl_convert.javascript_bundle(vl_version=VEGA_LITE))


def plotted(plot: Plot) -> Markup:
    """Return the HTML of a plot: its still picture, and its specification for the page's script."""
    text = json.dumps(whole(plot), sort_keys=True, allow_nan=False).replace("<", "\\u003c")
    return Markup('<figure class="plot"><div role="img" aria-label="{}">{}</div>'
                  '<script type="application/json">{}</script></figure>'
                  ).format(escape(plot.description), Markup(svg(plot)), Markup(text))  # fmt: skip


def write_plots(folder: Path, plots: Iterable[tuple[Plot, str]]) -> None:
    """Write every plot's SVG as {name}.svg and its rows as {name}.csv into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for plot, drawn in plots:
        write_csv(folder / f"{plot.name}.csv", list(plot.rows[0]), plot.rows)
        with replacing(folder / f"{plot.name}.svg") as temporary:
            temporary.write_text(drawn)
