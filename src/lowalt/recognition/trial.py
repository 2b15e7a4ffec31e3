"""One trial of a candidate: train it without some subtypes, predict those and the validation samples of the others."""

import copy
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.recognition import choose, runs
from lowalt.recognition.extra import opened, with_extra
from lowalt.recognition.samples import ViewSamples, joined_sources
from lowalt.recognition.schemes import TABLE, Scheme, named, refuse_cues
from lowalt.recognition.sources import of_size

BLOCKS = ("size", "network", "training", "augmentation", "evaluation")
"""Keys of the block `recognition` that a candidate may change."""


def part_of(samples: ViewSamples, numbers: np.ndarray) -> ViewSamples:
    """Return the samples `numbers` of a source as a source of its own."""
    found = copy.copy(samples)
    found.keep(numbers)
    return found


def trial(
    choices: choose.Choices,
    candidate: str,
    fold: int,
    settings: dict,
    scheme: Scheme,
    views: list,
    extra: list,
    out: Path,
) -> None:
    """Train a candidate in one fold and write `predictions.csv` and its record into the folder `out`.

    settings: {seed, colour_map, classes} and BLOCKS, as the configuration has them; views, extra: cache files of the
    candidate's size, the latter of other runs whose samples are trained on too; held-out subtypes are left out of them.
    Raises: InputError for an unknown candidate or fold, and as a training does.
    """
    seed, colour_map, classes, *_ = pick(settings, "seed", "colour_map", "classes", *BLOCKS)
    name = choices.named(candidate)
    block = choose.settled({key: settings[key] for key in BLOCKS}, choices.changes(name))
    source = ViewSamples(views, scheme.columns, choose.PAIRS)
    of_size(source, scheme, block["size"])
    parts = {part: part_of(source, rows) for part, rows in choose.parts(source.facts, fold, choices.folds).items()}
    held = sorted(set(parts["held"].facts.subtype.tolist()))
    for more in opened(extra, None, scheme, choose.PAIRS):
        more.keep(np.flatnonzero(~np.isin(more.facts.subtype, held)))
        parts["train"] = with_extra(parts["train"], more)
    evaluation = block.pop("evaluation")
    given = {"train": parts["train"], "validation": parts["validation"]}
    block |= {"seed": seed, "colour_map": colour_map, "classes": classes}
    runs.train(given, scheme, f"without fold {fold}", block, out)
    asked = joined_sources(parts["held"], parts["validation"])
    about = {"candidate": name, "fold": fold, "held": held}
    trained = runs.load(out / "model.pt", scheme.backbone_of(block["network"]))
    runs.evaluate(trained, asked, evaluation, out / "predictions.csv", more=about)


def main(arguments: list[str]) -> None:
    """Try one candidate. Settings: seed, colour_map, classes, size, network, training, augmentation, evaluation."""
    line = parser("lowalt.recognition.trial", main.__doc__)
    line.add_argument(
        "--views", nargs="+", required=True, help="caches of views (.npz): group seen, folds train and val"
    )
    line.add_argument("--extra", nargs="+", default=[], help="caches of views of other runs that are trained on too")
    line.add_argument("--candidates", default=choose.TABLE, help=f"table of candidates (default: {choose.TABLE})")
    line.add_argument("--candidate", required=True, help="name or slug of a candidate")
    line.add_argument("--fold", type=int, required=True, help="number of the fold held out, from 0")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--stations", nargs="+", required=True, help="names of the network's stations, in its order")
    line.add_argument("--out", required=True, help="folder for predictions.csv, its record and the model")
    given = line.parse_args(arguments)
    table = choose.read(given.candidates)
    scheme = named(given.schemes, table.scheme, given.stations)
    refuse_cues(scheme, "choices")
    trial(table, given.candidate, given.fold, given.settings, scheme, given.views, given.extra, Path(given.out))


if __name__ == "__main__":
    run(main)
