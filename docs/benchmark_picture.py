"""The picture of the benchmark's table: each method on each track with its 95 % interval.

python docs/benchmark_picture.py TABLE_FOLDER OUT_FOLDER

writes benchmark.svg, and benchmark-narrow.svg for telephones.
"""

import math
import sys
from pathlib import Path

from matplotlib.figure import Figure

from lowalt.extensions.benchmark import baseline_table
from lowalt.files.atomic import write_file
from lowalt.report.figures.style import COLOURS, plain, svg
from lowalt.report.plots import NARROW_IN

WIDE_IN = 9.6
LINE_IN = 0.19
"""Height of a method's line."""
HEAD_IN = 0.55
"""Height of a panel's title and numbers."""
LEADING = "1"
"""The group of methods that cannot be told apart from the best one of a track."""
TRACKS = [track for tracks in baseline_table.SHOWN for track in tracks]


def picture(rows: list[dict], narrow: bool = False) -> str:
    """Return the SVG of the table's rows: a panel per track, a line per method, the best on
    average first, methods of a track's leading group in colour.
    """
    found = {(row["track"], row["method"]): row for row in rows}
    tracks = [track for track in TRACKS if any(row["track"] == track for row in rows)]
    of_methods: dict[str, list[float]] = {}
    for row in rows:
        of_methods.setdefault(row["method"], []).append(baseline_table.interval(row).value)
    methods = sorted(of_methods, key=lambda name: sum(of_methods[name]) / len(of_methods[name]))
    columns = 2 if narrow else 6
    lines = math.ceil(len(tracks) / columns)
    size = NARROW_IN if narrow else WIDE_IN, lines * (LINE_IN * len(methods) + HEAD_IN)
    figure = Figure(figsize=size, layout="constrained")
    panels = plain(figure.subplots(lines, columns, sharey=True, squeeze=False))
    for panel, track in zip(panels, tracks, strict=False):
        for place, method in enumerate(methods):
            row = found.get((track, method))
            if row is None:
                continue
            value, low, high = baseline_table.interval(row)
            colour = COLOURS[0] if row["group"] == LEADING else COLOURS[6]
            panel.plot([low, high], [place, place], color=colour, linewidth=1.5)
            panel.plot(value, place, "o", color=colour, markersize=4)
        panel.set_title(track, fontsize=9)
        panel.set_xlim(0, 100)
        panel.set_xticks([0, 50, 100])
        panel.set_yticks(range(len(methods)), methods)
        panel.tick_params(labelsize=7.5)
    for panel in panels[len(tracks) :]:
        panel.set_axis_off()
    figure.supxlabel("headline number, percent, with its 95 % interval", fontsize=8)
    # A document may have any background colour.
    return svg(figure).replace("<svg", '<svg style="background: white"', 1)


def main(arguments: list[str]) -> None:
    """Write both pictures."""
    table, out = arguments
    rows = baseline_table.read(table)
    write_file(Path(out) / "benchmark.svg", picture(rows))
    write_file(Path(out) / "benchmark-narrow.svg", picture(rows, narrow=True))


if __name__ == "__main__":
    main(sys.argv[1:])
