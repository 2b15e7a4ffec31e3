"""Recipes compared without a look at test data: subtypes are held out of those that the unseen protocol trains on.

    python studies/choices/study.py [--candidates studies/choices/candidates.yaml] [--data default] --out TABLE.csv

A fold takes some subtypes of each category out of the group that the unseen protocol trains on, trains on the others
and is judged by those taken out, and by the validation motion models of the others. Only the folds "train" and "val" of
that group are read. A candidate is a name and what it changes in the block `recognition`; also
    extra    other finished runs whose samples are trained on too, without the subtypes held out
    stream   trains on fresh motion models alone (`fresh.py`): so many distinct ones, 0 for no end of them
TABLE.csv: candidate; what it took (folds, seeds, steps, batch, pixels, core_s a training); held_percent: subtypes held
out; kept_percent: validation motion models of the trained ones; the difference of held_percent to the first candidate
with its 95 % interval. TABLE_subtypes.csv: the same percentages by subtype.
"""

import argparse
import copy
import json
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from fresh import Fresh

import trainings
from lowalt.config.classes import stated
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.atomic import slug
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, runs
from lowalt.recognition.dataset_samples import opened
from lowalt.recognition.intervals import model_shares, strict_difference
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Facts, ViewSamples, joined_sources
from lowalt.recognition.schemes import TABLE, named
from lowalt.recognition.statistics import accuracy_by

PAIRS = folds("unseen", "train") | folds("unseen", "validation")
"""The only (group, fold) pairs from which choosing reads samples."""
COLUMNS = (
    "candidate", "folds", "seeds", "steps", "batch", "pixels", "core_s", "held_percent", "kept_percent",
    "difference_points", "low", "high", "hardware",
)  # fmt: skip
HERE = Path(__file__).parent


def held_out(facts: Facts, fold: int, count: int) -> list[str]:
    """Return the subtypes that the fold `fold` of `count` holds out: of each category every count-th by name.

    Raises: InputError where a category has too few subtypes for that many folds.
    """
    chosen = []
    for label in np.unique(facts.label):
        names = np.unique(facts.subtype[facts.label == label]).tolist()
        if not 2 <= count <= len(names):
            raise InputError(f"choices: {count} folds, expected 2 to {len(names)}")
        chosen += names[fold::count]
    return chosen


def part_of(samples: ViewSamples, rows: np.ndarray) -> ViewSamples:
    """Return the samples of some rows (a mask) as a source of its own."""
    found = copy.copy(samples)
    found.keep(np.flatnonzero(rows))
    return found


def trial(job: tuple[str, int, int], table: dict, config: dict, data: Path, out: Path) -> Path:
    """Train a candidate in one fold from one seed, unless that is done; return its predictions of both parts.

    job: candidate, fold and seed; table: the content of the file of candidates; data: folder of a finished run.
    """
    name, fold, seed = job
    folder = out / slug(name) / f"{fold}-{seed}"
    path = folder / "predictions.csv"
    if path.with_suffix(".json").is_file():
        return path
    changes = dict(table["candidates"][name])
    extra, models = changes.pop("extra", []), changes.pop("stream", None)
    config = merge(config, {"recognition": changes})
    scheme = named(TABLE, table["scheme"], list(config["network"]["stations"]))
    settings = trainings.settings_of(config, data, scheme, seed)
    whole = trainings.images_of(data, scheme, PAIRS, settings["size"])
    out_of = held_out(whole.facts, fold, table["folds"])
    held, train = np.isin(whole.facts.subtype, out_of), whole.facts.fold == "train"
    samples = {"train": part_of(whole, ~held & train), "validation": part_of(whole, ~held & ~train)}
    for other in extra:
        more = trainings.images_of(Path("results") / other, scheme, PAIRS, settings["size"])
        more = part_of(more, ~np.isin(more.facts.subtype, out_of))
        more.facts = replace(more.facts, model=more.facts.model + 1 + samples["train"].facts.model.max())
        samples["train"] = joined_sources(samples["train"], more)
    if models is not None:
        count = settings["training"]["steps"] * settings["training"]["batch"]
        dataset = opened(data / "config.yaml")
        samples["train"] = Fresh(dataset, scheme.columns, settings["size"], count, models, out_of)
    runs.train(samples, scheme, f"without fold {fold}", settings, folder)
    asked = joined_sources(part_of(whole, held), samples["validation"])
    about = {"candidate": name, "fold": fold, "held": out_of}
    runs.evaluate(runs.load(folder / "model.safetensors"), asked, config["recognition"]["evaluation"], path, more=about)
    return path


