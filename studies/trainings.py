"""Trainings of a study: finished ones are kept, several run side by side, and their tables are those of a run."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from lowalt.config.layers import load
from lowalt.recognition import runs, tables
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.protocols import evaluated_folds, folds
from lowalt.recognition.recogniser import built
from lowalt.recognition.samples import Samples, ViewSamples
from lowalt.recognition.schemes import Scheme
from lowalt.shards import ShardSet

ROOT = Path(__file__).parents[1]
PARTS = ("train", "validation")


class Job(NamedTuple):
    """One training: a scheme, a protocol and a training seed."""

    scheme: Scheme
    protocol: str
    seed: int

    @property
    def name(self) -> str:
        """Folder of its files."""
        return f"{self.protocol}/{self.scheme.slug}/{self.seed}"


def config_of(*overlays: str | Path) -> dict:
    """Return the default configuration with overlays laid on it."""
    return load([ROOT / "config/default.yaml", *overlays], ROOT / "workflow/schemas/config.schema.yaml")


def settings_of(config: dict, data: Path, scheme: Scheme, seed: int) -> dict:
    """Return what `runs.train` asks of a configuration; data: folder of the run whose data set is trained on."""
    kept = {key: config["recognition"][key] for key in ("size", "network", "training", "augmentation")}
    classes = ShardSet(data / "shards/index.json", check=False).classes
    return scheme.settled(
        {**kept, "seed": seed, "colour_map": config["images"]["colour_map"], "classes": list(classes)}
    )


def images_of(data: Path, scheme: Scheme, pairs: set, size: int) -> ViewSamples:
    """Return the images of a run's (group, fold) pairs as a scheme sees them, from its caches of views."""
    paths = [path for path in (data / f"views/{size}").glob("*.npz") if tuple(path.stem.split("-")[:2]) in pairs]
    return ViewSamples(paths, scheme.columns, pairs)


def trained(
    job: Job,
    config: dict,
    data: Path,
    out: Path,
    source: Callable[[Scheme, set, str], Samples],
    build: runs.Build = built,
) -> Path:
    """Train and evaluate one job, unless that is done, and return its prediction file.

    data: folder of the run whose data set it is; out: folder of the study's results; source: gives the samples of
    (group, fold) pairs to a part, "train", "validation" or "asked"; build: makes the network.
    """
    path, folder = out / f"predictions/{job.name}.csv", out / f"models/{job.name}"
    if not path.with_suffix(".json").is_file():
        samples = {part: source(job.scheme, folds(job.protocol, part), part) for part in PARTS}
        settings = settings_of(config, data, job.scheme, job.seed)
        runs.train(samples, job.scheme, job.protocol, settings, folder, build=build)
        pairs = evaluated_folds(job.protocol)
        model = runs.load(folder / "model.safetensors", build=build)
        runs.evaluate(model, source(job.scheme, pairs, "asked"), config["recognition"]["evaluation"], path)
    return path


def side_by_side(call: Callable, jobs: Iterable, workers: int | None = None) -> list:
    """Return what a call gives for each job, in processes of their own; workers: how many, all cores by default."""
    with ProcessPoolExecutor(workers or os.cpu_count(), get_context("spawn")) as pool:
        return list(pool.map(call, jobs))


def write_tables(paths: list[Path], out: Path, seed: int) -> None:
    """Write accuracy.csv and its companions of prediction files into a folder."""
    found = [Evaluated(path) for path in paths]
    tables.write(found, list(dict.fromkeys(one.scheme for one in found)), {}, out, seed)
