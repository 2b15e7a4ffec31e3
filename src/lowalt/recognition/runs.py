"""Build and train a network from settings, load a trained one, and evaluate it.

`model.safetensors` holds everything needed to use the model: scheme, protocol, network settings,
image size, palettes and weights.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import timm
import torch
from torch import nn

from lowalt.config.classes import stated
from lowalt.config.command import pick
from lowalt.config.named_code import allowed, file_of
from lowalt.config.schema import check_brought
from lowalt.files.atomic import sha256, write_file
from lowalt.files.errors import InputError, in_one_line
from lowalt.files.json_objects import read_object
from lowalt.machine.hardware import describe
from lowalt.recognition import checkpoint, inference, model_file, predictions, recipe, recogniser
from lowalt.recognition.batches import Prefetch, Unchanged
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.model_file import ModelFile
from lowalt.recognition.named_models import path_of
from lowalt.recognition.recogniser import built
from lowalt.recognition.samples import Samples, first_models, statement
from lowalt.recognition.schemes import Scheme, of_record
from lowalt.recognition.training import Trainer, TrainingRun, tensorboard
from lowalt.recognition.weights import filled, refuse_unfinite, refuse_unfit

Build = Callable[[Scheme, dict, int, str, int], nn.Module]
"""Makes a network from: scheme, block `recognition.network`, image size, colour map, number of
classes.
"""


def train(
    samples: dict[str, Samples],
    scheme: Scheme,
    protocol: str,
    settings: dict,
    folder: Path,
    events: bool = False,
    build: Build = built,
) -> None:
    """Train a scheme, from its checkpoint if there is one, and write its files.

    They are `model.safetensors`, `history.csv` and `run.json`.

    samples: the sources "train", of which the scheme's share is kept, and "validation"; settings:
    {seed, size, colour_map, network, training, augmentation, classes}, the classes by label;
    folder: where the files go; events: whether to write the metrics for TensorBoard too, into
    `events/` of the folder; build: makes the network.
    Raises: InputError for a wrong setting, a checkpoint of another run, or a loss that becomes NaN.
    """
    pick(settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    block = recipe.check(settings["training"])
    classes = settings["classes"]
    if len(classes) < 2:
        raise InputError(f"training: classes {classes}, expected two or more to tell apart")
    check_brought("augmentation", settings["augmentation"], "recognition.augmentation")
    if scheme.share < 1:
        samples["train"].keep(first_models(samples["train"].facts, scheme.share))
    machine = Machine.here(block["precision"])
    identity = _identity(samples, scheme, protocol, settings, machine)
    keys = (protocol, scheme.name)
    recipe.seeded(settings["seed"], keys, block["threads"])
    model = build(
        scheme, settings["network"], settings["size"], settings["colour_map"], len(classes)
    )
    run = TrainingRun(keys, identity, folder)
    trainer = Trainer(model, samples, scheme.columns, {**settings, "training": block}, run, machine)
    resumed = trainer.resume()
    machine.agree(identity, trainer.at.steps)
    if resumed and machine.rank == 0:
        print(f"{folder}: resumed at step {trainer.at.steps}", file=sys.stderr)
    if events and machine.rank == 0:
        trainer.metrics = tensorboard(folder / "events", trainer.at.steps)
    first = trainer.at.steps
    began = time.monotonic()
    processor_began = time.process_time()
    trainer.fit()
    seconds = time.monotonic() - began
    processor_s = time.process_time() - processor_began
    about = {
        "protocol": protocol,
        "size": settings["size"],
        "seed": settings["seed"],
        "classes": list(classes),
    }
    trainer.finish(
        {
            **about,
            "scheme": scheme.record,
            "network": settings["network"],
            "colour_map": settings["colour_map"],
        }
    )
    if machine.rank != 0:
        return
    _record(
        folder / "run.json",
        {
            **about,
            **_spent(trainer, first, seconds),
            "scheme": scheme.name,
            "backbone": scheme.backbone_of(settings["network"]),
            "weights": settings["network"]["weights"],
            "parameters": recogniser.parameters(model),
            "resumed": resumed,
            "train_processor_s": processor_s,
        },
    )


def _spent(trainer: Trainer, first: int, seconds: float) -> dict:
    """What a training has done from step `first` on, in this many seconds, and its machine."""
    at = trainer.at
    batch = trainer.block["batch"]
    # A training that was resumed after its last step takes no time.
    time_s = max(seconds, 1e-9)
    return {
        "hardware": describe(),
        "precision": trainer.machine.precision,
        "ranks": trainer.machine.ranks,
        "torch": torch.__version__,
        "timm": timm.__version__,
        "train_samples": len(trainer.train.facts),
        "steps": at.steps,
        "batch": batch,
        "samples_seen": at.steps * batch,
        "validation_accuracy": at.best,
        "train_s": seconds,
        "samples_per_s": (at.steps - first) * batch / time_s,
        "waiting_share": trainer.waited_s / time_s,
    }


def _identity(
    samples: dict, scheme: Scheme, protocol: str, settings: dict, machine: Machine
) -> str:
    """Return the JSON text of all that determines a training's weights."""
    own_code = {}
    code = file_of(scheme.backbone_of(settings["network"]))
    if code and code.is_file():
        own_code["own"] = sha256(code)
    # Leave out settings that change no weight, and name the precision that this machine computes
    # with.
    replaced = {"checkpoint_s": None, "workers": None, "precision": machine.precision}
    return checkpoint.identity(
        scheme=scheme.record,
        protocol=protocol,
        settings={**settings, "training": {**settings["training"], **replaced}},
        samples={part: source.sha256() for part, source in samples.items()},
        torch=torch.__version__,
        trained_on=statement(samples["train"].facts),
        **own_code,
    )


