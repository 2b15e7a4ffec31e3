"""Methods that people ask about next to the default's network: fusions, backbones, networks on signals, classical ones.

    python studies/methods/study.py [--data default] [--seeds 0 1 2] [--methods NAME ...]

Trains each in both protocols on a finished run's data set; accuracy.csv and its companions go into results/methods.
"""

import argparse
import json
import time
from functools import partial
from itertools import product
from pathlib import Path

import classical
import fusions  # noqa: F401  registers its fusions
from signal_networks import BACKBONES, SignalRecogniser
from signals import Signals

import trainings
from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.machine.hardware import describe
from lowalt.recognition import predictions
from lowalt.recognition.batches import epoch_order
from lowalt.recognition.protocols import FOLDS, folds
from lowalt.recognition.recogniser import built as plain
from lowalt.recognition.samples import Samples
from lowalt.recognition.schemes import PROTOCOLS, Scheme

OWN = "studies/methods/backbones.py:"
IMAGES = {
    "images attention": ("attention", ""), "images mean": ("mean", ""), "images voting": ("voting", ""),
    "images concatenation": ("concatenation", ""),
    "audio-spectrogram transformer": ("attention", f"{OWN}ast_micro"),
    "transformer behind convolutions": ("attention", f"{OWN}dc_former_micro"),
}  # fmt: skip
"""Fusion and backbone of each method on images."""
SIGNALS = {"signal CNN": "cnn", "signal transformer": "transformer", "complex-valued CNN": "complex"}
FEATURES = {"RBF-SVM on features": "svm", "gradient boosting on features": "boosting", "XGBoost on features": "xgboost"}
LEVELS = 3
"""SNRs of each motion model that a classical method trains on, drawn by the training seed."""


def scheme_of(name: str, symbols: int) -> Scheme:
    """Return the scheme of a method on three stations; without spectra its size is the symbols of a signal."""
    if name in IMAGES:
        fusion, backbone = IMAGES[name]
        return Scheme(name, (0, 1, 2), (0, 1, 2), fusion, backbone)
    return Scheme(name, (0, 1, 2), (), "attention", (SIGNALS | FEATURES)[name], size=symbols)


def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int):
    """Return a method's network with fresh weights."""
    if scheme.backbone in BACKBONES:
        return SignalRecogniser(scheme, block, size, classes)
    return plain(scheme, block, size, colours, classes)


def source(data: Path, size: int, scheme: Scheme, pairs: set, part: str) -> Samples:
    """Return the samples of a part: images of `size` pixels, or signals."""
    return (trainings.images_of if scheme.spectra else Signals)(data, scheme, pairs, size)


def classified(job: trainings.Job, config: dict, data: Path, out: Path) -> Path:
    """Train and evaluate a classical method, unless that is done, and return its prediction file."""
    path = out / f"predictions/{job.name}.csv"
    if path.with_suffix(".json").is_file():
        return path
    size = config["recognition"]["size"]
    kept = [source(data, size, job.scheme, folds(job.protocol, part), part) for part in trainings.PARTS]
    settings = trainings.settings_of(config, data, job.scheme, job.seed)
    numbers = epoch_order(kept[0].facts, job.seed, (job.protocol, job.scheme.name), 0, LEVELS)
    busy = time.process_time()
    pairs = [(found.features(), found.facts.label) for found in kept]
    train = tuple(values[numbers] for values in pairs[0])
    answer = classical.fit(job.scheme.backbone, train, pairs[1], job.seed)
    busy = time.process_time() - busy
    asked = source(
        data, size, job.scheme, set().union(*FOLDS[job.protocol].values()) - folds(job.protocol, "train"), ""
    )
    classes = settings["classes"]
    found = predictions.from_facts(asked.facts, job.scheme.stations, answer(asked.features()).astype(float))
    predictions.write(path, found, tuple(classes))
    with replacing(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps({
            "protocol": job.protocol, "scheme": job.scheme.name, "seed": job.seed, "hardware": describe(), "ranks": 1,
            "backbone": job.scheme.backbone, "weights": "none", "train_processor_s": busy, "classes": classes,
            "train_samples": len(numbers), "precision": "fp64",
        }, indent=1, sort_keys=True) + "\n")  # fmt: skip
    return path


def one(job: trainings.Job, config: dict, data: Path, out: Path) -> Path:
    """Train and evaluate one method; return its prediction file."""
    if job.scheme.name in FEATURES:
        return classified(job, config, data, out)
    of = partial(source, data, config["recognition"]["size"])
    return trainings.trained(job, config, data, out, of, built)


def main(arguments: list[str]) -> None:
    """Train all methods and write the tables."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    names = [*IMAGES, *SIGNALS, *FEATURES]
    line.add_argument("--data", default="default", help="finished run whose data set is trained on (default: default)")
    line.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)")
    line.add_argument("--methods", nargs="+", choices=names, default=names, metavar="NAME", help="default: all")
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    given = line.parse_args(arguments)
    config, out = trainings.config_of(Path(__file__).with_name("config.yaml")), Path("results/methods")
    schemes = [scheme_of(name, config["network"]["symbols"]) for name in given.methods]
    jobs = [trainings.Job(*job) for job in product(schemes, PROTOCOLS, given.seeds)]
    call = partial(one, config=config, data=Path("results") / given.data, out=out)
    trainings.write_tables(trainings.side_by_side(call, jobs, given.workers), out, config["seed"])
    print(f"{out / 'accuracy.csv'}: written, {len(jobs)} trainings")


if __name__ == "__main__":
    run(main)
