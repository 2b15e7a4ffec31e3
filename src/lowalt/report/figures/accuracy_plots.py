"""Plots of accuracy over SNR, and confusion matrices."""

import math
from collections.abc import Iterator
from itertools import cycle, product

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lowalt.report.figures.style import COLOURS, SNR_LABELS, plain
from lowalt.report.plots import NARROW_IN, Plot, drawn

PAGE_WIDTH = 960
CELL = 46
"""Width of the page's column, and of a cell of a matrix, in pixels; 100.0 fits into a cell."""
SOURCES: dict = {"this run": "-", "paper": "--"}
"""Style of the lines of each source."""


def _rows_over_snr(ours: dict, published: dict) -> Iterator[dict]:
    """Yield the rows of `over_snr`: of both sources, what protocols and schemes `ours` has."""
    for source, table in zip(SOURCES, (ours, published), strict=True):
        for protocol, schemes in table.items():
            for scheme, values in schemes.items():
                if scheme not in ours.get(protocol, {}):
                    continue
                for label, value in values.items():
                    if label != "avg":
                        yield {
                            "protocol": f"{protocol} subtypes",
                            "scheme": scheme,
                            "snr_db": SNR_LABELS.get(label, label),
                            "accuracy_percent": round(value, 3),
                            "source": source,
                        }


def over_snr(ours: dict, published: dict, narrow: bool = False) -> Plot:
    """Return accuracy over SNR, one panel per protocol, with the paper's values dashed.

    ours, published: protocol -> scheme -> SNR label -> percent; the published ones are those on the
    paper's data; narrow: one panel below the other.
    """
    rows = list(_rows_over_snr(ours, published))
    infinite = set(SNR_LABELS.values())
    levels = sorted(
        {row["snr_db"] for row in rows}, key=lambda snr: float("inf" if snr in infinite else snr)
    )
    schemes = list(dict.fromkeys(row["scheme"] for row in rows))
    colours = {scheme: COLOURS[number % len(COLOURS)] for number, scheme in enumerate(schemes)}
    names = [f"{protocol} subtypes" for protocol in ours]
    columns = 1 if narrow else len(names)
    lines = math.ceil(len(names) / columns)
    legend_columns = 2 if narrow else 4
    wide = NARROW_IN if narrow else 6.5 * columns
    high = 4 * lines + 0.2 * math.ceil(len(schemes) / legend_columns)
    figure = Figure(figsize=(wide, high), layout="constrained")
    panels = plain(figure.subplots(lines, columns, sharey=True, squeeze=False))
    for panel, name in zip(panels, names, strict=True):
        for scheme, source in dict.fromkeys((row["scheme"], row["source"]) for row in rows):
            line = [
                (levels.index(row["snr_db"]), row["accuracy_percent"])
                for row in rows
                if (row["protocol"], row["scheme"], row["source"]) == (name, scheme, source)
            ]
            panel.plot(
                *np.array(line).reshape(-1, 2).T,
                SOURCES[source],
                marker="o",
                ms=4,
                color=colours[scheme],
            )
        panel.set(title=name, xlabel="SNR (dB)", xticks=range(len(levels)), xticklabels=levels)
    for panel in panels[::columns]:
        panel.set_ylabel("accuracy (%)")
    handles = [Line2D([], [], color=colour, label=scheme) for scheme, colour in colours.items()]
    handles += [
        Line2D([], [], linestyle=style, color="0.5", label=source)
        for source, style in SOURCES.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=legend_columns, frameon=False)
    return drawn(
        "accuracy_over_snr", "recognition accuracy over SNR by scheme and protocol", figure, rows
    )


