"""The test of networks on recordings: confusion by file, and balanced accuracy with an interval over files.

measured-recognition.csv: one row a radar, training seed and recording, with the number of windows of each name. The
    seed "mean" stands for all networks together, by the mean of their probabilities.
measured-accuracy.csv: share of right windows of each class in each half, mean over its files, and balanced accuracy
    over the twin's classes. low and high resample files within their class; devices_low and devices_high resample the
    radars that recorded a class, then their files, where there are two or more; each of them has a row "CLASS by
    RADAR" as well. One row is for all twins together.
"""

import math
from pathlib import Path

import numpy as np
from recorded_sets import HALVES, Measured
from torch import nn

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.twin_training import simulated, train
from lowalt.extensions.recordings.window_samples import Windows, facts, rendered
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import model_file, runs
from lowalt.recognition.inference import Machine, probabilities
from lowalt.tiles import join
from lowalt.tiles.image_settings import Images
from lowalt.tiles.png import encode

RECOGNITION = ("radar", "seed", "device", "set", "half", "file", "label", "windows", *CATEGORIES, "right_percent")
ACCURACY = ("radar", "half", "class", "devices", "files", "windows", "accuracy_percent", "low", "high", "devices_low",
            "devices_high", "chance_percent")  # fmt: skip
REPEATS = 4000
PIXELS = 3
"""Side of a network's pixel in a picture."""

Heard = list[tuple[Measured, Windows]]
"""Recordings with their windows."""


def heard(recordings: list[Measured], library: Library, block: dict) -> Heard:
    """Return the windows of recordings that hold a target, rendered as their radar's twin renders its own.

    Recordings without any such window are left out.
    """
    pairs = []
    for recording in recordings:
        twin = recording.twin(library)
        images = rendered(recording.windows(twin), twin, Images.from_settings(block["images"]), block["size"])
        count, label = len(images), CATEGORIES.index(recording.record.label)
        about = facts(np.full(count, label), [recording.name] * count, np.arange(count), np.zeros(count), "test")
        if count:
            pairs.append((recording, Windows(images, about)))
    return pairs


