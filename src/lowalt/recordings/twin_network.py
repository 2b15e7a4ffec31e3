"""The network of a radar's twin: it learns from simulated windows alone and names the windows of recordings.

The images are those of the data set: spectra, tiles and shrinking by the same functions, one station. The network and
its training are those of `lowalt.recognition`. Recordings are never trained or validated on.
"""

from pathlib import Path

import numpy as np
from torch import nn

from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load_yaml, merge
from lowalt.files.errors import InputError
from lowalt.recognition.checkpoint import identity
from lowalt.recognition.inference import Machine
from lowalt.recognition.recipe import check, seeded
from lowalt.recognition.recogniser import built
from lowalt.recognition.samples import Facts, Samples
from lowalt.recognition.schemes import named
from lowalt.recognition.training import Trainer, TrainingRun
from lowalt.recordings.library import Library
from lowalt.recordings.twin import Twin
from lowalt.tiles.image_settings import Images
from lowalt.tiles.render import Renderer, split
from lowalt.tiles.resample import resize


class Windows(Samples):
    """Samples in memory, as a trainer reads them: images (n, 3, size, size) uint8, and the facts of each."""

    def __init__(self, images: np.ndarray, facts: Facts) -> None:
        """Keep the images and their facts."""
        self.images, self.facts, self.size = images, facts, images.shape[-1]

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), 3, size, size) uint8 of the samples `numbers`."""
        return self.images[numbers]


def settings(path: str | Path) -> dict:
    """Return the recognition settings: the default run's block with the file's network, training and augmentation.

    Raises: InputError naming a missing key.
    """
    block = load_yaml(path, "recognition of recordings")
    try:
        default = load_yaml(block["default"])
        result = merge(default["recognition"], {key: block[key] for key in ("size", "training", "augmentation")})
        simulation = {key: block[key] for key in ("scheme", "echoes", "receivers", "seeds")}
        return {**result, **simulation, "images": default["images"], "seed": default["seed"]}
    except KeyError as error:
        raise InputError(f"{path}: key {error} is missing") from None


def rendered(intervals: np.ndarray, twin: Twin, images: Images, size: int) -> np.ndarray:
    """Return the images (n, 3, size, size) uint8 of coherent intervals (n, symbols), at a radar's own carrier."""
    renderer = Renderer(twin.network(intervals.shape[1]), twin.spectra(), images)
    result = np.empty((len(intervals), len(renderer.spectra), size, size), np.uint8)
    for number, interval in enumerate(intervals):
        result[number] = resize(split(renderer.tile(interval[None].astype(np.complex64)), len(renderer.spectra)), size)
    return result


def facts(labels: np.ndarray, names: list[str], models: np.ndarray, snr: np.ndarray, fold: str) -> Facts:
    """Return the facts of n samples.

    labels (n,); names: subtypes or file names; models (n,): their numbers; snr (n,): number of the receiver."""
    count = len(labels)
    unknown = np.full((count, 1), np.nan)
    keys = [f"{name}-{model:06d}-{int(number)}" for name, model, number in zip(names, models, snr, strict=True)]
    return Facts(
        key=np.array(keys),
        subtype=np.array(names), model=models, snr_db=snr, group=np.full(count, "seen"), fold=np.full(count, fold),
        label=labels, range_m=unknown, aspect_rad=unknown,
    )  # fmt: skip


def simulated(library: Library, name: str, block: dict, fold: str) -> Windows:
    """Return the windows of a twin's four categories for a fold, "train" or "validation": disjoint random streams."""
    images, parts = Images.from_settings(block["images"]), []
    labels, names, models, snrs = [], [], [], []
    count, receivers = block["echoes"][fold], block["receivers"]
    for label, category in enumerate(CATEGORIES):
        intervals, subtypes = library.simulated(name, category, count, fold, receivers)
        every_interval = intervals.reshape(-1, intervals.shape[-1])
        parts.append(rendered(every_interval, library.twins[name], images, block["size"]))
        labels += [label] * count * receivers
        names += np.repeat(subtypes, receivers).tolist()
        models += np.repeat(np.arange(count), receivers).tolist()
        snrs += list(range(receivers)) * count
    return Windows(np.concatenate(parts), facts(np.array(labels), names, np.array(models), np.array(snrs, float), fold))


def train(block: dict, windows: dict[str, Windows], name: str, seed: int, folder: str | Path) -> nn.Module:
    """Return the network trained on simulated windows {"train": ..., "validation": ...} of the twin `name`.

    block: as `settings` gives it; seed: of the weights and the order; folder: where `model.pt` and `history.csv` go.
    """
    keys, colours = ("recordings", name, seed), block["images"]["colour_map"]
    seeded(block["seed"], keys, block["training"]["threads"])
    scheme = named(block["table"], block["scheme"], ["A"])
    model = built(scheme, block["network"], block["size"], colours, len(CATEGORIES))
    Path(folder).mkdir(parents=True, exist_ok=True)
    training = {key: block[key] for key in ("seed", "augmentation")}
    training |= {"training": check(block["training"]), "classes": CATEGORIES}
    run = TrainingRun(keys, identity(twin=name, seed=seed, settings=block), Path(folder))
    trainer = Trainer(model, windows, scheme.columns, training, run, Machine.here(block["training"]["precision"]))
    trainer.fit()
    weights = trainer.best_weights
    trainer.finish({
        "scheme": scheme.record, "protocol": "seen", "network": block["network"], "size": block["size"], "seed": seed,
        "colour_map": colours, "classes": list(CATEGORIES), "twin": name,
    })  # fmt: skip
    model.load_state_dict(weights)
    return model.eval()
