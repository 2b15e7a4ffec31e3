"""The test of networks on recordings, counted from what `lowalt predict` answers, window by window.

A window counts where one interval of `labels.yaml` holds it as a whole. A recording that is not in
that file, such as one of a user's own, is as a whole what its record's label says.

measured-windows.csv: one row a radar, training seed, recording and labelled window: what it is and
what is said. measured-recognition.csv: one row a radar, training seed, recording and label, with
the number of windows by what is
    said of them: a class, none of these, nothing there, a line beyond the network's speeds,
    clipped, or lost. right_percent is of all windows of the label, named_percent of those that are
    named at all.
measured-accuracy.csv: right_percent and named_percent of each label in each half, mean over its
files and over seeds,
    and balanced accuracy over the classes of a radar. low and high resample files within their
    class; devices_low and devices_high resample the radars that recorded a class, then their files,
    where there are two or more; each of them has a row "CLASS by RADAR" as well; seeds_low and
    seeds_high are the least and the most right of any seed.
"""

import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from labels import EMPTY, TOGETHER, Interval, intervals_of, label_of, read_labels
from recorded_sets import HALVES, Measured

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.answers import UNNAMED, Answers, answers
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import NO_CLASS, Twin
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.twin_training import simulated, train
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import model_file, runs
from lowalt.recognition.runs import Trained, opened

COUNTED = (*CATEGORIES, NO_CLASS, *UNNAMED)
"""What is said of a window."""
WINDOWS = ("radar", "seed", "set", "half", "file", "start_s", "label", "said")
RECOGNITION = (
    "radar",
    "seed",
    "device",
    "set",
    "half",
    "file",
    "label",
    "windows",
    *COUNTED,
    "right_percent",
    "named_percent",
)
ACCURACY = (
    "radar",
    "half",
    "class",
    "devices",
    "files",
    "windows",
    "right_percent",
    "low",
    "high",
    "devices_low",
    "devices_high",
    "seeds_low",
    "seeds_high",
    "named_percent",
)
REPEATS = 4000


def loaded(path: Path, name: str) -> Trained:
    """Return the network in a file that `train` wrote.

    Raises: InputError where the file is missing, damaged, or was trained on another twin than
    `name`.
    """
    twin = model_file.read(path).model.get("twin")
    if twin != name:
        raise InputError(f"{path}: trained on the twin {twin!r}, expected {name!r}")
    return runs.load(path)


class Said(NamedTuple):
    """What a network says of the labelled windows of a recording: their starts (s), labels and
    outcomes.
    """

    starts_s: list[float]
    labels: list[str]
    outcomes: list[str]


def said_of(found: Answers, classes: list[str], window_s: float, intervals: list[Interval]) -> Said:
    """Return what answers say of the windows that lie in intervals."""
    result = Said([], [], [])
    for start_s, outcome in zip(found.starts_s.tolist(), found.outcomes(classes), strict=True):
        label = label_of(start_s, window_s, intervals)
        if label is None:
            continue
        result.starts_s.append(start_s)
        result.labels.append(label)
        result.outcomes.append(outcome)
    return result


def is_right(label: str, outcome: str) -> bool:
    """Whether a window's outcome fits its label: one of its classes, or no class where nothing is
    there.
    """
    if label == EMPTY:
        return outcome in (EMPTY, NO_CLASS)
    return outcome in label.split(TOGETHER)


def counts(label: str, outcomes: list[str]) -> list:
    """Return the columns of `RECOGNITION` from windows on, of the outcomes of the windows of one
    label.
    """
    right = sum(is_right(label, outcome) for outcome in outcomes)
    named = sum(outcome not in UNNAMED for outcome in outcomes)
    named_percent = 100 * right / named if named and label != EMPTY else math.nan
    return [
        len(outcomes),
        *(outcomes.count(one) for one in COUNTED),
        100 * right / len(outcomes),
        named_percent,
    ]


def by_label(said: Said) -> Iterator[tuple[str, list[str]]]:
    """Yield each label of a recording, and the outcomes of its windows."""
    for label in dict.fromkeys(said.labels):
        yield (
            label,
            [
                outcome
                for one, outcome in zip(said.labels, said.outcomes, strict=True)
                if one == label
            ],
        )


def record_of(recording: Measured) -> Record:
    """Return a recording's record with the one of its set's possible rates that its file has."""
    return replace(recording.record, rate_hz=recording.read().rate_hz)


def radar_rows(
    name: str,
    recordings: list[Measured],
    library: Library,
    block: dict,
    models: Path | None,
    reuse: bool = False,
) -> tuple[list[list], list[list]]:
    """Train one network a seed on the twin `name` and return the rows of `WINDOWS` and of
    `RECOGNITION`.

    models: where the networks go, one folder a seed, and the windows that they learn from; None
    asks the network of this name in the zoo, whose seed is "zoo"; reuse: take the networks that are
    there and train none.
    """
    labels = read_labels()
    measured = [one for one in recordings if one.radar == name]
    windows = []
    rows = []
    if not measured:
        return windows, rows
    twin = library.twins[name]
    for seed, (trained, settings) in networks(name, library, block, models, reuse):
        for recording in measured:
            found = answers(trained, settings, record_of(recording), recording.name)
            intervals = intervals_of(labels, recording.set, recording.name, recording.record.label)
            said = said_of(found, list(trained.classes), window_s(twin), intervals)
            about = recording.set, recording.half, recording.name
            windows += [[name, seed, *about, *each] for each in zip(*said, strict=True)]
            rows += [
                [name, seed, recording.device, *about, label, *counts(label, outcomes)]
                for label, outcomes in by_label(said)
            ]
    return windows, rows


