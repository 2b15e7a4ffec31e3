"""The list of a configuration's samples, which follows from its plan: nothing is made to read it.

Data sets, the benchmark and its scores count and name samples by this list alone.
"""

import functools
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import classes_of, label
from lowalt.config.splits import FOLDS, fold
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.shards.plan import GROUPS, Plan


class Place(NamedTuple):
    """Identification of a sample: its group, subtype, motion model and SNR."""

    group: str
    subtype: str
    model: int
    snr_db: float

    @property
    def key(self) -> str:
        """Key of the sample, as in the shards."""
        return sample_key(self.subtype, self.model, self.snr_db)


def snr_label(snr_db: float) -> str:
    """Return an SNR for a key: `snrinf`, `snr003`, `snr-60`, `snr003p5`.

    It has no dots, since a dot ends a key in a tar.
    """
    if math.isinf(snr_db):
        return "snrinf"
    text = f"{int(snr_db):03d}" if float(snr_db).is_integer() else f"{snr_db:05.1f}"
    if float(text) != snr_db:
        text = repr(float(snr_db))
    return "snr" + text.replace(".", "p")


def model_key(subtype: str, model: int) -> str:
    """Return the key of a motion model, {slug}-{model, six digits}."""
    return f"{slug(subtype)}-{model:06d}"


def sample_key(subtype: str, model: int, snr_db: float) -> str:
    """Return the key of a sample, {slug}-{model, six digits}-{SNR}.

    Keys are unique, have no dots, and sort by subtype and motion model.
    """
    return f"{model_key(subtype, model)}-{snr_label(snr_db)}"


def slug_of(key: str) -> str:
    """Return the slug of the subtype at the start of a sample's key.

    Raises: InputError naming a key of another form.
    """
    match = re.match(r"(.+)-\d{6,}-snr", key)
    if match is None:
        raise InputError(f"sample key {key!r}: expected SUBTYPE-MODEL-snrSNR")
    return match[1]


def refuse_unknown(groups: Iterable[str], folds: Iterable[str]) -> None:
    """Refuse groups and folds that no data set has. Raises: InputError naming them."""
    for option, names, known in (("groups", groups, GROUPS), ("folds", folds, FOLDS)):
        if set(names) - set(known):
            raise InputError(f"{option} {names}, expected some of {known}")


class SampleList:
    """The samples of a plan by number: by group, then model, then subtype, then SNR.

    `classes` are those of the table of targets, by label; `groups` and `folds` those that were
    chosen.
    """

    def __init__(
        self,
        plan: Plan,
        published: Mapping[str, dict],
        groups: Iterable[str] = GROUPS,
        folds: Iterable[str] = FOLDS,
    ) -> None:
        """Choose groups and folds of a plan.

        published: the row of each subtype in the table of targets. Raises: InputError for a group
        or fold that no data set has, and for a category that is no word.
        """
        groups = tuple(groups)
        self.folds = tuple(folds)
        refuse_unknown(groups, self.folds)
        self.plan = plan
        self.groups = tuple(name for name in plan.groups if name in groups)
        self.classes = classes_of(published)
        self.label_of = {}
        for subtype, row in published.items():
            self.label_of[subtype] = label(self.classes, {**row, "subtype": subtype})

    @functools.cached_property
    def _numbers(self) -> np.ndarray | None:
        """Numbers of the chosen folds' samples, counted over all folds; None for all folds."""
        if set(self.folds) == set(FOLDS):
            return None
        chosen = []
        for number in range(self._all):
            if self.fold(self._of_all(number)) in self.folds:
                chosen.append(number)
        return np.array(chosen, np.int64)

    @property
    def _all(self) -> int:
        """Number of samples of the chosen groups in all folds."""
        subtypes = sum(len(self.plan.groups[group]) for group in self.groups)
        return subtypes * self.plan.models * len(self.plan.snrs)

    def __len__(self) -> int:
        if self._numbers is None:
            return self._all
        return len(self._numbers)

    def _of_all(self, number: int) -> Place:
        """Return the sample with this number, counted over all folds."""
        position, level = divmod(number, len(self.plan.snrs))
        for group in self.groups:
            names = self.plan.groups[group]
            if position < len(names) * self.plan.models:
                model, index = divmod(position, len(names))
                return Place(group, names[index], model, self.plan.snrs[level])
            position -= len(names) * self.plan.models
        raise IndexError(number)

    def __getitem__(self, number: int) -> Place:
        number = int(number)
        if not 0 <= number < len(self):
            raise IndexError(f"sample {number}: expected 0 to {len(self) - 1}")
        if self._numbers is not None:
            number = int(self._numbers[number])
        return self._of_all(number)

    def __iter__(self) -> Iterator[Place]:
        return (self[number] for number in range(len(self)))

    def named(self, subtype: str, model: int, snr_db: float) -> Place:
        """Return the place of any motion model of a subtype at any SNR (dB).

        Raises: InputError for a subtype that is not selected.
        """
        for group, members in self.plan.groups.items():
            if subtype in members:
                return Place(group, subtype, model, snr_db)
        known = [*itertools.chain(*self.plan.groups.values())]
        raise InputError(f"subtype is {subtype!r}, expected one of {known}")

    def models_from(self, first: int, step: int = 1) -> Iterator[Place]:
        """Yield the samples of models first, first + step, ... of the chosen groups and folds.

        The sequence has no end.
        """
        for model in itertools.count(first, step):
            for group in self.groups:
                for subtype in self.plan.groups[group]:
                    for snr_db in self.plan.snrs:
                        place = Place(group, subtype, model, snr_db)
                        if self.fold(place) in self.folds:
                            yield place

    def fold(self, place: Place) -> str:
        """Return the fold of a sample."""
        track = place.model // self.plan.looks
        return fold(self.plan.split, self.plan.seed, place.subtype, track, place.snr_db)

    @property
    def labels(self) -> np.ndarray:
        """Labels of all samples, (n,) int64 indices into `classes`."""
        return np.array([self.label_of[place.subtype] for place in self], np.int64)

    def columns(self) -> dict[str, np.ndarray]:
        """Return arrays (n,) of all samples: key, subtype, model, snr_db, group, fold, label."""
        places = list(self)
        return {
            "key": np.array([place.key for place in places]),
            "subtype": np.array([place.subtype for place in places]),
            "model": np.array([place.model for place in places], np.int64),
            "snr_db": np.array([place.snr_db for place in places], float),
            "group": np.array([place.group for place in places]),
            "fold": np.array([self.fold(place) for place in places]),
            "label": self.labels,
        }
