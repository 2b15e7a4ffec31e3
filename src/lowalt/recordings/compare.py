"""Measured against simulated in numbers: figures of each class with intervals, distributions with floor and ceiling.

measured-figures.csv: figures of whole recordings and of simulated scenes of the same length, one row a pair and figure.
measured-distances.csv: Wasserstein distances of the figures of coherent intervals, in the figure's unit,
    floor      between the two halves of the measured set (by file)
    before     measured to simulated without the corrections of the model (`plain`)
    distance   measured to simulated as recorded, low and high its 95 % interval over files
    tuning     the same with the half of the recordings that set the scenes, test with the other half
    learnt     measured to the wider scenes that networks learn from
    ceiling    measured to the nearest other class: a measured one where the radar has one, else the twin's
"""

from dataclasses import replace

import numpy as np
from scipy.stats import wasserstein_distance

from lowalt.config.classes import CATEGORIES
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.numerics.streams import stream
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
    "radar", "label", "figure", "unit", "files", "windows", "floor", "before", "distance", "low", "high", "tuning",
    "test", "learnt", "ceiling", "ceiling_class",
)  # fmt: skip
REPEATS = 400


def plain(scene: dict, mended: list[str]) -> dict:
    """Return a scene without the keys `mended`, which correct the model; the foil on blades stays, as it was real."""
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
    """Return the figures of a signal at the symbol rate, by the function that pair["figures"]["kind"] names."""
    spec = {**pair["figures"], "window": pair["window"], "hop": pair["hop"]}
    wavelength = SPEED_OF_LIGHT / twin.carrier_hz
    return KINDS[spec["kind"]](signal, 1 / twin.symbol_interval_s, wavelength, spec)


def class_figures(name: str, pair: dict, found: list[Measured], records: dict, settings: dict) -> tuple[list, list]:
    """Return the rows of `FIGURES` of one pair, and (pair, half, file, figure, value) of every recording.

    settings: seed, mended and realisations of the file of pairs.
    """
    mine = [one for one in found if one.like == pair["set"] and one.record.file.match(pair["figures"]["files"])]
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


def _near(tables: list[np.ndarray], other: np.ndarray, column: int) -> float:
    """Return the Wasserstein distance of one figure between the joined tables and `other`; NaN without tables."""
    if not tables:
        return float("nan")
    return float(wasserstein_distance(np.concatenate(tables)[:, column], other[:, column]))


def _measured(found: list[Measured], twin: Twin) -> dict[str, dict[str, tuple[str, np.ndarray]]]:
    """Class -> file -> (half, table) of the recordings in `found`; files without a target are left out."""
    tables: dict[str, dict[str, tuple[str, np.ndarray]]] = {}
    for one in found:
        own = at_carrier(twin, one.record.carrier_hz)
        intervals = measured_intervals(one, own)
        if len(intervals):
            tables.setdefault(one.record.label, {})[f"{one.set}/{one.name}"] = one.half, _table(intervals, own)
    return tables


def distances(
    name: str, found: list[Measured], library: Library, recorded: Library, mended: list[str], count: int
) -> list[list]:
    """Return the rows of `DISTANCES` of one radar; `count` simulated intervals stand for each class.

    recorded: scenes as they were in front of the radar; library: those that networks learn from.
    The interval resamples whole recordings: windows of one are not independent.
    """
    twin = library.twins[name]

    def model(scenes: Library, label: str) -> np.ndarray:
        """Return the figures (intervals, figures) of simulated intervals of one class."""
        intervals = scenes.simulated(name, label, count, "compare")[0]
        return _table(intervals.reshape(-1, intervals.shape[-1]), twin)

    measured = _measured([one for one in found if one.like in library.sets[name]], twin)
    learnt = {label: model(library, label) for label in CATEGORIES} if measured else {}
    rows = []
    for label, files in measured.items():
        own, before = model(recorded, label), model(unmended(recorded, mended), label)
        tables = [table for _, table in files.values()]
        sides = [[table for part, table in files.values() if part == half] for half in HALVES]
        others = {other: [table for _, table in block.values()] for other, block in measured.items() if other != label}
        if not others:
            others = {f"{other}, simulated": [table] for other, table in learnt.items() if other != label}
        for column, figure in enumerate(INTERVAL):
            floor = _near(sides[0], np.concatenate(sides[1]), column) if all(sides) else float("nan")
            rng = stream(library.seed, "distances", name, label, figure)
            spread = [
                _near([tables[place] for place in chosen], own, column)
                for chosen in rng.integers(0, len(tables), (REPEATS, len(tables)))
            ]
            low, high = np.quantile(spread, [0.025, 0.975])
            far = {other: _near(tables, np.concatenate(table), column) for other, table in others.items()}
            nearest = min(far, key=far.get)
            rows.append([
                name, label, figure, unit(figure), len(files), sum(map(len, tables)), floor,
                _near(tables, before, column), _near(tables, own, column), float(low), float(high),
                *(_near(side, own, column) for side in sides), _near(tables, learnt[label], column), far[nearest],
                nearest,
            ])  # fmt: skip
    return rows
