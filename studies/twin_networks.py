"""Networks of measured radars, which learn from simulated windows of their twins alone.

    python studies/twin_networks.py --models FOLDER --out results/zoo

keeps a network of every radar in a zoo, from where `lowalt predict` takes it, in 8 bits; one that FOLDER lacks is
trained first. The images are those of the data set: spectra, tiles and shrinking by the same functions, one station.
Recordings are never trained or validated on.
"""

import argparse
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from torch import nn
from twin_scenes import Library

from lowalt.config.classes import CATEGORIES
from lowalt.config.command import run
from lowalt.config.layers import load_yaml, merge
from lowalt.files.errors import InputError
from lowalt.recognition import zoo
from lowalt.recognition.checkpoint import identity
from lowalt.recognition.inference import Machine
from lowalt.recognition.model_file import of_run
from lowalt.recognition.recipe import check, seeded
from lowalt.recognition.recogniser import built
from lowalt.recognition.schemes import named
from lowalt.recognition.training import Trainer, TrainingRun
from lowalt.recordings.twin import TWINS
from lowalt.recordings.window_samples import Windows, facts, rendered
from lowalt.tiles.image_settings import Images

RECOGNITION = "config/measured/recognition.yaml"


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


def main(arguments: list[str]) -> None:
    """Keep a network of every radar in a zoo, in 8 bits; one that --models lacks is trained on its twin first."""
    line = argparse.ArgumentParser(prog="twin_networks.py", description=main.__doc__)
    line.add_argument("--twins", default=TWINS, help=f"radars and scenes (default: {TWINS})")
    line.add_argument("--recognition", default=RECOGNITION, help=f"network and training (default: {RECOGNITION})")
    line.add_argument("--models", required=True, type=Path, help="folder of networks, RADAR-SEED/model.pt")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    options = line.parse_args(arguments)
    library, block = Library.read(options.twins), settings(options.recognition)
    seed = block["seeds"][0]
    for name, twin in library.twins.items():
        path, validation = options.models / f"{name}-{seed}/model.pt", simulated(library, name, block, "validation")
        if not path.is_file():
            windows = {"train": simulated(library, name, block, "train"), "validation": validation}
            train(block, windows, name, seed, path.parent)
        made_with = {"network": twin.network_settings(), "spectra": twin.spectra_settings(), "images": block["images"]}
        content = replace(of_run(path), input={**made_with, "radar": asdict(twin)})
        measured = zoo.kept(content, path, validation, name, options.out)
        print(f"{name}: {measured['percent']:.2f} % of {measured['samples']} simulated windows right")


if __name__ == "__main__":
    run(main)
