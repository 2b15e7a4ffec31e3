"""Measured next to simulated: pictures of the same stretch on the same axes and scale, measured above.

This module only draws; its input are the files `pair-NAME.npz` of `python -m lowalt.recordings pairs`.
"""

import zipfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.report.figures.style import plt, png

ROWS = {"measured": "measured", "simulated": "simulated", "before": "simulated, before the model was mended"}


def read_pair(path: str | Path) -> dict:
    """Return a pair: caption, times_s (T,), speeds_mps (V,), and levels (V, T) in dB by ROWS.

    Raises: InputError naming the file where it is missing or no pair.
    """
    try:
        with np.load(existing(path, "pair of pictures"), allow_pickle=False) as data:
            return {"caption": str(data["caption"]), **{name: data[name] for name in ("times_s", "speeds_mps", *ROWS)}}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: not a pair of pictures ({error})") from error


def _draw(panel: Axes, pair: dict, row: str, floor_db: float, fastest_mps: float | None):
    """Draw one of the pair's images, `row`, over time and radial speed; return it for the colour bar."""
    speeds, times = pair["speeds_mps"], pair["times_s"]
    corners = (times[0], times[-1], speeds[0], speeds[-1])
    drawn = panel.imshow(pair[row], extent=corners, origin="lower", aspect="auto", vmin=floor_db, vmax=0)
    if fastest_mps:
        panel.set_ylim(max(-fastest_mps, speeds[0]), min(fastest_mps, speeds[-1]))
    panel.set(title=ROWS[row], ylabel="radial speed (m/s)")
    return drawn


def pair_picture(pair: dict, rows: tuple[str, ...] = tuple(ROWS), fastest_mps: float | None = None) -> bytes:
    """Return the pictures of one pair below each other, all in decibels below the picture's own largest value."""
    figure, panels = plt.subplots(len(rows), 1, figsize=(7, 2.6 * len(rows)), sharex=True, squeeze=False)
    floor = float(min(pair[row].min() for row in rows))
    for panel, row in zip(panels[:, 0], rows, strict=True):
        drawn = _draw(panel, pair, row, floor, fastest_mps)
    panels[-1, 0].set_xlabel("time (s)")
    figure.suptitle(pair["caption"], fontsize=10)
    figure.tight_layout()
    figure.colorbar(drawn, ax=panels[:, 0].tolist(), label="dB", shrink=0.6)
    return png(figure, colours=128)


def overview(pairs: list[dict]) -> bytes:
    """Return one picture of several pairs: measured above, simulated below, a column a pair."""
    figure, panels = plt.subplots(2, len(pairs), figsize=(3.4 * len(pairs), 5), squeeze=False)
    for column, pair in enumerate(pairs):
        for line, row in enumerate(("measured", "simulated")):
            _draw(panels[line, column], pair, row, float(pair["measured"].min()), None)
            panels[line, column].set(ylabel="radial speed (m/s)" if column == 0 else "")
        panels[0, column].set_title(f"{pair['caption']}\nmeasured", fontsize=8)
        panels[1, column].set_title("simulated", fontsize=8)
        panels[1, column].set_xlabel("time (s)")
    figure.tight_layout()
    return png(figure, colours=128)
