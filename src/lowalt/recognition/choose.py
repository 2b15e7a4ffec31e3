"""Choosing a recipe for unseen subtypes without looking at one: subtypes of the trained group are held out.

A fold of this protocol takes some subtypes of each category out of the group that the unseen protocol trains on,
trains on the others and is tested on those taken out. Only the folds "train" and "val" of that group are used: neither
a subtype nor a motion model that any table tests on is opened. Every subtype of the group is held out in one fold.

A candidate (of `config/choices/default.yaml`) is a name and what it changes in the block `recognition`. Its trials
write predictions of both parts (`lowalt.recognition.trial`), from which two tables are made:
    choices.csv            candidate; what it took (folds, seeds, steps, batch, pixels, core_s a training);
                           held_percent: subtypes held out; kept_percent: validation motion models of the trained
                           ones; and the difference of held_percent to the first candidate with its 95 % interval
    choices_subtypes.csv   candidate, category, subtype, held_percent, kept_percent
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.common.classes import stated
from lowalt.common.command import parser, pick, run
from lowalt.common.config import merge
from lowalt.common.csv_tables import write_csv
from lowalt.common.errors import InputError
from lowalt.common.files import slug
from lowalt.common.streams import stream
from lowalt.common.yaml_files import load_yaml
from lowalt.recognition import predictions
from lowalt.recognition.intervals import model_shares, strict_difference
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Facts
from lowalt.recognition.statistics import accuracy_by

TABLE = "config/choices/default.yaml"
PAIRS = folds("unseen", "train") | folds("unseen", "validation")
"""The only (group, fold) pairs from which choosing reads samples."""
COLUMNS = (
    "candidate", "folds", "seeds", "steps", "batch", "pixels", "core_s", "held_percent", "kept_percent",
    "difference_points", "low", "high", "hardware",
)  # fmt: skip


@dataclass(frozen=True)
class Choices:
    """Candidates by name, each what it changes in the block `recognition`; number of folds; name of the scheme.

    A candidate's key `extra`, as the block's, names other runs whose samples are trained on too.
    """

    candidates: dict[str, dict]
    folds: int
    scheme: str

    def named(self, name: str) -> str:
        """Return the candidate called `name`, or with that file name.

        Raises: InputError naming the candidates there are.
        """
        for candidate in self.candidates:
            if name in (candidate, slug(candidate)):
                return candidate
        raise InputError(f"choices: no candidate {name!r}, expected one of {list(self.candidates)}")

    def changes(self, name: str) -> dict:
        """Return what a candidate, by name or file name, changes in the settings of the block."""
        return {key: value for key, value in self.candidates[self.named(name)].items() if key != "extra"}

    def extra(self, name: str) -> list[str]:
        """Return the names of the runs whose samples a candidate trains on too."""
        return self.candidates[self.named(name)].get("extra", [])


def read(path: str | Path) -> Choices:
    """Return the table of candidates.

    Raises: InputError naming the file and the key that is missing or unknown.
    """
    content = load_yaml(path)
    if set(content) != {"folds", "scheme", "candidates"} or not content["candidates"]:
        raise InputError(f"{path}: keys {sorted(content)}, expected candidates, folds, scheme")
    return Choices(content["candidates"], content["folds"], content["scheme"])


def settled(block: dict, changes: dict) -> dict:
    """Return a block of settings with a candidate's changes in it.

    Raises: InputError naming a key that the block does not have.
    """

    def check(known: dict, given: dict, where: str) -> None:
        """Refuse a key of `given`, at any depth, that `known` does not have."""
        for key, value in given.items():
            if key not in known:
                raise InputError(f"choices: {where}{key} is no key of the block, expected one of {sorted(known)}")
            if isinstance(value, dict):
                check(known[key], value, f"{where}{key}.")

    check(block, changes, "")
    return merge(block, changes)


def held_out(facts: Facts, fold: int, count: int) -> list[str]:
    """Return the subtypes that the fold `fold` of `count` holds out: of each category every count-th by name.

    Raises: InputError where a category has too few subtypes for that many folds, or there is no such fold.
    """
    chosen = []
    for label in np.unique(facts.label):
        names = np.unique(facts.subtype[facts.label == label]).tolist()
        if not 2 <= count <= len(names) or not 0 <= fold < count:
            raise InputError(f"choices: fold {fold} of {count}, expected 2 to {len(names)} folds, counted from 0")
        chosen += names[fold::count]
    return chosen


def parts(facts: Facts, fold: int, count: int) -> dict[str, np.ndarray]:
    """Return the numbers of the samples that train, that validate on trained subtypes, and of held-out subtypes.

    Raises: InputError where the facts hold samples of another group or of a test fold.
    """
    found = set(zip(facts.group.tolist(), facts.fold.tolist(), strict=True))
    if found - PAIRS:
        raise InputError(f"choices: samples of {sorted(found - PAIRS)}, expected {sorted(PAIRS)} alone")
    held = np.isin(facts.subtype, held_out(facts, fold, count))
    return {
        "train": np.flatnonzero(~held & (facts.fold == "train")),
        "validation": np.flatnonzero(~held & (facts.fold == "val")),
        "held": np.flatnonzero(held),
    }


class CandidateTrial:
    """Predictions of one candidate, fold and seed, and the JSON record that goes with them."""

    def __init__(self, path: str | Path) -> None:
        """path: the prediction file of `choose`, with its record under the same name (.json).

        Raises: InputError where one is missing or no such file.
        """
        self.about = predictions.record(path)
        lacking = {"candidate", "fold", "seed", "held", "train_processor_s"} - set(self.about)
        if lacking:
            raise InputError(f"{path}: its record lacks {sorted(lacking)}")
        found = predictions.read(path, stated(self.about))
        rows = np.argsort(found.key, kind="stable")
        held = np.isin(found.subtype, self.about["held"])[rows]
        self.held, self.kept = found.take(rows[held]), found.take(rows[~held])


def _held(trials: list[CandidateTrial], seeds: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Motion models of all folds: their names, subtypes, numbers of samples, and shares correct (seeds, models)."""
    by_seed = []
    for seed in seeds:
        mine = sorted((trial for trial in trials if trial.about["seed"] == seed), key=lambda trial: trial.about["fold"])
        motion, subtypes, correct = (
            np.concatenate([getattr(trial.held, name) for trial in mine]) for name in ("motion", "subtype", "correct")
        )
        first, count, shares = model_shares(motion, [correct])
        by_seed.append((motion[first], subtypes[first], count, shares[0]))
    names, subtypes, count, _ = by_seed[0]
    return names, subtypes, count, np.array([entry[-1] for entry in by_seed])


