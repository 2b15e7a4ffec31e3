"""One choice of the paper at a time: `python studies/open-choices/study.py [--rows NAME ...] [--fresh]`.

Each row of `choices.yaml` makes the data of its change, trains the small network three times on the subtypes that the
unseen protocol trains on, and is judged by the twenty others. Clean signals are kept by what decides them, so a row
repeats only the stages that it changes, and an interrupted run goes on where it stopped.
Writes results/choices.csv (a row a choice) and results/subtypes.csv (a row a choice and held-out subtype).
"""

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from local_choices import CELLS, changed_cloud, changed_row, continuous, local_effects, sample_of, signals_by_cell

import trainings
from lowalt.config.classes import label
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.config.splits import fold
from lowalt.echo.chunk import clean_signals
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.noise.noisy_signals import noisy_signals
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, runs, samples
from lowalt.recognition.intervals import Interval, model_shares, strict_difference
from lowalt.recognition.protocols import evaluated_folds, folds
from lowalt.recognition.samples import Facts, ViewSamples
from lowalt.recognition.schemes import TABLE, Scheme, named
from lowalt.scene.chain import scene_signals
from lowalt.scene.effects import called
from lowalt.scene.observe import Scene
from lowalt.scene.set_noise import in_all_cells
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import sample_key
from lowalt.targets.cloud import Cloud
from lowalt.tiles.resample import resize

HERE, OUT = Path(__file__).parent, Path("results/open-choices")
SCHEME = "ABC:VRP+TRP+VT"


def key_of(*what) -> str:
    """Return a file name that stands for all that decides its content."""
    return hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()[:16]


CLOUDS: dict[str, Mapping[str, Cloud]] = {}


def dataset_of(config: dict) -> Dataset:
    """Return the data set of a configuration; rows of equal targets share their clouds."""
    key = key_of(config["targets"], config["seed"])
    dataset = Dataset(config, CLOUDS.get(key))
    CLOUDS[key] = dataset.clouds
    return dataset


def motion_rows(dataset: Dataset, local: dict) -> list[dict]:
    """Return the motion table of all subtypes, subtype by subtype, under the local choices."""
    plan, found = dataset.plan, []
    for group, names in plan.groups.items():
        for name in names:
            rows = [dataset.row(Place(group, name, model, plan.snrs[0])) for model in range(plan.models)]
            found += [changed_row(row, dataset.clouds[name], local) for row in rows]
    return found


def clean(dataset: Dataset, local: dict, rows: list[dict]) -> dict[str, np.ndarray]:
    """Return clean signals (stations, models, N) or, with noise in all range cells, (stations, models, snrs, N), by
    the choice of the range cell; "" is the strongest of each symbol. rows: motion table."""
    maker, config = dataset.maker, dataset.config
    stations = [station.name for station in maker.network.stations]
    asked = tuple(called(config["effects"]))
    snrs = list(dataset.plan.snrs) if in_all_cells(config["effects"]) else None
    parts: dict[str, list] = {}
    if not config["effects"] and not set(local) & {"cell", "amplitude"} and local.get("rotors") != "rates":
        clouds = {name: changed_cloud(cloud, local) for name, cloud in dataset.clouds.items()}
        return {"": clean_signals(maker.network, stations, clouds, rows, None)}
    for row in rows:
        name = row["subtype"]
        cloud = changed_cloud(dataset.clouds[name], local)
        more = local_effects(local, dataset.published[name], config["seed"])
        scene = Scene(maker.network, config["seed"], config["echo"]["tolerance"], (*asked, *more))
        if local.get("cell") == "smooth":
            heard = {"smooth": [continuous(maker.network, maker.network.station(station), cloud, row)
                                for station in stations]}  # fmt: skip
        elif "cell" in local:
            every = [signals_by_cell(sample_of(scene, station, cloud, row)) for station in stations]
            heard = {cell: [one[cell] for one in every] for cell in CELLS}
        else:
            heard = {"": [scene_signals(scene, station, {name: cloud}, [row], None, snrs)[0][0]
                          for station in stations]}  # fmt: skip
        for cell, signals in heard.items():
            parts.setdefault(cell, []).append(np.array(signals, np.complex64))
    return {cell: np.stack(signals, axis=1) for cell, signals in parts.items()}


