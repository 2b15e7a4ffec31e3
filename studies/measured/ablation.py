"""Ablation: networks trained without one randomisation of a twin, tested on the tuning half of the recordings.

measured-ablation.csv has one row for each change and class, and one row "balanced" for each change: the mean over the
classes. accuracy_percent is the mean over training seeds and files; its interval resamples seeds, and files within
their class. difference_percent is this accuracy less that of the unchanged twin on the same files and seeds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from accuracy import heard, recognition_rows
from recorded_sets import Measured

from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recordings.library import Library
from lowalt.recordings.twin_network import simulated, train

ABLATION = (
    "radar", "change", "class", "seeds", "files", "windows", "accuracy_percent", "low", "high", "difference_percent",
    "difference_low", "difference_high",
)  # fmt: skip
REPEATS = 4000
FULL = "none"
"""Name of the unchanged twin."""


def changed(library: Library, name: str, change: dict) -> Library:
    """Return the library with another receiver and plainer scenes of the twin `name`.

    change: receiver, settings that replace those of the twin; drop, keys of scenes that are left out.
    Raises: InputError for another key, or a receiver's setting that the twin does not have.
    """
    receiver, drop = change.get("receiver", {}), change.get("drop", [])
    if set(change) - {"receiver", "drop"}:
        raise InputError(f"ablation: {sorted(change)}, expected some of receiver and drop")

    def plainer(scene: dict) -> dict:
        """Return the scene without the keys `drop` and with the settings `receiver`."""
        unknown = set(receiver) - set(scene["receiver"])
        if unknown:
            raise InputError(
                f"ablation: receiver has no {sorted(unknown)}, expected some of {sorted(scene['receiver'])}"
            )
        kept = {key: item for key, item in scene.items() if key not in drop}
        return kept | {"receiver": scene["receiver"] | receiver}

    scenes = {category: [plainer(scene) for scene in scenes] for category, scenes in library.scenes[name].items()}
    return replace(library, scenes=library.scenes | {name: scenes})


def shares(rows: list[list]) -> dict[str, np.ndarray]:
    """Return class -> share of right windows (files, seeds) in percent from rows of `accuracy.RECOGNITION`."""
    files: dict[str, dict[str, list[float]]] = {}
    for _, seed, folder, _, file, label, *_, right in rows:
        if seed != "mean":
            files.setdefault(label, {}).setdefault(f"{folder}/{file}", []).append(right)
    return {label: np.array(list(of_label.values())) for label, of_label in files.items()}


def _draws(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the bootstrap means (REPEATS,) of values (files, seeds): each repeat draws files and seeds with
    replacement."""
    files, seeds = (rng.integers(0, count, (REPEATS, count)) for count in values.shape)
    return values[files[:, :, None], seeds[:, None, :]].mean(axis=(1, 2))


def summarised(name: str, change: str, changed: dict, full: dict, windows: dict[str, int], seed: int) -> list[list]:
    """Return the rows of `ABLATION` of one change from its `shares` and those of the unchanged twin."""
    rows, means, levels = [], [], []
    for label in changed:
        keys = (seed, "measured-ablation", name, label)
        # Both streams have the same keys, so both twins get the same draws and the difference is paired.
        pair = [_draws(values[label], stream(*keys)) for values in (changed, full)]
        means.append((changed[label].mean(), changed[label].mean() - full[label].mean()))
        levels.append((pair[0], pair[0] - pair[1]))
    labels, counts = list(changed), [changed[label].shape for label in changed]
    if len(labels) > 1:
        labels.append("balanced")
        counts.append((sum(files for files, _ in counts), counts[0][1]))
        means.append(tuple(np.mean(means, axis=0)))
        levels.append(tuple(np.mean(levels, axis=0)))
    for label, (files, seeds), mean, level in zip(labels, counts, means, levels, strict=True):
        bounds = [[float(bound) for bound in np.quantile(part, [0.025, 0.975])] for part in level]
        total = windows.get(label, sum(windows.values()))
        rows.append([name, change, label, seeds, files, total, float(mean[0]), *bounds[0], float(mean[1]), *bounds[1]])
    return rows


def ablation_rows(
    name: str, recordings: list[Measured], library: Library, block: dict, changes: dict, folder: Path
) -> list[list]:
    """Return the rows of `ABLATION` of the twin `name`: trained as it is, and with each of the changes.

    changes: name -> change as `changed` takes it; folder: where the networks go. Test recordings are not looked at;
    without any tuning recording there are no rows.
    """
    of_radar = [recording for recording in recordings if recording.like in library.sets[name]]
    measured = heard([recording for recording in of_radar if recording.half == "tuning"], library, block)
    if not measured:
        return []
    counts: dict[str, int] = {}
    for recording, windows in measured:
        counts[recording.record.label] = counts.get(recording.record.label, 0) + len(windows.images)
    rows, full = [], None
    for title, change in {FULL: {}, **changes}.items():
        plainer = changed(library, name, change)
        samples = {fold: simulated(plainer, name, block, fold) for fold in ("train", "validation")}
        networks = {
            seed: train(block, samples, name, seed, folder / f"{name}-{title}-{seed}".replace(" ", "_"))
            for seed in block["seeds"]
        }
        of_change = shares(recognition_rows(name, measured, networks, block))
        full = full or of_change
        rows += summarised(name, title, of_change, full, counts, block["seed"])
    return rows
