"""Networks for any radar, against one network per radar.

    python studies/measured/any_radar.py --inputs FOLDER --out FOLDER --models FOLDER

A network learns from simulated windows of radars that are drawn at random (`any_radar.yaml`), in
front of the usual scenes. No drawn radar is a measured one, and nothing that was fitted to a
recording is used, so every measured radar is one that was left out. The rows of its images are
absolute speeds in m/s, the same for all radars, because the sign of the Doppler is lost in a real
channel; rows that a radar does not hear are zero.

The table measured-any-radar.csv has, of every labelled window of the recordings, how many are named
right, with the columns of measured-accuracy.csv and next to them what the radar's own network says
of the same files. The rows of radar "any" hold all radars that have an own network.

A second network learns a fifth class as well, none of these: measured-refused.csv (`refused.py`).
"""

import argparse
import math
import tempfile
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from accuracy import (
    ACCURACY,
    RECOGNITION,
    accuracy_rows,
    by_label,
    counts,
    loaded,
    record_of,
    said_of,
    window_s,
)
from any_speed import RADAR, any_speed
from foreign import recorded_inputs, simulated_inputs
from fourth_radar import RECORDS as FOURTH
from labels import intervals_of, label_of, read_labels
from measured_tables import write_measured
from recorded_sets import Measured, recordings, usable
from refused import (
    FOREIGN,
    REFUSED,
    Asked,
    draw,
    leaning_for,
    over_seeds,
    refusals,
    simulated_names,
)
from torch import nn

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import run
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.answers import Answers, answers
from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.presence import speeds_shown
from lowalt.extensions.recordings.record import Record, record
from lowalt.extensions.recordings.twin import NO_CLASS, Twin, twin_of
from lowalt.extensions.recordings.twin_others import KINDS
from lowalt.extensions.recordings.twin_scenes import SCENES, Library, clouds_of, intervals
from lowalt.extensions.recordings.twin_training import kept_signals, settings, train
from lowalt.extensions.recordings.window_samples import Windows, facts
from lowalt.files.csv_tables import read_csv
from lowalt.files.shipped import shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.progress import reported
from lowalt.numerics.streams import stream
from lowalt.recognition.checkpoint import identity
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.runs import Trained
from lowalt.tiles.image_settings import Images
from lowalt.tiles.scale import Scale

SETTINGS = Path(__file__).with_name("any_radar.yaml")
REFERENCE = Path("results/reference")
NAME = "any"
"""Name of the network, and of the rows of all radars together."""
REFUSING = "refusing"
"""Name of the network that knows a fifth class."""
USUAL = "usual"
ANY_SPEED = "any speed"
"""Names of sets of scenes; that of a third is `NO_CLASS`."""
HB100 = "hb100"
"""Name of the radar of `fourth_radar.yaml`."""
OWN = ("right_percent", "low", "high", "devices_low", "devices_high", "named_percent")
COLUMNS = (*ACCURACY, *(f"own_{key}" for key in OWN))
SIMULATED = ("seed", "class", "windows", "right_percent")
DRAWN_PERCENT = 95.0
"""Share of known windows that the network keeps whose answers are drawn."""
LEVELS = 255
"""Steps of an image's values above zero."""


@dataclass(frozen=True)
class View:
    """An image of a window: short-time spectra of `seconds`, from the slowest to the fastest
    absolute speed (m/s) on an `axis` that is "linear" or "logarithmic"."""

    seconds: float
    slowest_mps: float
    fastest_mps: float
    axis: str

    def edges_mps(self, size: int) -> np.ndarray:
        """Speeds (size + 1,) m/s between the rows, ascending."""
        if self.axis == "linear":
            return np.linspace(self.slowest_mps, self.fastest_mps, size + 1)
        return np.geomspace(self.slowest_mps, self.fastest_mps, size + 1)