def kept_clean(config: dict, local: dict) -> np.ndarray:
    """Return the clean signals of a row, from its file where they were made before."""
    # All choices of the cell are made at once.
    decides = {**local, "cell": "any"} if local.get("cell") in CELLS else local
    blocks = {name: config[name] for name in ("seed", "network", "targets", "motion", "echo", "effects")}
    noise = config["noise"] if in_all_cells(config["effects"]) else None
    path = OUT / f"signals/{key_of(blocks, noise, decides)}.npz"
    if not path.is_file():
        dataset = dataset_of(config)
        made = clean(dataset, local, motion_rows(dataset, local))
        with replacing(path) as temporary:
            np.savez(temporary, **{cell or "strongest": signals for cell, signals in made.items()})
    with np.load(path) as kept:
        return kept[local.get("cell", "strongest")]


def write_views(config: dict, local: dict, path: Path) -> None:
    """Write the cache of views of all samples of a row."""
    signals, dataset = kept_clean(config, local), dataset_of(config)
    plan, maker, size = dataset.plan, dataset.maker, config["recognition"]["size"]
    rows, snrs = motion_rows(dataset, local), list(plan.snrs)
    stations = [station.name for station in maker.network.stations]
    columns = list(range(len(stations) * len(config["spectra"])))
    views = np.empty((len(rows) * len(snrs), len(columns), size, size), np.uint8)
    for number, row in enumerate(rows):
        noisy = noisy_signals(signals[:, number : number + 1], [row], stations, snrs, plan.seed)[0]
        for level, signal in enumerate(noisy):
            views[number * len(snrs) + level] = resize(maker.renderer.some(signal, columns), size)
    pairs = [(row, snr) for row in rows for snr in snrs]
    nowhere = np.full((len(pairs), len(stations)), np.nan)
    facts = Facts(
        np.array([sample_key(row["subtype"], row["model"], snr) for row, snr in pairs]),
        np.array([row["subtype"] for row, _ in pairs]),
        np.array([row["model"] for row, _ in pairs]),
        np.array([snr for _, snr in pairs], float),
        np.array([row["group"] for row, _ in pairs]),
        np.array([fold(plan.split, plan.seed, row["subtype"], row["model"], snr) for row, snr in pairs]),
        np.array([label(dataset.classes, row) for row, _ in pairs], np.int64),
        nowhere, nowhere,
    )  # fmt: skip
    samples.write(path, views, facts, list(config["spectra"]))


def trained(config: dict, views: Path, scheme: Scheme, folder: Path) -> list[Path]:
    """Train and evaluate a row from every training seed, unless that is done; return its prediction files."""
    found = []
    for seed in config["recognition"]["seeds"]:
        path = folder / f"{seed}/predictions.csv"
        found.append(path)
        if path.with_suffix(".json").is_file():
            continue
        of = partial(ViewSamples, [views], scheme.columns)
        parts = {part: of(folds("unseen", part)) for part in trainings.PARTS}
        block = {key: config["recognition"][key] for key in ("size", "network", "training", "augmentation")}
        classes = list(predictions.CATEGORIES)
        settings = {**block, "seed": seed, "colour_map": config["images"]["colour_map"], "classes": classes}
        runs.train(parts, scheme, "unseen", scheme.settled(settings), folder / str(seed))
        model = runs.load(folder / f"{seed}/model.pt")
        runs.evaluate(model, of(evaluated_folds("unseen")), config["recognition"]["evaluation"], path)
    return found


def judged(config: dict, local: dict) -> list[Path]:
    """Return the prediction files of a row, one a training seed; whatever is there is not made again."""
    scheme = named(TABLE, SCHEME, list(config["network"]["stations"]))
    decides = {name: value for name, value in config.items() if name not in ("run", "report", "cost", "tiles")}
    folder = OUT / key_of(decides, local)
    views = folder / "views.npz"
    if not views.is_file():
        write_views(config, local, views)
    return trained(config, views, scheme, folder)


