"""What ImageNet's weights bring: `python studies/open-choices/pretrained.py [--weights FILE.pth]`.

EfficientNet-Lite0 as a frozen backbone, with ImageNet's weights and with random ones, and a linear
classifier on the features of all images, on samples as those of the row `base` of `choices.yaml`.
Both protocols share one extraction. Writes results/pretrained.csv.
"""

import argparse
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from choice_rows import HERE, OUT, key_of, write_views
from choice_tables import NAMED, Held, percents
from imagenet_weights import BACKBONE, write_weights
from sklearn.linear_model import LogisticRegression
from sklearn.preprocessing import StandardScaler

import trainings
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.hardware import describe
from lowalt.recognition.protocols import folds
from lowalt.recognition.recogniser import Palettes, backbone
from lowalt.recognition.samples import Facts, ViewSamples
from lowalt.recognition.schemes import TABLE, named
from lowalt.tiles import colour_map


class Run(NamedTuple):
    """Samples: pixels a side, stations, motion models of each subtype, SNRs (dB); and seeds of
    random weights.
    """

    pixels: int
    stations: str
    models: int
    snr_db: list[float]
    random: tuple[int, ...]


NOISELESS = [float("inf")]
RUNS = (
    Run(224, "A", 30, NOISELESS, ()),
    Run(64, "A", 30, NOISELESS, (0,)),
    Run(64, "ABC", 40, [8, *NOISELESS], (0,)),
)
STRENGTHS = (1e-4, 1e-3, 1e-2)
"""Inverse strengths of the classifier's penalty, of which validation chooses."""


def features(images: np.ndarray, weights: str, seed: int, colours: str) -> np.ndarray:
    """Return the features (samples, views, 1280) float32 of index images (samples, views, S, S),
    frozen.

    weights: a file, or "none" for random ones of a seed; colours: name of the colour map.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    model = backbone(BACKBONE, weights, images.shape[-1]).eval()
    pre = model.pretrained_cfg
    palettes = Palettes(np.stack([colour_map(colours)]), (0,), pre["mean"], pre["std"])
    found = []
    with torch.inference_mode():
        for start in range(0, len(images), 32):
            batch = torch.from_numpy(images[start : start + 32])
            coloured = palettes(batch.flatten(0, 1)[:, None, None]).flatten(0, 2)
            found.append(
                model(coloured.contiguous(memory_format=torch.channels_last)).view(
                    *batch.shape[:2], -1
                )
            )
    return torch.cat(found).numpy()


def answers(told: np.ndarray, facts: Facts, protocol: str) -> np.ndarray:
    """Return the label (samples,) that a linear classifier gives each sample; told: features
    (samples, F).

    Weights of the least penalty are combinations of the samples that train, so it is trained on
    these alone: on as many coordinates as there are of them.
    """
    pairs = np.array(
        [f"{group} {fold}" for group, fold in zip(facts.group, facts.fold, strict=True)]
    )
    parts = {
        part: np.isin(pairs, [" ".join(pair) for pair in folds(protocol, part)])
        for part in trainings.PARTS
    }
    scaled = StandardScaler().fit(told[parts["train"]]).transform(told)
    values, vectors = np.linalg.eigh(scaled[parts["train"]] @ scaled[parts["train"]].T)
    kept = values > values[-1] * 1e-6
    seen = (scaled @ scaled[parts["train"]].T) @ (vectors[:, kept] / np.sqrt(values[kept]))
    tried = []
    for strength in STRENGTHS:
        model = LogisticRegression(C=strength, max_iter=300).fit(
            seen[parts["train"]], facts.label[parts["train"]]
        )
        tried.append(
            (
                model.score(seen[parts["validation"]], facts.label[parts["validation"]]),
                strength,
                model,
            )
        )
    return max(tried, key=lambda one: one[:2])[2].predict(seen)


def samples_of(run: Run, base: dict) -> tuple[ViewSamples, str, dict]:
    """Return the samples of a run, a name for what decides them, and their configuration."""
    more = {
        "motion": {"models": run.models, "models_per_chunk": run.models},
        "noise": {"snr_db": run.snr_db},
    }
    config = merge(
        merge(merge(trainings.config_of(), base), more), {"recognition": {"size": run.pixels}}
    )
    scheme = named(TABLE, f"{run.stations}:VRP+TRP+VT", list(config["network"]["stations"]))
    name = key_of(config["seed"], run.models, run.snr_db, run.pixels, run.stations)
    path = OUT / f"views/pretrained-{name}.npz"
    if not path.is_file():
        write_views(config, {}, list(config["network"]["stations"])[: len(scheme.stations)], path)
    pairs = set().union(*(folds("seen", part) for part in ("train", "validation", "test")))
    return ViewSamples([path], scheme.columns, pairs), name, config


def rows_of(run: Run, base: dict) -> list[list]:
    """Return a row for each number of stations, protocol and kind of weights of a run."""
    every, name, config = samples_of(run, base)
    right: dict[tuple[str, str, str], list[np.ndarray]] = {}
    kinds = [
        ("ImageNet", str(write_weights(OUT / f"{BACKBONE}.pth")), 0),
        *(("random", "none", seed) for seed in run.random),
    ]
    for words, weights, seed in kinds:
        kept = OUT / f"features/{name}-{words}-{seed}.npy"
        if not kept.is_file():
            found = features(every.images, weights, seed, config["images"]["colour_map"])
            with replacing(kept) as temporary, temporary.open("wb") as file:
                np.save(file, found)
        told = np.load(kept)
        for stations, protocol in product(dict.fromkeys((run.stations, "A")), ("seen", "unseen")):
            views = told if stations == run.stations else told[:, :3]
            answer = answers(views.reshape(len(told), -1), every.facts, protocol)
            right.setdefault((stations, protocol, words), []).append(answer == every.facts.label)
    rows = []
    facts = every.facts
    pairs = list(zip(facts.group.tolist(), facts.fold.tolist(), strict=True))
    for (stations, protocol, words), correct in right.items():
        tests = np.array([pair in folds(protocol, "test") for pair in pairs])
        found = Held(facts.take(tests), [one[tests] for one in correct])
        # Subtypes are drawn again only where they are held out.
        whole = found.difference(
            None, "", config["seed"], words, protocol, stations, whole=protocol == "unseen"
        )
        each = percents(found.share(subtype) for subtype in list(NAMED.values())[1:])
        about = run.pixels, run.models, len(run.snr_db), stations, protocol, words, len(correct)
        rows.append([*about, *percents(whole), *each, found.worst(), describe()])
    return rows


def main(arguments: list[str]) -> None:
    """Extract features, train the classifiers and write the table after each run."""
    line = argparse.ArgumentParser("pretrained.py", description=__doc__.splitlines()[0])
    line.add_argument(
        "--out", type=Path, default=HERE / "results/pretrained.csv", help="table to write (.csv)"
    )
    line.add_argument(
        "--weights",
        type=Path,
        help="write ImageNet's weights into this file (.pth), and nothing else",
    )
    given = line.parse_args(arguments)
    if given.weights:
        print(f"{write_weights(given.weights)}: weights of {BACKBONE}")
        return
    base = load_yaml(HERE / "choices.yaml")["base"]
    rows = []
    for one in RUNS:
        rows += rows_of(one, base)
        columns = (
            "pixels",
            "models",
            "snrs",
            "stations",
            "protocol",
            "weights",
            "seeds",
            "percent",
            "low",
            "high",
        )
        write_csv(given.out, (*columns, *list(NAMED)[1:], "worst", "hardware"), rows)


if __name__ == "__main__":
    run(main)
