"""The commands `lowalt verify`, `lowalt remake` and `lowalt predict`: check a data set, remake samples, ask a model."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.commands.for_programs import acts, as_json
from lowalt.config.command import name_backbone
from lowalt.config.layers import overlaid
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.shards.verify import faults, frozen

if TYPE_CHECKING:
    from lowalt.recognition.runs import Trained


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the three commands to a parser's."""
    verify = commands.add_parser(
        "verify",
        help="check every byte of a data set",
        epilog="example: lowalt verify results/default/shards/index.json",
    )
    verify.add_argument("index", type=_index, help="index.json of the data set")
    verify.add_argument("--remake", type=int, default=0, metavar="N", help="also make N random samples again")
    remake = commands.add_parser(
        "remake", help="make stored samples again from their records and compare every byte",
        epilog="example: lowalt remake results/default/shards/index.json crow-000003-snr013",
    )  # fmt: skip
    remake.add_argument("index", type=_index, help="index.json of the data set")
    remake.add_argument("sample", nargs="+", metavar="KEY", help="keys of samples")
    for line, act in ((verify, verified), (remake, remade)):
        acts(line, act)
        line.add_argument("--clouds", type=Path, help="folder of the run's clouds (default: ../clouds)")
        line.add_argument("--occluders", type=Path, help="folder of its surfaces (default: occluders next to clouds)")
    predict = commands.add_parser(
        "predict", help="class probabilities of a tile, of signals or of a recording by a trained model",
        epilog="example: lowalt predict default-seen sample.npy",
    )  # fmt: skip
    predict.add_argument("model", help="model.pt of a training, a .safetensors file, or the name of one in results/zoo")
    predict.add_argument(
        "input",
        type=Path,
        help="tile (.png), signals (stations, symbols) complex (.npy), or a recording's record (.yaml)",
    )
    name_backbone(predict)
    predict.add_argument("--overlay", type=Path, nargs="+", default=[], help="overlays of the run that trained it")
    acts(predict, predicted)


def _ended(lines: list[str], good: str, machine: bool) -> str:
    """The text to print, or JSON with the faults; a fault ends the command with status 1."""
    text = as_json({"good": not lines, "faults": lines}) if machine else "\n".join(lines) or good
    if lines:
        print(text)
        raise SystemExit(1)
    return text


def _index(text: str) -> Path:
    """The index that a command line names; behind a link to it alone, the one whose shards stand next to it."""
    return Path(text).resolve() if Path(text).is_symlink() else Path(text)


def verified(given: argparse.Namespace) -> str:
    """Check a data set and return one line; print every fault and end with status 1 where there is one.

    Raises: InputError where there is no index.
    """
    from lowalt.shards.remake import opened, some

    lines = list(faults(given.index))
    if given.remake and not lines:
        remaker = opened(given.index, given.clouds, given.occluders)
        lines = [line for number in some(remaker.shards, given.remake) for line in remaker.faults(number)]
    again = f", {given.remake} samples made again" if given.remake else ""
    more = frozen(given.index)
    clouds = (
        f"also of {len(more)} clouds and motion tables" if more else "clouds and motion tables have no checksums here"
    )
    return _ended(lines, f"{given.index}: every byte is as it was written, {clouds}{again}", given.json)


def remade(given: argparse.Namespace) -> str:
    """Make samples again and return one line; print what differs and end with status 1 where anything does.

    Raises: InputError for a key that the data set lacks.
    """
    from lowalt.shards.remake import number_of, opened

    remaker = opened(given.index, given.clouds, given.occluders)
    lines = [line for key in given.sample for line in remaker.faults(number_of(remaker.shards, key))]
    return _ended(lines, f"{len(given.sample)} samples made again, equal in every byte", given.json)


def predicted(given: argparse.Namespace) -> str:
    """Return the probability of each class, the most probable first.

    A model file that knows how its images were made of signals is asked with that, unless overlays are given.
    Raises: InputError for a file that is no model, tile or signal.
    """
    from lowalt.recognition.one_sample import predict
    from lowalt.recognition.zoo import opened

    if given.input.suffix not in (".png", ".npy", ".yaml"):
        raise InputError(f"{given.input}: expected a tile (.png), signals (.npy) or the record of a recording (.yaml)")
    config = overlaid(given.overlay) if given.overlay else {}
    own = given.backbone or (config["recognition"]["network"]["backbone"] if config else "")
    model, settings = opened(given.model, trusted=own)
    if given.input.suffix == ".yaml":
        return _recording(model, settings, given)
    if "radar" in settings and given.input.suffix == ".npy":
        raise InputError(f"{given.input}: {given.model} knows recordings, expected the record of one (.yaml)")
    if config or not settings:
        config = config or overlaid([])
        settings = {key: config[key] for key in ("network", "spectra", "images")}
    found = predict(model, existing(given.input, "input"), settings)
    if given.json:
        return as_json(found)
    return "\n".join(f"{100 * value:6.2f} %  {name}" for name, value in sorted(found.items(), key=lambda p: -p[1]))


def _recording(model: "Trained", settings: dict, given: argparse.Namespace) -> str:
    """The class of every window of a recording, one line each, and how many windows of each class there are."""
    from lowalt.recordings.answers import answers
    from lowalt.recordings.record import read_record

    found = answers(model, settings, read_record(given.input), str(given.input))
    names = np.array(model.classes)[found.probabilities.argmax(1)]
    rows = list(zip(found.starts_s.tolist(), found.present.tolist(), names, found.probabilities.tolist(), strict=True))
    if given.json:
        return as_json([
            {"start_s": start, "target": target, "class": str(name), **dict(zip(model.classes, shares, strict=True))}
            for start, target, name, shares in rows
        ])  # fmt: skip
    lines = [
        f"{start:8.2f} s  " + (f"{100 * max(shares):6.2f} %  {name}" if target else "no target")
        for start, target, name, shares in rows
    ]
    counts = [f"{category} {int((names[found.present] == category).sum())}" for category in model.classes]
    return "\n".join([*lines, f"{found.present.sum()} of {len(names)} windows hold a target: {', '.join(counts)}"])