class Held:
    """Answers to samples of held-out subtypes, a row a training seed and a column a motion model."""

    def __init__(self, facts: Facts | predictions.Predictions, correct: list[np.ndarray]) -> None:
        """facts: of the samples; correct: (samples,) bool, of each training seed."""
        motion = np.char.add(np.char.add(facts.subtype, "/"), facts.model.astype(str))
        first, self.count, self.shares = model_shares(motion, correct)
        self.subtype = facts.subtype[first]

    def difference(self, other: "Held | None", name: str, seed: int, *keys: str) -> Interval:
        """Return the share of right answers less that of others to the same samples, None for nothing, with its 95 %
        interval over training seeds, motion models and, where no subtype is named, subtypes."""
        mine = np.full(len(self.subtype), True) if not name else self.subtype == name
        second = np.zeros((1, mine.sum())) if other is None else other.shares[:, mine]
        facts = self.count[mine], self.subtype[mine], not name
        return strict_difference(self.shares[:, mine], second, *facts, stream(seed, "open-choices", *keys, name))

    def worst(self, count: int = 3) -> str:
        """Return the subtypes that are right least often, with their percentages."""
        shares = {name: self.share(name) for name in np.unique(self.subtype)}
        return "; ".join(f"{name} {100 * shares[name]:.0f}" for name in sorted(shares, key=shares.__getitem__)[:count])

    def share(self, name: str) -> float:
        """Return the share of a subtype's samples that are right."""
        mine = self.subtype == name
        return float(np.average(self.shares[:, mine].mean(0), weights=self.count[mine]))


def percents(values: Iterable[float]) -> list[str]:
    """Return shares as percentages."""
    return [f"{100 * value:.1f}" for value in values]


NAMED = {"unseen": "", "eh216s": "EH 216 S", "sparrow": "Sparrow", "type_b": "Type-B Firefighting UAV",
         "toucan": "Ramphastidae (toucan)"}  # fmt: skip
"""Columns of the table and the subtypes whose samples they count, "" for all held-out ones."""
COLUMNS = (
    "choice", "section", "seen_percent", *(f"{name}_{column}" for name in NAMED
    for column in ("percent", "low", "high", "difference", "difference_low", "difference_high")),
    "worst", "core_s", "hardware", "physics",
)  # fmt: skip


def write_tables(table: dict, paths: dict[str, list[Path]], out: Path) -> None:
    """Write the tables of all rows that are trained."""
    seed, rows, each, base = table["base"]["seed"], [], [], None
    for choice, files in paths.items():
        every = [predictions.read(path) for path in files]
        held = [one.of(folds("unseen", "test")) for one in every]
        found = Held(held[0], [one.correct for one in held])
        base, told = base or found, [json.loads(path.with_suffix(".json").read_text()) for path in files]
        cells = []
        for name in NAMED.values():
            cells += percents(found.difference(None, name, seed, choice))
            cells += percents(found.difference(base, name, seed, choice))
        seen = np.mean([one.of(folds("unseen", "seen_test")).correct.mean() for one in every])
        took, block = sum(part["train_processor_s"] for part in told), table["rows"][choice]
        rows.append([choice, block["section"], *percents([seen]), *cells, found.worst(), f"{took:.0f}",
                     told[0]["hardware"], block["physics"]])  # fmt: skip
        said, of = (np.concatenate([getattr(one, key) for one in held]) for key in ("guesses", "subtype"))
        for name in np.unique(of):
            shares = np.bincount(said[of == name], minlength=len(predictions.CATEGORIES)) / np.sum(of == name)
            each.append([choice, name, *percents([found.share(name), *shares])])
    decides = [COLUMNS.index(f"{name}_difference") for name in ("eh216s", "sparrow", "unseen")]
    rows.sort(key=lambda row: -sum(float(row[place]) for place in decides))
    write_csv(out / f"{table['name']}.csv", COLUMNS, rows)
    write_csv(out / f"{table['name']}-subtypes.csv", ("choice", "subtype", "right", *predictions.CATEGORIES), each)


def main(arguments: list[str]) -> None:
    """Run every row that is not there yet, and write the tables after each."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--table", type=Path, default=HERE / "choices.yaml", help="table of rows (.yaml)")
    line.add_argument("--out", type=Path, default=HERE / "results", help="folder of the tables")
    given = line.parse_args(arguments)
    table = load_yaml(given.table)
    paths: dict[str, list[Path]] = {}
    for name, block in table["rows"].items():
        config = merge(merge(trainings.config_of(), table["base"]), block.get("overlay", {}))
        began = time.monotonic()
        paths[name] = judged(config, block.get("local", {}))
        write_tables(table, paths, given.out)
        print(f"{name}: {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    run(main)
