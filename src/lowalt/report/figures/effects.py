"""The figure of what effects cost and do: one spectrum with and without each effect, time added, accuracy lost.

    python -m lowalt.report.figures.effects --table effects.csv --samples none.npz adc.npz ... --figure effects.png

`--samples` are the files of `lowalt.measure.effects_samples` from which the table was made; they hold the spectra.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from lowalt.common.command import run
from lowalt.common.csv_tables import read_csv
from lowalt.common.files import replacing
from lowalt.measure.effects_cost import COLUMNS, gathered
from lowalt.measure.effects_samples import pixel_change, read_samples
from lowalt.report.figures.style import SNR_LABELS, png

NUMBERS = ("base_ms", "added_ms", "parts_ms", "accuracy_without_percent", "difference_points", "low", "high")
ACROSS = 4
"""Pairs of spectra in a row."""


def most_changed(example: np.ndarray, spectra: int) -> int:
    """Return which of the first station's spectra changes most on average; example: (2, V, S, S) uint8."""
    first = example[:, :spectra].astype(np.int16)
    return int(np.abs(first[1] - first[0]).mean(axis=(1, 2)).argmax())


def _pairs(panels: np.ndarray, table: list[dict], examples: dict, colours: str) -> None:
    """Fill the panels (n,) with a pair of spectra for each row: without the effects left, with them right."""
    for panel, row in zip(panels, table, strict=False):
        _, example, names = examples[row["call"]]
        number = most_changed(example, len(names))
        gap = np.full((example.shape[2], 6), np.nan)
        pair = np.hstack([example[0, number].astype(float), gap, example[1, number].astype(float)])
        panel.imshow(pair, cmap=colours, vmin=0, vmax=255, aspect="auto", interpolation="nearest")
        share, _ = pixel_change(example[0, number], example[1, number])
        panel.set_title(f"{row['call']} ({names[number].upper()}, {100 * share:.2g} % changed)", fontsize=9)
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


def figure(
    table: list[dict], examples: dict[str, tuple[str, np.ndarray, list[str]]], colours: str = "viridis"
) -> bytes:
    """Return PNG bytes: a pair of spectra a call, free of noise, above the bars of time and accuracy.

    table: rows of `read_rows`, the first without effects; examples: (subtype, spectra (2, V, S, S) uint8, names of
    the spectra) of each call, of which the first station's spectrum that changes most is shown.
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
    return png(result, 48)


def read_rows(path: str | Path) -> list[dict]:
    """Return the rows of effects.csv with their numbers (columns NUMBERS; a scene's `parts_ms` may be empty).

    Raises: InputError where the table is missing or lacks a column.
    """
    rows = read_csv(path, *COLUMNS)
    return [{**row, **{name: float(row[name]) if row[name] else "" for name in NUMBERS}} for row in rows]


def main(arguments: list[str]) -> None:
    """Write the figure."""
    options = argparse.ArgumentParser(prog="python -m lowalt.report.figures.effects", description=__doc__)
    options.add_argument("--table", required=True, help="table of lowalt.measure.effects_cost (.csv)")
    options.add_argument("--samples", nargs="+", required=True, help="files of lowalt.measure.effects_samples (.npz)")
    options.add_argument("--figure", required=True, type=Path, help="figure to write (.png)")
    given = options.parse_args(arguments)
    calls = gathered([read_samples(path) for path in given.samples])
    examples = {
        header["name"]: (str(arrays["example_subtype"]), arrays["example"], arrays["spectra"].tolist())
        for header, arrays in calls
    }
    with replacing(given.figure) as temporary:
        temporary.write_bytes(figure(read_rows(given.table), examples))


if __name__ == "__main__":
    run(main)
