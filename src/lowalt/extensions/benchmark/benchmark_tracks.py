"""The tracks of the benchmark: their samples, what is predicted, and which number counts.

The samples that train and validate are always those of the main part. Validation uses fold val of
the subtypes that train. Samples that validate or test come in the order of a digest of their keys,
so that neither the number of a row nor its neighbours tell its class. docs/benchmark.md lists the
tracks.
"""

import hashlib
from dataclasses import dataclass, replace

import numpy as np

from lowalt.extensions.benchmark.definition import MAIN, Truth, listed, truth
from lowalt.files.errors import InputError, instead
from lowalt.recognition.protocols import FOLDS
from lowalt.recognition.samples import Facts

USES = ("train", "validation", "test")
INNER = ("inner-1", "inner-2", "inner-3", "inner-4", "inner-5")
"""Splits of the subtypes that train in tracks of unseen subtypes, for choices that should hold for
other subtypes.
"""
UNKNOWN = "Bird"
"""The class that the track open-set holds out."""
_TESTED = {("unseen", "val"), ("unseen", "test")}


@dataclass(frozen=True)
class Track:
    """One track. serves: whom it serves, one sentence; part: the part it tests on; stations:
    numbers of those that may be used; shots: motion models of each unseen subtype that train too;
    headline: "accuracy" or "AUROC"; limit: what a score on this track cannot show, one sentence or
    ""."""

    name: str
    serves: str
    protocol: str = "seen"
    part: str = MAIN
    stations: tuple[int, ...] = (0, 1, 2)
    shots: int = 0
    headline: str = "accuracy"
    subtypes: bool = False
    limit: str = ""

    @property
    def whole(self) -> bool:
        """Whether intervals draw whole subtypes, because results should hold for other subtypes."""
        return self.protocol == "unseen"

    @property
    def trains_as(self) -> str:
        """Name of the track whose training serves this one, such as `seen` for `low-snr`."""
        if self.part == MAIN:
            return self.name
        return self.protocol

    def truth(self, part: str = "") -> Truth:
        """Return the samples of the track's part (or another), labelled as this track asks."""
        facts, classes = truth(part or self.part)
        if not self.subtypes:
            return Truth(facts, classes)
        names, first, labels = np.unique(facts.subtype, return_index=True, return_inverse=True)
        # Subtypes are numbered in the order of the plan, not of the alphabet.
        order = np.argsort(first)
        return Truth(replace(facts, label=np.argsort(order)[labels]), tuple(names[order].tolist()))

    def samples(self, use: str = "test", split: str = "") -> Truth:
        """Return the samples of a use, and their classes.

        split: as in `numbers`. Raises: as `numbers`.
        """
        part = self.part if use == "test" else MAIN
        facts, classes = self.truth(part)
        return Truth(facts.take(self.numbers(use, split)), classes)

    def numbers(self, use: str, split: str = "") -> np.ndarray:
        """Return which samples of `truth(MAIN)` train or validate, or which of `truth()` test.

        Those that train come in the order of `truth`, the others in that of `shuffled`. split: a
        name of INNER, of which one subtype of each class does not train, and only these validate.
        Raises: InputError for another use than USES, and for a split where there is none.
        """
        if split:
            return self._inner(use, split)
        if use not in USES:
            raise InputError(f"part {use!r}: expected one of {list(USES)}")
        if use == "test" and self.part != MAIN:
            facts = self.truth().facts
            return shuffled(facts, np.arange(len(facts)))
        facts = self.truth(MAIN).facts
        pairs = FOLDS[self.protocol][use]
        if use == "test" and self.whole:
            pairs = _TESTED
        own_pairs = zip(facts.group.tolist(), facts.fold.tolist(), strict=True)
        chosen = np.array([pair in pairs for pair in own_pairs])
        if use == "train" and self.shots:
            chosen |= _first(facts, self.shots)
        if use != "test" and self.headline == "AUROC":
            chosen &= facts.label != self.truth(MAIN).classes.index(UNKNOWN)
        numbers = np.flatnonzero(chosen)
        if use == "train":
            return numbers
        return shuffled(facts, numbers)

    def _inner(self, use: str, split: str) -> np.ndarray:
        """Which samples of `truth(MAIN)` train or validate in an inner split.

        Raises: InputError; see `numbers`.
        """
        if not self.whole or split not in INNER or use == "test":
            whole = [track.name for track in TRACKS.values() if track.whole]
            raise InputError(
                f"split {split!r} of track {self.name}, part {use!r}: expected one of "
                f"{list(INNER)}, a track of {whole}, and the part train or validation"
            )
        numbers = self.numbers(use)
        held = np.isin(self.truth(MAIN).facts.subtype[numbers], held_out(split))
        if use == "validation":
            return numbers[held]
        return numbers[~held]