def loguniform(span: list[float], rng: np.random.Generator) -> float:
    """Return a draw from [low, high] whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(span[0]), np.log(span[1]))))


def drawn_twin(block: dict, measured: list[Twin], rng: np.random.Generator) -> Twin:
    """Return a radar drawn from the ranges of the settings that is none of the measured ones."""
    while True:
        carrier_hz = loguniform(block["carrier_hz"], rng)
        fastest_mps = loguniform(block["fastest_mps"], rng)
        seconds = loguniform(block["window_s"], rng)
        channel = str(rng.choice(list(block["samplings"])))
        sampling = str(rng.choice(block["samplings"][channel]))
        slowest_mps = float(rng.choice(block["slowest_mps"]))
        per_symbol = int(rng.choice(block["bare_rates"])) if sampling == "bare" else 2
        # One-sided sampling shows speeds up to twice lambda / (4 T).
        quarters = 2 if sampling == "one_sided" else 4
        interval_s = SPEED_OF_LIGHT / carrier_hz / (quarters * fastest_mps)
        symbols = round(seconds / interval_s)
        twin = Twin(
            carrier_hz,
            channel,
            per_symbol / interval_s,
            interval_s,
            symbols,
            sampling,
            slowest_mps,
            float(block["detect_db"]),
        )
        enough = block["symbols"][0] <= symbols <= block["symbols"][1]
        if enough and not any(alike(twin, other, block["apart"]) for other in measured):
            return twin


def alike(one: Twin, other: Twin, apart: float) -> bool:
    """Whether two radars' carriers and symbol intervals both differ by less than the share
    `apart`."""
    carriers = abs(math.log(one.carrier_hz / other.carrier_hz))
    symbols = abs(math.log(one.symbol_interval_s / other.symbol_interval_s))
    return max(carriers, symbols) < math.log(1 + apart)


@lru_cache(maxsize=64)
def _cells(twin: Twin, length: int, view: View, size: int) -> tuple[np.ndarray, ...]:
    """The cells (n,) of spectra of `length` symbols that a view shows, row by row; the number of the
    first cell of each row that has any, and which rows (size,) these are.

    Where cells are wider than rows, each row has the cell that holds its middle.
    """
    speeds = np.fft.fftshift(np.fft.fftfreq(length)) * 2 * twin.edge_mps
    order, meant = speeds_shown(speeds, twin.edge_mps, twin.sides)
    cell_of = np.fft.fftshift(np.arange(length))[order]
    meant = np.abs(meant)
    edges = view.edges_mps(size)
    half_mps = twin.edge_mps / length
    rows = []
    for low, high in pairwise(edges):
        inside = (meant >= low) & (meant < high)
        if not inside.any():
            inside = np.abs(meant - (low + high) / 2) <= half_mps
        inside &= meant <= twin.fastest_mps
        rows.append(cell_of[inside])
    filled = np.array([len(row) > 0 for row in rows])
    starts = np.concatenate([[0], np.cumsum([len(row) for row in rows])])[:-1]
    return np.concatenate(rows), starts[filled], filled


def image(interval: np.ndarray, twin: Twin, view: View, size: int) -> np.ndarray:
    """Return the magnitudes (size, size) of one interval (symbols,): a row is the largest of the
    Doppler cells in its stretch of absolute speeds, the fastest on top; a column is a time.

    Rows beyond what the radar hears are zero.
    """
    symbols = len(interval)
    length = min(round(view.seconds / twin.symbol_interval_s), symbols // 2)
    window = np.hanning(length + 2)[1:-1]
    firsts = np.rint(np.linspace(0, symbols - length, size)).astype(int)
    points = 1 << (2 * length - 1).bit_length()
    cut = interval[firsts[:, None] + np.arange(length)] * window
    magnitude = np.abs(np.fft.fft(cut, points, axis=1))
    cells, starts, filled = _cells(twin, points, view, size)
    result = np.zeros((size, size))
    if filled.any():
        result[filled] = np.maximum.reduceat(magnitude[:, cells], starts, axis=1).T
    return result[::-1]


def rendered(
    intervals: np.ndarray, twin: Twin, views: list[View], floor_db: float, size: int
) -> np.ndarray:
    """Return the images (n, views, size, size) uint8 of coherent intervals (n, symbols) of any
    radar, in decibels below each image's strongest cell."""
    steps = Scale("decibel", floor_db).thresholds(LEVELS)
    result = np.empty((len(intervals), len(views), size, size), np.uint8)
    for number, interval in enumerate(intervals):
        for channel, view in enumerate(views):
            shown = image(interval, twin, view, size)
            share = shown / max(shown.max(), 1e-300)
            result[number, channel] = np.searchsorted(steps, share.ravel(), side="right").reshape(
                size, size
            )
    return result


