"""Can a class be told without its micro-Doppler? Linear classifiers on one number of each simulated window.

    python studies/measured/shortcuts.py --out FOLDER [--count N] [--radars RECORDS]

Of windows that networks learn from, measured-shortcuts.csv says how well a linear classifier tells the classes by one
number alone, in percent, the mean over the classes, cross-validated over scenes: `speed` of the strongest line (m/s),
within the speeds that all classes share; `level` of the window (dB); `colour`, the slow noise between lines over the
fast (dB); `hum`, the strongest line that is narrower than two cells over the floor (dB).
"""

import argparse
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GroupKFold, cross_val_predict

from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.recordings.presence import heard_powers
from lowalt.recordings.twin import RADARS, Twin
from lowalt.recordings.twin_scenes import Library

COLUMNS = ("radar", "number", "low", "high", "windows", "right_percent", "chance_percent")
SHARED = 0.025
"""Share of each class's windows that may lie beyond either end of the speeds that all classes share."""
RECEIVERS, FOLDS = 2, 5


def numbers_of(intervals: np.ndarray, twin: Twin) -> dict[str, np.ndarray]:
    """Return the numbers (n,) of intervals (n, symbols), by name."""
    power, heard = heard_powers(intervals, twin)
    kept = power[:, heard]
    speeds = np.linspace(twin.slowest_mps, twin.fastest_mps, kept.shape[1])
    third = kept.shape[1] // 3
    between = np.quantile(kept.reshape(len(kept), -1)[:, :third], 0.25, axis=1)
    fast = np.quantile(kept[:, 2 * third :], 0.25, axis=1)
    around = np.maximum(kept[:, :-4], kept[:, 4:])
    narrow = (kept[:, 2:-2] / np.maximum(around, 1e-300)).max(axis=1)
    decibels = {"level": kept.mean(axis=1), "colour": between / np.maximum(fast, 1e-300), "hum": narrow}
    return {"speed": speeds[kept.argmax(axis=1)]} | {name: 10 * np.log10(one) for name, one in decibels.items()}


def told_percent(number: np.ndarray, labels: np.ndarray, scenes: np.ndarray) -> float:
    """Return how many windows a linear classifier names rightly by a number (n,), percent, the mean over classes.

    labels (n,): classes; scenes (n,): a scene is either learned from or tested on.
    """
    model = LogisticRegression(class_weight="balanced")
    scaled = (number - number.mean())[:, None] / max(number.std(), 1e-12)
    named = cross_val_predict(model, scaled, labels, groups=scenes, cv=GroupKFold(FOLDS))
    return 100 * float(np.mean([(named[labels == label] == label).mean() for label in np.unique(labels)]))


def rows(name: str, library: Library, count: int) -> list[list]:
    """Return the rows of `COLUMNS` of a radar, from `count` scenes a class."""
    parts = []
    labels = []
    for label, category in enumerate(library.scenes[name]):
        intervals, _ = library.simulated(name, category, count, "shortcuts", RECEIVERS)
        parts.append(numbers_of(intervals.reshape(-1, intervals.shape[-1]), library.twins[name]))
        labels += [label] * count * RECEIVERS
    labels = np.array(labels)
    scenes = np.repeat(np.arange(len(labels) // RECEIVERS), RECEIVERS)
    chance = 100 / len(parts)
    result = []
    for number in parts[0]:
        values = np.concatenate([part[number] for part in parts])
        low, high = -np.inf, np.inf
        if number == "speed":
            low = max(float(np.quantile(part[number], SHARED)) for part in parts)
            high = min(float(np.quantile(part[number], 1 - SHARED)) for part in parts)
        inside = (values >= low) & (values <= high)
        right = told_percent(values[inside], labels[inside], scenes[inside])
        result.append([name, number, f"{low:.3g}", f"{high:.3g}", int(inside.sum()), f"{right:.1f}", f"{chance:.1f}"])
    return result


def main(arguments: list[str]) -> None:
    """Write the table."""
    line = argparse.ArgumentParser(prog="shortcuts.py", description=main.__doc__)
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument("--count", type=int, default=200, help="scenes a class")
    line.add_argument("--radars", default=RADARS, help="folder of the records of radars")
    line.add_argument("--radar", default="cw_24ghz", help="name of the radar")
    options = line.parse_args(arguments)
    table = rows(options.radar, Library.read(options.radars), options.count)
    write_csv(options.out / "measured-shortcuts.csv", COLUMNS, table)
    for row in table:
        print(*row, sep=", ")


if __name__ == "__main__":
    run(main)
