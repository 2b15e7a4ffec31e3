"""The commands `lowalt verify`, `lowalt remake` and `lowalt predict`: check a data set, remake samples, ask a model."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.command import name_backbone
from lowalt.config.layers import overlaid
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.shards.verify import faults, frozen

if TYPE_CHECKING:
    from lowalt.recognition.runs import Trained


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the three commands to a parser's."""
    index = "results/default/shards/index.json"
    verify = add_command(commands, "verify", verified, "check every byte of a data set", f"lowalt verify {index}")
    verify.add_argument("--remake", type=int, default=0, metavar="N", help="also make N random samples again")
    meaning = "make stored samples again from their records and compare every byte"
    remake = add_command(commands, "remake", remade, meaning, f"lowalt remake {index} crow-000003-snr013")
    for line in (verify, remake):
        line.add_argument("index", type=_index, help="index.json of the data set")
        line.add_argument("--clouds", type=Path, help="folder of the run's clouds (default: ../clouds)")
        line.add_argument("--occluders", type=Path, help="folder of its surfaces (default: occluders next to clouds)")
    remake.add_argument("sample", nargs="+", metavar="KEY", help="keys of samples")
    meaning = "class probabilities of a tile, of signals or of a recording by a trained model"
    predict = add_command(commands, "predict", predicted, meaning, "lowalt predict default-seen sample.npy")
    predict.add_argument("model", help="model.pt of a training, a .safetensors file, or the name of one in results/zoo")
    predict.add_argument("input", type=Path, help="tile (.png), signals (stations, symbols) complex (.npy), or a "
                         "recording's record (.yaml)")  # fmt: skip
    name_backbone(predict)
    predict.add_argument("--overlay", type=Path, nargs="+", default=[], help="overlays of the run that trained it")


def _checked(lines: list[str], good: str) -> Answer:
    """The faults that were found, one a line, or that all is good."""
    return Answer({"good": not lines, "faults": lines}, "\n".join(lines) or good, int(bool(lines)))


def _index(text: str) -> Path:
    """The index that a command line names; behind a link to it alone, the one whose shards stand next to it."""
    return Path(text).resolve() if Path(text).is_symlink() else Path(text)


def verified(options: argparse.Namespace) -> Answer:
    """Check a data set, and make samples again where it has no fault. Raises: InputError where there is no index."""
    from lowalt.shards.remake import opened, some

    lines = list(faults(options.index))
    if options.remake and not lines:
        remaker = opened(options.index, options.clouds, options.occluders)
        lines = [line for number in some(remaker.shards, options.remake) for line in remaker.faults(number)]
    again = f", {options.remake} samples made again" if options.remake else ""
    count = len(frozen(options.index))
    clouds = f"also of {count} clouds and motion tables" if count else "clouds and motion tables have no checksums here"
    return _checked(lines, f"{options.index}: every byte is as it was written, {clouds}{again}")


def remade(options: argparse.Namespace) -> Answer:
    """Make samples again and compare them. Raises: InputError for a key that the data set lacks."""
    from lowalt.shards.remake import opened, place_of

    remaker = opened(options.index, options.clouds, options.occluders)
    lines = [line for key in options.sample for line in remaker.faults(place_of(remaker.shards, key))]
    return _checked(lines, f"{len(options.sample)} samples made again, equal in every byte")


def predicted(options: argparse.Namespace) -> Answer:
    """Ask a model for the probability of each class; the text names the most probable first.

    A model file that knows how its images were made of signals is asked with that, unless overlays are given.
    Raises: InputError for a file that is no model, tile or signal.
    """
    from lowalt.recognition.one_sample import predict
    from lowalt.recognition.zoo import opened

    if options.input.suffix not in (".png", ".npy", ".yaml"):
        raise InputError(
            f"{options.input}: expected a tile (.png), signals (.npy) or the record of a recording (.yaml)"
        )
    config = overlaid(options.overlay) if options.overlay else {}
    own = options.backbone or (config["recognition"]["network"]["backbone"] if config else "")
    model, settings = opened(options.model, trusted=own)
    if options.input.suffix == ".yaml":
        return _recording(model, settings, options)
    if "radar" in settings and options.input.suffix == ".npy":
        raise InputError(f"{options.input}: {options.model} knows recordings, expected the record of one (.yaml)")
    if config or not settings:
        config = config or overlaid([])
        settings = {key: config[key] for key in ("network", "spectra", "images")}
    shares = predict(model, existing(options.input, "input"), settings)
    lines = [f"{100 * share:6.2f} %  {name}" for name, share in sorted(shares.items(), key=lambda pair: -pair[1])]
    return Answer(shares, "\n".join(lines))


def _recording(model: "Trained", settings: dict, options: argparse.Namespace) -> Answer:
    """The class of every window of a recording, one line each, and how many windows of each class there are."""
    from lowalt.recordings.answers import answers
    from lowalt.recordings.record import read_record

    heard = answers(model, settings, read_record(options.input), str(options.input))
    names = np.array(model.classes)[heard.probabilities.argmax(1)]
    facts = zip(heard.starts_s.tolist(), heard.present.tolist(), heard.clipped.tolist(), heard.beyond_mps.tolist(),
                names, heard.probabilities.tolist(), strict=True)  # fmt: skip
    windows = [
        {"start_s": start, "target": target, "clipped": clipped, "beyond_mps": None if beyond != beyond else beyond,
         "class": str(name), **dict(zip(model.classes, shares, strict=True))}
        for start, target, clipped, beyond, name, shares in facts
    ]  # fmt: skip
    lines = [f"{start:8.2f} s  {heard.words(number, model.classes)}" for number, start in enumerate(heard.starts_s)]
    counts = [f"{category} {int((names[heard.present] == category).sum())}" for category in model.classes]
    last = f"{heard.present.sum()} of {len(names)} windows hold a target: {', '.join(counts)}"
    if not heard.present.any():
        last = f"nothing there: none of {len(names)} windows holds a target that this network could know"
    return Answer(windows, "\n".join([*lines, last]))
