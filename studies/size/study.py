"""Is the paper's number of samples worth its cost? Trainings on parts of its 1.44 million samples.

    python studies/size/study.py --out studies/size/results/size.csv

Reads the data set of `config/paper.yaml`: the caches of views that `--files` lists and `config.yaml` makes. A training
takes the first motion models of each trained subtype, so a smaller part is contained in each larger one. All trainings
are validated and tested on the same samples: the first TEST_CHUNKS chunks of the folds that no training reads. Finished
trainings are kept in results/size.
"""

import argparse
import json
import os
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

import trainings
from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, runs
from lowalt.recognition.intervals import Interval, model_shares, strict_difference
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.schemes import TABLE, named

HERE = Path(__file__).parent
DATA = trainings.ROOT / "results/paper"
TEST_CHUNKS = 12
"""Chunks of 50 motion models per subtype whose validation and test folds are read."""
SCHEMES = "ABC:VRP+TRP+VT", "A:VRP+TRP+VT"
SNRS_DB = None, 3.0
"""Rows of the table: all SNRs together, and the lowest."""
COLUMNS = (
    "scheme", "models", "steps", "samples_seen", "seeds", "part", "snr_db", "percent", "low", "high", "difference",
    "difference_low", "difference_high", "worst", "core_s", "hardware",
)  # fmt: skip


class Trial(NamedTuple):
    """A training: scheme, motion models of each subtype, steps and training seed."""

    scheme: str
    models: int
    steps: int
    seed: int

    @property
    def path(self) -> Path:
        """Prediction file of the training."""
        return (
            trainings.ROOT
            / f"results/size/{self.scheme.partition(':')[0]}-{self.models}-{self.steps}/{self.seed}/predictions.csv"
        )


def trials() -> list[Trial]:
    """Return all trainings: equal steps on four sizes, one pass over the largest, as many steps on the smallest."""
    equal = [Trial(scheme, models, 1000, seed) for seed, models, scheme
             in product((0, 1, 2), (100, 400, 1600, 6000), SCHEMES)]  # fmt: skip
    return [*equal, *(Trial(scheme, 6000, 18000, 0) for scheme in SCHEMES), Trial(SCHEMES[1], 100, 18000, 0)]


