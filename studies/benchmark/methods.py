"""The baselines by name: each trains on a track's samples and returns what it sees and how it
answers.

majority class                  the class with the most training samples, always
nearest centroid on moments     distance to each class's mean of the power spectrum's moments
... on features                 classical methods on the physical features of `features.py`
(`classical.py`) small CNN on images             the default's network: the reference
frozen EfficientNet-Lite0, linear   ImageNet's features of the images, and least squares
(`frozen.py`)
... on signals                  networks on the stations' complex signals (`signal_networks.py`)
audio-spectrogram transformer   on images (`backbones.py`)
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import classical
import numpy as np
from features import features, spectral_moments
from frozen import embedded, embedded_chunk, embedded_of
from signals import Signals, features_of, told

from lowalt.extensions.benchmark.part_samples import TrackSamples
from lowalt.recognition.batches import epoch_order
from lowalt.recognition.schemes import Scheme


class Trained(NamedTuple):
    """A trained method: `answer` returns class probabilities (samples, classes) of what it `sees`,
    a name of SEEN.

    It can be pickled, unless `answer` is that of a network, which its model.safetensors keeps.
    """

    sees: str
    answer: Callable[[Any], np.ndarray]

    def of(self, samples: TrackSamples, kept: Path) -> np.ndarray:
        """Return the answers to samples of a track; kept: folder of what methods see, computed
        once.
        """
        return self.answer(SEEN[self.sees](samples, kept))


SEEN: dict[str, Callable[[TrackSamples, Path], Any]] = {
    "nothing": lambda samples, kept: len(samples),
    "moments": lambda samples, kept: features_of(samples, kept, spectral_moments),
    "features": features_of,
    "embedded": embedded_of,
    "images": lambda samples, kept: samples,
    "signals": lambda samples, kept: Signals(samples),
}
"""What methods see of samples."""
LEVELS = 2
"""SNRs of each motion model that a classical method trains on, drawn by the training seed."""


@dataclass(frozen=True)
class Given:
    """What a training is given: both parts with labels among `classes`, the training seed, the
    folder of its files, the folder of kept features, and the configuration."""

    train: TrackSamples
    validation: TrackSamples
    classes: tuple[str, ...]
    seed: int
    folder: Path
    features: Path
    config: dict


class Kept(NamedTuple):
    """What methods see, computed once for all of them: by which function, of which files of a run,
    and by which function of a file and the folder that keeps the results."""

    of: Callable
    files: str
    make: Callable[..., Any]


def majority(given: Given) -> Trained:
    """Answer with the share of each class among the training samples."""
    shares = np.bincount(given.train.labels, minlength=len(given.classes)) / len(given.train)
    return Trained("nothing", partial(classical.constant, shares))


def centroid(given: Given) -> Trained:
    """Answer by the distance to the mean of each class's moments, in units of their deviations."""
    told = SEEN["moments"](given.train, given.features)
    return Trained("moments", classical.centroids(told, given.train.labels, len(given.classes)))


def on_features(method: str, given: Given) -> Trained:
    """Train a classical method on physical features."""
    picked = epoch_order(given.train.facts, given.seed, ("benchmark", method), 0, LEVELS)
    told = features_of(given.train, given.features)[picked], given.train.labels[picked]
    held = features_of(given.validation, given.features), given.validation.labels
    return Trained("features", classical.fit(method, told, held, given.seed))


def on_frozen(given: Given) -> Trained:
    """Train a linear classifier on the features of a frozen backbone with ImageNet's weights."""
    told, held = (embedded_of(part, given.features) for part in (given.train, given.validation))
    return Trained(
        "embedded",
        classical.fit(
            "ridge", (told, given.train.labels), (held, given.validation.labels), given.seed
        ),
    )


def network(given: Given, scheme: Scheme, build: Callable, sees: str) -> Trained:
    """Train a network and return its answers."""
    from lowalt.recognition import runs
    from lowalt.recognition.inference import Machine

    block = given.config["recognition"]
    model = given.folder / "model.safetensors"
    if not model.is_file():
        samples = {
            "train": SEEN[sees](given.train, given.features),
            "validation": SEEN[sees](given.validation, given.features),
        }
        kept = {key: block[key] for key in ("network", "training", "augmentation")}
        settings = scheme.settled(
            {
                **kept,
                "size": samples["train"].size,
                "seed": given.seed,
                "classes": list(given.classes),
                "colour_map": given.config["images"]["colour_map"],
            }
        )
        runs.train(samples, scheme, given.train.track.protocol, settings, given.folder, build=build)
    trained = runs.load(model, build=build)
    settings = block["evaluation"]
    machine = Machine.here(settings["precision"])
    return Trained(sees, lambda seen: runs.answers(trained, seen, settings, machine))


def on_images(backbone: str, given: Given) -> Trained:
    """Train a network on images; backbone: as a scheme names it, "" for the default's."""
    from lowalt.recognition.recogniser import built

    scheme = Scheme("images attention", given.train.track.stations, (0, 1, 2), backbone=backbone)
    return network(given, scheme, built, "images")


def on_signals(backbone: str, given: Given) -> Trained:
    """Train a network on signals."""
    from signal_networks import builder

    # A model's file names at least one view per station; the network's is the signal.
    scheme = Scheme(f"signals {backbone}", given.train.track.stations, (0,))
    return network(given, scheme, builder(backbone), "signals")


METHODS: dict[str, Callable[[Given], Trained]] = {
    "majority class": majority,
    "nearest centroid on moments": centroid,
    "small CNN on images": lambda given: on_images("", given),
    "gradient boosting on features": lambda given: on_features("boosting", given),
    "RBF-SVM on features": lambda given: on_features("svm", given),
    "random forest on features": lambda given: on_features("forest", given),
    "logistic regression on features": lambda given: on_features("logistic", given),
    "CNN on signals": lambda given: on_signals("cnn", given),
    "complex-valued CNN on signals": lambda given: on_signals("complex", given),
    "XGBoost on features": lambda given: on_features("xgboost", given),
    "frozen EfficientNet-Lite0, linear": on_frozen,
    "audio-spectrogram transformer": lambda given: on_images(
        "studies/benchmark/backbones.py:ast_micro", given
    ),
    "transformer on signals": lambda given: on_signals("transformer", given),
}
"""In the order in which a study trains them."""
KEPT = {
    "moments": Kept(spectral_moments, "noisy/*.npy", partial(told, told_of=spectral_moments)),
    "features": Kept(features, "noisy/*.npy", partial(told, told_of=features)),
    "linear": Kept(embedded, "views/*/*.npz", embedded_chunk),
}
"""By the last word of a method's name; its time is added to the method's."""
CHOSEN_ON = {"majority class": "nothing", "nearest centroid on moments": "nothing"}
"""Part on which a method's settings, candidates or training step were chosen: `validation` where it
stands not here.
"""
SEEDLESS = ("majority class", "nearest centroid on moments", "frozen EfficientNet-Lite0, linear")
"""Methods that draw nothing, so that one seed is enough."""