def _record(path: Path, content: dict) -> None:
    """Write a record as JSON with sorted keys."""
    write_file(path, json.dumps(content, indent=1, sort_keys=True) + "\n")


@dataclass(frozen=True)
class Trained:
    """A loaded trained model: the network with its weights, the views it uses, and its origin."""

    model: nn.Module
    scheme: Scheme
    protocol: str
    size: int
    seed: int
    path: Path
    classes: tuple[str, ...]


def load(path: str | Path, trusted: str = "", build: Build = built) -> Trained:
    """Return the trained model of a model file; trusted, build: as in `of_file`.

    Raises: InputError where the file is missing, damaged or not a model of this project.
    """
    return of_file(model_file.read(path), path, trusted, build)


def opened(model: str | Path, trusted: str = "") -> tuple["Trained", dict]:
    """Return a trained model and how its images are made of signals.

    The latter is {network, spectra, images}, {} where it is unknown.

    model: a model file (.safetensors) of a training or another, or a name that
    `named_models.path_of` knows; trusted: the user's FILE.py:FUNCTION for a model whose backbone is
    such code.
    Raises: InputError naming the models there are, or the fault of the file.
    """
    path = path_of(model)
    content = model_file.read(path)
    return of_file(content, path, trusted), content.input


def of_file(
    content: ModelFile, path: str | Path, trusted: str = "", build: Build = built
) -> Trained:
    """Return the model of a file's content, ready to answer.

    path: its file; trusted: the user's FILE.py:FUNCTION for a model whose backbone is such code;
    build: makes its network.
    Raises: InputError where weights and settings do not fit together, or the backbone is code that
    nobody named.
    """
    weights = model_file.weights_of(content, path)
    state = content.model
    scheme = of_record(state["scheme"])
    classes = stated(state)
    try:
        refuse_unfinite(weights, path)
        model = _network(scheme, state, weights, path, trusted, build)
    except InputError as error:
        message = str(error)
        if str(path) not in message:
            message = f"{path}: {message}"
        raise InputError(message) from error
    except Exception as error:
        # For settings that do not fit together, torch and timm raise almost any exception.
        raise InputError(f"{path}: not a trained model ({in_one_line(error)})") from error
    return Trained(
        model.eval(), scheme, state["protocol"], state["size"], state["seed"], Path(path), classes
    )


def _network(
    scheme: Scheme, state: dict, weights: dict, path: str | Path, trusted: str, build: Build
) -> nn.Module:
    """The network of a file with its weights; trusted, build: as in `of_file`."""
    named_backbone = scheme.backbone_of(state["network"])
    name = allowed(named_backbone, trusted)
    block = {**state["network"], "backbone": name, "weights": "none"}
    bare = replace(scheme, backbone="")
    views = len(scheme.columns)
    size = state["size"]

    def fresh() -> nn.Module:
        """The network with fresh weights."""
        return build(bare, block, size, state["colour_map"], len(stated(state)))

    if name == named_backbone and build is built:
        return filled(
            fresh,
            lambda: torch.zeros(1, views, size, size, dtype=torch.uint8),
            weights,
            path,
        )
    # The user named this code, so it is trusted; its output cannot be checked here.
    model = fresh()
    refuse_unfit(weights, model, path)
    model.load_state_dict(weights)
    return model


def answers(trained: Trained, samples: Samples, settings: dict, machine: Machine) -> np.ndarray:
    """Return the class probabilities (n, classes) of all samples; settings as in `evaluate`."""
    batch, threads, _, mirror, workers = inference.evaluation(settings)
    recipe.seeded(trained.seed, ("evaluate",), threads)
    ahead = Prefetch(Unchanged(samples), workers, pin=machine.gpu)
    every = np.arange(len(samples.facts))
    return probabilities(
        machine.placed(trained.model), samples, every, machine, batch, mirror, ahead
    )


def evaluate(
    trained: Trained,
    samples: Samples,
    settings: dict,
    out: str | Path,
    trained_on: str = "",
    more: dict | None = None,
) -> None:
    """Write the predictions for all samples of a source, with the run's record (.json) beside them.

    settings: {batch, threads, precision, mirror}, perhaps with workers, the processes that read
    samples; trained_on: the run that trained the model, where it is another; more: further entries
    of the record. Under torchrun the ranks share the work and rank 0 writes.
    """
    _, _, precision, mirror, _ = inference.evaluation(settings)
    machine = Machine.here(precision)
    start = time.monotonic()
    shares = answers(trained, samples, settings, machine)
    seconds = time.monotonic() - start
    if machine.rank:
        return
    table = predictions.from_facts(samples.facts, trained.scheme.stations, shares)
    predictions.write(out, table, trained.classes, trained.protocol)
    side = trained.path.with_name("run.json")
    known = read_object(side, "a run record") if side.exists() else {}
    _record(
        Path(out).with_suffix(".json"),
        {
            **known,
            "protocol": trained.protocol,
            "scheme": trained.scheme.name,
            "seed": trained.seed,
            "hardware": describe(),
            "evaluated_samples": len(shares),
            "evaluate_s": seconds,
            "trained_on": trained_on,
            "mirror": mirror,
            "classes": list(trained.classes),
            **(more or {}),
        },
    )
