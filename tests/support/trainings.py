"""Small trainings that a few steps finish: their settings, their samples, and how a test runs one."""

import numpy as np
import torch

import model_files
from lowalt.numerics.streams import stream
from lowalt.recognition import runs, samples, schemes

TRAINING = {
    "steps": 24,
    "batch": 8,
    "snrs_per_model": 1,
    "rate": 3e-3,
    "backbone_rate": 1.0,
    "weight_decay": 0.05,
    "warmup": 0.1,
    "clip": 5.0,
    "label_smoothing": 0.0,
    "alone": 0.5,
    "ema": 0.99,
    "precision": "fp32",
    "channels_last": True,
    "compile": False,
    "validate_every": 8,
    "patience": 0,
    "checkpoint_s": 1e9,
    "threads": 1,
    "workers": 0,
}
SETTINGS = {
    "seed": 3,
    "size": 32,
    "colour_map": "gray",
    "network": {
        "backbone": "test_vit2",
        "weights": "none",
        "intra_depth": 1,
        "inter_depth": 1,
        "heads": 4,
        "feed_forward": 1,
        "dropout": 0.1,
        "hidden": 8,
    },
    "training": TRAINING,
    "classes": ["UAV", "Bird", "Vehicle", "Pedestrian"],
    "augmentation": {
        "mirror": 0.5,
        "shift_doppler": 0.1,
        "shift_time": 0.2,
        "contrast": 0.0,
        "mask_doppler": 0.1,
        "mask_time": 0.1,
        "drop_view": 0.1,
    },
}
SCHEME = schemes.Scheme("AB:VRP+VT", (0, 1), (0, 2))


def with_training(**changes):
    """The settings with these changes of the training."""
    return {**SETTINGS, "training": {**TRAINING, **changes}}


def write_views(path, models=20):
    """Four classes that differ in brightness, which no augmentation here touches: a few steps must
    learn them.
    """
    rng = stream(8, "brightness")
    rows = []
    views = []
    for label in range(4):
        for model in range(models):
            fold = ("val", "test", "train", "train", "train")[model % 5]
            for snr in (3.0, np.inf):
                image = rng.integers(60 * label, 60 * label + 60, (9, 32, 32), dtype=np.uint8)
                views.append(image)
                rows.append(
                    (f"s{label}-{model}-{snr:g}", f"s{label}", model, snr, "seen", fold, label)
                )
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    nan = np.full((len(rows), 3), np.nan)
    samples.write(path, np.stack(views), samples.Facts(*columns, nan, nan))
    return path


def sources(path):
    """The samples for training and validation from a cache of views."""
    return {
        part: samples.ViewSamples([path], SCHEME.columns, {("seen", fold)})
        for part, fold in (("train", "train"), ("validation", "val"))
    }


def train(path, folder, settings=SETTINGS):
    """Train into a folder; return the weights and the text of history.csv."""
    runs.train(sources(path), SCHEME, "seen", settings, folder)
    return (
        model_files.load(folder / "model.safetensors")[1]["weights"],
        (folder / "history.csv").read_text(),
    )


def equal(one, other):
    """Whether two sets of weights are equal in every bit."""
    return one.keys() == other.keys() and all(
        torch.equal(value, other[key]) for key, value in one.items()
    )


class Killed(Exception):
    """A training ends as if it were killed."""


def kill_at(monkeypatch, steps):
    """Let the next training end after so many steps; returns the trainer's own step, to be put
    back.
    """
    step = runs.Trainer._step

    def breaking(self, *batch):
        """Take one step, or end."""
        if self.at.steps == steps:
            raise Killed
        step(self, *batch)

    monkeypatch.setattr(runs.Trainer, "_step", breaking)
    return step
