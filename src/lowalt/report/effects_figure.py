"""The figure of `lowalt.report.effects`: one spectrum with and without each effect, time added, accuracy lost."""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from lowalt.report.effect_samples import pixel_change
from lowalt.report.figures import SNR_LABELS, png
from lowalt.tiles.render import VIEWS

ACROSS = 4
"""Pairs of spectra in a row."""


def most_changed(example: np.ndarray, stations: int = 1) -> int:
    """Return which of the first stations' spectra changes most on average; example: (2, V, S, S) uint8."""
    first = example[:, : len(VIEWS) * stations].astype(np.int16)
    return int(np.abs(first[1] - first[0]).mean(axis=(1, 2)).argmax())


def _pairs(panels: np.ndarray, table: list[dict], examples: dict, colours: str) -> None:
    """Fill the panels (n,) with a pair of spectra for each row: without the effects left, with them right."""
    for panel, row in zip(panels, table, strict=False):
        _, example = examples[row["call"]]
        number = most_changed(example)
        gap = np.full((example.shape[2], 6), np.nan)
        pair = np.hstack([example[0, number].astype(float), gap, example[1, number].astype(float)])
        panel.imshow(pair, cmap=colours, vmin=0, vmax=255, aspect="auto", interpolation="nearest")
        share, _ = pixel_change(example[0, number], example[1, number])
        panel.set_title(f"{row['call']} ({VIEWS[number].upper()}, {100 * share:.2g} % changed)", fontsize=9)
    for panel in panels[len(table) :]:
        panel.axis("off")
    for panel in panels:
        panel.set(xticks=[], yticks=[])


def _levels(text: str) -> str:
    """The SNRs of a row in words: "13 inf" is "13 dB and ∞"."""
    return " and ".join(SNR_LABELS.get(level, f"{level} dB") for level in text.split())


def _bars(times, losses, table: list[dict]) -> None:
    """Draw time added (log) and accuracy change with its interval, a bar a row, the first on top."""
    places = np.arange(len(table))[::-1]
    together = ["C1" if row["parts_ms"] != "" else "C0" for row in table]
    smallest = min((row["added_ms"] for row in table if row["added_ms"] > 0), default=1.0)
    floor = 10.0 ** np.floor(np.log10(smallest))
    times.barh(places, [max(row["added_ms"], floor) for row in table], left=0, color=together)
    for place, row in zip(places, table, strict=True):
        parts = f"   (parts: {row['parts_ms']:.3g})" if row["parts_ms"] != "" else ""
        times.text(max(row["added_ms"], floor) * 1.1, place, f"{row['added_ms']:.3g}{parts}", va="center", fontsize=8)
    times.set(xscale="log", xlabel=f"processor ms added a sample and station (base: {table[0]['base_ms']:.2g} ms)")
    times.set_xlim(floor / 2, 30 * max(row["added_ms"] for row in table))
    value = np.array([row["difference_points"] for row in table])
    spread = np.abs(np.array([[row["low"], row["high"]] for row in table]) - value[:, None]).T
    losses.barh(places, value, xerr=spread, color=together, error_kw={"lw": 0.9, "capsize": 2})
    losses.axvline(0, color="0.3", lw=0.8)
    usual = table[0]["snr_db"]
    others = sorted({_levels(row["snr_db"]) for row in table if row["snr_db"] != usual})
    marked = f"; *: {', '.join(others)}" if others else ""
    losses.set_xlabel(f"accuracy change, points, and its 95 % interval; SNR {_levels(usual)}{marked}")
    names = [row["call"] + " *" * (row["snr_db"] != usual) for row in table]
    for panel in (times, losses):
        panel.set_yticks(places, names, fontsize=9)
        panel.grid(axis="x", alpha=0.3)
        panel.set_ylim(-0.6, len(table) - 0.4)


def figure(table: list[dict], examples: dict[str, tuple[str, np.ndarray]], colours: str = "viridis") -> bytes:
    """Return PNG bytes: a pair of spectra a call, free of noise, above the bars of time and accuracy.

    table: rows of `effects.rows`, the first without effects; examples: (subtype, spectra (2, V, S, S) uint8) of each
    call; of a pair the spectrum at the first station that changes most is shown.
    """
    calls = table[1:]
    lines = -(-len(calls) // ACROSS)
    result: Figure = plt.figure(figsize=(14, 1.75 * lines + 0.32 * len(calls) + 2.2), layout="constrained")
    above, below = result.subfigures(2, 1, height_ratios=(1.75 * lines + 0.5, 0.32 * len(calls) + 1.2))
    subtype = examples[table[0]["call"]][0]
    above.suptitle(
        f"{subtype}, first station, no noise: without (left) and with each effect (right); "
        "the spectrum that changes most",
        fontsize=11,
    )
    _pairs(
        np.atleast_1d(above.subplots(lines, min(ACROSS, len(calls)), squeeze=False)).ravel(), calls, examples, colours
    )
    _bars(*below.subplots(1, 2), calls)
    row = table[0]
    below.suptitle(
        f"{row['motion_models']} test motion models; {row['scheme']}, {row['protocol']}, trained without effects, "
        f"{row['accuracy_without_percent']:.1f} % right without them; {row['hardware']}", fontsize=9,
    )  # fmt: skip
    return png(result, 256)
