"""The command `lowalt predict`: what a trained model says of a tile, of signals or of a recording."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.command import name_backbone
from lowalt.config.layers import overlaid
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.recognition.zoo_files import path_of

if TYPE_CHECKING:
    from lowalt.recognition.runs import Trained
    from lowalt.recordings.record import Record


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `predict` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("model", help="model.pt of a training, a .safetensors file, or the name of one in results/zoo")
    line.add_argument("input", type=Path, help="tile (.png), signals (stations, symbols) complex (.npy), or a "
                         "recording's record (.yaml)")  # fmt: skip
    name_backbone(line)
    line.add_argument("--overlay", type=Path, nargs="+", default=[], help="overlays of the run that trained it")


def run(options: argparse.Namespace) -> Answer:
    """Ask a model for the probability of each class; the text names the most probable first.

    A model file that knows how its images were made of signals is asked with that, unless overlays are given.
    Raises: InputError for a file that is no model, tile or signal.
    """
    if options.input.suffix not in (".png", ".npy", ".yaml"):
        raise InputError(
            f"{options.input}: expected a tile (.png), signals (.npy) or the record of a recording (.yaml)"
        )
    existing(path_of(options.model), "model")
    existing(options.input, "input")
    record = _record(options.input) if options.input.suffix == ".yaml" else None
    config = overlaid(options.overlay) if options.overlay else {}
    # What can be refused without torch has been refused: it takes seconds to import.
    if sys.stderr.isatty():
        print("lowalt predict: loading the network", file=sys.stderr, flush=True)
    from lowalt.recognition.predict_sample import predict
    from lowalt.recognition.zoo import opened

    own = options.backbone or (config["recognition"]["network"]["backbone"] if config else "")
    model, settings = opened(options.model, trusted=own)
    if record is not None:
        return _recording(model, settings, record, options)
    if "radar" in settings and options.input.suffix == ".npy":
        raise InputError(f"{options.input}: {options.model} knows recordings, expected the record of one (.yaml)")
    if config or not settings:
        config = config or overlaid([])
        settings = {key: config[key] for key in ("network", "spectra", "images")}
    shares = predict(model, options.input, settings)
    lines = [f"{100 * share:6.2f} %  {name}" for name, share in sorted(shares.items(), key=lambda pair: -pair[1])]
    return Answer(shares, "\n".join(lines))


def _record(path: Path) -> "Record":
    """The record of a recording."""
    from lowalt.recordings.record import read_record

    return read_record(path)


def _recording(model: "Trained", settings: dict, record: "Record", options: argparse.Namespace) -> Answer:
    """The class of every window of a recording, one line each, and how many windows of each class there are."""
    from lowalt.recordings.answers import answers

    heard = answers(model, settings, record, str(options.input))
    outcomes = heard.outcomes(list(model.classes))
    names = np.array(model.classes)[heard.probabilities.argmax(1)]
    facts = zip(heard.starts_s.tolist(), heard.present.tolist(), heard.clipped.tolist(), heard.lost.tolist(),
                heard.beyond_mps.tolist(), names, heard.probabilities.tolist(), strict=True)  # fmt: skip
    windows = [
        {"start_s": start, "target": target, "clipped": clipped, "lost": lost,
         "beyond_mps": None if beyond != beyond else beyond, "class": str(name),
         **dict(zip(model.classes, shares, strict=True))}
        for start, target, clipped, lost, beyond, name, shares in facts
    ]  # fmt: skip
    lines = [f"{heard.starts_s[number]:8.2f} s  {heard.words(number, outcome)}"
             for number, outcome in enumerate(outcomes)]  # fmt: skip
    counts = [f"{category} {outcomes.count(category)}" for category in model.classes]
    last = f"{heard.present.sum()} of {len(names)} windows hold a target: {', '.join(counts)}"
    if not heard.present.any():
        last = f"nothing there: none of {len(names)} windows holds a target that this network could know"
    return Answer(windows, "\n".join([*lines, last, *(f"note: {note}" for note in heard.notes)]))
