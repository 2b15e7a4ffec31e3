"""The zoo: small trained models under 1 MB in `results/zoo`, which `lowalt predict` takes by name.

`python -m lowalt.extensions.formats.zoo --model MODEL.safetensors --views FILES --name NAME` makes
an entry of a finished run: weights in 8 bits, their answers on the whole validation fold compared
with those of the weights as trained, and a card.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from lowalt.config.command import add_backbone_option, run
from lowalt.extensions.formats.zoo_files import ZOO
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.recognition import model_card, model_file
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.model_file import EIGHT, ModelFile, rounded
from lowalt.recognition.protocols import folds
from lowalt.recognition.runs import Trained, load, of_file
from lowalt.recognition.samples import Samples

LARGEST_BYTES = 1_000_000
BATCH = 64
"""Samples that a network answers at a time."""
FEWER_POINTS = 0.5
"""An entry that loses more of the validation accuracy, in percentage points, is not written."""


def small(content: ModelFile, trusted: str = "") -> ModelFile:
    """Return a model with its trained matrices in 8 bits; trusted: as in `runs.opened`."""
    exact = of_file(content, "model", trusted)
    matrices = {
        name
        for name, value in exact.model.named_parameters()
        if value.ndim > 1 and not value.is_complex()
    }
    return replace(content, tensors=rounded(content.tensors, matrices), weights=EIGHT)


def held_against(exact: Trained, entry: Trained, samples: Samples) -> dict:
    """Return how an entry answers samples next to the weights as trained.

    Both answer in float32, without mirroring.

    Keys: samples; exact_percent, percent: accuracies; changed: samples with another answer;
    largest_change: of any probability.
    """
    machine = Machine(torch.device("cpu"), "fp32")
    everything = np.arange(len(samples.facts))
    as_trained, rounded_off = (
        probabilities(model.model, samples, everything, machine, BATCH) for model in (exact, entry)
    )
    guesses = as_trained.argmax(1)
    changed_guesses = rounded_off.argmax(1)
    labels = samples.facts.label
    return {
        "samples": len(labels),
        "exact_percent": 100 * float(np.mean(guesses == labels)),
        "percent": 100 * float(np.mean(changed_guesses == labels)),
        "changed": int(np.sum(guesses != changed_guesses)),
        "largest_change": float(np.abs(as_trained - rounded_off).max()),
    }


def entry(
    model: str | Path, samples: Samples, name: str, zoo: Path = ZOO, trusted: str = ""
) -> dict:
    """Write NAME.safetensors and NAME.md into the zoo and return the measurements.

    model: model.safetensors of a training; samples: its validation fold; trusted: as in
    `runs.opened`.
    Raises: InputError for a name that is no plain file name, samples that are not the validation
    fold of the training, an entry of 1 MB or more, or one that loses accuracy.
    """
    if not name or slug(name) != name:
        raise InputError(f"--name: {name!r}, expected lower-case letters, digits and hyphens")
    content = model_file.of_run(model)
    if content.identity.get("samples", {}).get("validation") != samples.sha256():
        raise InputError(
            f"{model}: was validated on other samples, expected the validation fold of its own run"
        )
    return kept(content, model, samples, name, zoo, trusted)


def kept(
    content: ModelFile,
    model: str | Path,
    samples: Samples,
    name: str,
    zoo: Path = ZOO,
    trusted: str = "",
) -> dict:
    """Write a model's content in 8 bits as NAME.safetensors and NAME.md.

    Return the measurements, as `entry` does.
    samples: those that both sets of weights answer. Raises: InputError as `entry`, for size and
    accuracy.
    """
    reduced = small(content, trusted)
    size = len(model_file.packed(reduced))
    if size >= LARGEST_BYTES:
        raise InputError(f"--model: {size} bytes in 8 bits, expected less than {LARGEST_BYTES}")
    exact, answering = (of_file(weights, model, trusted) for weights in (content, reduced))
    measured = held_against(exact, answering, samples)
    if measured["percent"] < measured["exact_percent"] - FEWER_POINTS:
        raise InputError(
            f"--model: 8 bits fall from {measured['exact_percent']:.2f} to "
            f"{measured['percent']:.2f} % of the validation fold, expected at most {FEWER_POINTS} "
            "points less"
        )
    reduced = replace(reduced, measured=measured)
    out = zoo / f"{name}.safetensors"
    model_file.write(out, reduced)
    model_card.write(
        out, reduced, model_card.accuracy_rows(model, exact.protocol, exact.scheme.name)
    )
    return measured


def main(arguments: list[str]) -> None:
    """Make an entry of the zoo: 8-bit weights of a finished training, measured, with a card."""
    line = argparse.ArgumentParser(
        prog="python -m lowalt.extensions.formats.zoo", description=main.__doc__
    )
    line.add_argument("--model", required=True, help="model.safetensors of a training run")
    line.add_argument(
        "--views",
        nargs="+",
        required=True,
        help="caches of views (.npz) that hold the validation fold",
    )
    line.add_argument("--name", required=True, help="name of the entry, such as default-seen")
    line.add_argument("--out", type=Path, default=ZOO, help=f"folder of the zoo (default: {ZOO})")
    add_backbone_option(line)
    options = line.parse_args(arguments)
    from lowalt.recognition.sample_sources import Source

    trained = load(options.model, options.backbone)
    pairs = folds(trained.protocol, "validation")
    samples = Source(views=options.views).samples(trained.scheme.columns, pairs, trained.size)
    measured = entry(options.model, samples, options.name, options.out, options.backbone)
    print(
        f"{options.name}: "
        f"{(options.out / options.name).with_suffix('.safetensors').stat().st_size} bytes, "
        f"validation {measured['exact_percent']:.3f} % as trained, {measured['percent']:.3f} % in "
        f"8 bits, {measured['changed']} of {measured['samples']} answers differ"
    )


if __name__ == "__main__":
    run(main)