def rows_of(name: str, paths: list[Path], base: list, seed: int) -> tuple[list, list[list]]:
    """Return a candidate's row of the table and its rows of subtypes.

    paths: its predictions, fold by fold and seed by seed; base: motion models and shares of the first candidate, which
    fills the empty list; seed: of the interval.
    """
    abouts = [json.loads(path.with_suffix(".json").read_text()) for path in paths]
    classes = stated(abouts[0])
    found = [predictions.read(path, classes) for path in paths]
    parts = [np.isin(one.subtype, about["held"]) for one, about in zip(found, abouts, strict=True)]
    held = [one.take(part) for one, part in zip(found, parts, strict=True)]
    kept = [one.take(~part) for one, part in zip(found, parts, strict=True)]
    by_seed = []
    for number in sorted({about["seed"] for about in abouts}):
        mine = [one for one, about in zip(held, abouts, strict=True) if about["seed"] == number]
        motion, subtypes, correct = (
            np.concatenate([getattr(one, key) for one in mine]) for key in ("motion", "subtype", "correct")
        )
        first, count, (shares,) = model_shares(motion, [correct])
        by_seed.append((motion[first], subtypes[first], count, shares))
    models, subtypes, count, _ = by_seed[0]
    shares = np.array([one[-1] for one in by_seed])
    base[:] = base or [models, shares]
    if not np.array_equal(models, base[0]):
        raise InputError(f"choices: {name!r} was tried on other motion models than the first candidate")
    interval = strict_difference(shares, base[1], count, subtypes, True, stream(seed, "choices", name))
    about, took = abouts[0], np.mean([one["train_processor_s"] for one in abouts])
    percents = (np.average(shares.mean(0), weights=count), np.concatenate([one.correct for one in kept]).mean())
    row = [
        name, len({one["fold"] for one in abouts}), len(by_seed), about["steps"], about["batch"], about["size"],
        f"{took:.1f}", *(f"{100 * value:.2f}" for value in (*percents, *interval)), about["hardware"],
    ]  # fmt: skip
    tables = [accuracy_by(*(np.concatenate([getattr(one, key) for one in part]) for key in ("subtype", "correct")))
              for part in (held, kept)]  # fmt: skip
    labels = sorted({(int(label), name) for one in held for label, name in zip(one.label, one.subtype, strict=True)})
    each = [[name, classes[label], subtype, *(f"{100 * table[subtype][0]:.2f}" for table in tables)]
            for label, subtype in labels]  # fmt: skip
    return row, each


def main(arguments: list[str]) -> None:
    """Try every candidate and write the tables; finished trials are kept in results/choices."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--candidates", type=Path, default=HERE / "candidates.yaml", help="table of candidates (.yaml)")
    line.add_argument("--data", default="default", help="finished run whose data set it is (default: default)")
    line.add_argument("--seeds", type=int, nargs="+", default=[0], help="training seeds (default: 0)")
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    table, config = load_yaml(given.candidates), trainings.config_of()
    jobs = list(product(table["candidates"], range(table["folds"]), given.seeds))
    folder = Path("results/choices") / given.candidates.stem
    call = partial(trial, table=table, config=config, data=Path("results") / given.data, out=folder)
    paths = dict(zip(jobs, trainings.side_by_side(call, jobs, given.workers), strict=True))
    base: list = []
    found = [rows_of(name, [path for job, path in paths.items() if job[0] == name], base, config["seed"])
             for name in table["candidates"]]  # fmt: skip
    write_csv(given.out, COLUMNS, [row for row, _ in found])
    names = ("candidate", "category", "subtype", "held_percent", "kept_percent")
    write_csv(given.out.with_name(f"{given.out.stem}_subtypes.csv"), names, [row for _, each in found for row in each])


if __name__ == "__main__":
    run(main)
