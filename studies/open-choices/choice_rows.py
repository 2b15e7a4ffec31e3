"""Samples and trainings of a row of `choices.yaml`: each stage is kept by what decides it, and not repeated."""

import hashlib
import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from local_choices import CELLS, changed_cloud, changed_row, continuous, local_effects, sample_of, signals_by_cell

import trainings
from lowalt.config.classes import label
from lowalt.config.splits import fold
from lowalt.echo.chunk import clean_signals
from lowalt.files.atomic import replacing
from lowalt.machine.hardware import describe
from lowalt.noise.awgn import noisy_signals
from lowalt.recognition import predictions, runs, samples
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


def key_of(*what) -> str:
    """Return a file name that stands for all that decides its content."""
    return hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()[:16]


SVM = "svm"
"""In place of a training seed: a support vector machine instead of the network."""
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


def clean(dataset: Dataset, local: dict, rows: list[dict], stations: list[str]) -> dict[str, np.ndarray]:
    """Return clean signals (stations, models, N) or, with noise in all range cells, (stations, models, snrs, N), by
    the choice of the range cell; "" is the strongest of each symbol. rows: motion table; stations: their names."""
    maker, config = dataset.maker, dataset.config
    asked = tuple(called(config["effects"]))
    snrs = list(dataset.plan.snrs) if in_all_cells(config["effects"]) else None
    parts: dict[str, list] = {}
    if not config["effects"] and not set(local) & {"cell", "amplitude"} and local.get("rotors") != "rates":
        clouds = {name: changed_cloud(cloud, local, dataset.published[name]) for name, cloud in dataset.clouds.items()}
        return {"": clean_signals(maker.network, stations, clouds, rows, None)}
    for row in rows:
        name = row["subtype"]
        cloud = changed_cloud(dataset.clouds[name], local, dataset.published[name])
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


def kept_clean(config: dict, local: dict, stations: list[str]) -> np.ndarray:
    """Return the clean signals of a row, from its file where they were made before."""
    # All choices of the cell are made at once.
    decides = {**local, "cell": "any"} if local.get("cell") in CELLS else local
    blocks = {name: config[name] for name in ("seed", "network", "targets", "motion", "echo", "effects")}
    noise = config["noise"] if in_all_cells(config["effects"]) else None
    path = OUT / f"signals/{key_of(blocks, noise, decides, stations)}.npz"
    if not path.is_file():
        dataset = dataset_of(config)
        made = clean(dataset, local, motion_rows(dataset, local), stations)
        with replacing(path) as temporary:
            np.savez(temporary, **{cell or "strongest": signals for cell, signals in made.items()})
    with np.load(path) as kept:
        return kept[local.get("cell", "strongest")]


def write_views(config: dict, local: dict, stations: list[str], path: Path) -> None:
    """Write the cache of views of all samples of a row; stations: the first of the network's, by name."""
    signals, dataset = kept_clean(config, local, stations), dataset_of(config)
    plan, maker, size = dataset.plan, dataset.maker, config["recognition"]["size"]
    rows, snrs = motion_rows(dataset, local), list(plan.snrs)
    columns = list(range(len(stations) * len(config["spectra"])))
    views = np.empty((len(rows) * len(snrs), len(columns), size, size), np.uint8)
    every = np.zeros((len(maker.network.stations), maker.network.symbols), np.complex64)
    for number, row in enumerate(rows):
        noisy = noisy_signals(signals[:, number : number + 1], [row], stations, snrs, plan.seed)[0]
        for level, signal in enumerate(noisy):
            every[: len(stations)] = signal
            views[number * len(snrs) + level] = resize(maker.renderer.some(every, columns), size)
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


def trained(config: dict, views: Path, scheme: Scheme, seed: int, path: Path) -> None:
    """Train and evaluate a row from one training seed, and write its prediction file."""
    of = partial(ViewSamples, [views], scheme.columns)
    parts = {part: of(folds("unseen", part)) for part in trainings.PARTS}
    block = {key: config["recognition"][key] for key in ("size", "network", "training", "augmentation")}
    classes = list(predictions.CATEGORIES)
    settings = {**block, "seed": seed, "colour_map": config["images"]["colour_map"], "classes": classes}
    runs.train(parts, scheme, "unseen", scheme.settled(settings), path.parent)
    model = runs.load(path.with_name("model.safetensors"))
    runs.evaluate(model, of(evaluated_folds("unseen")), config["recognition"]["evaluation"], path)


def classified(views: Path, scheme: Scheme, path: Path) -> None:
    """Train a support vector machine on the pixels of a row's images, and write its prediction file.

    It takes a second where the network takes ten, and no seed. Source: Cortes and Vapnik, Support-vector networks,
    1995.
    """
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    of, began = partial(ViewSamples, [views], scheme.columns), time.process_time()
    known, asked = of(folds("unseen", "train")), of(evaluated_folds("unseen"))
    model = make_pipeline(StandardScaler(), SVC()).fit(known.images.reshape(len(known.facts), -1), known.facts.label)
    said = model.predict(asked.images.reshape(len(asked.facts), -1))
    table = predictions.from_facts(asked.facts, scheme.stations, np.eye(len(predictions.CATEGORIES))[said])
    predictions.write(path, table, predictions.CATEGORIES, "unseen")
    told = {"train_processor_s": time.process_time() - began, "hardware": describe()}
    with replacing(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(told))


def judged(config: dict, local: dict, scheme: str, seed: int | str | None, make: bool = True) -> Path | None:
    """Return the prediction file of a row's training from one seed; whatever is there is not made again.

    scheme: name of one whose stations are the first of the network's; seed: None makes the row's views alone; make:
    whether to make what is not there, or to return None.
    """
    names = list(config["network"]["stations"])
    what = named(TABLE, scheme, names)
    stations = [names[number] for number in what.stations]
    shown = {name: value for name, value in config.items() if name not in ("run", "report", "cost", "recognition")}
    views = OUT / f"views/{key_of(shown, local, config['recognition']['size'], stations)}.npz"
    seen = {name: config["recognition"][name] for name in ("size", "network", "training", "augmentation", "evaluation")}
    path = OUT / f"trained/{key_of(views.stem, what.record, seen)}/{seed}/predictions.csv"
    if not path.with_suffix(".json").is_file():
        if not make:
            return None
        if not views.is_file():
            write_views(config, local, stations, views)
        if seed is None:
            return None
        if seed == SVM:
            classified(views, what, path)
        else:
            trained(config, views, what, seed, path)
    return path
