"""Section: held against measurement, class by class: pictures, figures, distances, and recognition of the recordings.

All of it stands in one folder: measured-figures.csv, -distances.csv, -recognition.csv, -accuracy.csv, and one
measured-NAME.png a pair of pictures. `make measured` writes them.
"""

from pathlib import Path

from lowalt.config.classes import CATEGORIES
from lowalt.files.csv_tables import read_csv
from lowalt.report.figures.style import embedded
from lowalt.report.run import ReportedRun

FIGURES = (
    "pair", "label", "figure", "unit", "files", "measured", "measured_low", "measured_high", "before", "before_low",
    "before_high", "simulated", "simulated_low", "simulated_high",
)  # fmt: skip
DISTANCES = (
    "radar", "label", "figure", "unit", "files", "windows", "floor", "before", "distance", "low", "high", "tuning",
    "test", "learnt", "ceiling", "ceiling_class",
)  # fmt: skip
RECOGNITION = ("radar", "seed", "set", "half", "file", "label", "windows", *CATEGORIES, "right_percent")
ACCURACY = ("radar", "half", "class", "files", "windows", "accuracy_percent", "low", "high", "chance_percent")

ABLATION = (
    "radar", "change", "class", "seeds", "files", "windows", "accuracy_percent", "low", "high", "difference_percent",
    "difference_low", "difference_high",
)  # fmt: skip


def held(folder: str | Path) -> dict:
    """Return the section's values from a folder of reference tables and pictures.

    classes: one entry a category that was measured, with its pictures (name, address), and its rows of the tables;
    answers: every recording's row by all networks together, the least right first, and the address of the picture of
    its spectra ("" for none); accuracy: the rows over whole radars; ablation: those of measured-ablation.csv, none
    where it was not computed.
    Raises: InputError for another table that is missing, or one that lacks a column.
    """
    folder = Path(folder)
    without = folder / "measured-ablation.csv"
    figures = read_csv(folder / "measured-figures.csv", *FIGURES)
    distances = read_csv(folder / "measured-distances.csv", *DISTANCES)
    recognition = read_csv(folder / "measured-recognition.csv", *RECOGNITION)
    accuracy = read_csv(folder / "measured-accuracy.csv", *ACCURACY)
    classes = []
    for label in CATEGORIES:
        mine = [row for row in figures if row["label"] == label]
        if not mine:
            continue
        pairs = list(dict.fromkeys(row["pair"] for row in mine))
        pictures = [(pair, folder / f"measured-{pair}.png") for pair in pairs]
        classes.append(
            {
                "label": label,
                "pictures": [(pair, embedded(path.read_bytes())) for pair, path in pictures if path.is_file()],
                "figures": mine,
                "distances": [row for row in distances if row["label"] == label],
                "recognition": [row for row in recognition if row["label"] == label],
                "accuracy": [row for row in accuracy if row["class"] == label],
            }
        )
    mean = sorted((row for row in recognition if row["seed"] == "mean"), key=lambda row: float(row["right_percent"]))
    spectra = [folder / f"spectra-{row['set']}-{row['file']}.png" for row in mean]
    addresses = [embedded(path.read_bytes()) if path.is_file() else "" for path in spectra]
    answers = list(zip(mean, addresses, strict=True))
    return {"classes": classes, "answers": answers, "accuracy": [row for row in accuracy if row["class"] == "balanced"],
            "ablation": read_csv(without, *ABLATION) if without.is_file() else [],
            "categories": CATEGORIES}  # fmt: skip


def values(run: ReportedRun) -> dict | None:
    """Return the section's values; None where the configuration names no measured tables."""
    return {"own": True, **held(run.inputs.path("measured").parent)} if "measured" in run.inputs else None
