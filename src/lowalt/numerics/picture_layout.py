"""Rounds the positions of a figure's parts, so that equal figures give equal bytes in every
process.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = 6
"""Decimal places of a position relative to its figure: a thousandth of a pixel for a figure of 1000
pixels.
"""


def settle(figure: "Figure", dpi: float) -> None:
    """Let the figure's layout engine place its axes and sub-figures once, then round their places
    and switch it off.

    The solver of matplotlib's constrained layout orders its unknowns by memory address: the last
    bits of its answer differ from process to process, and with them a letter that stands on the
    edge of a pixel. A figure without layout engine is left as it is. Everything must have been
    drawn into the figure before.

    dpi: dots per inch at which the figure will be saved; the width of letters, and so the layout,
    depends on it.
    """
    from matplotlib.transforms import Bbox

    if figure.get_layout_engine() is None:
        return
    figure.set_dpi(dpi)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    parts = list(figure.subfigs)
    for part in parts:
        part.bbox_relative.set_points(part.bbox_relative.get_points().round(DIGITS))
        parts += part.subfigs
    for axes in figure.axes:
        # The drawn position, narrower if both axes have equal scales, follows from this one.
        axes.set_position(Bbox(axes.get_position(original=True).get_points().round(DIGITS)))
        axes.set_in_layout(True)
