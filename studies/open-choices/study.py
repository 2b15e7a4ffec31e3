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
from functools import partial
from pathlib import Path

import numpy as np
from local_choices import CELLS, changed_cloud, changed_row, local_effects, sample_of, signals_by_cell

import trainings
from lowalt.config.classes import label
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.config.splits import fold
from lowalt.files.atomic import replacing, slug
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.echo.chunk import clean_signals
from lowalt.noise.noisy_signals import noisy_signals
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, runs, samples
from lowalt.recognition.intervals import bootstrap, model_shares, strict_difference
from lowalt.recognition.protocols import evaluated_folds, folds
from lowalt.recognition.samples import Facts, ViewSamples
from lowalt.recognition.schemes import TABLE, Scheme, named
from lowalt.scene.chain import scene_signals
from lowalt.scene.effects import called
from lowalt.scene.observe import Scene
from lowalt.scene.set_noise import in_all_cells
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import sample_key
from lowalt.tiles.resample import resize

HERE, OUT = Path(__file__).parent, Path("results/open-choices")
SCHEME = "ABC:VRP+TRP+VT"


def key_of(*what) -> str:
    """Return a file name that stands for all that decides its content."""
    return hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()[:16]


def motion_rows(dataset: Dataset, local: dict) -> list[dict]:
    """Return the motion table of all subtypes, subtype by subtype, under the local choices."""
    plan, found = dataset.plan, []
    for group, names in plan.groups.items():
        for name in names:
            rows = [dataset.row(Place(group, name, model, plan.snrs[0])) for model in range(plan.models)]
            found += [changed_row(row, dataset.clouds[name], local) for row in rows]
    return found


def clean(dataset: Dataset, local: dict) -> dict[str, np.ndarray]:
    """Return clean signals (stations, models, N) or, with noise in all range cells, (stations, models, snrs, N), by
    the choice of the range cell; "" is the strongest of each symbol."""
    maker, config = dataset.maker, dataset.config
    stations = [station.name for station in maker.network.stations]
    asked = tuple(called(config["effects"]))
    snrs = list(dataset.plan.snrs) if in_all_cells(config["effects"]) else None
    parts: dict[str, list] = {}
    if not config["effects"] and not set(local) & {"cell", "amplitude"} and local.get("rotors") != "rates":
        clouds = {name: changed_cloud(cloud, local) for name, cloud in dataset.clouds.items()}
        return {"": clean_signals(maker.network, stations, clouds, motion_rows(dataset, local), None)}
    for row in motion_rows(dataset, local):
        name = row["subtype"]
        cloud = changed_cloud(dataset.clouds[name], local)
        more = local_effects(local, dataset.published[name], config["seed"])
        scene = Scene(maker.network, config["seed"], config["echo"]["tolerance"], (*asked, *more))
        if "cell" in local:
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
    decides = {**local, "cell": "any"} if "cell" in local else local
    blocks = {name: config[name] for name in ("seed", "network", "targets", "motion", "echo", "effects")}
    noise = config["noise"] if in_all_cells(config["effects"]) else None
    path = OUT / f"signals/{key_of(blocks, noise, decides)}.npz"
    if not path.is_file():
        made = clean(Dataset(config), local)
        with replacing(path) as temporary:
            np.savez(temporary, **{cell or "strongest": signals for cell, signals in made.items()})
    with np.load(path) as kept:
        return kept[local.get("cell", "strongest")]


def write_views(config: dict, local: dict, path: Path) -> None:
    """Write the cache of views of all samples of a row."""
    signals, dataset = kept_clean(config, local), Dataset(config)
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


class Judged:
    """The answers of a row's networks on the held-out subtypes, a row a training seed and a column a motion model."""

    def __init__(self, paths: list[Path]) -> None:
        """paths: prediction files, one a training seed."""
        every = [predictions.read(path) for path in paths]
        held = [one.of(folds("unseen", "test")) for one in every]
        first, self.count, self.shares = model_shares(held[0].motion, [one.correct for one in held])
        self.subtype = held[0].subtype[first]
        self.seen = float(np.mean([one.of(folds("unseen", "seen_test")).correct.mean() for one in every]))
        said = np.concatenate([one.guesses for one in held])
        of = np.concatenate([one.subtype for one in held])
        self.said = {name: np.bincount(said[of == name], minlength=4) / (of == name).sum() for name in np.unique(of)}

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Shares (seeds, models) and counts (models,) of one subtype."""
        mine = self.subtype == name
        return self.shares[:, mine], self.count[mine]


COLUMNS = (
    "choice", "section", "seen_percent", *(f"{name}{column}" for name in ("unseen", "eh216s", "sparrow", "type_b", "toucan")
    for column in ("_percent", "_difference", "_low", "_high")), "worst", "core_s", "hardware", "physics",
)  # fmt: skip
NAMED = ("EH 216 S", "Sparrow", "Type-B Firefighting UAV", "Ramphastidae (toucan)")


def figures(found: Judged, base: Judged, name: str, choice: str, seed: int) -> list[str]:
    """Percentage of a subtype's samples that are right, "" for all, and its difference to the base (points) with the
    95 % interval, which resamples training seeds and motion models and, for all, subtypes."""
    (shares, count), (before, _) = ((found.shares, found.count), (base.shares, 0)) if not name else (found.of(name), base.of(name))
    subtypes = base.subtype if not name else np.full(len(count), name)
    told = strict_difference(shares, before, count, subtypes, not name, stream(seed, "open-choices", choice, name))
    return [f"{100 * value:.1f}" for value in (np.average(shares.mean(0), weights=count), *told)]


def write_tables(table: dict, paths: dict[str, list[Path]], out: Path) -> None:
    """Write the tables of all rows that are trained."""
    found = {name: Judged(files) for name, files in paths.items()}
    base, seed, rows, each = found["base"], table["base"]["seed"], [], []
    for choice, one in found.items():
        told = [json.loads(path.with_suffix(".json").read_text()) for path in paths[choice]]
        right = {name: np.average(one.of(name)[0].mean(0), weights=one.of(name)[1]) for name in np.unique(one.subtype)}
        worst = sorted(right, key=right.__getitem__)[:3]
        block = table["rows"][choice]
        rows.append([
            choice, block["section"], f"{100 * one.seen:.1f}",
            *(value for name in ("", *NAMED) for value in figures(one, base, name, choice, seed)),
            "; ".join(f"{name} {100 * right[name]:.0f}" for name in worst),
            f"{sum(part['train_processor_s'] for part in told):.0f}", told[0]["hardware"], block["physics"],
        ])  # fmt: skip
        each += [[choice, name, f"{100 * right[name]:.1f}", *(f"{100 * share:.1f}" for share in one.said[name])]
                 for name in right]  # fmt: skip
    unseen, eh, sparrow = (COLUMNS.index(f"{name}_difference") for name in ("unseen", "eh216s", "sparrow"))
    rows.sort(key=lambda row: -(float(row[eh]) + float(row[sparrow]) + float(row[unseen])))
    write_csv(out / "choices.csv", COLUMNS, rows)
    write_csv(out / "subtypes.csv", ("choice", "subtype", "right", "UAV", "Bird", "Vehicle", "Pedestrian"), each)


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