def confusion(counts: dict, categories: tuple[str, ...], narrow: bool = False) -> Plot:
    """Return row-normalised confusion matrices, one per (protocol, scheme).

    counts: as returned by `pivots.confusion`; narrow: one matrix below the other. A class without
    samples has dashes in its row. With more classes, fewer matrices are placed side by side.
    """
    count = len(categories)
    fitting = PAGE_WIDTH // (CELL * count + 40)
    columns = 1 if narrow else max(1, min(len(counts), fitting))
    side = (CELL * count + 40) / 72
    figure = Figure(
        figsize=(columns * side, math.ceil(len(counts) / columns) * (side + 0.6)),
        layout="constrained",
    )
    panels = plain(figure.subplots(math.ceil(len(counts) / columns), columns, squeeze=False))
    rows: list[dict] = []
    for panel, ((protocol, scheme), cells) in zip(panels, counts.items(), strict=False):
        totals = []
        shares = []
        for true in categories:
            answers = [cells.get((true, guess), 0) for guess in categories]
            total = sum(answers)
            totals.append(total)
            shares.append([100 * answer / max(total, 1) for answer in answers])
        panel.pcolormesh(shares, cmap="Blues", vmin=0, vmax=100, edgecolors="white")
        for line, (true, total) in enumerate(zip(categories, totals, strict=True)):
            for column, guess in enumerate(categories):
                percent = shares[line][column]
                shown = f"{percent:.1f}" if total else "-"
                ink = "white" if percent > 50 else "0.2"
                panel.text(column + 0.5, line + 0.5, shown, color=ink, ha="center", va="center")
                rows.append(
                    {
                        "panel": f"{protocol}: {scheme}",
                        "true": true,
                        "recognised_as": guess,
                        "samples": cells.get((true, guess), 0),
                        "percent": round(percent, 2),
                        "shown": shown,
                    }
                )
        centres = [number + 0.5 for number in range(count)]
        panel.set_title(f"{protocol}: {scheme}", fontsize=9)
        panel.set(xlabel="recognised as (%)", ylabel="true", aspect="equal")
        panel.set_xticks(centres, categories, rotation=90)
        panel.set_yticks(centres, categories)
        panel.invert_yaxis()
        panel.grid(False)
    for panel in panels[len(counts) :]:
        panel.set_axis_off()
    return drawn("confusion", "confusion matrices in percent of the true class", figure, rows)


def confusion_by_snr(
    rows: list[dict[str, str]], categories: tuple[str, ...], narrow: bool = False
) -> Plot:
    """Return what each class is taken for at each SNR, as a panel per protocol and true class.

    A panel has a bar per SNR of the shares (percent) of all answers. rows: those of
    confusion_by_snr.csv, one scheme per protocol; narrow: two panels side by side.
    """
    counts = {
        (row["protocol"], row["snr_db"], row["category"], row["predicted"]): int(row["samples"])
        for row in rows
    }
    schemes = {row["protocol"]: row["scheme"] for row in rows}
    levels = sorted({row["snr_db"] for row in rows}, key=float)
    shown_in_panels = list(product(schemes, categories))
    columns = min(len(categories), 2 if narrow else 4)
    height = math.ceil(len(shown_in_panels) / columns)
    wide = NARROW_IN if narrow else 3.2 * columns
    figure = Figure(figsize=(wide, 2.4 * height + 0.5), layout="constrained")
    panels = plain(figure.subplots(height, columns, sharex=True, sharey=True, squeeze=False))
    shown: list[dict] = []
    for panel, (protocol, true) in zip(panels, shown_in_panels, strict=False):
        by_answer = []
        for answer in categories:
            by_answer.append([counts.get((protocol, snr, true, answer), 0) for snr in levels])
        samples = np.array(by_answer)
        shares = 100 * samples / np.maximum(samples.sum(axis=0), 1)
        below = shares.cumsum(axis=0) - shares
        for line, (answer, colour) in enumerate(zip(categories, cycle(COLOURS))):
            panel.bar(
                range(len(levels)), shares[line], bottom=below[line], color=colour, label=answer
            )
            for column, snr in enumerate(levels):
                shown.append(
                    {
                        "protocol": protocol,
                        "scheme": schemes[protocol],
                        "snr_db": snr,
                        "true": true,
                        "recognised_as": answer,
                        "samples": samples[line, column],
                        "percent": shares[line, column].round(2),
                    }
                )
        panel.set_title(f"{true}, {protocol} subtypes", fontsize=9 if narrow else None)
        panel.set_ylim(0, 100)
        panel.set_xticks(range(len(levels)), [SNR_LABELS.get(snr, snr) for snr in levels])
        panel.grid(visible=False)
    for panel in panels[len(shown_in_panels) :]:
        panel.set_axis_off()
    figure.supxlabel("SNR (dB)")
    figure.supylabel("recognised as (%)")
    figure.legend(
        *panels[0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=2 * columns,
        frameon=False,
    )
    words = "what each class is taken for at each SNR, in percent of its samples"
    return drawn("confusion_by_snr", words, figure, shown)
