"""Training without end of data: fresh motion models, made as they are asked for, next to a fixed set of samples.

A fresh sample has a place in a sequence that seed and place alone decide, so a training resumes anywhere and workers
make any part of it. The sequence goes round by round: each round has one motion model of every subtype, in a random
order, at one random SNR each. Motion models are numbered after those of the run and lie in the fold that trains, so
none is ever validated or tested, not even where the data set grows later.
"""

import functools
import hashlib
import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from lowalt.common.classes import label
from lowalt.common.errors import InputError
from lowalt.common.splits import fold
from lowalt.common.streams import stream
from lowalt.recognition.made import CLEAN_BYTES, cloud_sha256, opened, stations_of, views_of
from lowalt.recognition.protocols import folds
from lowalt.recognition.schemes import columns_in
from lowalt.shards.dataset import Dataset, Place
from lowalt.spectra.catalogue import named

STRIDE = 2**31
"""Distance of the motion models that one place may take: the first of them that lies in the fold that trains."""


class Stream:
    """A sequence of fresh samples without end: the place, label and images of each."""

    def __init__(
        self,
        dataset: Dataset,
        columns: list[int],
        size: int,
        groups: Iterable[str],
        models: int = 0,
        without: Iterable[str] = (),
    ) -> None:
        """columns: views of a scheme; size: pixels; groups: those whose subtypes take part, except `without`; models:
        distinct motion models over all subtypes, after which they repeat at other SNRs, or 0.

        Raises: InputError where no subtype is left, or there are fewer models than subtypes.
        """
        plan, maker = dataset.plan, dataset.maker
        self.dataset, self.size, self.models = dataset, size, models
        self.subtypes = [
            (group, name) for group in sorted(groups) for name in plan.groups.get(group, ()) if name not in set(without)
        ]
        if not self.subtypes or 0 < models < len(self.subtypes):
            raise InputError(f"stream: {models or 'endless'} motion models of {len(self.subtypes)} subtypes")
        self.columns = columns_in(columns, named(maker.render["spectra"]), len(maker.network.stations), "stream")
        self.stations = stations_of(maker, self.columns)
        self._labels = [
            label(dataset.classes, dataset.published[name] | {"subtype": name}) for _, name in self.subtypes
        ]
        self._made: dict[tuple, np.ndarray] = {}
        self._round = functools.lru_cache(maxsize=16)(self._drawn)

    def __getstate__(self) -> dict:
        # Each worker draws and keeps samples for itself.
        return {name: value for name, value in self.__dict__.items() if name != "_round"} | {"_made": {}}

    def __setstate__(self, state: dict) -> None:
        self.__dict__ |= state
        self._round = functools.lru_cache(maxsize=16)(self._drawn)

    def _drawn(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the order of the subtypes in a round, and the SNR's place of each."""
        generator = stream(self.dataset.plan.seed, "recognition-stream", number)
        count = len(self.subtypes)
        return generator.permutation(count), generator.integers(0, len(self.dataset.plan.snrs), count)

    def _subtype(self, position: int) -> tuple[int, int, float]:
        """Return round, number of the subtype and SNR (dB) of a sample."""
        number, place = divmod(int(position), len(self.subtypes))
        order, levels = self._round(number)
        return number, int(order[place]), self.dataset.plan.snrs[levels[place]]

    def place(self, position: int) -> Place:
        """Return group, subtype, motion model and SNR of the sample at a position of the sequence, from 0."""
        plan = self.dataset.plan
        number, which, snr_db = self._subtype(position)
        group, name = self.subtypes[which]
        model = plan.models + (number % (self.models // len(self.subtypes)) if self.models else number)
        while fold(plan.split, plan.seed, name, model, snr_db) != "train":
            model += STRIDE
        return Place(group, name, model, snr_db)

    def labels(self, positions: np.ndarray) -> np.ndarray:
        """Return the labels of samples, (len(positions),) int64; nothing is made for them."""
        return np.array([self._labels[self._subtype(position)[1]] for position in positions], np.int64)

    def views(self, positions: np.ndarray) -> np.ndarray:
        """Return the index images (len(positions), columns, size, size) uint8 of samples."""
        return np.stack([self._images(self.place(position)) for position in positions])

    def _images(self, place: Place) -> np.ndarray:
        """Return the images of one sample; those of motion models that repeat are kept, as far as memory allows."""
        if place in self._made:
            return self._made[place]
        maker, row = self.dataset.maker, self.dataset.row(place)
        images = views_of(maker, row, place.snr_db, self.columns, self.size, self.stations)
        if self.models and (len(self._made) + 1) * images.nbytes < CLEAN_BYTES:
            self._made[place] = images
        return images

    def sha256(self) -> str:
        """Return the SHA-256 of all that decides these samples: settings, seed, subtypes and their clouds."""
        dataset = self.dataset
        clouds = {name: cloud_sha256(dataset.clouds[name]) for _, name in self.subtypes}
        told = [
            dataset.maker.render, dataset.maker.echo, dataset.config["motion"], dataset.plan.seed, dataset.plan.snrs,
            dataset.plan.models, self.columns, self.size, self.models, self.subtypes, clouds,
        ]  # fmt: skip
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


class Streamed:
    """A fixed set of samples, and behind its last number the fresh ones of a stream."""

    def __init__(self, fixed: Any, fresh: Stream) -> None:
        """fixed: samples with facts; they decide the epochs, and the classes are checked on them."""
        self.fixed, self.fresh, self.facts, self.size = fixed, fresh, fixed.facts, fixed.size

    def _mixed(self, numbers: np.ndarray, fixed: Any, fresh: Any) -> np.ndarray:
        """Return the answers of two functions to the numbers of each kind, in the order of the numbers."""
        first = len(self.facts)
        old = numbers < first
        parts = [(old, fixed, numbers[old]), (~old, fresh, numbers[~old] - first)]
        answers = [(mask, ask(some)) for mask, ask, some in parts if len(some)]
        result = np.empty((len(numbers), *answers[0][1].shape[1:]), answers[0][1].dtype)
        for mask, answer in answers:
            result[mask] = answer
        return result

    def labels(self, numbers: np.ndarray) -> np.ndarray:
        """Return the labels of samples."""
        return self._mixed(numbers, self.facts.label.__getitem__, self.fresh.labels)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Return the index images (len(numbers), columns, size, size) uint8 of samples."""
        return self._mixed(numbers, self.fixed.views, self.fresh.views)

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples."""
        return hashlib.sha256((self.fixed.sha256() + self.fresh.sha256()).encode()).hexdigest()


def streamed(fixed: Any, config: str, columns: list[int], protocol: str, models: int) -> Streamed:
    """Return fixed samples with a stream of fresh ones behind them, of the groups that a protocol trains on.

    config: config.yaml of a run with clouds; columns: the scheme's views. Raises: InputError as `opened` and `Stream`.
    """
    groups = {group for group, _ in folds(protocol, "train")}
    return Streamed(fixed, Stream(opened(config), columns, fixed.size, groups, models))