class Drawing:
    """What simulated radars are drawn from: the settings, the measured radars, scenes and clouds.

    scenes: by the name of the set, then by class.
    """

    def __init__(self, block: dict, library: Library, measured: list[Twin]) -> None:
        """Read the scenes and make the clouds of their targets."""
        self.block = block
        self.measured = measured
        usual = load_yaml(shipped(SCENES), "usual scenes")
        self.seed = int(usual["seed"])
        at_any_speed = any_speed()[0][RADAR]["scenes"]
        receiver = {"receiver": block["receiver"]}
        self.scenes = {
            USUAL: {
                label: [{**one, **receiver} for one in usual["scenes"][label]]
                for label in CATEGORIES
            },
            ANY_SPEED: {
                label: [{**one, **receiver} for one in at_any_speed[label]] for label in CATEGORIES
            },
            NO_CLASS: {NO_CLASS: [{"others": list(KINDS), **receiver}]},
        }
        every = [
            scene
            for of_set in self.scenes.values()
            for of_class in of_set.values()
            for scene in of_class
        ]
        every += [scene["second"]["scene"] for scene in every if "scene" in scene.get("second", {})]
        names = {name for scene in every for name in scene.get("subtypes", ())}
        self.clouds = clouds_of(library.records, sorted(names), self.seed)

    def twin(self, fold: str, number: int) -> Twin:
        """Return the radar `number` of a fold."""
        return drawn_twin(self.block, self.measured, stream(self.seed, "any-radar", fold, number))

    def windows(self, fold: str, number: int, which: str) -> tuple[np.ndarray, list[str]]:
        """Return the intervals (classes, echoes, receivers, symbols) complex64 of a radar in front
        of a set of scenes, and the subtypes (classes echoes) of its targets."""
        twin = self.twin(fold, number)
        echoes = self.block["echoes"][which]
        receivers = self.block["receivers"]
        # The random streams of the usual scenes are named without their set.
        of_set = () if which == USUAL else (which,)
        result = np.empty((len(self.scenes[which]), echoes, receivers, twin.symbols), np.complex64)
        subtypes = []
        for place, (label, scenes) in enumerate(self.scenes[which].items()):
            for echo in range(echoes):
                scene = scenes[(number * echoes + echo) % len(scenes)]
                keys = ("any-radar", *of_set, fold, number, label, echo)
                found, names = intervals(twin, scene, self.clouds, self.seed, keys, 1, receivers)
                result[place, echo] = found[0]
                subtypes += names
        return result, subtypes

    def kept(
        self, fold: str, number: int, which: str, folder: Path
    ) -> tuple[np.ndarray, list[str]]:
        """Return what `windows` does, out of the folder where an earlier run left it there."""
        made_of = identity(
            twin=asdict(self.twin(fold, number)),
            echoes=self.block["echoes"][which],
            receivers=self.block["receivers"],
            scenes=self.scenes[which],
            seed=self.seed,
            fold=fold,
            number=number,
        )
        return kept_signals(made_of, folder, lambda: self.windows(fold, number, which))