def chunks_of(models: int) -> int:
    """Return how many chunks of the data set hold the first motion models of each subtype."""
    return -(-models // load_yaml(trainings.ROOT / "config/paper.yaml")["motion"]["models_per_chunk"])


def files_of(config: dict, group: str, fold: str, chunks: int) -> list[Path]:
    """Return the caches of views of the first chunks of a group's fold."""
    folder = DATA / f"views/{config['recognition']['size']}"
    return [folder / f"{group}-{fold}-{part:05d}.npz" for part in range(chunks)]


def samples_of(config: dict, part: str, columns: list[int], chunks: int) -> ViewSamples:
    """Return the samples of a part of the unseen protocol, of the first chunks of its folds.

    Of the held-out subtypes the test fold alone is read.
    """
    pairs = {(group, fold) for group, fold in folds("unseen", part) if group == "seen" or fold == "test"}
    paths = [path for group, fold in sorted(pairs) for path in files_of(config, group, fold, chunks)]
    return ViewSamples(paths, columns, pairs)


def answered(trial: Trial, config: dict) -> Path:
    """Train and test, unless that is done, and return the prediction file."""
    if trial.path.with_suffix(".json").is_file():
        return trial.path
    scheme = named(TABLE, trial.scheme, list(config["network"]["stations"]))
    settings = trainings.settings_of(config, DATA, scheme, trial.seed)
    settings["training"] = settings["training"] | {"steps": trial.steps, "validate_every": trial.steps // 4}
    read = partial(samples_of, config, columns=scheme.columns)
    samples = {"train": read("train", chunks=chunks_of(trial.models)),
               "validation": read("validation", chunks=TEST_CHUNKS)}  # fmt: skip
    runs.train(samples, scheme, "unseen", settings, trial.path.parent)
    model = runs.load(trial.path.parent / "model.safetensors")
    asked = ViewSamples(
        [path for group in ("seen", "unseen") for path in files_of(config, group, "test", TEST_CHUNKS)],
        scheme.columns, {("seen", "test"), ("unseen", "test")},
    )  # fmt: skip
    runs.evaluate(model, asked, config["recognition"]["evaluation"], trial.path)
    return trial.path


class Judged(NamedTuple):
    """Right answers of several trainings to the same samples: share of each motion model (seeds, models), its number
    of samples and its subtype (models,)."""

    shares: np.ndarray
    count: np.ndarray
    subtype: np.ndarray

    @classmethod
    def of(cls, paths: list[Path], part: str, snr_db: float | None) -> "Judged":
        """Judge the answers of prediction files to a part of the unseen protocol at one SNR, None for all."""
        found = [predictions.read(path).of(folds("unseen", part)) for path in paths]
        rows = slice(None) if snr_db is None else found[0].snr_db == snr_db
        first, count, shares = model_shares(found[0].motion[rows], [one.correct[rows] for one in found])
        return cls(shares, count, found[0].subtype[rows][first])

    def less(self, other: "Judged | None", whole: bool, *keys: str) -> Interval:
        """Return the share less that of another (None: nothing) with its interval; whole: resample subtypes."""
        shares = np.zeros((1, len(self.count))) if other is None else other.shares
        return strict_difference(self.shares, shares, self.count, self.subtype, whole, stream(1, "size", *keys))

    def worst(self) -> str:
        """Return the three subtypes with the smallest shares, with their percentages."""
        share = {name: np.average(self.shares.mean(0)[self.subtype == name], weights=self.count[self.subtype == name])
                 for name in np.unique(self.subtype).tolist()}  # fmt: skip
        return "; ".join(f"{name} {100 * share[name]:.0f}" for name in sorted(share, key=share.__getitem__)[:3])


def rows_of(finished: list[Trial]) -> list[list]:
    """Return the rows of the table; differences are to the smallest size with 1000 steps of the same scheme."""
    rows = []
    for scheme, part, snr_db in product(SCHEMES, ("seen_test", "test"), SNRS_DB):
        base = None
        for models, steps in dict.fromkeys((one.models, one.steps) for one in finished if one.scheme == scheme):
            paths = [one.path for one in finished if one[:3] == (scheme, models, steps)]
            told = [json.loads(path.with_suffix(".json").read_text()) for path in paths]
            judged = Judged.of(paths, part, snr_db)
            base = judged if base is None else base
            keys, whole = (scheme, part, str(snr_db), str(models), str(steps)), part == "test"
            share = np.clip(judged.less(None, whole, *keys), 0, 1)
            gain = (0, 0, 0) if judged is base else judged.less(base, whole, *keys)
            numbers = [100 * value for value in (*share, *gain)]
            took = np.mean([one["train_processor_s"] for one in told])
            rows.append([scheme, models, steps, told[0]["samples_seen"], len(paths), part,
                         "all" if snr_db is None else f"{snr_db:g}", *(f"{number:.2f}" for number in numbers),
                         judged.worst(), f"{took:.1f}", told[0]["hardware"]])  # fmt: skip
    return rows


def main(arguments: list[str]) -> None:
    """Train what is not there yet and write the table of what is finished."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--files", action="store_true", help="list the caches of views that the trainings read, and end")
    line.add_argument("--finished", action="store_true", help="the table of what is finished, without a training")
    line.add_argument("--workers", type=int, default=os.cpu_count(), help="trainings side by side (default: the cores)")
    line.add_argument("--out", type=Path, default=HERE / "results/size.csv", help="table to write (.csv)")
    given = line.parse_args(arguments)
    config = trainings.config_of()
    if given.files:
        most = chunks_of(max(one.models for one in trials()))
        asked = (("seen", "train", most), *((*pair, TEST_CHUNKS) for pair in
                 (("seen", "val"), ("seen", "test"), ("unseen", "test"))))  # fmt: skip
        print(*(path.relative_to(trainings.ROOT) for ask in asked for path in files_of(config, *ask)), sep="\n")
        return
    if not given.finished:
        trainings.side_by_side(partial(answered, config=config), trials(), given.workers)
    write_csv(given.out, COLUMNS, rows_of([one for one in trials() if one.path.with_suffix(".json").is_file()]))


if __name__ == "__main__":
    run(main)