def write_picture(recording: Measured, windows: Windows, block: dict, folder: Path) -> None:
    """Write the three spectra of a recording's middle window, as the network sees them, into `folder` as PNG."""
    views = windows.images[len(windows.images) // 2]
    tile = encode(np.kron(join(views, len(views)), np.ones((PIXELS, PIXELS), np.uint8)),
                  Images.from_settings(block["images"]).palette)  # fmt: skip
    with replacing(folder / f"spectra-{recording.set}-{recording.name}.png") as temporary:
        temporary.write_bytes(tile)


def loaded(path: Path, name: str) -> nn.Module:
    """Return the network in a file that `train` wrote.

    Raises: InputError where the file is missing, damaged, or was trained on another twin than `name`.
    """
    twin = model_file.read(path).model.get("twin")
    if twin != name:
        raise InputError(f"{path}: trained on the twin {twin!r}, expected {name!r}")
    return runs.load(path).model


def recognition_rows(name: str, measured: Heard, networks: dict[int, nn.Module], block: dict) -> list[list]:
    """Return the rows of `RECOGNITION` of recordings with their windows, named by networks {training seed: network}.

    One row per network and recording, and one of all networks together (seed "mean"), whose probabilities are averaged.
    """
    rows, machine = [], Machine.here(block["evaluation"]["precision"])
    for recording, windows in measured:
        every = np.arange(len(windows.images))
        answers = {seed: probabilities(network, windows, every, machine, block["evaluation"]["batch"])
                   for seed, network in networks.items()}  # fmt: skip
        answers["mean"] = np.mean(list(answers.values()), axis=0)
        about = recording.device, recording.set, recording.half, recording.name, recording.record.label
        for seed, shares in answers.items():
            guesses = shares.argmax(1)
            counts = np.bincount(guesses, minlength=len(CATEGORIES)).tolist()
            right = 100 * float(np.mean(guesses == windows.facts.label))
            rows.append([name, seed, *about, len(guesses), *counts, right])
    return rows


def radar_rows(
    name: str, recordings: list[Measured], library: Library, block: dict, models: Path, out: Path, reuse: bool = False
) -> list[list]:
    """Train one network a seed on the twin `name` and return the rows of `RECOGNITION` of its recordings.

    models: where the networks go, one folder a seed; out: where a picture of every recording's spectra goes; reuse:
    take the networks that are there and train none.
    """
    measured = heard([recording for recording in recordings if recording.radar == name], library, block)
    if not measured:
        return []
    for recording, windows in measured:
        write_picture(recording, windows, block, out)
    if reuse:
        networks = {seed: loaded(models / f"{name}-{seed}/model.safetensors", name) for seed in block["seeds"]}
    else:
        samples = {fold: simulated(library, name, block, fold) for fold in ("train", "validation")}
        networks = {seed: train(block, samples, name, seed, models / f"{name}-{seed}") for seed in block["seeds"]}
    return recognition_rows(name, measured, networks, block)


Right = dict[str, list[float]]
"""Share of right windows (percent) of the files of a class, by the radar that recorded them."""


def _interval(classes: list[Right], rng: np.random.Generator, devices: bool) -> tuple[float, float]:
    """The 95 % interval of the mean over classes of the mean over files, from resampling files within each class.

    devices: resample the radars of each class first, then the files of each; a file counts once.
    """
    means = []
    for _ in range(REPEATS):
        by_class = []
        for files in classes:
            groups = list(files.values()) if devices else [np.concatenate(list(files.values()))]
            drawn = [groups[place] for place in rng.integers(0, len(groups), len(groups))]
            by_class.append(np.concatenate([rng.choice(group, len(group)) for group in drawn]).mean())
        means.append(np.mean(by_class))
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


def accuracy_rows(rows: list[list], seed: int) -> list[list]:
    """Return the rows of `ACCURACY` from those of `RECOGNITION` whose seed is "mean"; a file counts once.

    Classes are counted for each twin: drones at 10 GHz and drones at 3.3 GHz are two classes.
    """
    files: dict[tuple[str, str, str], Right] = {}
    windows: dict[tuple[str, str, str], dict[str, int]] = {}
    for name, kind, device, _, half, _, label, count, *_, right in rows:
        if kind == "mean":
            key = name, half, label
            files.setdefault(key, {}).setdefault(device, []).append(right)
            of_device = windows.setdefault(key, {})
            of_device[device] = of_device.get(device, 0) + count
    result = []

    def add(name: str, half: str, title: str, shares: list[Right], windows: int) -> None:
        """Append a row under the name `title`; shares: of each of its classes."""
        rng = stream(seed, "measured-accuracy", name, half, title)
        middle = float(np.mean([np.mean(np.concatenate(list(of.values()))) for of in shares]))
        devices = {device for of in shares for device in of}
        over = (math.nan, math.nan)
        interval = _interval(shares, rng, False)
        if all(len(of) > 1 for of in shares):
            over = _interval(shares, rng, True)
        count = sum(len(right) for of in shares for right in of.values())
        result.append([name, half, title, len(devices), count, windows, middle, *interval, *over,
                       100 / len(CATEGORIES)])  # fmt: skip

    for half in HALVES:
        for name in dict.fromkeys(name for name, _, _ in files):
            classes = [key for key in files if key[:2] == (name, half)]
            for key in classes:
                add(name, half, key[2], [files[key]], sum(windows[key].values()))
                for device, right in files[key].items() if len(files[key]) > 1 else ():
                    add(name, half, f"{key[2]} by {device}", [{device: right}], windows[key][device])
            if len(classes) > 1:
                every = sum(sum(windows[key].values()) for key in classes)
                add(name, half, "balanced", [files[key] for key in classes], every)
        of_half = [key for key in files if key[1] == half]
        if of_half:
            every = sum(sum(windows[key].values()) for key in of_half)
            add("all", half, "balanced", [files[key] for key in of_half], every)
    return result
