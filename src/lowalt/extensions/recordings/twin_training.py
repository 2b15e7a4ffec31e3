"""Networks of measured radars, which learn from simulated windows of their twins alone.

The images are those of the data set: spectra, tiles and shrinking by the same functions, one
station. Recordings are never trained or validated on.
"""

import hashlib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
from torch import nn

from lowalt.config.brought import refuse_brought, refuse_training
from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load_yaml, merge, read_layer
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.window_samples import Windows, facts, rendered
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.recognition.checkpoint import identity
from lowalt.recognition.inference import Machine
from lowalt.recognition.recipe import check, seeded
from lowalt.recognition.recogniser import built
from lowalt.recognition.schemes import named
from lowalt.recognition.training import Trainer, TrainingRun
from lowalt.tiles.image_settings import Images

RECOGNITION = "config/measured/recognition.yaml"


def settings(path: str | Path = RECOGNITION, over: dict | None = None) -> dict:
    """Return the recognition settings: the default run's block with the file's network, training
    and augmentation.

    over: keys to lay over those of the file.
    Raises: InputError naming a missing key, or code, weights or files elsewhere that the file's
    `default` names, or the file itself where it counts as a run's configuration.
    """
    block = merge(read_layer(shipped(path)), over or {})
    try:
        default = load_yaml(shipped(block["default"]))
        refuse_brought(default, block["default"])
        refuse_training(default, block["default"])
        result = merge(
            default["recognition"],
            {key: block[key] for key in ("size", "training", "augmentation")},
        )
        simulation = {key: block[key] for key in ("scheme", "echoes", "receivers", "seeds")}
        return {
            **result,
            **simulation,
            "images": default["images"],
            "seed": default["seed"],
        }
    except KeyError as error:
        raise InputError(f"{path}: key {error} is missing") from None


Signals = tuple[np.ndarray, list[str]]
"""Intervals of simulated targets, and the targets' subtypes."""


def kept_signals(made_of: str, folder: Path | None, make: Callable[[], Signals]) -> Signals:
    """Return what `make` returns, out of a folder that an earlier call has kept it in.

    made_of: everything that the signals depend on; folder: None keeps nothing.
    """
    if folder is None:
        return make()
    path = folder / f"{hashlib.sha256(made_of.encode()).hexdigest()[:16]}.npz"
    if path.is_file():
        with np.load(path, allow_pickle=False) as data:
            return data["intervals"], data["subtypes"].tolist()
    intervals, subtypes = make()
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, intervals=intervals, subtypes=np.array(subtypes))
    return intervals, subtypes


def _intervals(
    library: Library, name: str, category: str, block: dict, fold: str, kept: Path | None
) -> Signals:
    """The intervals of a category for a fold, and their subtypes; out of the folder `kept` where it
    has them.
    """
    count = block["echoes"][fold]
    receivers = block["receivers"]
    made_of = identity(
        twin=asdict(library.twins[name]),
        scenes=library.scenes[name][category],
        seed=library.seed,
        count=count,
        receivers=receivers,
        fold=fold,
        name=name,
        category=category,
    )

    def made() -> Signals:
        """Simulate the intervals."""
        intervals, subtypes = library.simulated(name, category, count, fold, receivers)
        return intervals.astype(np.complex64), subtypes

    return kept_signals(made_of, kept, made)


def simulated(
    library: Library,
    name: str,
    block: dict,
    fold: str,
    classes: tuple[str, ...] = tuple(CATEGORIES),
    kept: Path | None = None,
) -> Windows:
    """Return the windows of a twin's classes for a fold of the block's `echoes`: disjoint random
    streams per fold.

    kept: folder that keeps the signals of each class, so that making them can be interrupted.
    """
    images = Images.from_settings(block["images"])
    parts = []
    labels = []
    names = []
    models = []
    snrs = []
    count = block["echoes"][fold]
    receivers = block["receivers"]
    for label, category in enumerate(classes):
        intervals, subtypes = _intervals(library, name, category, block, fold, kept)
        every_interval = intervals.reshape(-1, intervals.shape[-1])
        parts.append(rendered(every_interval, library.twins[name], images, block["size"]))
        labels += [label] * count * receivers
        names += np.repeat(subtypes, receivers).tolist()
        models += np.repeat(np.arange(count), receivers).tolist()
        snrs += list(range(receivers)) * count
    return Windows(
        np.concatenate(parts),
        facts(np.array(labels), names, np.array(models), np.array(snrs, float), fold),
    )


def train(
    block: dict,
    windows: dict[str, Windows],
    name: str,
    seed: int,
    folder: str | Path,
    classes: tuple[str, ...] = tuple(CATEGORIES),
) -> nn.Module:
    """Return the network trained on simulated windows {"train": ..., "validation": ...} of the twin
    `name`.

    block: as `settings` gives it; seed: of the weights and the order; folder: of the files that
    training writes.
    """
    keys = ("recordings", name, seed)
    colours = block["images"]["colour_map"]
    seeded(block["seed"], keys, block["training"]["threads"])
    scheme = named(shipped(block["table"]), block["scheme"], ["A"])
    model = built(scheme, block["network"], block["size"], colours, len(classes))
    Path(folder).mkdir(parents=True, exist_ok=True)
    training = {key: block[key] for key in ("seed", "augmentation")}
    training |= {"training": check(block["training"]), "classes": list(classes)}
    run = TrainingRun(keys, identity(twin=name, seed=seed, settings=block), Path(folder))
    trainer = Trainer(
        model, windows, scheme.columns, training, run, Machine.here(block["training"]["precision"])
    )
    trainer.fit()
    weights = trainer.best_weights
    trainer.finish(
        {
            "scheme": scheme.record,
            "protocol": "seen",
            "network": block["network"],
            "size": block["size"],
            "seed": seed,
            "colour_map": colours,
            "classes": list(classes),
            "twin": name,
        }
    )
    model.load_state_dict(weights)
    return model.eval()
