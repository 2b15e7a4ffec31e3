"""The baselines by name: each trains on a track's samples and returns a function from samples to probabilities.

majority class                  the class with the most training samples, always
nearest centroid on moments     distance to each class's mean of the power spectrum's moments
... on features                 classical methods on the physical features of `features.py` (`classical.py`)
small CNN on images             the default's network: the reference
frozen EfficientNet-Lite0, linear   ImageNet's features of the images, and least squares (`frozen.py`)
... on signals                  networks on the stations' complex signals (`signal_networks.py`)
audio-spectrogram transformer   on images (`backbones.py`)
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
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

Answer = Callable[[TrackSamples], np.ndarray]
"""Class probabilities (samples, classes) of samples."""
LEVELS = 2
"""SNRs of each motion model that a classical method trains on, drawn by the training seed."""


@dataclass(frozen=True)
class Given:
    """What a training is given: both parts with labels among `classes`, the training seed, the folder of its files, the
    folder of kept features, and the configuration."""

    train: TrackSamples
    validation: TrackSamples
    classes: tuple[str, ...]
    seed: int
    folder: Path
    features: Path
    config: dict


class Kept(NamedTuple):
    """What methods see, computed once for all of them: by which function, of which files of a run, and by which
    function of a file and the folder that keeps the results."""

    of: Callable
    files: str
    make: Callable[..., Any]


def majority(given: Given) -> Answer:
    """Answer with the share of each class among the training samples."""
    shares = np.bincount(given.train.labels, minlength=len(given.classes)) / len(given.train)
    return lambda samples: np.tile(shares, (len(samples), 1))


def centroid(given: Given) -> Answer:
    """Answer by the distance to the mean of each class's moments, in units of their deviations."""
    told = features_of(given.train, given.features, spectral_moments)
    mean, scale = told.mean(0), np.maximum(told.std(0), 1e-9)
    told = (told - mean) / scale
    centres = np.array([told[given.train.labels == label].mean(0) for label in range(len(given.classes))])

    def answer(samples: TrackSamples) -> np.ndarray:
        """Probabilities that fall off with the squared distance."""
        asked = (features_of(samples, given.features, spectral_moments) - mean) / scale
        away = (asked[:, None] - centres) ** 2
        logits = -0.5 * away.sum(-1)
        shares = np.exp(logits - logits.max(1, keepdims=True))
        return shares / shares.sum(1, keepdims=True)

    return answer


def on_features(method: str, given: Given) -> Answer:
    """Train a classical method on physical features."""
    picked = epoch_order(given.train.facts, given.seed, ("benchmark", method), 0, LEVELS)
    told = features_of(given.train, given.features)[picked], given.train.labels[picked]
    held = features_of(given.validation, given.features), given.validation.labels
    answer = classical.fit(method, told, held, given.seed)
    return lambda samples: answer(features_of(samples, given.features))


def on_frozen(given: Given) -> Answer:
    """Train a linear classifier on the features of a frozen backbone with ImageNet's weights."""
    told, held = (embedded_of(part, given.features) for part in (given.train, given.validation))
    answer = classical.fit("ridge", (told, given.train.labels), (held, given.validation.labels), given.seed)
    return lambda samples: answer(embedded_of(samples, given.features))


def network(given: Given, scheme: Scheme, build: Callable, source: Callable[[TrackSamples], Any]) -> Answer:
    """Train a network and return its answers; source: makes the source of a training of a track's samples."""
    from lowalt.recognition import runs
    from lowalt.recognition.inference import Machine

    block, model = given.config["recognition"], given.folder / "model.safetensors"
    if not model.is_file():
        samples = {"train": source(given.train), "validation": source(given.validation)}
        kept = {key: block[key] for key in ("network", "training", "augmentation")}
        settings = scheme.settled({
            **kept, "size": samples["train"].size, "seed": given.seed, "classes": list(given.classes),
            "colour_map": given.config["images"]["colour_map"],
        })  # fmt: skip
        runs.train(samples, scheme, given.train.track.protocol, settings, given.folder, build=build)
    trained, settings = runs.load(model, build=build), block["evaluation"]
    return lambda samples: runs.answers(trained, source(samples), settings, Machine.here(settings["precision"]))


def on_images(backbone: str, given: Given) -> Answer:
    """Train a network on images; backbone: as a scheme names it, "" for the default's."""
    from lowalt.recognition.recogniser import built

    scheme = Scheme("images attention", given.train.track.stations, (0, 1, 2), backbone=backbone)
    return network(given, scheme, built, lambda samples: samples)


def on_signals(backbone: str, given: Given) -> Answer:
    """Train a network on signals."""
    from signal_networks import SignalRecogniser

    def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int) -> SignalRecogniser:
        """Return a network on signals with fresh weights."""
        return SignalRecogniser(replace(scheme, backbone=backbone), block, size, classes)

    # A model's file names at least one view per station; the network's is the signal.
    scheme = Scheme(f"signals {backbone}", given.train.track.stations, (0,))
    return network(given, scheme, built, Signals)


METHODS: dict[str, Callable[[Given], Answer]] = {
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
    "audio-spectrogram transformer": lambda given: on_images("studies/benchmark/backbones.py:ast_micro", given),
    "transformer on signals": lambda given: on_signals("transformer", given),
}
"""In the order in which a study trains them."""
KEPT = {
    "moments": Kept(spectral_moments, "noisy/*.npy", partial(told, told_of=spectral_moments)),
    "features": Kept(features, "noisy/*.npy", partial(told, told_of=features)),
    "linear": Kept(embedded, "views/*/*.npz", embedded_chunk),
}
"""By the last word of a method's name; its time is added to the method's."""
SEEDLESS = ("majority class", "nearest centroid on moments", "frozen EfficientNet-Lite0, linear")
"""Methods that draw nothing, so that one seed is enough."""
