"""A test set that nobody can have tuned on: its root seed follows from the model that it tests.

The seed is the first eight hexadecimal digits of the SHA-256 of the model file's bytes followed by the version of the
benchmark. docs/benchmark.md says how much trying many model files can gain.
"""

import hashlib
from pathlib import Path
from typing import NamedTuple
from warnings import catch_warnings

import numpy as np

from lowalt.config.layers import merge
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track
from lowalt.extensions.benchmark.definition import VERSION, config_of, root_seed
from lowalt.extensions.benchmark.scoring import headline, tested, values_of
from lowalt.files.errors import InputError, InputWarning
from lowalt.recognition.dataset_samples import DatasetSamples
from lowalt.recognition.intervals import Interval
from lowalt.recognition.zoo_files import path_of
from lowalt.shards.dataset import Dataset

MODELS = {"town": 5}
"""Motion models of each subtype by part; of other parts `USUAL`."""
USUAL = 10
CONFIRMED = tuple(name for name, track in TRACKS.items() if track.headline == "accuracy" and not track.subtypes)
"""Tracks whose results can be confirmed: those of the four classes."""


class Confirmed(NamedTuple):
    """A confirmed result: accuracy in percent, samples and root seed of the test set, SHA-256 of the model."""

    track: str
    percent: Interval
    samples: int
    seed: int
    sha256: str


def dataset(track: Track, seed: int) -> Dataset:
    """Return the test set of a track with this root seed, made when it is read: all motion models test.

    Subtypes are those that the track tests on; they and the scene are the benchmark's, clouds and motion are new.
    """
    count = MODELS.get(track.part, USUAL) * (2 if track.whole else 1)
    every = {"train": 1, "val": 0, "test": 0}
    more = {"seed": seed, "motion": {"models": count, "models_per_chunk": count}, "split": every}
    with catch_warnings(action="ignore", category=InputWarning):  # nobody can change the benchmark's settings
        return Dataset(merge(config_of(track.part), more), groups=("unseen",) if track.whole else ("seen", "unseen"))


def confirm(model: str | Path, track: Track, trusted: str = "") -> Confirmed:
    """Make the test set that follows from a model file, evaluate the model on it, and return the result.

    model: a .safetensors file, or the name of one in results/zoo; trusted: FILE.py:FUNCTION of
    a model whose backbone is the user's own code.
    Raises: InputError for a file that is no model, one that does not answer with the track's classes or sees stations
    that the track forbids, and a track that cannot be confirmed.
    """
    from lowalt.recognition import runs
    from lowalt.recognition.inference import Machine
    from lowalt.recognition.zoo import opened

    if track.name not in CONFIRMED:
        raise InputError(f"track {track.name}: cannot be confirmed, expected one of {list(CONFIRMED)}")
    path = path_of(model)
    trained, _ = opened(model, trusted=trusted)
    content = Path(path).read_bytes()
    seed, classes = root_seed(content + VERSION.encode()), track.truth().classes
    if trained.classes != classes or set(trained.scheme.stations) - set(track.stations):
        raise InputError(
            f"{path}: classes {list(trained.classes)} and stations {list(trained.scheme.stations)}, expected the "
            f"classes {list(classes)} and some of the stations {list(track.stations)}"
        )
    data = dataset(track, seed)
    pairs = {(group, "train") for group in data.groups}
    samples = DatasetSamples(data, trained.scheme.columns, pairs, trained.size, placed=False)
    settings = {"batch": 64, "threads": 1, "precision": "auto", "mirror": True}
    answers = runs.answers(trained, samples, settings, Machine.here("auto"))
    part = tested(track, samples.facts, np.asarray(answers))
    return Confirmed(
        track.name, headline(track, values_of(track, [part], classes)), len(samples.facts), seed,
        hashlib.sha256(content).hexdigest(),
    )  # fmt: skip
