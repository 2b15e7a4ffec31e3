"""Recognition from simulation to reality: a network that saw only a twin's samples names the recordings' windows.

The images are those of the data set: spectra, tiles and shrinking by the same functions, one station. The network and
its training are those of `lowalt.recognition`. Recordings are never trained or validated on.
"""

from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load_yaml, merge
from lowalt.files.errors import InputError
from lowalt.recognition.samples import Facts, Samples
from lowalt.recognition.schemes import SPECTRA, named
from lowalt.recordings.library import Library
from lowalt.recordings.twin import Twin
from lowalt.tiles.render import Renderer, split
from lowalt.tiles.resample import resize
from lowalt.tiles.settings import Images


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
        own = {key: block[key] for key in ("scheme", "echoes", "receivers", "seeds")}
        return {**result, **own, "images": default["images"], "seed": default["seed"]}
    except KeyError as error:
        raise InputError(f"{path}: key {error} is missing") from None


def rendered(intervals: np.ndarray, twin: Twin, images: Images, size: int) -> np.ndarray:
    """Return the images (n, 3, size, size) uint8 of coherent intervals (n, symbols), at a radar's own carrier."""
    renderer = Renderer(twin.network(intervals.shape[1]), twin.spectra(), images)
    found = np.empty((len(intervals), len(renderer.spectra), size, size), np.uint8)
    for number, interval in enumerate(intervals):
        found[number] = resize(split(renderer.tile(interval[None].astype(np.complex64)), len(renderer.spectra)), size)
    return found


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
        found, subtypes = library.simulated(name, category, count, fold, receivers)
        parts.append(rendered(found.reshape(-1, found.shape[-1]), library.twins[name], images, block["size"]))
        labels += [label] * count * receivers
        names += np.repeat(subtypes, receivers).tolist()
        models += np.repeat(np.arange(count), receivers).tolist()
        snrs += list(range(receivers)) * count
    told = facts(np.array(labels), names, np.array(models), np.array(snrs, float), fold)
    return Windows(np.concatenate(parts), told)


def recogniser(block: dict):
    """Return a network of the settings' scheme with fresh weights, and the scheme."""
    from lowalt.recognition.network import Recogniser

    scheme = named(block["table"], block["scheme"], ["A"])
    palette = Images.from_settings(block["images"]).palette
    palettes = np.stack([palette] * len(SPECTRA))
    return Recogniser(scheme, block["network"], block["size"], palettes, len(CATEGORIES)), scheme


def train(block: dict, windows: dict[str, Windows], name: str, seed: int, folder: str | Path):
    """Return the network trained on simulated windows {"train": ..., "validation": ...} of the twin `name`.

    seed: of the weights and the order; folder: where `model.pt` and `history.csv` go.
    """
    from lowalt.recognition.checkpoint import identity
    from lowalt.recognition.inference import Machine
    from lowalt.recognition.recipe import check, seeded
    from lowalt.recognition.training import Trainer, TrainingRun

    keys = ("recordings", name, seed)
    seeded(block["seed"], keys, block["training"]["threads"])
    model, scheme = recogniser(block)
    Path(folder).mkdir(parents=True, exist_ok=True)
    own = {key: block[key] for key in ("seed", "augmentation")}
    own |= {"training": check(block["training"]), "classes": CATEGORIES}
    run = TrainingRun(keys, identity(twin=name, seed=seed, settings=block), Path(folder))
    trainer = Trainer(model, windows, scheme.columns, own, run, Machine.here(block["training"]["precision"]))
    trainer.fit()
    weights = trainer.best_weights
    trainer.finish({
        "scheme": scheme.record, "protocol": "seen", "network": block["network"], "size": block["size"], "seed": seed,
        "colour_map": block["images"]["colour_map"], "classes": list(CATEGORIES), "twin": name,
    })  # fmt: skip
    model.load_state_dict(weights)
    return model.eval()


def load_model(path: str | Path, name: str, block: dict):
    """Return the network in a file that `train` wrote.

    Raises: InputError where the file is missing, damaged, or was trained on another twin than `name`.
    """
    from lowalt.recognition.checkpoint import load

    _, state = load(path)
    if state.get("twin") != name:
        raise InputError(f"{path}: trained on the twin {state.get('twin')!r}, expected {name!r}")
    model, _ = recogniser(block)
    model.load_state_dict(state["weights"])
    return model.eval()


def guesses(model, windows: Windows, block: dict) -> np.ndarray:
    """Return class probabilities (n, 4) of windows."""
    from lowalt.recognition.inference import Machine, probabilities

    machine = Machine.here(block["evaluation"]["precision"])
    return probabilities(model, windows, np.arange(len(windows.images)), machine, block["evaluation"]["batch"])
