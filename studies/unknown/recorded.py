"""Recordings at the threshold that keeps 95 % of a twin's own validation windows.

    python studies/unknown/recorded.py --inputs MEASURED --foreign FOLDER --out studies/unknown/results/recorded.csv

MEASURED: folder of the measured sets (design/measured.md); FOLDER: the files of foreign.yaml by the paths given there.
The table has one row a network, a kind of window and a score:
    windows         simulated by the network's twin, or what was recorded
    known           whether the network knows its class
    count           windows; "all windows" counts those of a recording in which nothing moves too
    kept_percent    share of them that is kept; right_percent: kept and named rightly
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rejection
from study import logits

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition import zoo
from lowalt.recordings import recognise, sets
from lowalt.recordings.channel import coherent_intervals
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.library import Library
from lowalt.recordings.presence import present
from lowalt.recordings.record import Record
from lowalt.recordings.scenes import heard, samples, stretch
from lowalt.recordings.twin import Twin
from lowalt.tiles.settings import Images

FOLDER = Path("config/measured")
SCORES = {"largest probability": rejection.probability, "energy": rejection.energy}
NOISE = 200
"""Windows of the receiver's noise alone."""
COLUMNS = ("network", "windows", "known", "score", "count", "kept_percent", "right_percent")


@dataclass(frozen=True)
class Radar:
    """A network of the zoo with its twin, and how its images are made."""

    name: str
    model: object
    twin: Twin
    images: Images
    size: int

    def logits(self, intervals: np.ndarray, twin: Twin) -> np.ndarray:
        """Return the logits (n, 4) of intervals (n, symbols) at a recording's own carrier."""
        shown = recognise.rendered(intervals, twin, self.images, self.size)
        count = len(shown)
        told = recognise.facts(np.zeros(count, int), ["window"] * count, np.arange(count), np.zeros(count), "")
        return logits(self.model, recognise.Windows(shown, told))


class Part(NamedTuple):
    """Windows of one kind: what they are, their logits (n, 4), and their labels, None where the network knows none."""

    windows: str
    logits: np.ndarray
    label: int | np.ndarray | None


def opened(name: str) -> Radar:
    """Return a network of the zoo by name."""
    trained, settings = zoo.opened(name)
    twin = Twin.from_settings(settings["radar"])
    return Radar(name, trained.model, twin, Images.from_settings(settings["images"]), trained.size)


def of_text(path: Path) -> Baseband:
    """Return samples and rate (Hz) of a text file of times (s) and volts below three lines of names and units."""
    times, volts = np.loadtxt(path, skiprows=3).T
    return Baseband(volts, (len(times) - 1) / (times[-1] - times[0]))


def foreign(entry: dict, folder: Path, twin: Twin) -> np.ndarray:
    """Return the windows (n, symbols) of a file of foreign.yaml.

    Raises: InputError naming a file that is not there.
    """
    path = folder / entry["file"]
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected the recording that foreign.yaml names")
    record = Record(path, entry["carrier_hz"], "real", "foreign.yaml", "none stated")
    signal = sets.sampled(record, twin, of_text(path) if path.suffix == ".txt" else read(record))
    return coherent_intervals(signal, twin.symbols, name=str(path))


def noise(radar: Radar, library: Library) -> np.ndarray:
    """Return windows (NOISE, symbols) of what the twin's receiver hears without a target, scene by scene in turn.

    The noise is as strong as beside the target that was taken away.
    """
    twin, seconds, found = radar.twin, radar.twin.symbols * radar.twin.symbol_interval_s, []
    scenes = [(category, scene) for category in CATEGORIES for scene in library.scenes[radar.name][category]]
    clouds = {category: library.clouds(radar.name, category) for category in CATEGORIES}
    for number in range(NOISE):
        category, scene = scenes[number % len(scenes)]
        rng = stream(library.seed, "unknown", radar.name, number)
        signal, _ = heard(twin, scene, clouds[category], rng, seconds)
        values = samples(twin, scene["receiver"], signal, rng, target=False)
        found.append(coherent_intervals(stretch(values, twin, seconds), twin.symbols)[0])
    return np.array(found)


def known_parts(radar: Radar, library: Library, inputs: Path) -> list[Part]:
    """Return the parts of the recordings that a network knows, one a category: windows that hold a target."""
    every = sets.recordings(inputs, FOLDER / "sets.yaml", FOLDER / "split.yaml")
    mine, parts = [one for one in every if library.twin_of(one.like) == radar.name], []
    for label, category in enumerate(CATEGORIES):
        found = []
        for one in mine:
            if one.record.label == category:
                twin = sets.at_carrier(radar.twin, one.record.carrier_hz)
                found.append(radar.logits(sets.measured_intervals(one, twin), twin))
        if found:
            parts.append(Part(f"recorded, {category}", np.concatenate(found), label))
    return parts


def foreign_parts(radar: Radar, folder: Path) -> list[Part]:
    """Return the parts of the files of foreign.yaml: all windows, and those with a target where these are fewer."""
    parts = []
    for entry in load_yaml(Path(__file__).with_name("foreign.yaml"), "recordings")["files"]:
        if entry["network"] != radar.name:
            continue
        twin = sets.at_carrier(radar.twin, entry["carrier_hz"])
        windows = foreign(entry, folder, twin)
        moving = present(windows, twin)
        parts.append(Part(f"recorded, {entry['what']}, all windows", radar.logits(windows, twin), None))
        if moving.any() and not moving.all():
            some = radar.logits(windows[moving], twin)
            parts.append(Part(f"recorded, {entry['what']}, windows with a target", some, None))
    return parts


def rows_of(radar: Radar, library: Library, inputs: Path, folder: Path) -> list[list]:
    """Return the table's rows of one network."""
    own = recognise.simulated(library, radar.name, recognise.settings(FOLDER / "recognition.yaml"), "validation")
    parts = [
        Part("simulated, validation", logits(radar.model, own), own.facts.label),
        Part("simulated, noise alone", radar.logits(noise(radar, library), radar.twin), None),
        *known_parts(radar, library, inputs), *foreign_parts(radar, folder),
    ]  # fmt: skip
    rows = []
    for name, score in SCORES.items():
        scores = [score(part.logits, len(CATEGORIES)) for part in parts]
        level = rejection.level(scores[0], np.ones(len(scores[0])))
        for part, values in zip(parts, scores, strict=True):
            kept, known = values >= level, part.label is not None
            right = f"{100 * np.mean(kept & (part.logits.argmax(1) == part.label)):.1f}" if known else ""
            rows.append([radar.name, part.windows, known, name, len(kept), f"{100 * kept.mean():.1f}", right])
    return rows


def main(arguments: list[str]) -> None:
    """Write the table of all networks of radars in the zoo."""
    line = argparse.ArgumentParser("recorded.py", description=__doc__.splitlines()[0])
    line.add_argument("--inputs", type=Path, required=True, help="folder of the measured sets")
    line.add_argument("--foreign", type=Path, required=True, help="folder of the files that foreign.yaml names")
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    library = Library.read(FOLDER / "twins.yaml")
    rows = [row for name in library.twins for row in rows_of(opened(name), library, given.inputs, given.foreign)]
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
