"""The command `lowalt sample`: one sample of a configuration as files and as a picture with axes."""

import argparse
import math
import os
from pathlib import Path

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.layers import overlaid
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import sample_key
from lowalt.tiles.png import encode


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `sample` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("subtype", help="name of the subtype, as in the table of targets")
    line.add_argument("model", type=int, help="number of the motion model; any number, also beyond the configuration's")
    line.add_argument("--snr", type=float, default=math.inf, help="signal-to-noise ratio in dB (default: no noise)")
    line.add_argument("--overlay", type=Path, nargs="+", default=[], help="overlays on the default")
    line.add_argument("--out", type=Path, default=Path(), help="folder to write into (default: the current one)")


def run(options: argparse.Namespace) -> Answer:
    """Write {key}.png, .npy and .json as the shards hold them, and {key}-axes.png; answer with what was written.

    Raises: InputError for a wrong configuration, subtype or model.
    """
    from lowalt.report.figures.tile_axes import figure

    config = overlaid(options.overlay)
    everything = config["targets"]["select"]
    # Only the target's own cloud is made.
    config["targets"]["select"] = [options.subtype]
    dataset = Dataset(config, inputs=config["inputs"] or os.environ.get("LOWALT_INPUTS"))
    if options.model < 0 or (everything and options.subtype not in everything):
        raise InputError(f"{options.subtype!r}, model {options.model}: expected a selected subtype and a number from 0")
    (group,) = dataset.plan.groups
    place = Place(group, options.subtype, options.model, options.snr)
    image, signal, _ = dataset.made(place)
    key, renderer = sample_key(options.subtype, options.model, options.snr), dataset.maker.renderer
    noise = "no noise" if math.isinf(options.snr) else f"SNR {options.snr:g} dB"
    written = {
        f"{key}.png": encode(image, renderer.images.palette),
        f"{key}.json": dataset.made_record(place),
        f"{key}-axes.png": figure(image, renderer, f"{options.subtype}, motion model {options.model}, {noise}"),
    }
    for name, data in written.items():
        with replacing(options.out / name) as temporary:
            temporary.write_bytes(data)
    with replacing(options.out / f"{key}.npy") as temporary:
        np.save(temporary, signal)
    paths = [str(options.out / name) for name in (*written, f"{key}.npy")]
    return Answer({"key": key, "files": paths}, "\n".join(paths))
