"""From settings to files: build a network and train it, read it back, evaluate it, predict with it.

`model.pt` carries everything a model needs to be used again: scheme, protocol, network settings, image size and
palettes and the weights.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import timm
import torch
from torch import nn

from lowalt.common.classes import stated
from lowalt.common.command import pick
from lowalt.common.errors import InputError
from lowalt.common.files import replacing, sha256
from lowalt.common.hardware import describe
from lowalt.common.network import Network
from lowalt.recognition import (
    augment,
    checkpoint,
    classical_runs,
    inference,
    metrics,
    network,
    own_backbone,
    predictions,
    recipe,
)  # fmt: skip
from lowalt.recognition.ahead import ReadAhead, Unchanged
from lowalt.recognition.classical_models import of_arrays
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.methods import built
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.schemes import Scheme, columns_in, of_record, refuse_cues
from lowalt.recognition.slow_time import SlowTimeSamples, of_stations
from lowalt.recognition.start import Start, carry
from lowalt.recognition.training import Trainer
from lowalt.recognition.views import ShardSamples
from lowalt.spectra.catalogue import named
from lowalt.tiles import resize

Samples = ViewSamples | ShardSamples | SlowTimeSamples


def train(
    samples: dict[str, Samples], scheme: Scheme, protocol: str, settings: dict, folder: Path, events: bool = False,
    start: Start | None = None,
) -> None:  # fmt: skip
    """Train a scheme and write `model.pt`, `history.csv` and `run.json` into `folder`; resumes its own checkpoint.

    samples: the sources "train" and "validation"; settings: {seed, size, colour_map, network, training,
    augmentation, classes}, the classes by label; events: whether to write the metrics for TensorBoard too,
    into `events/` of the folder; start: the finished training whose weights it starts from, checked by `start`.
    Raises: InputError for a wrong setting, a foreign checkpoint, or a training that ends in NaN.
    """
    pick(settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    block, classes = recipe.check(settings["training"]), settings["classes"]
    if len(classes) < 2:
        raise InputError(f"training: classes {classes}, expected two or more to tell apart")
    if scheme.sees == "features":
        _record(folder / "run.json", classical_runs.train(samples, scheme, protocol, settings, folder))
        return
    augment.check(settings["augmentation"])
    if bool(block["stream"]) != hasattr(samples["train"], "fresh"):
        raise InputError(
            f"training: stream is {block['stream']}, expected a share above 0 together with --stream, or neither"
        )
    machine = Machine.here(block["precision"])
    begun = {"start": start.about} if start else {}
    name = _identity(samples, scheme, protocol, settings, machine, begun)
    keys = (protocol, scheme.name)
    recipe.seeded(settings["seed"], keys, block["threads"])
    model = built(scheme, settings["network"], settings["size"], settings["colour_map"], len(classes))
    if start:
        carry(start, scheme, model)
    trainer = Trainer(model, samples, scheme.columns, settings, keys, name, folder, machine)
    # Weights that come from another training are a candidate as they are.
    trainer.validates_first = start is not None
    resumed = trainer.resume()
    machine.agree(name, trainer.at.steps)
    if resumed and machine.rank == 0:
        print(f"{folder}: resumed at step {trainer.at.steps}", file=sys.stderr)
    if events and machine.rank == 0:
        trainer.metrics = metrics.tensorboard(folder / "events", trainer.at.steps)
    began, busy, steps = time.monotonic(), time.process_time(), trainer.at.steps
    at = trainer.fit()
    seconds, busy = time.monotonic() - began, time.process_time() - busy
    trainer.finish({
        "scheme": scheme.record, "protocol": protocol, "network": settings["network"], "size": settings["size"],
        "seed": settings["seed"], "colour_map": settings["colour_map"], "classes": list(classes), **begun,
    })  # fmt: skip
    if machine.rank == 0:
        _record(folder / "run.json", {
            "protocol": protocol, "scheme": scheme.name, "seed": settings["seed"], "hardware": describe(),
            "backbone": scheme.method or scheme.backbone or settings["network"]["backbone"],
            "weights": settings["network"]["weights"],
            "parameters": network.parameters(model), "train_samples": len(samples["train"].facts),
            "samples_seen": at.steps * block["batch"], "validation_accuracy": at.best, "train_s": seconds,
            "train_processor_s": busy, "size": settings["size"], "steps": at.steps, "batch": block["batch"],
            "samples_per_s": (at.steps - steps) * block["batch"] / max(seconds, 1e-9), "resumed": resumed,
            "precision": machine.precision,
            "waiting_share": trainer.waited_s / max(seconds, 1e-9), "ranks": machine.ranks,
            "torch": torch.__version__, "timm": timm.__version__, "classes": list(classes), **begun,
        })  # fmt: skip


def _identity(samples: dict, scheme: Scheme, protocol: str, settings: dict, machine: Machine, begun: dict) -> str:
    """Return the JSON text of all that determines a training's weights."""
    own = own_backbone.file_of(scheme.backbone or settings["network"]["backbone"])
    # Leave out settings that change no weight, and name the precision that this machine computes with.
    kept = {"checkpoint_s": None, "workers": None, "precision": machine.precision}
    return checkpoint.identity(
        scheme=scheme.record, protocol=protocol, settings={**settings, "training": {**settings["training"], **kept}},
        samples={part: source.sha256() for part, source in samples.items()}, torch=torch.__version__,
        **({"own": sha256(own)} if own and own.is_file() else {}), **begun,
    )  # fmt: skip