def held_out(split: str) -> tuple[str, ...]:
    """Return the subtypes that an inner split holds out: one of each class among those that train.

    The subtypes of each class are ordered by the SHA-256 of their names; split k holds out the k-th
    of each class.
    """
    samples = listed(MAIN)
    by_class: dict[int, list[str]] = {}
    for name in samples.plan.groups["seen"]:
        by_class.setdefault(samples.label_of[name], []).append(name)
    number = INNER.index(split)
    found = []
    for names in by_class.values():
        ordered = sorted(names, key=lambda name: hashlib.sha256(name.encode()).digest())
        found.append(ordered[number % len(ordered)])
    return tuple(found)


def shuffled(facts: Facts, numbers: np.ndarray) -> np.ndarray:
    """Return the numbers (n,) of samples in the order of the SHA-256 of their keys."""
    digests = [hashlib.sha256(key.encode()).digest() for key in facts.key[numbers].tolist()]
    order = sorted(range(len(numbers)), key=digests.__getitem__)
    return numbers[order]


def _first(facts: Facts, count: int) -> np.ndarray:
    """Whether each sample, (samples,), is of the first models that train of its unseen subtype.

    count: the number of motion models in fold train that count as first.
    """
    chosen = np.zeros(len(facts), bool)
    for name in np.unique(facts.subtype[facts.group == "unseen"]):
        members = (facts.subtype == name) & (facts.fold == "train")
        chosen |= members & np.isin(facts.model, np.unique(facts.model[members])[:count])
    return chosen


TRACKS = {
    track.name: track
    for track in (
        Track("seen", "Serves operators who know every type that will fly."),
        Track("unseen", "Serves surveillance: no training has seen these types.", "unseen"),
        Track(
            "one-station",
            "Serves operators of a single radar: unseen types, station A alone.",
            "unseen",
            stations=(0,),
            limit="A file of answers cannot show whether other stations were used; `confirm` can, "
            "because it shows station A alone.",
        ),
        Track(
            "few-shot-1",
            "Serves whoever has one recorded flight of each new type.",
            "unseen",
            shots=1,
        ),
        Track(
            "few-shot-5",
            "Serves whoever has five recorded flights of each new type.",
            "unseen",
            shots=5,
        ),
        Track(
            "few-shot-20",
            "Serves whoever has twenty recorded flights of each new type.",
            "unseen",
            shots=20,
        ),
        Track(
            "open-set",
            "Serves operators who need an alarm instead of a wrong class: birds are held out.",
            headline="AUROC",
        ),
        Track("forty", "Serves forensics: which of the forty types was it?", subtypes=True),
        Track(
            "low-snr",
            "Serves the detection of small and distant targets: 3 dB down to -10 dB.",
            part="low-snr",
        ),
        Track(
            "clutter",
            "Serves deployment near the ground: trained without clutter, tested in clutter and "
            "wind.",
            part="clutter",
            limit="The scene has ground, clutter and wind, and no building.",
        ),
        Track(
            "fr2",
            "Serves operators of another band: trained at 4.9 GHz, tested at 28 GHz.",
            part="fr2",
        ),
    )
}


def named(name: str) -> Track:
    """Return a track by its name. Raises: InputError for an unknown one, naming those there are."""
    if name not in TRACKS:
        raise InputError(
            f"track {name!r}: expected {instead([name], TRACKS, f'one of {list(TRACKS)}')}"
        )
    return TRACKS[name]
