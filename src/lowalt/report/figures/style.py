"""Helpers of all figures: PNG bytes that repeat, one colour a scheme, legends that cover no line."""

import base64
import io
from collections.abc import Iterable

import matplotlib
from PIL import Image

matplotlib.use("Agg")  # no screen on a cluster node
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

SNR_LABELS = {"inf": "∞"}


def png(figure: Figure, colours: int = 0) -> bytes:
    """Return the figure as PNG bytes and close it; no dates inside, so equal figures are equal bytes.

    colours: so many at most, for figures full of spectra, which take half the bytes then (0: all).
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    if colours:
        few = Image.open(buffer).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        buffer = io.BytesIO()
        few.save(buffer, format="png", optimize=True)
    return buffer.getvalue()


def scheme_colours(names: Iterable[str]) -> dict[str, tuple]:
    """Return a colour for every scheme, the same in all panels of a figure."""
    distinct = list(dict.fromkeys(names))
    colours = plt.cm.tab10 if len(distinct) <= 10 else plt.cm.tab20
    return {name: colours(number % colours.N) for number, name in enumerate(distinct)}


def legend_below(figure: Figure, title: str | None = None) -> None:
    """Name the lines of all panels once, under the figure, where no legend covers a line."""
    entries = {}
    for panel in figure.axes:
        handles, labels = panel.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    figure.legend(
        entries.values(), entries.keys(), title=title, fontsize=8, title_fontsize=8, loc="upper center",
        bbox_to_anchor=(0.5, 0), ncols=min(max(len(entries), 1), 4),
    )  # fmt: skip


def embedded(data: bytes) -> str:
    """Return PNG bytes as the address of a picture that is part of the page."""
    return "data:image/png;base64," + base64.b64encode(data).decode()