def _record(path: Path, content: dict) -> None:
    """Write a record as JSON with sorted keys."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")


@dataclass(frozen=True)
class Trained:
    """A trained model read back: the network with its weights, what it sees, and where it came from."""

    model: nn.Module
    scheme: Scheme
    protocol: str
    size: int
    seed: int
    path: Path
    classes: tuple[str, ...]


def load(path: str | Path) -> Trained:
    """Return the trained model of a `model.pt`.

    Raises: InputError where the file is missing, damaged or not a model of this project.
    """
    return of_state(checkpoint.load(path)[1], path)


def of_state(state: dict, path: str | Path) -> Trained:
    """Return the trained model of what a model file keeps: `weights` and the settings of its network; path: its file.

    Raises: InputError where weights and settings do not fit together.
    """
    try:
        block = {**state["network"], "weights": "none"}
        scheme = of_record(state["scheme"])
        if scheme.sees == "features":
            model = of_arrays(state["weights"])
        else:
            model = built(scheme, block, state["size"], state["colour_map"], len(stated(state)))
            model.load_state_dict(state["weights"])
        return Trained(model.eval(), scheme, state["protocol"], state["size"], state["seed"], Path(path), stated(state))
    except (KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"{path}: not a trained model ({str(error)[:200]})") from error


def evaluate(
    trained: Trained, samples: Samples, settings: dict, out: str | Path, trained_on: str = "", more: dict | None = None
) -> None:
    """Write the predictions for all samples of a source, and the run's record (.json) in the same folder.

    settings: {batch, threads, precision, mirror}, perhaps with workers, the processes that read samples; trained_on:
    the run that trained the model, where it is another; more: further entries of the record.
    Under torchrun the ranks share the work and rank 0 writes.
    """
    batch, threads, precision, mirror, workers = inference.evaluation(settings)
    recipe.seeded(trained.seed, ("evaluate",), threads)
    machine = Machine.here(precision)
    model = machine.placed(trained.model)
    start = time.monotonic()
    ahead = ReadAhead(Unchanged(samples), workers, pin=machine.gpu)
    found = probabilities(model, samples, np.arange(len(samples.facts)), machine, batch, mirror, ahead)
    seconds = time.monotonic() - start
    if machine.rank:
        return
    told = predictions.from_facts(samples.facts, trained.scheme.stations, found)
    predictions.write(out, told, trained.classes)
    side = trained.path.with_name("run.json")
    known = json.loads(side.read_text()) if side.exists() else {}
    _record(Path(out).with_suffix(".json"), {
        **known, "protocol": trained.protocol, "scheme": trained.scheme.name, "seed": trained.seed,
        "hardware": describe(), "evaluated_samples": len(found), "evaluate_s": seconds,
        "trained_on": trained_on, "mirror": mirror, "classes": list(trained.classes), **(more or {}),
    })  # fmt: skip


def images_of(path: Path, settings: dict) -> np.ndarray:
    """Return all index images (stations spectra, S, S) uint8 of a signal file or a tile.

    path: .npy, complex (stations, symbols), or .png, an indexed tile; settings: {network, spectra, images}.
    Raises: InputError naming the file, for another kind of file or a shape that does not fit.
    """
    from lowalt.tiles import Renderer, decode, split

    spectra, tiled = len(named(settings["spectra"])), path.suffix == ".png"
    signals = None if tiled else _signals(path)
    renderer = None if tiled else Renderer.from_settings(settings)
    try:
        return split(decode(path.read_bytes())[0] if renderer is None else renderer.tile(signals), spectra)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _signals(path: Path) -> np.ndarray:
    """Return the complex array of a signal file. Raises: InputError naming the file, for another kind of file."""
    if path.suffix != ".npy":
        raise InputError(f"{path}: expected signals (.npy) or a tile (.png)")
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: not an array file ({error})") from error
    if found.dtype.kind != "c" or found.ndim != 2:
        raise InputError(f"{path}: {found.dtype} {found.shape}, expected complex (stations, symbols)")
    return found


def _seen(trained: Trained, path: Path, settings: dict) -> np.ndarray:
    """Return the input of a model, one sample (1, ...), from a signal file or, for models on images, a tile.

    Raises: InputError where a model on signals is given something else than the signals of its network.
    """
    if trained.scheme.sees == "images":
        images = images_of(path, settings)
        names = named(settings["spectra"])
        places = columns_in(trained.scheme.columns, names, len(images) // len(names), str(path))
        return resize(images, trained.size)[places][None]
    network_of, signals = Network.from_settings(settings["network"]), _signals(path)
    if signals.shape != (len(network_of.stations), network_of.symbols):
        raise InputError(f"{path}: shape {signals.shape}, expected {len(network_of.stations), network_of.symbols}")
    signals = signals.astype(np.complex64)[None]
    values = signals if trained.scheme.sees == "signals" else of_stations(signals, network_of)
    return values[:, trained.scheme.columns]


def predict(trained: Trained, path: Path, settings: dict) -> dict[str, float]:
    """Return the probability of each category for one signal file or tile, in full precision.

    Raises: InputError for a model that also asks for a measured height, which no such file has.
    """
    refuse_cues(trained.scheme, "predict")
    with torch.inference_mode():
        found = trained.model(torch.from_numpy(_seen(trained, path, settings))).double().softmax(1)[0]
    return dict(zip(trained.classes, found.tolist(), strict=True))
