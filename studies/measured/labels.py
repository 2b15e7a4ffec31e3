"""What is in a recording by the second (`labels.yaml`), and pictures that show it over the
spectrogram.
"""

from fnmatch import fnmatch
from pathlib import Path

import numpy as np
from scipy.signal import stft

from lowalt.config.classes import CATEGORIES
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.files import Baseband
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.report.figures.style import plt, png

LABELS = Path(__file__).with_name("labels.yaml")
EMPTY = "nothing"
"""Label of an interval without any target."""
TOGETHER = "+"
"""Joins the names of classes that are there at once."""
SECONDS = 0.1
"""Windows of the spectrograms from which labels are drawn."""
FASTEST_MPS = 18.0
COLOURS = {
    "UAV": "tab:purple",
    "Bird": "tab:olive",
    "Vehicle": "tab:red",
    "Pedestrian": "tab:green",
    EMPTY: "lightgrey",
    "none of these": "tab:blue",
    "beyond": "tab:orange",
    "clipped": "black",
    "lost": "black",
}

Interval = tuple[float, float, str]
"""First and last second of a stretch, and its label: classes joined by `TOGETHER`, or `EMPTY`."""


def read_labels(path: Path = LABELS) -> dict[str, dict[str, list[Interval]]]:
    """Return set -> file, or pattern of files -> intervals.

    Raises: InputError naming the file and what is wrong about an interval.
    """
    result: dict[str, dict[str, list[Interval]]] = {}
    for name, files in load_yaml(path, "labels", "sets to their files").items():
        result[name] = {}
        for file, stretches in files.items():
            where = f"{path}: {name}, {file}"
            last = 0.0
            intervals = []
            for first, end, what in stretches:
                words = what if isinstance(what, list) else [what]
                if not last <= first < end or not set(words) <= {*CATEGORIES, EMPTY}:
                    raise InputError(
                        f"{where}: interval {[first, end, what]}, expected seconds that rise, and"
                        f" classes of {CATEGORIES} or {EMPTY!r}"
                    )
                last = end
                intervals.append((float(first), float(end), TOGETHER.join(words)))
            result[name][file] = intervals
    return result


def intervals_of(
    labels: dict[str, dict[str, list[Interval]]], name: str, file: str, whole: str | None = None
) -> list[Interval]:
    """Return the intervals of a set's file; where it has no labels, one of the class `whole` that
    holds all of it, or none."""
    unlabelled = [(0.0, np.inf, whole)] if whole else []
    return next(
        (found for pattern, found in labels.get(name, {}).items() if fnmatch(file, pattern)),
        unlabelled,
    )


def label_of(start_s: float, window_s: float, intervals: list[Interval]) -> str | None:
    """Return the label of the interval that holds a window as a whole, None where no interval does."""
    # A window may end a rounding error after the recording.
    held = (
        what
        for first, last, what in intervals
        if first <= start_s and start_s + window_s <= last + 1e-6
    )
    return next(held, None)


def picture(
    baseband: Baseband,
    carrier_hz: float,
    intervals: list[Interval],
    title: str,
    window_s: float = 0.0,
    outcomes: dict[str, list[tuple[float, str]]] | None = None,
) -> bytes:
    """Return a PNG of a recording's spectrogram with its labels above, and below what networks say
    of each window.

    window_s: length of their windows; outcomes: name of a network -> start (s) of each window and
    what is said of it.
    """
    values, rate_hz = baseband
    length = min(round(SECONDS * rate_hz), len(values) // 4)
    frequency, times, shown = stft(
        values - values.mean(),
        rate_hz,
        nperseg=length,
        noverlap=length // 2,
        nfft=2 * length,
        return_onesided=bool(np.isrealobj(values)),
    )
    order = np.argsort(frequency)
    speeds = frequency[order] * SPEED_OF_LIGHT / carrier_hz / 2
    kept = np.abs(speeds) <= FASTEST_MPS
    level_db = 20 * np.log10(np.abs(shown[order][kept]) + 1e-300)
    level_db -= np.median(level_db)
    strips = {"label": intervals}
    for name, said in (outcomes or {}).items():
        strips[name] = [(start_s, start_s + window_s, what) for start_s, what in said]
    heights = [*[0.25] * len(strips), 3.0]
    figure, panels = plt.subplots(
        len(heights),
        1,
        figsize=(10, sum(heights) + 0.8),
        sharex=True,
        gridspec_kw={"height_ratios": heights},
    )
    for panel, (name, stretches) in zip(panels, strips.items(), strict=False):
        for first, last, what in stretches:
            words = what.split(TOGETHER)
            for place, word in enumerate(words):
                panel.axvspan(
                    first,
                    min(last, times[-1]),
                    place / len(words),
                    (place + 1) / len(words),
                    color=COLOURS[word],
                    lw=0,
                )
        panel.set_ylabel(name, rotation=0, ha="right", va="center", fontsize=8)
        panel.set_yticks([])
    corners = (0.0, times[-1], speeds[kept][0], speeds[kept][-1])
    panels[-1].imshow(
        level_db,
        extent=corners,
        origin="lower",
        aspect="auto",
        vmin=-5,
        vmax=np.quantile(level_db, 0.999),
    )
    panels[-1].set(xlabel="time (s)", ylabel="radial speed (m/s)")
    seen = {
        word
        for stretches in strips.values()
        for _, _, what in stretches
        for word in what.split(TOGETHER)
    }
    handles = [plt.Rectangle((0, 0), 1, 1, color=COLOURS[word]) for word in COLOURS if word in seen]
    figure.legend(
        handles, [word for word in COLOURS if word in seen], loc="lower right", ncols=5, fontsize=8
    )
    figure.suptitle(title, fontsize=10)
    figure.tight_layout()
    return png(figure, colours=128)
