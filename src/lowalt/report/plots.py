"""Plots of the page: a figure as SVG, in the page and as a file, and its data as CSV."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup
from matplotlib.figure import Figure

from lowalt.files.atomic import write_file
from lowalt.files.csv_tables import write_csv
from lowalt.report.figures.style import svg


class Plot(NamedTuple):
    """Name of its files, description for screen readers, its SVG, and the rows of its table."""

    name: str
    description: str
    svg: str
    rows: list[dict]


def drawn(name: str, description: str, figure: Figure, rows: list[dict]) -> Plot:
    """Return a figure as a plot, whose SVG's ids begin with its name, to be unique in a page."""
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{name}-", svg(figure))
    return Plot(name, description, text, rows)


def plotted(plot: Plot) -> Markup:
    """Return the HTML of a plot."""
    return Markup('<figure class="plot"><div role="img" aria-label="{}">{}</div></figure>').format(
        plot.description, Markup(plot.svg)
    )


def write_plots(folder: Path, plots: Iterable[Plot]) -> None:
    """Write every plot's SVG as {name}.svg and its rows as {name}.csv into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for plot in plots:
        write_csv(folder / f"{plot.name}.csv", list(plot.rows[0]), plot.rows)
        write_file(folder / f"{plot.name}.svg", plot.svg)
