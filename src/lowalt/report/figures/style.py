"""Helpers for figures: reproducible PNG bytes, and pictures embedded in the page."""

import base64
import io
import re

import matplotlib
import numpy as np
from PIL import Image

from lowalt.numerics.picture_layout import settle

matplotlib.use("Agg")  # cluster nodes have no display
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

DPI = 110
SVG_DPI = 72
"""Dots per inch of PNG figures; points per inch of SVG ones, which matplotlib lays out at that
resolution.
"""

SNR_LABELS = {"inf": "∞"}
COLOURS = [
    "#0969da",
    "#bc4c00",
    "#1a7f37",
    "#8250df",
    "#bf3989",
    "#9a6700",
    "#6e7781",
    "#1b7c83",
    "#cf222e",
    "#953800",
]
"""Colours of lines, which stand out on white and on black."""


def plain(panels: np.ndarray) -> list[Axes]:
    """Return the panels of a plot as a list, with grey lines and a faint grid.

    They suit light and dark pages.
    """
    for panel in panels.flat:
        panel.patch.set_visible(False)
        panel.grid(alpha=0.4)
        panel.tick_params(color="0.5")
        for name, spine in panel.spines.items():
            spine.set(color="0.5", visible=name in ("left", "bottom"))
    return list(panels.flat)


def png(figure: Figure, colours: int = 0) -> bytes:
    """Return the figure as PNG bytes and close it.

    No dates are inside, so equal figures are equal bytes.

    colours: largest number of colours (0: no limit); a limit halves the bytes of figures full of
    spectra.
    """
    buffer = io.BytesIO()
    settle(figure, DPI)
    figure.savefig(buffer, format="png", dpi=DPI, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    if colours:
        few = Image.open(buffer).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        buffer = io.BytesIO()
        few.save(buffer, format="png", optimize=True)
    return buffer.getvalue()


def svg(figure: Figure) -> str:
    """Return the figure as SVG in pixels, without a background, and close it.

    Letters stay letters. No dates and no random names are inside, so equal figures are equal texts.
    """
    buffer = io.StringIO()
    with plt.rc_context({"svg.hashsalt": "lowalt", "svg.fonttype": "none"}):
        settle(figure, SVG_DPI)
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(
            buffer, format="svg", bbox_inches="tight", metadata=nothing, facecolor="none"
        )
    plt.close(figure)
    text = buffer.getvalue()
    return re.sub(r'(width|height)="([\d.]+)pt"', r'\1="\2"', text[text.index("<svg") :])


def embedded(data: bytes) -> str:
    """Return PNG bytes as a data URL, which embeds the picture in the page."""
    return "data:image/png;base64," + base64.b64encode(data).decode()
