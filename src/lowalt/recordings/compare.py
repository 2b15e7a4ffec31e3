"""Measured against simulated in numbers: figures of each class with intervals, distributions with floor and ceiling.

measured-figures.csv: figures of whole recordings and of simulated scenes of the same length, one row a pair and figure.
measured-distances.csv: Wasserstein distances of the figures of coherent intervals, in the figure's unit,
    floor      between the two halves of the measured set (by file)
    before     measured to simulated without the mends of the model
    distance   measured to simulated, low and high its 95 % interval over files
    ceiling    measured to the nearest other class: a measured one where the radar has one, else the twin's
"""

from dataclasses import replace

import numpy as np
from scipy.stats import wasserstein_distance

from lowalt.common.classes import CATEGORIES
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.common.streams import stream
from lowalt.recordings.figures import INTERVAL, interval_figures, unit
from lowalt.recordings.kinds import KINDS
from lowalt.recordings.library import Library
from lowalt.recordings.pairs import simulated_stretch
from lowalt.recordings.sets import HALVES, Measured, at_carrier, measured_intervals, sampled
from lowalt.recordings.twin import Twin

FIGURES = (
    "pair", "set", "label", "figure", "unit", "files", "measured", "measured_low", "measured_high", "scenes", "before",
    "before_low", "before_high", "simulated", "simulated_low", "simulated_high",
)  # fmt: skip
DISTANCES = (
    "radar", "label", "figure", "unit", "files", "windows", "floor", "before", "distance", "low", "high", "ceiling",
    "ceiling_class",
)  # fmt: skip
REPEATS = 400


def plain(scene: dict, mended: list[str]) -> dict:
    """Return a scene without the keys that mend the model; foil on a blade stays, since it was on the craft."""
    left = {key: item for key, item in scene.items() if key not in mended}
    if "foils" in scene:
        left["strength_db"] = {"foil": scene["strength_db"]["foil"]}
    return left


def summary(values: list[float], rng: np.random.Generator) -> tuple[float, float, float]:
    """Return mean and 95 % bootstrap interval of values, one a file or a scene; NaN is left out."""
    known = np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return (float("nan"),) * 3
    means = known[rng.integers(0, len(known), (4000, len(known)))].mean(axis=1)
    return float(known.mean()), float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


def figures_of(signal: np.ndarray, twin: Twin, pair: dict) -> dict[str, float]:
    """Return the figures of a pair's kind of a signal at the symbol rate."""
    spec = {**pair["figures"], "window": pair["window"], "hop": pair["hop"]}
    wavelength = SPEED_OF_LIGHT / twin.carrier_hz
    return KINDS[spec["kind"]](signal, 1 / twin.symbol_interval_s, wavelength, spec)


def class_figures(name: str, pair: dict, found: list[Measured], records: dict, settings: dict) -> tuple[list, list]:
    """Return the rows of `FIGURES` of one pair, and (pair, half, file, figure, value) of every recording.

    settings: seed, mended and realisations of the file of pairs.
    """
    mine = [one for one in found if one.set == pair["set"] and one.record.file.match(pair["figures"]["files"])]
    if not mine:
        return [], []
    twin, seed = Twin.from_settings(pair["radar"]), settings["seed"]
    measured = []
    for one in mine:
        measured.append(figures_of(sampled(one.record, twin), at_carrier(twin, one.record.carrier_hz), pair))
    sides = []
    for scene in (plain(pair["scene"], settings["mended"]), pair["scene"]):
        drawn = {**pair, "scene": scene}
        again = range(settings["realisations"])
        sides.append([figures_of(simulated_stretch(name, drawn, records, seed, k), twin, pair) for k in again])
    rows = []
    for figure in measured[0]:
        rng = stream(seed, "figures", name, figure)
        three = [summary([entry[figure] for entry in part], rng) for part in (measured, *sides)]
        head = [name, pair["set"], mine[0].record.label, figure, unit(figure), len(mine), *three[0]]
        rows.append([*head, settings["realisations"], *three[1], *three[2]])
    files = [
        (name, one.half, one.name, figure, value)
        for one, entry in zip(mine, measured, strict=True)
        for figure, value in entry.items()
    ]
    return rows, files


def _table(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Figures of intervals (n, symbols) as (n, figures) by INTERVAL."""
    found = [interval_figures(interval, twin.edge_mps, twin.sides) for interval in intervals]
    return np.array([[entry[figure] for figure in INTERVAL] for entry in found])


def unmended(library: Library, mended: list[str]) -> Library:
    """Return the library with every scene as `plain` leaves it."""
    scenes = {
        name: {category: [plain(scene, mended) for scene in many] for category, many in block.items()}
        for name, block in library.scenes.items()
    }
    return replace(library, scenes=scenes)


def _near(files: dict[str, np.ndarray], other: np.ndarray, column: int) -> float:
    values = np.concatenate([table[:, column] for table in files.values()])
    return float(wasserstein_distance(values, other[:, column]))


def distances(name: str, found: list[Measured], library: Library, mended: list[str], count: int) -> list[list]:
    """Return the rows of `DISTANCES` of one radar; `count` simulated intervals stand for each class.

    The interval resamples whole recordings: windows of one are not independent.
    """
    twin = library.twins[name]
    tables: dict[str, dict[str, np.ndarray]] = {}
    half: dict[str, str] = {}
    for one in found:
        if one.set in library.sets[name]:
            own = at_carrier(twin, one.record.carrier_hz)
            tables.setdefault(one.record.label, {})[one.name] = _table(measured_intervals(one, own), own)
            half[one.name] = one.half
    flat = lambda block: block.reshape(-1, block.shape[-1])  # noqa: E731
    model = {label: _table(flat(library.simulated(name, label, count, "compare")[0]), twin) for label in CATEGORIES}
    early = unmended(library, mended)
    rows = []
    for label, files in tables.items():
        before = _table(flat(early.simulated(name, label, count, "compare")[0]), twin)
        sides = [[table for file, table in files.items() if half[file] == part] for part in HALVES]
        others = {other: np.concatenate(list(block.values())) for other, block in tables.items() if other != label}
        if not others:
            others = {f"{other}, simulated": table for other, table in model.items() if other != label}
        for column, figure in enumerate(INTERVAL):
            floor = float("nan")
            if all(sides):
                floor = wasserstein_distance(*(np.concatenate(side)[:, column] for side in sides))
            rng, names = stream(library.seed, "distances", name, label, figure), list(files)
            spread = [
                _near({str(k): files[names[place]] for k, place in enumerate(chosen)}, model[label], column)
                for chosen in rng.integers(0, len(names), (REPEATS, len(names)))
            ]
            low, high = np.quantile(spread, [0.025, 0.975])
            far = {other: _near(files, table, column) for other, table in others.items()}
            nearest = min(far, key=far.get)
            windows = sum(map(len, files.values()))
            rows.append([
                name, label, figure, unit(figure), len(files), windows, float(floor), _near(files, before, column),
                _near(files, model[label], column), float(low), float(high), far[nearest], nearest,
            ])  # fmt: skip
    return rows
