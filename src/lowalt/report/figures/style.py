"""Helpers of all figures: PNG bytes that repeat, and pictures as parts of the page."""

import base64
import io

import matplotlib
from PIL import Image

from lowalt.numerics.picture_layout import settle

matplotlib.use("Agg")  # no screen on a cluster node
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

DPI, SVG_DPI = 110, 72
"""Dots per inch of PNG figures; points per inch of SVG ones, which matplotlib lays out at that resolution."""

SNR_LABELS = {"inf": "∞"}


def png(figure: Figure, colours: int = 0) -> bytes:
    """Return the figure as PNG bytes and close it; no dates inside, so equal figures are equal bytes.

    colours: largest number of colours (0: no limit); a limit halves the bytes of figures full of spectra.
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
    """Return the figure as SVG and close it; no dates and no random names inside, so equal figures are equal texts."""
    buffer = io.StringIO()
    with plt.rc_context({"svg.hashsalt": "lowalt"}):
        settle(figure, SVG_DPI)
        figure.savefig(buffer, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    plt.close(figure)
    return buffer.getvalue()


def embedded(data: bytes) -> str:
    """Return PNG bytes as a data URL, so that the page holds the picture itself."""
    return "data:image/png;base64," + base64.b64encode(data).decode()
