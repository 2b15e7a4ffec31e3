"""The test of networks on recordings: confusion by file, and balanced accuracy with an interval over files.

measured-recognition.csv: one row a radar, training seed and recording, with the number of windows of each name. The
    seed "mean" stands for all networks together, by the mean of their probabilities.
measured-accuracy.csv: share of right windows of each class in each half, mean over its files, and balanced accuracy
    over the radar's classes; intervals resample files within their class. One row is for all radars together.
"""

from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.files.atomic import replacing
from lowalt.numerics.streams import stream
from lowalt.recordings.library import Library
from lowalt.recordings.recognise import Windows, facts, guesses, load_model, rendered, simulated, train
from lowalt.recordings.sets import HALVES, Measured, at_carrier, measured_intervals
from lowalt.tiles import join
from lowalt.tiles.png import encode
from lowalt.tiles.settings import Images

RECOGNITION = ("radar", "seed", "set", "half", "file", "label", "windows", *CATEGORIES, "right_percent")
ACCURACY = ("radar", "half", "class", "files", "windows", "accuracy_percent", "low", "high", "chance_percent")
REPEATS = 4000
PIXELS = 3
"""Side of a network's pixel in a picture."""


def windows_of(one: Measured, library: Library, block: dict) -> Windows:
    """Return the windows of a recording that hold a target, rendered as its radar's twin renders its own."""
    twin = at_carrier(library.twins[library.twin_of(one.like)], one.record.carrier_hz)
    images = rendered(measured_intervals(one, twin), twin, Images.from_settings(block["images"]), block["size"])
    count, label = len(images), CATEGORIES.index(one.record.label)
    told = facts(np.full(count, label), [one.name] * count, np.arange(count), np.zeros(count), "test")
    return Windows(images, told)


def picture(one: Measured, windows: Windows, block: dict, folder: Path) -> None:
    """Write the three spectra of a recording's middle window, as the network sees them, into `folder` as PNG."""
    views = windows.images[len(windows.images) // 2]
    tile = encode(np.kron(join(views, len(views)), np.ones((PIXELS, PIXELS), np.uint8)),
                  Images.from_settings(block["images"]).palette)  # fmt: skip
    with replacing(folder / f"spectra-{one.set}-{one.name}.png") as temporary:
        temporary.write_bytes(tile)


def tested(name: str, measured: list[tuple[Measured, Windows]], models: dict, block: dict) -> list[list]:
    """Return the rows of `RECOGNITION` of recordings with their windows, named by networks {training seed: network}.

    One row a network and recording, and one of all networks together (seed "mean"), whose probabilities are averaged.
    """
    rows = []
    for one, windows in measured:
        found = {seed: guesses(model, windows, block) for seed, model in models.items()}
        found["mean"] = np.mean(list(found.values()), axis=0)
        for seed, shares in found.items():
            named = shares.argmax(1)
            counts = np.bincount(named, minlength=len(CATEGORIES)).tolist()
            right = 100 * float(np.mean(named == windows.facts.label))
            rows.append([name, seed, one.set, one.half, one.name, one.record.label, len(named), *counts, right])
    return rows


def radar(
    name: str, found: list[Measured], library: Library, block: dict, folder: Path, out: Path, reuse: bool = False
) -> list[list]:
    """Train one network a seed on the twin `name` and return the rows of `RECOGNITION` of its recordings.

    folder: where the networks go, one folder a seed; out: where a picture of every recording's spectra goes; reuse:
    take the networks that are there and train none. Recordings without any window that holds a target are left out.
    """
    mine = [one for one in found if one.like in library.sets[name]]
    if not mine:
        return []
    measured = [(one, windows_of(one, library, block)) for one in mine]
    measured = [(one, windows) for one, windows in measured if len(windows.images)]
    for one, windows in measured:
        picture(one, windows, block, out)
    if reuse:
        models = {seed: load_model(folder / f"{name}-{seed}/model.pt", name, block) for seed in block["seeds"]}
        return tested(name, measured, models, block)
    model_windows = {fold: simulated(library, name, block, fold) for fold in ("train", "validation")}
    models = {seed: train(block, model_windows, name, seed, folder / f"{name}-{seed}") for seed in block["seeds"]}
    return tested(name, measured, models, block)


def _interval(by_class: dict[str, list[float]], rng: np.random.Generator) -> tuple[float, float, float]:
    """Mean over classes of the mean over files, with the 95 % interval from resampling files within each class."""
    classes = [np.array(values) for values in by_class.values()]
    draws = [values[rng.integers(0, len(values), (REPEATS, len(values)))].mean(axis=1) for values in classes]
    low, high = np.quantile(np.mean(draws, axis=0), [0.025, 0.975])
    return float(np.mean([values.mean() for values in classes])), float(low), float(high)


def accuracy(rows: list[list], seed: int) -> list[list]:
    """Return the rows of `ACCURACY` from those of `RECOGNITION` whose seed is "mean"; a file counts once.

    Classes are counted for each radar: drones at 10 GHz and drones at 3.3 GHz are two classes.
    """
    shares: dict[tuple, dict[str, list[float]]] = {}
    windows: dict[str, int] = {}
    for row in (row for row in rows if row[1] == "mean"):
        name, _, folder, half, file, label, count = row[:7]
        file = f"{folder}/{file}"
        shares.setdefault((name, half, label), {}).setdefault(file, []).append(row[-1])
        windows[file] = count
    chance = 100 / len(CATEGORIES)
    found = []

    def add(name: str, half: str, title: str, keys: list[tuple]) -> None:
        """Append the row of the classes `keys`, (radar, half, class), under the name `title`."""
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
