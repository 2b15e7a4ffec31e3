"""Recordings at the threshold that keeps 95 % of a twin's own validation windows.

    python studies/unknown/recorded.py --inputs MEASURED --foreign FOLDER --out
    studies/unknown/results/recorded.csv

MEASURED: folder of the measured sets (design/measured.md); FOLDER: the files of foreign.yaml by the
paths given there. The table has one row per network, kind of window and score:
    windows         simulated by the network's twin, or what was recorded
    known           whether the network knows its class
    count           number of windows; "all windows" includes those in which nothing moves
    kept_percent    share of them that is kept; right_percent: kept and named rightly
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import recorded_sets
import rejection
import torch

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import run
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings import twin_training
from lowalt.extensions.recordings.channel import coherent_intervals
from lowalt.extensions.recordings.files import Baseband, read
from lowalt.extensions.recordings.presence import present
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import MARGIN, Library, samples, stretch
from lowalt.extensions.recordings.window_samples import Windows, facts, rendered
from lowalt.extensions.recordings.windows import at_symbol_rate
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition import runs
from lowalt.recognition.inference import Machine
from lowalt.recognition.samples import Samples, fingerprint, joined
from lowalt.recognition.schemes import TABLE, named
from lowalt.tiles.image_settings import Images

FOLDER = Path("config/measured")
SCORES = {"largest probability": rejection.probability, "energy": rejection.energy}
EXTRA = {"extra class": rejection.no_extra}
EMPTY = ("noise", "swinging point")
"""Windows without a target of the four classes; the extra class is trained on both."""
ASKED = 200
"""Windows of each kind of EMPTY that the networks are asked about."""
MODELS = Path("results/unknown/twins")
COLUMNS = ("network", "windows", "score", "known", "count", "kept_percent", "right_percent")


def logits(model: torch.nn.Module, samples: Samples, batch: int = 256) -> np.ndarray:
    """Return the logits (n, classes) float64 of all samples of a source."""
    model = Machine.here("fp32").placed(model).eval()
    with torch.inference_mode():
        parts = [
            model(
                torch.from_numpy(
                    samples.views(np.arange(start, min(start + batch, len(samples.facts))))
                )
            )
            for start in range(0, len(samples.facts), batch)
        ]
    return torch.cat(parts).double().numpy()


@dataclass(frozen=True)
class Radar:
    """A network of the zoo with its twin, and how its images are made."""

    name: str
    model: object
    twin: Twin
    images: Images
    size: int

    def rendered(self, intervals: np.ndarray, twin: Twin) -> np.ndarray:
        """Return the images (n, 3, size, size) uint8 of intervals (n, symbols)."""
        return rendered(intervals, twin, self.images, self.size)

    def logits(self, intervals: np.ndarray, twin: Twin) -> np.ndarray:
        """Return the logits (n, classes) of intervals (n, symbols) at a recording's own carrier."""
        shown = self.rendered(intervals, twin)
        count = len(shown)
        known = facts(
            np.zeros(count, int), ["window"] * count, np.arange(count), np.zeros(count), ""
        )
        return logits(self.model, Windows(shown, known))


class Part(NamedTuple):
    """Windows of one kind: what they are, their logits (n, classes), and their labels, None where
    it knows none.
    """

    windows: str
    logits: np.ndarray
    label: int | np.ndarray | None


def opened(name: str) -> Radar:
    """Return a network of the zoo by name."""
    trained, settings = runs.opened(name)
    twin = Twin.from_settings(settings["radar"])
    return Radar(name, trained.model, twin, Images.from_settings(settings["images"]), trained.size)


def of_text(path: Path) -> Baseband:
    """Return samples and rate (Hz) of a text file of times (s) and volts below three lines of names
    and units.
    """
    times, volts = np.loadtxt(path, skiprows=3).T
    return Baseband(volts, (len(times) - 1) / (times[-1] - times[0]))


def foreign(entry: dict, folder: Path, twin: Twin) -> np.ndarray:
    """Return the windows (n, symbols) of a file of foreign.yaml.

    Raises: InputError naming a file that is not there.
    """
    path = folder / entry["file"]
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected the recording that foreign.yaml names")
    record = Record(path, entry["carrier_hz"], "real")
    signal = at_symbol_rate(record, twin, of_text(path) if path.suffix == ".txt" else read(record))
    return coherent_intervals(signal, twin.symbols, str(path), twin.slow)


def swung(times_s: np.ndarray, wavelength_m: float, rng: np.random.Generator) -> np.ndarray:
    """Return the echo (N,) complex128 of a point that swings, at three random rates and sizes,
    while it drifts.
    """
    range_m = rng.uniform(-2, 2) * times_s
    for _ in range(3):
        size_m = 10 ** rng.uniform(-2.5, -0.3)
        rate_hz = 10 ** rng.uniform(-0.5, 0.7)
        range_m = range_m + size_m * np.sin(2 * np.pi * (rate_hz * times_s + rng.random()))
    return np.exp(-4j * np.pi / wavelength_m * range_m)


def empty(radar: Radar, library: Library, kind: str, count: int, fold: str) -> np.ndarray:
    """Return windows (count, symbols) without a target of the four classes through the twin's
    receivers.

    kind: "noise", which is that beside an echo of unit power, or "swinging point"; fold: keys the
    random streams.
    """
    twin = radar.twin
    found = []
    receivers = [
        scene["receiver"]
        for category in CATEGORIES
        for scene in library.scenes[radar.name][category]
    ]
    seconds = twin.symbols * twin.symbol_interval_s
    times = (
        np.arange(int((seconds + 2 * MARGIN * twin.symbol_interval_s) * twin.rate_hz) + 1)
        / twin.rate_hz
    )
    for number in range(count):
        rng = stream(library.seed, "unknown", radar.name, kind, fold, number)
        signal = swung(times, SPEED_OF_LIGHT / twin.carrier_hz, rng)
        values = samples(
            twin, receivers[number % len(receivers)], signal, rng, target=kind != "noise"
        )
        found.append(
            coherent_intervals(stretch(values, twin, seconds), twin.symbols, slow=twin.slow)[0]
        )
    return np.array(found)


