"""What ImageNet's weights bring a network that is trained whole: `python
studies/open-choices/fine_tuned.py`.

EfficientNet-Lite0 from ImageNet's weights and from random ones, with the proposed fusion and
equally many steps, on samples as those of the row `base` of `choices.yaml`, trained on the subtypes
of the unseen protocol. One training tells of seen and of unseen subtypes. Meant for a GPU
(`--workers` trainings share it). Writes results/fine-tuned.csv.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from choice_rows import HERE, OUT, key_of, trained
from choice_tables import NAMED, Held, percents
from imagenet_weights import BACKBONE, write_weights
from pretrained import Run, samples_of

import trainings
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import predictions
from lowalt.recognition.protocols import folds
from lowalt.recognition.schemes import TABLE, named

SNRS = [8, float("inf")]
RUNS = [
    Run(pixels, stations, 40, SNRS, ()) for pixels in (64, 128, 224) for stations in ("A", "ABC")
]
SEEDS = 0, 1, 2
WEIGHTS = "ImageNet", "random"
TRAINING = {
    "steps": 600,
    "batch": 16,
    "rate": 1e-3,
    "backbone_rate": 0.3,
    "validate_every": 150,
    "workers": 1,
}
"""As the default's otherwise."""


def views_of(one: Run) -> None:
    """Make the samples of a run."""
    samples_of(one, load_yaml(HERE / "choices.yaml")["base"])


def answered(job: tuple[Run, str, int]) -> Path:
    """Train a network of a run from weights and a seed, unless that is done, and return its
    prediction file.
    """
    one, words, seed = job
    # Trainings share the GPU: each finds its lock in a folder of its own.
    tempfile.tempdir = tempfile.mkdtemp()
    _, name, config = samples_of(one, load_yaml(HERE / "choices.yaml")["base"])
    weights = str((OUT / f"{BACKBONE}.pth").absolute()) if words == "ImageNet" else "none"
    block = {"network": {"backbone": BACKBONE, "weights": weights}, "training": TRAINING}
    config = merge(config, {"recognition": block})
    path = OUT / f"fine-tuned/{key_of(name, words, TRAINING)}/{seed}/predictions.csv"
    if not path.with_suffix(".json").is_file():
        scheme = named(TABLE, f"{one.stations}:VRP+TRP+VT", list(config["network"]["stations"]))
        trained(config, OUT / f"views/pretrained-{name}.npz", scheme, seed, path)
    return path


def rows() -> Iterator[list]:
    """Give a row for each run and kind of weights whose trainings are there."""
    for one, words in product(RUNS, WEIGHTS):
        name = samples_name(one)
        paths = [
            OUT / f"fine-tuned/{key_of(name, words, TRAINING)}/{seed}/predictions.csv"
            for seed in SEEDS
        ]
        found = [predictions.read(path) for path in paths if path.with_suffix(".json").is_file()]
        if not found:
            continue
        told = [
            json.loads(path.with_suffix(".json").read_text())
            for path in paths
            if path.with_suffix(".json").is_file()
        ]
        held = [one_seed.of(folds("unseen", "test")) for one_seed in found]
        judged = Held(held[0], [each.correct for each in held])
        seen = np.mean(
            [one_seed.of(folds("unseen", "seen_test")).correct.mean() for one_seed in found]
        )
        each = percents(judged.share(subtype) for subtype in list(NAMED.values())[1:])
        whole = percents(judged.difference(None, "", 20261201, words, name))
        about = one.pixels, one.models, len(one.snr_db), one.stations, words, len(found)
        yield [*about, *percents([seen]), *whole, *each, judged.worst(), told[0]["hardware"]]


def samples_name(one: Run) -> str:
    """Return the name of what decides a run's samples."""
    seed = load_yaml(HERE / "choices.yaml")["base"]["seed"]
    return key_of(seed, one.models, one.snr_db, one.pixels, one.stations)


def main(arguments: list[str]) -> None:
    """Train what is not there yet, and write the table."""
    line = argparse.ArgumentParser("fine_tuned.py", description=__doc__.splitlines()[0])
    line.add_argument(
        "--out", type=Path, default=HERE / "results/fine-tuned.csv", help="table to write (.csv)"
    )
    line.add_argument("--workers", type=int, default=os.cpu_count(), help="trainings side by side")
    line.add_argument(
        "--pixels", type=int, nargs="+", help="images of these sizes alone (default: 64, 128, 224)"
    )
    line.add_argument("--stations", nargs="+", help="of these stations alone (default: A, ABC)")
    line.add_argument(
        "--finished", action="store_true", help="the table of what is finished, without a training"
    )
    given = line.parse_args(arguments)
    if not given.finished:
        asked = [one for one in RUNS if one.pixels in (given.pixels or [one.pixels])]
        asked = [one for one in asked if one.stations in (given.stations or [one.stations])]
        write_weights(OUT / f"{BACKBONE}.pth")
        trainings.side_by_side(views_of, asked, given.workers)
        jobs = [
            (one, words, seed) for seed in SEEDS for one in reversed(asked) for words in WEIGHTS
        ]
        trainings.side_by_side(answered, jobs, given.workers)
    columns = (
        "pixels",
        "models",
        "snrs",
        "stations",
        "weights",
        "seeds",
        "seen_percent",
        "percent",
        "low",
        "high",
    )
    write_csv(given.out, (*columns, *list(NAMED)[1:], "worst", "hardware"), rows())


if __name__ == "__main__":
    run(main)