def networks(
    name: str, library: Library, block: dict, models: Path | None, reuse: bool
) -> Iterator[tuple[int | str, tuple[Trained, dict]]]:
    """Yield the seed of each network of a radar, the network, and how its images are made;
    arguments: as `radar_rows`."""
    if models is None:
        yield "zoo", opened(name)
        return
    classes = tuple(library.scenes[name])
    if not reuse:
        samples = {
            fold: simulated(library, name, block, fold, classes, models)
            for fold in ("train", "validation")
        }
    settings = {"radar": asdict(library.twins[name]), "images": block["images"]}
    for seed in block["seeds"]:
        folder = models / f"{name}-{seed}"
        if not reuse:
            train(block, samples, name, seed, folder, classes)
        yield seed, (loaded(folder / "model.safetensors", name), settings)


def window_s(twin: Twin) -> float:
    """Return the length of a twin's window (s)."""
    return twin.symbols * twin.symbol_interval_s


Right = dict[str, list[float]]
"""Share of right windows (percent) of the files of a class, by the radar that recorded them."""


def _interval(classes: list[Right], rng: np.random.Generator, devices: bool) -> tuple[float, float]:
    """The 95 % interval of the mean over classes of the mean over files, from resampling files
    within each class.

    devices: resample the radars of each class first, then the files of each; a file counts once.
    """
    means = []
    for _ in range(REPEATS):
        by_class = []
        for files in classes:
            groups = list(files.values()) if devices else [np.concatenate(list(files.values()))]
            drawn = [groups[place] for place in rng.integers(0, len(groups), len(groups))]
            by_class.append(
                np.concatenate([rng.choice(group, len(group)) for group in drawn]).mean()
            )
        means.append(np.mean(by_class))
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


class _Files(NamedTuple):
    """The files of a label: windows of each, and of each its right and its named windows by seed,
    percent.
    """

    windows: dict[tuple[str, str], int]
    right: dict[tuple[str, str], dict[int | str, float]]
    named: dict[tuple[str, str], dict[int | str, float]]

    @property
    def by_device(self) -> Right:
        """Right windows of each file, the mean over seeds, by the radar that recorded it."""
        result: Right = {}
        for (device, _), seeds in self.right.items():
            result.setdefault(device, []).append(float(np.mean(list(seeds.values()))))
        return result

    def of_device(self, device: str) -> "_Files":
        """The files that one radar recorded."""
        return _Files(
            *({key: item for key, item in part.items() if key[0] == device} for part in self)
        )


def _mean(parts: list[_Files], seed: int | str) -> float:
    """Right windows (percent) of a seed: the mean over classes of the mean over files."""
    return float(
        np.mean([np.mean([seeds[seed] for seeds in part.right.values()]) for part in parts])
    )


def _accuracy_row(title: str, parts: list[_Files], rng: np.random.Generator) -> list:
    """A row of `ACCURACY` from class on; parts: the files of each of its classes."""
    shares = [part.by_device for part in parts]
    seeds = sorted({seed for part in parts for of_file in part.right.values() for seed in of_file})
    of_seeds = [_mean(parts, seed) for seed in seeds]
    over = (
        _interval(shares, rng, True) if all(len(of) > 1 for of in shares) else (math.nan, math.nan)
    )
    named = [
        share for part in parts for of_file in part.named.values() for share in of_file.values()
    ]
    named = [share for share in named if not math.isnan(share)]
    devices = {device for of in shares for device in of}
    files = sum(len(part.right) for part in parts)
    windows = sum(sum(part.windows.values()) for part in parts)
    return [
        title,
        len(devices),
        files,
        windows,
        float(np.mean(of_seeds)),
        *_interval(shares, rng, False),
        *over,
        min(of_seeds),
        max(of_seeds),
        float(np.mean(named)) if named else math.nan,
    ]


def accuracy_rows(rows: list[list], seed: int) -> list[list]:
    """Return the rows of `ACCURACY` from those of `RECOGNITION`; a file counts once.

    Classes are counted for each twin: drones at 10 GHz and drones at 3.3 GHz are two classes.
    """
    found: dict[tuple[str, str, str], _Files] = {}
    for row in rows:
        name, trained, device, _, half, file, label = row[:7]
        part = found.setdefault((name, half, label), _Files({}, {}, {}))
        part.windows[device, file] = row[7]
        part.right.setdefault((device, file), {})[trained] = row[-2]
        part.named.setdefault((device, file), {})[trained] = row[-1]
    result = []

    def add(name: str, half: str, title: str, parts: list[_Files]) -> None:
        """Append a row under the name `title`."""
        rng = stream(seed, "measured-accuracy", name, half, title)
        result.append([name, half, *_accuracy_row(title, parts, rng)])

    for half in HALVES:
        for name in dict.fromkeys(name for name, _, _ in found):
            of_radar = {key[2]: part for key, part in found.items() if key[:2] == (name, half)}
            for label, part in of_radar.items():
                add(name, half, label, [part])
                for device in part.by_device if len(part.right) > 1 else ():
                    add(name, half, f"{label} by {device}", [part.of_device(device)])
            classes = [part for label, part in of_radar.items() if label in CATEGORIES]
            if len(classes) > 1:
                add(name, half, "balanced", classes)
    return result