class Kept(Windows):
    """Windows in memory whose images and facts name a training."""

    def sha256(self) -> str:
        """Return the SHA-256 of images and facts."""
        return fingerprint(self.facts, np.ascontiguousarray(self.images).data)


def with_empty(radar: Radar, library: Library, block: dict, fold: str) -> Kept:
    """Return the twin's windows of a fold, "train" or "validation", and as many of an extra class
    as of another.
    """
    known = twin_training.simulated(library, radar.name, block, fold)
    count = len(known.facts) // (2 * len(CATEGORIES))
    parts = [known.images]
    told = [known.facts]
    for kind in EMPTY:
        parts.append(radar.rendered(empty(radar, library, kind, count, fold), radar.twin))
        numbers = np.arange(count)
        told.append(
            facts(np.full(count, len(CATEGORIES)), [kind] * count, numbers, np.zeros(count), fold)
        )
    return Kept(np.concatenate(parts), joined(told))


def with_extra(radar: Radar, library: Library, block: dict, folder: Path) -> Radar:
    """Return the radar with a network of five classes that is trained here, unless that is done."""
    path = folder / radar.name / "model.safetensors"
    if not path.is_file():
        windows = {
            fold: with_empty(radar, library, block, fold) for fold in ("train", "validation")
        }
        settings = {
            key: block[key] for key in ("seed", "size", "network", "training", "augmentation")
        }
        settings |= {"colour_map": block["images"]["colour_map"], "classes": [*CATEGORIES, "Other"]}
        runs.train(windows, named(TABLE, block["scheme"], ["A"]), "seen", settings, path.parent)
    return replace(radar, model=runs.load(path).model)


def known_parts(radar: Radar, library: Library, inputs: Path) -> list[Part]:
    """Return the parts of the recordings that a network knows, one a category: windows that hold a
    target.
    """
    every = recorded_sets.recordings(inputs)
    parts = []
    of_radar = [recording for recording in every if recording.radar == radar.name]
    for label, category in enumerate(CATEGORIES):
        of_category = []
        for recording in of_radar:
            if recording.record.label == category:
                twin = radar.twin.at_carrier(recording.record.carrier_hz)
                of_category.append(radar.logits(recording.windows(twin), twin))
        if of_category:
            parts.append(Part(f"recorded, {category}", np.concatenate(of_category), label))
    return parts


def foreign_parts(radar: Radar, folder: Path) -> list[Part]:
    """Return the parts of the files of foreign.yaml: all windows, and those with a target where
    these are fewer.
    """
    parts = []
    for entry in load_yaml(Path(__file__).with_name("foreign.yaml"), "recordings")["files"]:
        if entry["network"] != radar.name:
            continue
        twin = radar.twin.at_carrier(entry["carrier_hz"])
        windows = foreign(entry, folder, twin)
        moving = present(windows, twin)
        parts.append(
            Part(f"recorded, {entry['what']}, all windows", radar.logits(windows, twin), None)
        )
        if moving.any() and not moving.all():
            some = radar.logits(windows[moving], twin)
            parts.append(Part(f"recorded, {entry['what']}, windows with a target", some, None))
    return parts


def rows_of(radar: Radar, library: Library, inputs: Path, folder: Path, models: Path) -> list[list]:
    """Return the table's rows of one network of the zoo, and of one with an extra class."""
    block = twin_training.settings(FOLDER / "recognition.yaml")
    own = twin_training.simulated(library, radar.name, block, "validation")
    hollow = {kind: empty(radar, library, kind, ASKED, "test") for kind in EMPTY}
    rows = []
    for asked, scores in ((radar, SCORES), (with_extra(radar, library, block, models), EXTRA)):
        parts = [
            Part("simulated, validation", logits(asked.model, own), own.facts.label),
            *(
                Part(f"simulated, {kind}", asked.logits(windows, asked.twin), None)
                for kind, windows in hollow.items()
            ),
            *known_parts(asked, library, inputs),
            *foreign_parts(asked, folder),
        ]
        for name, score in scores.items():
            values = [score(part.logits, len(CATEGORIES)) for part in parts]
            level = rejection.level(values[0], np.ones(len(values[0])))
            rows += [
                [radar.name, part.windows, name, *shares(part, found >= level)]
                for part, found in zip(parts, values, strict=True)
            ]
    return rows


def shares(part: Part, kept: np.ndarray) -> list:
    """Return count, share kept and, of a class that the network knows, share kept and named
    rightly, percent.
    """
    named_as = part.logits[:, : len(CATEGORIES)].argmax(1)
    right = "" if part.label is None else f"{100 * np.mean(kept & (named_as == part.label)):.1f}"
    return [part.label is not None, len(kept), f"{100 * kept.mean():.1f}", right]


def main(arguments: list[str]) -> None:
    """Write the table of all networks of radars in the zoo."""
    line = argparse.ArgumentParser("recorded.py", description=__doc__.splitlines()[0])
    line.add_argument("--inputs", type=Path, required=True, help="folder of the measured sets")
    line.add_argument(
        "--foreign", type=Path, required=True, help="folder of the files that foreign.yaml names"
    )
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    library = Library.read()
    rows = [
        row
        for name in library.twins
        for row in rows_of(opened(name), library, given.inputs, given.foreign, MODELS)
    ]
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