def tables(trials: list[CandidateTrial], seed: int) -> tuple[list[list], list[list]]:
    """Return the rows of choices.csv and of choices_subtypes.csv; candidates in the order of their first trial.

    Raises: InputError where a candidate lacks a fold or seed that the first one has.
    """
    groups: dict[str, list[CandidateTrial]] = {}
    for trial in trials:
        groups.setdefault(trial.about["candidate"], []).append(trial)
    wanted = {(trial.about["fold"], trial.about["seed"]) for trial in next(iter(groups.values()))}
    seeds = sorted({number for _, number in wanted})
    base, rows, each = None, [], []
    for name, mine in groups.items():
        if {(trial.about["fold"], trial.about["seed"]) for trial in mine} != wanted or len(mine) != len(wanted):
            raise InputError(f"choices: {name!r} has other folds and seeds than the first candidate, {sorted(wanted)}")
        models, subtypes, count, shares = _held(mine, seeds)
        base = base or (models, shares)
        if not np.array_equal(models, base[0]):
            raise InputError(f"choices: {name!r} was tried on other motion models than the first candidate")
        interval = strict_difference(shares, base[1], count, subtypes, True, stream(seed, "choices", name))
        kept = np.concatenate([trial.kept.correct for trial in mine])
        about = mine[0].about
        took = np.mean([trial.about["train_processor_s"] for trial in mine])
        held = np.average(shares.mean(0), weights=count)
        rows.append([
            name, len({fold for fold, _ in wanted}), len(seeds), about["steps"], about["batch"], about["size"],
            f"{took:.1f}", *(f"{100 * value:.2f}" for value in (held, kept.mean(), *interval)), about["hardware"],
        ])  # fmt: skip
        each += _subtypes(name, mine)
    return rows, each


def _subtypes(name: str, trials: list[CandidateTrial]) -> list[list]:
    """Rows of one candidate: accuracy of each subtype where it was held out and where it was trained on."""
    by_part = []
    for part in ("held", "kept"):
        found = [getattr(trial, part) for trial in trials]
        by_part.append(accuracy_by(*(np.concatenate([getattr(p, n) for p in found]) for n in ("subtype", "correct"))))
    classes = stated(trials[0].about)
    labels = {s: int(label) for t in trials for s, label in zip(t.held.subtype.tolist(), t.held.label, strict=True)}
    return [
        [name, classes[label], subtype, *(f"{100 * table[subtype][0]:.2f}" for table in by_part)]
        for subtype, label in sorted(labels.items(), key=lambda item: (item[1], item[0]))
    ]


def write(trials: list[CandidateTrial], folder: str | Path, seed: int) -> None:
    """Write choices.csv and choices_subtypes.csv; seed: of the intervals. Raises: as `tables`."""
    rows, each = tables(trials, seed)
    write_csv(Path(folder) / "choices.csv", COLUMNS, rows)
    names = ("candidate", "category", "subtype", "held_percent", "kept_percent")
    write_csv(Path(folder) / "choices_subtypes.csv", names, each)


def main(arguments: list[str]) -> None:
    """Write choices.csv and choices_subtypes.csv from the trials of all candidates. Settings: seed."""
    line = parser("lowalt.recognition.choose", main.__doc__)
    line.add_argument("--predictions", nargs="+", required=True, help="prediction files of trials, the base's first")
    line.add_argument("--out", required=True, help="folder for the tables")
    given = line.parse_args(arguments)
    (seed,) = pick(given.settings, "seed")
    write([CandidateTrial(path) for path in given.predictions], given.out, seed)


if __name__ == "__main__":
    run(main)
