"""The test of networks on recordings: confusion by file, and balanced accuracy with an interval over files.

measured-recognition.csv: one row a radar, training seed and recording; how many windows got which name.
measured-accuracy.csv: share of right windows of each class in each half, mean over its files and seeds, and balanced
    accuracy over the radar's classes; intervals resample files within their class. One row is for all radars together.
"""

import numpy as np

from lowalt.common.classes import CATEGORIES
from lowalt.common.streams import stream
from lowalt.recordings.library import Library
from lowalt.recordings.recognise import Windows, facts, guesses, rendered, simulated, train
from lowalt.recordings.sets import HALVES, Measured, at_carrier, measured_intervals
from lowalt.tiles.settings import Images

RECOGNITION = ("radar", "seed", "set", "half", "file", "label", "windows", *CATEGORIES, "right_percent")
ACCURACY = ("radar", "half", "class", "files", "windows", "accuracy_percent", "low", "high", "chance_percent")
REPEATS = 4000


def windows_of(one: Measured, library: Library, block: dict) -> Windows:
    """Return the windows of a recording that hold a target, rendered as its radar's twin renders its own."""
    twin = at_carrier(library.twins[library.twin_of(one.set)], one.record.carrier_hz)
    images = rendered(measured_intervals(one, twin), twin, Images.from_settings(block["images"]), block["size"])
    count, label = len(images), CATEGORIES.index(one.record.label)
    told = facts(np.full(count, label), [one.name] * count, np.arange(count), np.zeros(count), "test")
    return Windows(images, told)


def radar(name: str, found: list[Measured], library: Library, block: dict, folder) -> list[list]:
    """Train one network a seed on the twin `name` and return the rows of `RECOGNITION` of its recordings.

    folder: where the networks go, one folder a seed.
    """
    mine = [one for one in found if one.set in library.sets[name]]
    if not mine:
        return []
    measured = [windows_of(one, library, block) for one in mine]
    model_windows = {fold: simulated(library, name, block, fold) for fold in ("train", "validation")}
    rows = []
    for seed in block["seeds"]:
        model = train(block, model_windows, name, seed, folder / f"{name}-{seed}")
        for one, windows in zip(mine, measured, strict=True):
            named = guesses(model, windows, block).argmax(1)
            counts = np.bincount(named, minlength=len(CATEGORIES)).tolist()
            right = 100 * float(np.mean(named == windows.facts.label))
            head = [name, seed, one.set, one.half, one.name, one.record.label, len(named)]
            rows.append([*head, *counts, right])
    return rows


def _interval(by_class: dict[str, list[float]], rng: np.random.Generator) -> tuple[float, float, float]:
    """Mean over classes of the mean over files, with the 95 % interval from resampling files within each class."""
    classes = [np.array(values) for values in by_class.values()]
    draws = [values[rng.integers(0, len(values), (REPEATS, len(values)))].mean(axis=1) for values in classes]
    low, high = np.quantile(np.mean(draws, axis=0), [0.025, 0.975])
    return float(np.mean([values.mean() for values in classes])), float(low), float(high)


def accuracy(rows: list[list], seed: int) -> list[list]:
    """Return the rows of `ACCURACY` from those of `RECOGNITION`; a file counts once, by its mean over training seeds.

    A class of a set of recordings is one class: the drones at 10 GHz and at 3.3 GHz stand apart.
    """
    shares: dict[tuple, dict[str, list[float]]] = {}
    windows: dict[str, int] = {}
    for row in rows:
        name, _, _, half, file, label, count = row[:7]
        shares.setdefault((name, half, label), {}).setdefault(file, []).append(row[-1])
        windows[file] = count
    chance = 100 / len(CATEGORIES)
    found = []

    def add(name: str, half: str, title: str, keys: list[tuple]) -> None:
        rng = stream(seed, "measured-accuracy", name, half, title)
        by_class = {str(key): [float(np.mean(values)) for values in shares[key].values()] for key in keys}
        files = [file for key in keys for file in shares[key]]
        mean, low, high = _interval(by_class, rng)
        found.append([name, half, title, len(files), sum(windows[file] for file in files), mean, low, high, chance])

    for half in HALVES:
        for name in dict.fromkeys(key[0] for key in shares):
            keys = [key for key in shares if key[:2] == (name, half)]
            for key in keys:
                add(name, half, key[2], [key])
            if len(keys) > 1:
                add(name, half, "balanced", keys)
        everything = [key for key in shares if key[1] == half]
        if everything:
            add("all", half, "balanced", everything)
    return found
