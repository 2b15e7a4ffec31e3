"""Training and evaluation on the data set of a finished run, in one call each."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.brought import refuse_brought, refuse_weights
from lowalt.config.layers import SCHEMA, check, of_run
from lowalt.config.named_code import allowed
from lowalt.config.network import station_names
from lowalt.files.csv_tables import number, read_csv
from lowalt.files.errors import InputError
from lowalt.files.shipped import located, shipped
from lowalt.recognition import inference, runs
from lowalt.recognition.inference import Machine
from lowalt.recognition.protocols import folds
from lowalt.recognition.sample_sources import Source
from lowalt.recognition.schemes import named
from lowalt.recognition.score import scores
from lowalt.shards import ShardSet

BY_ARGUMENT = "none, or the argument `weights` with a file that you trust or 'hub'"


def train(
    run: str | Path,
    scheme: str = "ABC:VRP+TRP+VT",
    protocol: str = "unseen",
    seed: int = 0,
    out: str | Path = "model",
    backbone: str = "",
    weights: str = "",
    **training: object,
) -> runs.Trained:
    """Train a scheme on the data set of a finished run and return the model.

    The model stays in `out`/model.safetensors.

    run: its folder, such as results/default; scheme: a name of config/schemes.csv; protocol:
    "unseen" trains on twenty subtypes and tests on the others, "seen" trains and tests on other
    motion of all; backbone: FILE.py:FUNCTION of your own, weights: hub or a file of your own to
    begin with, which a run's folder may not choose; training: settings that replace the run's own,
    such as steps=500. A training that was interrupted goes on.
    Raises: InputError for a run that is not finished, or names code, weights or files elsewhere, or
    a wrong name or setting.
    """
    config, index = _opened(run)
    block = config["recognition"]
    refuse_brought({"recognition": {"table": block["table"]}}, Path(run) / "config.yaml")
    if not weights:
        weights = block["network"]["weights"]
        refuse_weights(weights, run, BY_ARGUMENT)
    chosen = named(block["table"], scheme, station_names(config["network"]))
    name = backbone or allowed(chosen.backbone_of(block["network"]), "", run)
    network = {**block["network"], "backbone": name, "weights": weights}
    settings = chosen.settled(
        {
            "size": block["size"],
            "augmentation": block["augmentation"],
            "network": network,
            "seed": seed,
            "training": {**block["training"], **training},
            "colour_map": config["images"]["colour_map"],
            "classes": list(ShardSet(index).classes),
        }
    )
    samples = Source.of_run(index, settings["size"]).for_training(
        chosen, protocol, settings["size"]
    )
    runs.train(
        samples, replace(chosen, backbone=chosen.backbone and name), protocol, settings, Path(out)
    )
    return runs.load(Path(out) / "model.safetensors", backbone)


def evaluate(model: runs.Trained | str | Path, run: str | Path, backbone: str = "") -> dict:
    """Return how a trained model does on its protocol's test samples in a finished run's data set.

    model: of `train`, a file (.safetensors), or a name of the zoo; run: a folder such as
    results/default; backbone: the FILE.py:FUNCTION of a model file that names code. The result has
    `accuracy_percent`, the mean over the SNRs, `by_snr_percent`, `by_subtype_percent`, `confusion`
    (samples by true class and answer, in the order of the classes), `confusion_by_snr` and the
    calibration.
    Raises: InputError for a run that is not finished, or a model that does not fit its images.
    """
    if isinstance(model, runs.Trained):
        trained = model
    else:
        trained, _ = runs.opened(model, backbone)
    config, index = _opened(run)
    settings = config["recognition"]["evaluation"]
    machine = Machine.here(inference.evaluation(settings)[2])
    pairs = folds(trained.protocol, "test")
    source = Source.of_run(index, trained.size)
    samples = source.samples(trained.scheme.columns, pairs, trained.size)
    answers = runs.answers(trained, samples, settings, machine)
    return {"protocol": trained.protocol, **scores(samples.facts, answers)}


class Confusion(NamedTuple):
    """The classes (C,), and the number of test samples (C, C) int by true class and answer.

    Rows are true classes, columns answers.
    """

    classes: tuple[str, ...]
    samples: np.ndarray

    @property
    def percent(self) -> np.ndarray:
        """The same in percent of each true class (C, C); a class without samples has zeros."""
        return 100 * self.samples / np.maximum(self.samples.sum(axis=1, keepdims=True), 1)


def confusion(
    run: str | Path,
    scheme: str = "ABC:VRP+TRP+VT",
    protocol: str = "unseen",
    snr_db: float | None = None,
) -> Confusion:
    """Return what a finished run's networks took for what.

    snr_db: the SNR (dB), `math.inf` for no noise, or None for all; run: its folder; scheme,
    protocol: as in its table confusion_by_snr.csv, which sums over the training seeds.
    Raises: InputError for a folder without that table, or a scheme, a protocol or an SNR that it
    lacks.
    """
    path = Path(run) / "confusion_by_snr.csv"
    rows = read_csv(path, "protocol", "scheme", "snr_db", "category", "predicted", "samples")
    wanted: dict[str, str | float] = {"protocol": protocol, "scheme": scheme}
    if snr_db is not None:
        wanted["snr_db"] = snr_db
    for column, value in wanted.items():
        text = value if isinstance(value, str) else f"{value:g}"
        known = list(dict.fromkeys(row[column] for row in rows))
        if text not in known:
            raise InputError(f"{path}: {column} {value!r} is not there, expected one of {known}")
        rows = [row for row in rows if row[column] == text]
    classes = tuple(dict.fromkeys(row["category"] for row in rows))
    samples = np.zeros((len(classes), len(classes)), int)
    for row in rows:
        true = classes.index(row["category"])
        answer = classes.index(row["predicted"])
        samples[true, answer] += int(number(row, "samples", path))
    return Confusion(classes, samples)


def _opened(run: str | Path) -> tuple[dict, Path]:
    """The configuration of a finished run, and the path of its index."""
    folder = Path(run)
    index = folder / "shards/index.json"
    if not index.is_file():
        raise InputError(
            f"{folder}: has no shards/index.json, expected the folder of a finished run"
        )
    try:
        return located(check(of_run(folder), shipped(SCHEMA))), index
    except InputError as error:
        message = str(error)
        if str(folder) not in message:
            message = f"{folder / 'config.yaml'}: {message}"
        raise InputError(message) from None
