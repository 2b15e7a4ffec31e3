"""The page's figures, each from plain numbers to PNG bytes."""

import io
from collections.abc import Iterable

import matplotlib
import numpy as np
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


def accuracy_over_snr(ours: dict, published: dict) -> bytes:
    """Draw accuracy over SNR, one panel a protocol; solid is this run, dashed the published value on its own data.

    ours, published: protocol -> scheme -> SNR label -> percent.
    """
    figure, panels = plt.subplots(1, len(ours), figsize=(5.5 * len(ours), 4), squeeze=False)
    colours = scheme_colours(name for schemes in ours.values() for name in schemes)
    for panel, (protocol, schemes) in zip(panels[0], ours.items(), strict=True):
        for scheme, values in schemes.items():
            labels = [label for label in values if label != "avg"]
            panel.plot(labels, [values[label] for label in labels], "o-", color=colours[scheme], label=scheme)
            paper = published.get(protocol, {}).get(scheme, {})
            known = [label for label in labels if label in paper]
            if known:
                panel.plot(known, [paper[label] for label in known], "--", color=colours[scheme], alpha=0.6)
        panel.set(title=f"{protocol} subtypes", xlabel="SNR (dB)", ylabel="accuracy (%)")
        ticks = [label for label in next(iter(schemes.values())) if label != "avg"]
        panel.set_xticks(range(len(ticks)), [SNR_LABELS.get(label, label) for label in ticks])
        panel.grid(alpha=0.3)
    figure.tight_layout()
    legend_below(figure, "solid: this run, dashed: paper" if published else None)
    return png(figure)


def confusion_matrices(counts: dict, categories: tuple[str, ...]) -> bytes:
    """Draw one row-normalised confusion matrix a (protocol, scheme), four a row; counts as `tables.confusion` gives."""
    across = min(len(counts), 4)
    down = -(-len(counts) // across)
    figure, panels = plt.subplots(down, across, figsize=(3.6 * across, 3.7 * down), squeeze=False)
    for panel in panels.flat[len(counts) :]:
        panel.set_axis_off()
    for panel, ((protocol, scheme), cells) in zip(panels.flat, counts.items(), strict=False):
        matrix = np.array([[cells.get((true, guess), 0) for guess in categories] for true in categories], float)
        share = 100 * matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
        panel.imshow(share, cmap="Blues", vmin=0, vmax=100)
        for row, column in np.ndindex(*share.shape):
            dark = share[row, column] > 50
            panel.text(column, row, f"{share[row, column]:.1f}", ha="center", va="center", color="w" if dark else "k")
        panel.set_xticks(range(len(categories)), categories, rotation=30)
        panel.set_yticks(range(len(categories)), categories)
        panel.set_title(f"{protocol}\n{scheme}", fontsize=9)
        panel.set(xlabel="recognised as (%)", ylabel="true")
    figure.tight_layout()
    return png(figure)


def stage_bars(times: list[dict]) -> bytes:
    """Draw the seconds of each rule's jobs, summed; `times` as `tables.stage_times` gives them."""
    figure, panel = plt.subplots(figsize=(7, 0.32 * len(times) + 0.8))
    names = [f"{entry['rule']} ({entry['jobs']})" for entry in times][::-1]
    seconds = [entry["wall_s"] for entry in times][::-1]
    panel.barh(names, seconds)
    panel.bar_label(panel.containers[0], fmt="%.0f s", padding=3)
    panel.set(xlabel="job seconds, summed over jobs (number of jobs in brackets)")
    panel.margins(x=0.12)
    return png(figure)
