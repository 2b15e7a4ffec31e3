"""A test set that nobody can have tuned on: its root seed follows from the method that it tests.

The seed is the first eight hexadecimal digits of the SHA-256 of the model file's bytes, or of the
checksums of a file of predictions and of all that it reads, followed by the version of the
benchmark. docs/benchmark.md says how much trying many model files can gain.
"""

import hashlib
from pathlib import Path
from typing import NamedTuple
from warnings import catch_warnings

import numpy as np

from lowalt.config.layers import merge
from lowalt.config.schema import check_brought
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track, shuffled
from lowalt.extensions.benchmark.definition import VERSION, config_of, root_seed
from lowalt.extensions.benchmark.part_samples import columns_of, of_unit_power
from lowalt.extensions.benchmark.predict_file import PredictFile
from lowalt.extensions.benchmark.scoring import headline, tested, values_of
from lowalt.extensions.benchmark.submission import checked
from lowalt.files.errors import InputError, InputWarning
from lowalt.machine.progress import Reporter, announced
from lowalt.recognition.dataset_samples import DatasetSamples, images_of
from lowalt.recognition.intervals import Interval
from lowalt.recognition.named_models import path_of
from lowalt.recognition.samples import statement
from lowalt.shards.dataset import Dataset

MODELS = {"clutter": 5}
"""Motion models of each subtype by part; of other parts `USUAL`."""
USUAL = 10
CONFIRMED = tuple(
    name for name, track in TRACKS.items() if track.headline == "accuracy" and not track.subtypes
)
"""Tracks whose results can be confirmed: those of the four classes."""


class Confirmed(NamedTuple):
    """A confirmed result: accuracy in percent, samples, root seed, SHA-256 of the model."""

    track: str
    percent: Interval
    samples: int
    seed: int
    sha256: str


def dataset(track: Track, seed: int) -> Dataset:
    """Return the test set of a track with this root seed, made when it is read.

    All its motion models test.
    Subtypes are those that the track tests on; they and the scene are the benchmark's, clouds and
    motion are new.
    """
    count = MODELS.get(track.part, USUAL)
    groups: tuple[str, ...] = ("seen", "unseen")
    if track.whole:
        # Half of the subtypes test, so each has twice as many motion models.
        count *= 2
        groups = ("unseen",)
    config = merge(
        config_of(track.part),
        {
            "seed": seed,
            "motion": {"models": count, "models_per_chunk": count},
            "split": {"train": 1, "val": 0, "test": 0},
        },
    )
    # Nobody can change the benchmark's settings, so warnings about them help nobody.
    with catch_warnings(action="ignore", category=InputWarning):
        return Dataset(config, groups=groups)


def refuse_other_training(stated: dict, track: Track, path: Path) -> None:
    """Refuse a model whose file states another training than the track's, or states none.

    stated: the identity in the model's file, with `protocol` and `trained_on`, the [subtype, fold,
    number of motion models] that trained.
    Raises: InputError naming what is missing or what the track holds out.
    """
    missing = [name for name in ("protocol", "trained_on") if not stated.get(name)]
    if missing:
        raise InputError(
            f"{path}: its file does not state {' and '.join(missing)}, so nobody can tell whether "
            f"it trained on what the track {track.name} holds out; expected a model that this "
            "version of lowalt trained"
        )
    if stated["protocol"] != track.protocol:
        raise InputError(
            f"{path}: its file states the protocol {stated['protocol']!r}, and the track "
            f"{track.name} trains in the protocol {track.protocol!r}"
        )
    check_brought("trained_on", stated["trained_on"], path)
    allowed = {}
    for subtype, fold, models in statement(track.samples("train").facts):
        allowed[subtype, fold] = models
    held_out = set()
    if track.whole:
        held_out = set(track.samples("test").facts.subtype.tolist())
    for subtype, fold, models in stated["trained_on"]:
        if (subtype, fold) not in allowed:
            raise InputError(
                f"{path}: its file states that it trained on {subtype}, fold {fold}, which the "
                f"track {track.name} does not train on"
            )
        if subtype in held_out and models > allowed[subtype, fold]:
            raise InputError(
                f"{path}: its file states {models} motion models of {subtype}, of which the track "
                f"{track.name} trains on {allowed[subtype, fold]}"
            )


def stated_by(path: Path) -> dict:
    """Return the identity in a model's file: what determined its weights.

    Raises: InputError for no such file.
    """
    from lowalt.recognition import model_file

    return model_file.read(path).identity


