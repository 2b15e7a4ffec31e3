"""The command `lowalt predict`: a trained model's answer on a tile, signals or a recording."""

import argparse
import sys
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.blocks import render_blocks
from lowalt.config.command import add_backbone_option
from lowalt.config.extensions import module_offered, offered
from lowalt.config.layers import overlaid
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.machine.progress import announced
from lowalt.recognition.named_models import path_of


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `predict` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument(
        "model",
        help="a .safetensors file, of a training or another, or the name of one in results/zoo",
    )
    line.add_argument(
        "input",
        type=Path,
        help="tile (.png), signals (stations, symbols) complex (.npy), or a "
        "recording's record (.yaml)",
    )
    add_backbone_option(line)
    line.add_argument(
        "--overlay", type=Path, nargs="+", default=[], help="overlays of the run that trained it"
    )


def run(options: argparse.Namespace) -> Answer:
    """Ask a model for the probability of each class; the text names the most probable first.

    A model file that knows how its images were made of signals is asked with that, unless overlays
    are given.
    Raises: InputError for a file that is no model, tile or signal.
    """
    readers = offered("readers")
    if options.input.suffix not in (".png", ".npy", *readers):
        others = "".join(f" or {suffix}" for suffix in readers)
        raise InputError(f"{options.input}: expected a tile (.png) or signals (.npy){others}")
    existing(path_of(options.model), "model")
    existing(options.input, "input")
    reader = None
    if options.input.suffix in readers:
        suffix = options.input.suffix
        reader = module_offered("readers", suffix, readers[suffix])
        content = reader.read(options.input)
    config: dict = {}
    if options.overlay:
        # The backbone that an overlay of the user names is trusted, so that block counts here.
        config = overlaid(options.overlay, unused=())
    # What can be refused without torch has been refused: it takes seconds to import.
    if sys.stderr.isatty():
        print("lowalt predict: loading the network", file=sys.stderr, flush=True)
    from lowalt.recognition.predict_sample import predict
    from lowalt.recognition.runs import opened

    own_backbone = options.backbone
    if config and not own_backbone:
        own_backbone = config["recognition"]["network"]["backbone"]
    with announced("lowalt predict: loading the network"):
        model, settings = opened(options.model, trusted=own_backbone)
    if reader:
        return Answer(*reader.answer(model, settings, content, str(options.input)))
    if "radar" in settings and options.input.suffix == ".npy":
        raise InputError(
            f"{options.input}: {options.model} knows recordings, expected the record of one (.yaml)"
        )
    if config or not settings:
        config = config or overlaid([])
        settings = render_blocks(config)
    shares = predict(model, options.input, settings)
    best_first = sorted(shares.items(), key=lambda pair: -pair[1])
    lines = [f"{100 * share:6.2f} %  {name}" for name, share in best_first]
    return Answer(shares, "\n".join(lines))
