"""Measured against simulated in numbers: figures of each class with intervals, distributions with floor and ceiling.

measured-figures.csv: figures of whole recordings and of simulated scenes of the same length, one row a pair and figure.
measured-distances.csv: Wasserstein distances of the figures of windows, in the figure's unit,
    floor      between the two halves of the measured set (by file)
    before     measured to simulated without the corrections of the model (`unmended`)
    distance   measured to simulated as recorded, low and high its 95 % interval over files
    tuning     the same with the half of the recordings that set the scenes, test with the other half
    learnt     measured to the wider scenes that networks learn from
    ceiling    measured to the nearest other class: a measured one where the radar has one, else the twin's
"""

from dataclasses import replace

import numpy as np
from class_figures import KINDS
from pairs import simulated_stretch
from recorded_sets import HALVES, Measured
from scipy.stats import wasserstein_distance
from spectral_figures import INTERVAL, interval_figures, unit

from lowalt.config.classes import CATEGORIES
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.windows import at_symbol_rate
from lowalt.numerics.streams import stream

FIGURES = (
    "pair", "set", "label", "figure", "unit", "files", "measured", "measured_low", "measured_high", "scenes", "before",
    "before_low", "before_high", "simulated", "simulated_low", "simulated_high",
)  # fmt: skip
FILES = ("pair", "half", "file", "figure", "value")
DISTANCES = (
    "radar", "label", "figure", "unit", "files", "windows", "floor", "before", "distance", "low", "high", "tuning",
    "test", "learnt", "ceiling", "ceiling_class",
)  # fmt: skip
REPEATS = 400


def unmended(scene: dict, mended: list[str]) -> dict:
    """Return a scene without the keys `mended`, which correct the model; the foil on blades stays, as it was real."""
    plain = {key: item for key, item in scene.items() if key not in mended}
    if "foils" in scene:
        plain["strength_db"] = {"foil": scene["strength_db"]["foil"]}
    return plain


def summary(values: list[float], rng: np.random.Generator) -> tuple[float, float, float]:
    """Return mean and 95 % bootstrap interval of values, one per file or scene; NaN is left out."""
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


def figure_rows(
    name: str, pair: dict, recordings: list[Measured], records: dict, settings: dict
) -> tuple[list[list], list[list]]:
    """Return the rows of `FIGURES` of one pair, and those of `FILES` of every recording that its figures name.

    settings: seed, mended and realisations of the file of pairs.
    """
    pattern = pair["figures"]["files"]
    named = [recording for recording in recordings
             if recording.like == pair["set"] and recording.record.file.match(pattern)]  # fmt: skip
    if not named:
        return [], []
    twin, seed, repeats = Twin.from_settings(pair["radar"]), settings["seed"], range(settings["realisations"])
    measured = []
    for recording in named:
        signal = at_symbol_rate(recording.record, twin, recording.read())
        measured.append(figures_of(signal, twin.at_carrier(recording.record.carrier_hz), pair))
    sides = [measured]
    for scene in (unmended(pair["scene"], settings["mended"]), pair["scene"]):
        drawn = {**pair, "scene": scene}
        sides.append([
            figures_of(simulated_stretch(name, drawn, records, seed, again), twin, pair) for again in repeats
        ])  # fmt: skip
    rows = []
    for figure in measured[0]:
        rng = stream(seed, "figures", name, figure)
        of_files, before, simulated = (summary([entry[figure] for entry in side], rng) for side in sides)
        head = [name, pair["set"], named[0].record.label, figure, unit(figure), len(named)]
        rows.append([*head, *of_files, len(repeats), *before, *simulated])
    return rows, [
        [name, recording.half, recording.name, figure, value]
        for recording, entry in zip(named, measured, strict=True)
        for figure, value in entry.items()
    ]


def _table(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Figures of intervals (n, symbols) as (n, figures) by INTERVAL."""
    entries = [interval_figures(interval, twin.edge_mps, twin.sides) for interval in intervals]
    return np.array([[entry[figure] for figure in INTERVAL] for entry in entries])


def _apart(tables: list[np.ndarray], other: np.ndarray, column: int) -> float:
    """Return the Wasserstein distance of one figure between the joined tables and `other`; NaN without tables."""
    if not tables:
        return float("nan")
    return float(wasserstein_distance(np.concatenate(tables)[:, column], other[:, column]))


def _measured(recordings: list[Measured], library: Library) -> dict[str, list[tuple[str, np.ndarray]]]:
    """Class -> (half, table) of each recording; files without a target are left out."""
    tables: dict[str, list[tuple[str, np.ndarray]]] = {}
    for recording in recordings:
        twin = recording.twin(library)
        windows = recording.windows(twin)
        if len(windows):
            tables.setdefault(recording.record.label, []).append((recording.half, _table(windows, twin)))
    return tables


def distance_rows(
    name: str, recordings: list[Measured], library: Library, recorded: Library, mended: list[str], count: int
) -> list[list]:
    """Return the rows of `DISTANCES` of one radar; `count` simulated windows stand for each class.

    recorded: scenes as they were in front of the radar; library: those that networks learn from.
    The interval resamples whole recordings: windows of one are not independent.
    """
    measured = _measured([recording for recording in recordings if recording.radar == name], library)
    if not measured:
        return []
    before = {label: [unmended(scene, mended) for scene in scenes] for label, scenes in recorded.scenes[name].items()}
    plain = replace(recorded, scenes={name: before})

    def model(scenes: Library, label: str) -> np.ndarray:
        """Return the figures (windows, figures) of simulated windows of one class."""
        windows = scenes.simulated(name, label, count, "compare")[0]
        return _table(windows.reshape(-1, windows.shape[-1]), library.twins[name])

    learnt = {label: model(library, label) for label in CATEGORIES}
    rows = []
    for label, files in measured.items():
        simulated = model(recorded, label), model(plain, label)
        others = {other: [table for _, table in tables] for other, tables in measured.items() if other != label}
        if not others:
            others = {f"{other}, simulated": [table] for other, table in learnt.items() if other != label}
        for column, figure in enumerate(INTERVAL):
            rng = stream(library.seed, "distances", name, label, figure)
            row = _distances(files, simulated, column, rng)
            far = {other: _apart([table for _, table in files], np.concatenate(tables), column)
                   for other, tables in others.items()}  # fmt: skip
            nearest = min(far, key=far.get)
            windows = sum(len(table) for _, table in files)
            to_learnt = _apart([table for _, table in files], learnt[label], column)
            head = [name, label, figure, unit(figure), len(files), windows]
            rows.append([*head, *row, to_learnt, far[nearest], nearest])
    return rows


def _distances(
    files: list[tuple[str, np.ndarray]], simulated: tuple[np.ndarray, np.ndarray], column: int, rng: np.random.Generator
) -> list[float]:
    """Floor, before, distance with its interval, tuning and test of one figure; simulated: as recorded, and before."""
    as_recorded, before = simulated
    tables = [table for _, table in files]
    sides = [[table for half, table in files if half == wanted] for wanted in HALVES]
    floor = _apart(sides[0], np.concatenate(sides[1]), column) if all(sides) else float("nan")
    spread = [
        _apart([tables[place] for place in places], as_recorded, column)
        for places in rng.integers(0, len(tables), (REPEATS, len(tables)))
    ]
    low, high = np.quantile(spread, [0.025, 0.975])
    whole = _apart(tables, before, column), _apart(tables, as_recorded, column)
    return [floor, *whole, float(low), float(high), *(_apart(side, as_recorded, column) for side in sides)]
