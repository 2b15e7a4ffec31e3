"""Can a class be told without its micro-Doppler? Linear classifiers on one number of each simulated
window.

    python studies/measured/shortcuts.py --out FOLDER [--count N]

Of windows of the scenes at any speed (`any_speed.yaml`) and of those of the radar's record, which
the column `scenes` names, measured-shortcuts.csv says how well a linear classifier tells the
classes by one number alone, in percent, the mean over the classes, cross-validated over scenes:
`speed` of the strongest line (m/s), within the speeds that all classes share; and of the same
windows without their targets the `level` (dB), the `colour`, noise of the slowest third of the
speeds over that of the fastest (dB), and the `hum`, the strongest narrow line over what is beside
it (dB).
"""

import argparse
from pathlib import Path

import numpy as np
from any_speed import RADAR, any_speed
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GroupKFold, cross_val_predict

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import run
from lowalt.extensions.recordings.presence import heard_powers, strongest_mps
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.files.csv_tables import write_csv

COLUMNS = ("scenes", "number", "low", "high", "windows", "right_percent", "chance_percent")
SHARED = 0.025
"""Share of each class's windows that may lie beyond either end of the speeds that all classes
share.
"""
RECEIVERS = 2
FOLDS = 5


def receiver_numbers(quiet: np.ndarray, twin: Twin) -> dict[str, np.ndarray]:
    """Return what receivers add to windows, (n,) dB by name, from intervals (n, symbols) without
    targets.
    """
    power, heard = heard_powers(quiet, twin)
    kept = np.maximum(power[:, heard], 1e-300)
    third = kept.shape[1] // 3
    colour = np.median(kept[:, :third], axis=1) / np.median(kept[:, 2 * third :], axis=1)
    beside = np.maximum(kept[:, :-8], kept[:, 8:])
    hum = (kept[:, 4:-4] / beside).max(axis=1)
    return {
        name: 10 * np.log10(ratio)
        for name, ratio in {"level": kept.mean(axis=1), "colour": colour, "hum": hum}.items()
    }


def told_percent(number: np.ndarray, labels: np.ndarray, scenes: np.ndarray) -> float:
    """Return how many windows a linear classifier names rightly by a number (n,), percent, the mean
    over classes.

    labels (n,): classes; scenes (n,): a scene is either learned from or tested on.
    """
    model = LogisticRegression(class_weight="balanced")
    scaled = (number - number.mean())[:, None] / max(number.std(), 1e-12)
    named = cross_val_predict(model, scaled, labels, groups=scenes, cv=GroupKFold(FOLDS))
    return 100 * float(
        np.mean([(named[labels == label] == label).mean() for label in np.unique(labels)])
    )


def rows(title: str, library: Library, count: int) -> list[list]:
    """Return the rows of `COLUMNS` under a title, from `count` scenes a category of the library."""
    parts = []
    labels = []
    for label, category in enumerate(CATEGORIES):
        twin = library.twins[RADAR]
        windows, quiet = (
            library.simulated(RADAR, category, count, "shortcuts", RECEIVERS, without)[0].reshape(
                -1, twin.symbols
            )
            for without in (False, True)
        )
        parts.append({"speed": strongest_mps(windows, twin), **receiver_numbers(quiet, twin)})
        labels += [label] * count * RECEIVERS
    labels = np.array(labels)
    scenes = np.repeat(np.arange(len(labels) // RECEIVERS), RECEIVERS)
    chance = 100 / len(parts)
    result = []
    for number in parts[0]:
        values = np.concatenate([part[number] for part in parts])
        low = -np.inf
        high = np.inf
        if number == "speed":
            low = max(float(np.quantile(part[number], SHARED)) for part in parts)
            high = min(float(np.quantile(part[number], 1 - SHARED)) for part in parts)
        inside = (values >= low) & (values <= high)
        right = told_percent(values[inside], labels[inside], scenes[inside])
        result.append(
            [
                title,
                number,
                f"{low:.3g}",
                f"{high:.3g}",
                int(inside.sum()),
                f"{right:.1f}",
                f"{chance:.1f}",
            ]
        )
    return result


def main(arguments: list[str]) -> None:
    """Write the table."""
    line = argparse.ArgumentParser(prog="shortcuts.py", description=main.__doc__)
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument("--count", type=int, default=200, help="scenes a class")
    options = line.parse_args(arguments)
    table = rows("at any speed", Library.read(over=any_speed()[0]), options.count)
    table += rows("of the record", Library.read(), options.count)
    write_csv(options.out / "measured-shortcuts.csv", COLUMNS, table)
    for row in table:
        print(*row, sep=", ")


if __name__ == "__main__":
    run(main)