def samples(
    drawing: Drawing, fold: str, sets: list[str], views: list[View], size: int, folder: Path
) -> Windows:
    """Return the images of a fold's radars in front of sets of scenes as samples; folder: keeps
    their signals."""
    block = drawing.block
    classes = classes_of(sets)
    images = []
    labels = []
    names: list[str] = []
    radars = block["radars"][fold]
    for which in sets:
        of_set = drawing.scenes[which]
        for number in reported(range(radars), radars, "radars"):
            twin = drawing.twin(fold, number)
            found, subtypes = drawing.kept(fold, number, which, folder)
            every = found.reshape(-1, twin.symbols)
            images.append(rendered(every, twin, views, block["floor_db"], size))
            for label in of_set:
                labels += [classes.index(label)] * (len(every) // len(of_set))
            names += subtypes
    receivers = block["receivers"]
    return Windows(
        np.concatenate(images),
        facts(
            np.array(labels),
            np.repeat(names, receivers).tolist(),
            np.repeat(np.arange(len(names)), receivers),
            np.tile(np.arange(receivers, dtype=float), len(names)),
            fold,
        ),
    )


def classes_of(sets: list[str]) -> tuple[str, ...]:
    """Return the classes of a network that learns from sets of scenes."""
    return (*CATEGORIES, NO_CLASS) if NO_CLASS in sets else tuple(CATEGORIES)


def asked(
    block: dict, library: Library, inputs: Path, half: str | None
) -> list[tuple[str, Twin, Measured]]:
    """Return the recordings to ask about, each with its radar's name and twin: those of the
    measured sets, and those of the HB100 modules, which are test files.

    half: of the recordings, the only one that is taken; None for both.
    """
    found = [
        (one.radar, library.twins[one.radar], one) for one in usable(recordings(inputs), library)
    ]
    twin = fourth_twin(inputs)
    for one in load_yaml(FOURTH, "records")["records"]:
        about = record(one, inputs, one["file"])
        if about.file.is_file():
            found.append((HB100, twin, Measured("fourth", "test", about, "", HB100)))
    return [one for one in found if half in (None, one[2].half)]


def fourth_twin(inputs: Path) -> Twin:
    """Return the twin of the HB100 modules, as their own network has it."""
    first = load_yaml(FOURTH, "records")["records"][0]
    return twin_of(record(first, inputs, first["file"]), float(first["rate_hz"]))


def answered(trained: Trained, about: Record, name: str, twin: Twin, block: dict) -> Answers:
    """Return what a network for any radar says of a recording in front of a radar."""
    views = views_of(block)

    def images_of(intervals: np.ndarray, twin: Twin, _: Images, size: int) -> np.ndarray:
        """The images of intervals of any radar."""
        return rendered(intervals, twin, views, block["floor_db"], size)

    made_with = {"radar": asdict(twin), "images": block["recognition"]["images"]}
    return answers(trained, made_with, about, name, images_of)


def rows_of(
    trained: Trained, seed: int, recordings: list[tuple[str, Twin, Measured]], block: dict
) -> list[list]:
    """Return the rows of `RECOGNITION` of what a network says of recordings."""
    labels = read_labels()
    result = []
    for name, twin, recording in recordings:
        found = answered(trained, record_of(recording), recording.name, twin, block)
        stretches = intervals_of(labels, recording.set, recording.name, recording.record.label)
        said = said_of(found, list(trained.classes), window_s(twin), stretches)
        about = recording.device, recording.set, recording.half, recording.name
        result += [
            [name, seed, *about, label, *counts(label, outcomes)]
            for label, outcomes in by_label(said)
        ]
    return result


def answers_on_recordings(
    trained: Trained, recordings: list[tuple[str, Twin, Measured]], block: dict
) -> list[Asked]:
    """Return what a network says of recordings whose windows have labels."""
    intervals_by_file = read_labels()
    result = []
    for radar, twin, one in recordings:
        found = answered(trained, record_of(one), one.name, twin, block)
        stretches = intervals_of(intervals_by_file, one.set, one.name, one.record.label)
        labels = [label_of(start_s, window_s(twin), stretches) for start_s in found.starts_s]
        result.append(Asked(radar, one.half, [label or "" for label in labels], found))
    return result


def answers_on_foreign(
    trained: Trained, measured: dict[str, Twin], inputs: Path, block: dict
) -> list[Asked]:
    """Return what a network says of inputs without a class.

    measured: the radars by name; inputs: folder of the recordings.
    """
    result = []

    def asked_of_none(radar: str, twin: Twin, name: str, about: Record) -> Asked:
        """What the network says of an input of no class."""
        found = answered(trained, about, name, twin, block)
        return Asked(radar, FOREIGN, [name] * len(found.starts_s), found)

    with tempfile.TemporaryDirectory() as folder:
        for radar, twin in measured.items():
            for name, about in simulated_inputs(twin, Path(folder)):
                result.append(asked_of_none(radar, twin, name, about))
        for name, about in recorded_inputs(inputs, Path(folder)):
            if about.label:
                continue
            near = [radar for radar, twin in measured.items() if twin.near(about.carrier_hz)]
            if near:
                radar = near[0]
                twin = measured[radar]
            else:
                radar = f"{about.carrier_hz / 1e9:g} GHz"
                twin = twin_of(about, read(about).rate_hz)
            one = asked_of_none(radar, twin, name, about)
            result.append(
                one._replace(twin=twin.at_carrier(about.carrier_hz), baseband=read(about))
            )
    return result


def simulated_rows(network: nn.Module, windows: Windows, seed: int) -> list[list]:
    """Return the rows of `SIMULATED` of a network on the windows of radars that it did not learn."""
    named = shares_of(network, windows).argmax(axis=1)
    result = []
    for label, category in enumerate(CATEGORIES):
        of_class = windows.facts.label == label
        right_percent = 100 * float((named[of_class] == label).mean())
        result.append([seed, category, int(of_class.sum()), right_percent])
    return result


def shares_of(network: nn.Module, windows: Windows) -> np.ndarray:
    """Return the probabilities (n, classes) of a network for simulated windows."""
    return probabilities(network, windows, np.arange(len(windows.facts)), Machine.here("fp32"), 64)


def folds_of(drawing: Drawing, name: str, models: Path) -> dict[str, Windows]:
    """Return what a network learns from, and simulated windows to test it on, by fold."""
    block = drawing.block
    sets = block["networks"][name]["scenes"]
    size = block["recognition"]["size"]
    return {
        fold: samples(drawing, fold, sets, views_of(block), size, models / "signals")
        for fold in ("train", "validation", "test")
    }


def learned(block: dict, folds: dict[str, Windows], name: str, seed: int, models: Path) -> Trained:
    """Train a network of the settings and return it."""
    learns = block["networks"][name]
    recognition = block["recognition"]
    recognition = {
        **recognition,
        "training": {**recognition["training"], "steps": learns["steps"]},
    }
    windows = {fold: folds[fold] for fold in ("train", "validation")}
    folder = models / f"{name}-{seed}"
    train(recognition, windows, name, seed, folder, classes_of(learns["scenes"]))
    return loaded(folder / "model.safetensors", name)


def views_of(block: dict) -> list[View]:
    """Return the views of the settings."""
    return [View(**view) for view in block["views"]]


def together(rows: list[list], radars: set[str]) -> list[list]:
    """Return rows of `RECOGNITION`, and after them those of some radars as of one, `NAME`."""
    return rows + [[NAME, *row[1:]] for row in rows if row[0] in radars]


def own_rows(path: Path) -> list[list]:
    """Return what the networks of the zoo say, rows of `RECOGNITION` out of a kept table."""
    texts = ("radar", "seed", "device", "set", "half", "file", "label")
    return [
        [row[key] if key in texts else float(row[key] or "nan") for key in RECOGNITION]
        for row in read_csv(path, *RECOGNITION)
    ]


def compared(rows: list[list], own: list[list], seed: int) -> list[list]:
    """Return the rows of `COLUMNS`: the accuracy of this network, and of each radar's own. The rows
    of `NAME` hold the radars that have one."""
    columns = [ACCURACY.index(key) for key in OWN]
    with_own = {row[0] for row in own}
    of_own = {
        tuple(row[:3]): [row[column] for column in columns]
        for row in accuracy_rows(together(own, with_own), seed)
    }
    nothing = [math.nan] * len(OWN)
    return [
        [*row, *of_own.get(tuple(row[:3]), nothing)]
        for row in accuracy_rows(together(rows, with_own), seed)
    ]


def write_compared(
    drawing: Drawing, inputs: list[tuple[str, Twin, Measured]], options: argparse.Namespace
) -> None:
    """Train the network of the known classes and write its tables, next to each radar's own."""
    block = drawing.block
    folds = folds_of(drawing, NAME, options.models)
    rows = []
    simulated = []
    for seed in block["recognition"]["seeds"]:
        trained = learned(block, folds, NAME, seed, options.models)
        simulated += simulated_rows(trained.model, folds["test"], seed)
        rows += rows_of(trained, seed, inputs, block)
    own = own_rows(REFERENCE / "measured-recognition.csv")
    table = compared(rows, own, block["recognition"]["seed"])
    write_measured(options.out, "any-radar", COLUMNS, table)
    write_measured(options.out, "any-radar-files", RECOGNITION, rows)
    write_measured(options.out, "any-radar-simulated", SIMULATED, simulated)


def write_refused(
    drawing: Drawing,
    inputs: list[tuple[str, Twin, Measured]],
    measured: dict[str, Twin],
    options: argparse.Namespace,
) -> None:
    """Train the network that refuses, write its table, and draw what that of the first seed says."""
    block = drawing.block
    folds = folds_of(drawing, REFUSING, options.models)
    known = folds["validation"].facts.label < len(CATEGORIES)
    seeds = block["recognition"]["seeds"]
    of_seeds = []
    for seed in seeds:
        trained = learned(block, folds, REFUSING, seed, options.models)
        shares = shares_of(trained.model, folds["validation"])[known]
        on_test = shares_of(trained.model, folds["test"]), simulated_names(folds["test"].facts)
        said = answers_on_recordings(trained, inputs, block)
        said += answers_on_foreign(trained, measured, options.inputs, block)
        of_seeds.append(refusals(shares, on_test, said, block["kept_percent"]))
        if seed == seeds[0]:
            draw(said, leaning_for(shares, DRAWN_PERCENT), options.out)
    write_measured(options.out, "refused", REFUSED, over_seeds(of_seeds))


def main(arguments: list[str]) -> None:
    """Train both networks for any radar, ask them about the recordings and write the tables."""
    line = argparse.ArgumentParser(prog="any_radar.py", description=main.__doc__)
    line.add_argument("--inputs", required=True, type=Path, help="folder of the measured sets")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument("--models", required=True, type=Path, help="folder of signals and networks")
    line.add_argument("--settings", default=SETTINGS, type=Path, help="settings (.yaml)")
    line.add_argument("--half", choices=("tuning", "test"), help="ask about no other recordings")
    options = line.parse_args(arguments)
    block = load_yaml(options.settings, "settings of any radar")
    block["recognition"] = settings(over=block["recognition"])
    library = Library.read()
    measured = {**library.twins, HB100: fourth_twin(options.inputs)}
    drawing = Drawing(block, library, list(measured.values()))
    inputs = asked(block, library, options.inputs, options.half)
    write_compared(drawing, inputs, options)
    write_refused(drawing, inputs, measured, options)


if __name__ == "__main__":
    run(main)
