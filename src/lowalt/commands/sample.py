"""The command `lowalt sample`: one sample as files and a picture with axes, or its raw echo."""

import argparse
import math
from pathlib import Path

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.layers import overlaid
from lowalt.files.atomic import replacing, write_file
from lowalt.files.errors import InputError
from lowalt.shards.dataset import Dataset
from lowalt.shards.kept_datasets import dataset_of_subtype
from lowalt.shards.receive import AT, receive, write
from lowalt.shards.sample_list import sample_key
from lowalt.tiles.png import encode


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `sample` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("subtype", help="name of the subtype, as in the table of targets")
    line.add_argument(
        "model",
        type=int,
        help="number of the motion model; any number, also beyond the configuration's",
    )
    line.add_argument(
        "--snr",
        type=float,
        default=math.inf,
        help="signal-to-noise ratio in dB (default: no noise)",
    )
    line.add_argument("--overlay", type=Path, nargs="+", default=[], help="overlays on the default")
    line.add_argument(
        "--raw",
        nargs="?",
        const="cells",
        choices=AT,
        help="write the raw echo at this place of the "
        "chain instead (default: cells), as .npz and, where h5py is installed, .h5",
    )
    line.add_argument("--station", help="of a raw echo (default: each station)")
    line.add_argument(
        "--out", type=Path, default=Path(), help="folder to write into (default: the current one)"
    )


def run(options: argparse.Namespace) -> Answer:
    """Write {key}.png, .npy and .json as the shards hold them, and {key}-axes.png.

    The answer names the files. Raises: InputError for a wrong configuration, subtype or model.
    """
    config = overlaid(options.overlay)
    selected = config["targets"]["select"]
    if options.model < 0 or (selected and options.subtype not in selected):
        raise InputError(
            f"{options.subtype!r}, model {options.model}: expected a selected subtype and a number "
            "from 0"
        )
    dataset = dataset_of_subtype(config, options.subtype)
    if options.raw:
        return _raw(options, dataset)
    from lowalt.report.figures.tile_axes import figure

    index = dataset.place_of(options.subtype, options.model, options.snr)
    image, signal, _ = dataset.made(index)
    key = sample_key(options.subtype, options.model, options.snr)
    renderer = dataset.maker.renderer
    noise = "no noise" if math.isinf(options.snr) else f"SNR {options.snr:g} dB"
    title = f"{options.subtype}, motion model {options.model}, {noise}"
    written = {
        f"{key}.png": encode(image, renderer.images.palette),
        f"{key}.json": dataset.made_record(index),
        f"{key}-axes.png": figure(image, renderer, title),
    }
    for name, data in written.items():
        write_file(options.out / name, data)
    with replacing(options.out / f"{key}.npy") as temporary:
        np.save(temporary, signal)
    paths = [str(options.out / name) for name in (*written, f"{key}.npy")]
    return Answer({"key": key, "files": paths}, "\n".join(paths))


def _raw(options: argparse.Namespace, dataset: Dataset) -> Answer:
    """Write {key}-{station}-{place}.npz, and .h5 where h5py is installed.

    The files are of the station that --station names, otherwise of each station.
    """
    key = sample_key(options.subtype, options.model, options.snr)
    files = []
    names = [options.station]
    if not options.station:
        names = [station.name for station in dataset.maker.network.stations]
    for name in names:
        echo = receive(dataset, options.subtype, options.model, name, options.raw, options.snr)
        files += write(echo, options.out / f"{key}-{name}-{options.raw}")
    return Answer({"key": key, "files": files}, "\n".join(map(str, files)))
