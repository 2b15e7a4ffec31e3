"""Pictures of the pairs, measured above simulated, and the page of all tables: what `study.py page`
writes.
"""

import zipfile
from pathlib import Path

import numpy as np
from accuracy import ACCURACY, COUNTED, RECOGNITION
from comparison import DISTANCES, FIGURES

from lowalt.config.classes import CATEGORIES
from lowalt.files.atomic import existing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.report.figures.style import embedded, plt, png
from lowalt.report.page import assembled, templates

TITLE = "Held against measurement"
TEMPLATE = Path(__file__).with_name("page.html")
ROWS = {
    "measured": "measured",
    "simulated": "simulated",
    "before": "simulated, before the model was mended",
}


def read_pair(path: str | Path) -> dict:
    """Return a pair: caption, times_s (T,), speeds_mps (V,), and levels (V, T) in dB by ROWS.

    Raises: InputError naming the file where it is missing or no pair.
    """
    try:
        with np.load(existing(path, "pair of pictures"), allow_pickle=False) as data:
            return {
                "caption": str(data["caption"]),
                **{name: data[name] for name in ("times_s", "speeds_mps", *ROWS)},
            }
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: not a pair of pictures ({error})") from error


def pair_picture(pair: dict, rows: tuple[str, ...] = tuple(ROWS)) -> bytes:
    """Return a PNG of some of a pair's images below each other, in decibels below each image's own
    largest value.
    """
    speeds = pair["speeds_mps"]
    times = pair["times_s"]
    corners = (times[0], times[-1], speeds[0], speeds[-1])
    figure, panels = plt.subplots(
        len(rows), 1, figsize=(7, 2.6 * len(rows)), sharex=True, squeeze=False
    )
    floor_db = float(min(pair[row].min() for row in rows))
    for panel, row in zip(panels[:, 0], rows, strict=True):
        drawn = panel.imshow(
            pair[row], extent=corners, origin="lower", aspect="auto", vmin=floor_db, vmax=0
        )
        panel.set(title=ROWS[row], ylabel="radial speed (m/s)")
    panels[-1, 0].set_xlabel("time (s)")
    figure.suptitle(pair["caption"], fontsize=10)
    figure.tight_layout()
    figure.colorbar(drawn, ax=panels[:, 0].tolist(), label="dB", shrink=0.6)
    return png(figure, colours=128)


def _address(path: Path) -> str:
    """A picture's address inside the page, "" where there is no such file."""
    return embedded(path.read_bytes()) if path.is_file() else ""


def page(folder: Path) -> str:
    """Return the page of the tables measured-*.csv and pictures in a folder.

    What each network says of every recording stands there, the least right first, and every
    recording's spectrogram with its labels.
    Raises: InputError for a table that is missing or lacks a column.
    """
    figures = read_csv(folder / "measured-figures.csv", *FIGURES)
    distances = read_csv(folder / "measured-distances.csv", *DISTANCES)
    recognition = read_csv(folder / "measured-recognition.csv", *RECOGNITION)
    accuracy = read_csv(folder / "measured-accuracy.csv", *ACCURACY)
    classes = []
    for label in (label for label in CATEGORIES if label in {row["label"] for row in figures}):
        rows = [row for row in figures if row["label"] == label]
        pictures = {
            pair: _address(folder / f"measured-{pair}.png")
            for pair in dict.fromkeys(row["pair"] for row in rows)
        }
        classes.append(
            {
                "label": label,
                "figures": rows,
                "distances": [row for row in distances if row["label"] == label],
                "pictures": [(pair, address) for pair, address in pictures.items() if address],
            }
        )
    answers = sorted(recognition, key=lambda row: float(row["right_percent"]))
    pictures = {
        (row["set"], row["file"]): _address(folder / f"label-{row['set']}-{row['file']}.png")
        for row in recognition
    }
    html = (
        templates()
        .from_string(TEMPLATE.read_text())
        .render(
            classes=classes,
            counted=COUNTED,
            accuracy=accuracy,
            answers=answers,
            pictures=[(*key, address) for key, address in pictures.items() if address],
        )
    )
    return assembled(TITLE, [{"id": "measured", "title": TITLE, "html": html}])
