"""Plots of the page: a figure as SVG, in the page and as a file, and its data as CSV."""

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup
from matplotlib.figure import Figure

from lowalt.files.atomic import write_file
from lowalt.files.csv_tables import write_csv
from lowalt.report.figures.style import svg

NARROW_IN = 4.9
"""Width of a figure for telephones, which show 358 pixels beside the page's margins, in inches."""


class Plot(NamedTuple):
    """Name of its files, description for screen readers, its SVG, the rows of its table, and its
    SVG for telephones, "" where it has none.
    """

    name: str
    description: str
    svg: str
    rows: list[dict]
    narrow_svg: str = ""


def drawn(name: str, description: str, figure: Figure, rows: list[dict]) -> Plot:
    """Return a figure as a plot, whose SVG's ids begin with its name, to be unique in a page."""
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{name}-", svg(figure))
    return Plot(name, description, text, rows)


def for_every_width(draw: Callable[..., Plot], *given) -> Plot:
    """Return the plot `draw(*given)`, with the SVG of `draw(*given, narrow=True)` for telephones."""
    plot = draw(*given)
    narrow = draw(*given, narrow=True).svg
    # Both stand in one page, where ids are unique.
    return plot._replace(narrow_svg=narrow.replace(f"{plot.name}-", f"{plot.name}-narrow-"))


def plotted(plot: Plot) -> Markup:
    """Return the HTML of a plot, of which the page's style shows the picture that fits."""
    pictures = Markup('<div class="wide">{}</div>').format(Markup(plot.svg))
    if plot.narrow_svg:
        pictures += Markup('<div class="narrow">{}</div>').format(Markup(plot.narrow_svg))
    return Markup('<figure class="plot"><div role="img" aria-label="{}">{}</div></figure>').format(
        plot.description, pictures
    )


def write_plots(folder: Path, plots: Iterable[Plot]) -> None:
    """Write every plot's SVG as {name}.svg and its rows as {name}.csv into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for plot in plots:
        write_csv(folder / f"{plot.name}.csv", list(plot.rows[0]), plot.rows)
        write_file(folder / f"{plot.name}.svg", plot.svg)