class FreshSamples(DatasetSamples):
    """The test set of a track with one root seed, made here; the log counts its samples."""

    def __init__(self, track: Track, seed: int, columns: list[int], size: int) -> None:
        """columns: the images to make; size: of their pixels."""
        data = dataset(track, seed)
        folds = {(group, "train") for group in data.groups}
        with announced(f"benchmark confirm: making the targets and motions of root seed {seed}"):
            super().__init__(data, columns, folds, size, placed=False)
        self.track = track
        self._made = 0
        self._report = Reporter(len(self.facts), "samples")

    def _count(self, number: int) -> None:
        """Report that this many more samples have been made."""
        self._made += number
        self._report(self._made)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        self._count(len(numbers))
        return super().views(numbers)

    def signals_and_images(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the signals and the images of all samples.

        Signals are (n, stations, symbols) complex64 of unit power, images (n, columns, size, size)
        uint8.
        """
        maker = self.dataset.maker
        signals = []
        images = []
        for number, snr_db in self.chosen:
            row = self.rows[number]
            signal = maker.signal(row, snr_db, self.stations)
            signals.append(of_unit_power(signal[list(self.track.stations)]))
            images.append(images_of(maker, row, snr_db, signal, self.columns, self.size))
            self._count(1)
        return np.stack(signals), np.stack(images)


def _scored(
    track: Track, samples: FreshSamples, answers: np.ndarray, seed: int, digest: str
) -> Confirmed:
    """The result of answers (n, classes) to a test set."""
    part = tested(track, samples.facts, np.asarray(answers))
    with announced("benchmark confirm: computing the interval"):
        percent = headline(track, values_of(track, [part], track.truth().classes))
    return Confirmed(track.name, percent, len(samples.facts), seed, digest)


def refuse_unconfirmable(track: Track) -> None:
    """Refuse a track whose results cannot be confirmed.

    Raises: InputError naming those that can.
    """
    if track.name not in CONFIRMED:
        raise InputError(
            f"track {track.name}: cannot be confirmed, expected one of {list(CONFIRMED)}"
        )


def confirm_predictions(path: str | Path, track: Track) -> Confirmed:
    """Freeze a user's file of predictions, run it on the test set that follows, return the result.

    path: a Python file as `predict_file` describes; it runs in this process.
    Raises: InputError as `PredictFile`, for a file that states another training than the track's,
    answers that are no probabilities, and a track that cannot be confirmed.
    """
    refuse_unconfirmable(track)
    file = PredictFile(path)
    if file.trained_on != (track.name, "train"):
        raise InputError(
            f"{path}: states TRAINED_ON = {file.trained_on}, and the track {track.name} asks for "
            f"{(track.name, 'train')}"
        )
    seed = root_seed(file.checksums + VERSION.encode())
    size = config_of(track.part)["recognition"]["size"]
    samples = FreshSamples(track, seed, columns_of(track), size)
    samples.keep(shuffled(samples.facts, np.arange(len(samples.facts))))
    signals, images = samples.signals_and_images()
    with announced(f"benchmark confirm: {path} answers"):
        answers = file.answers(signals, images)
    checked(answers, samples.facts.key, track.truth().classes)
    return _scored(track, samples, answers, seed, file.sha256)


def confirm(model: str | Path, track: Track, trusted: str = "") -> Confirmed:
    """Evaluate a model on the test set that follows from its file, and return the result.

    model: a .safetensors file, or the name of one in results/zoo; trusted: FILE.py:FUNCTION of
    a model whose backbone is the user's own code.
    Raises: InputError for a file that is no model, one that does not answer with the track's
    classes or sees stations that the track forbids, one that states another training or none, and a
    track that cannot be confirmed.
    """
    from lowalt.recognition import runs
    from lowalt.recognition.inference import Machine
    from lowalt.recognition.runs import opened

    refuse_unconfirmable(track)
    path = path_of(model)
    trained, _ = opened(model, trusted=trusted)
    classes = track.truth().classes
    if trained.classes != classes or set(trained.scheme.stations) - set(track.stations):
        raise InputError(
            f"{path}: classes {list(trained.classes)} and stations "
            f"{list(trained.scheme.stations)}, expected the classes {list(classes)} and some of "
            f"the stations {list(track.stations)}"
        )
    refuse_other_training(stated_by(path), track, path)
    content = path.read_bytes()
    seed = root_seed(content + VERSION.encode())
    samples = FreshSamples(track, seed, trained.scheme.columns, trained.size)
    settings = {"batch": 64, "threads": 1, "precision": "auto", "mirror": True}
    answers = runs.answers(trained, samples, settings, Machine.here("auto"))
    return _scored(track, samples, answers, seed, hashlib.sha256(content).hexdigest())
