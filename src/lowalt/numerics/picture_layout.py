"""Rounds positions in a figure, so that equal figures give equal bytes in every process."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = 6
"""Decimal places of a position relative to its figure.

They are a thousandth of a pixel for a figure of 1000 pixels.
"""


def settle(figure: "Figure", dpi: float) -> None:
    """Place a figure's axes and sub-figures once, round their positions and end its layout engine.

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
    waiting = list(figure.subfigs)
    while waiting:
        inner = waiting.pop()
        inner.bbox_relative.set_points(inner.bbox_relative.get_points().round(DIGITS))
        waiting += inner.subfigs
    for axes in figure.axes:
        # The drawn position, narrower if both axes have equal scales, follows from this one.
        axes.set_position(Bbox(axes.get_position(original=True).get_points().round(DIGITS)))
        axes.set_in_layout(True)
