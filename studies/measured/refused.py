"""Which share of the windows without a class a network refuses, and which of the others it keeps.

A network with the fifth class "none of these" refuses a window where that class is the most
probable. Its probability is divided by a constant first, which is chosen so that a given share of
simulated windows of the known classes is kept. No training saw these windows.

measured-refused.csv has a row for each such share and for everything that the network was asked:
    kept_percent: the given share
    radar: name of the radar
    half: "tuning" or "test" for labelled windows of recordings, "foreign" for inputs without a
        class (`foreign.yaml`), "simulated" for simulated windows
    what: the label, or the name of the input
    windows: their number
    found_percent: share of the windows that the detector takes for a target
    named_percent: share of the windows that the network gives a known class, mean over training
        seeds; seeds_low and seeds_high: the least and the most of any seed
    right_percent: share of the windows that get their class, or none where they have none; mean
        over training seeds
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from accuracy import is_right, window_s
from labels import TOGETHER, picture

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.answers import UNNAMED, Answers
from lowalt.extensions.recordings.files import Baseband
from lowalt.extensions.recordings.twin import NO_CLASS, Twin
from lowalt.files.atomic import write_file
from lowalt.recognition.samples import Facts

REFUSED = (
    "kept_percent",
    "radar",
    "half",
    "what",
    "windows",
    "found_percent",
    "named_percent",
    "seeds_low",
    "seeds_high",
    "right_percent",
)
FOREIGN = "foreign"
SIMULATED = "simulated"
LEAST = 1e-12
"""Least probability whose logarithm is taken."""


class Asked(NamedTuple):
    """A recording that a network was asked about, and its answers.

    what: of each window its label, the name of an input without a class, or "" where it does not
    count; twin, baseband: the radar and the samples, where a picture is to be drawn.
    """

    radar: str
    half: str
    what: list[str]
    answers: Answers
    twin: Twin | None = None
    baseband: Baseband | None = None


Key = tuple[float, str, str, str]
"""The first columns of a row: kept_percent, radar, half, what."""


class Counts(NamedTuple):
    """Numbers of windows: all, those found, those that get a known class, and those right."""

    windows: int
    found: int
    named: int
    right: int


def leaning_for(shares: np.ndarray, kept_percent: float) -> float:
    """Return the logarithm of the constant at which a share of windows of known classes is kept.

    shares: their probabilities (n, classes), of which the last is that of no class.
    """
    logarithms = np.log(np.maximum(shares, LEAST))
    over_known = logarithms[:, -1] - logarithms[:, :-1].max(axis=1)
    return float(np.quantile(over_known, kept_percent / 100))


def leant(shares: np.ndarray, leaning: float) -> np.ndarray:
    """Return probabilities (n, classes) after the last, that of no class, is divided by the
    constant exp(leaning)."""
    result = shares.copy()
    result[:, -1] /= np.exp(leaning)
    return result / result.sum(axis=1, keepdims=True)


def _counted(what: list[str], outcomes: list[str]) -> dict[str, Counts]:
    """The counts of each thing that windows are."""
    result = {}
    for name in dict.fromkeys(what):
        if not name:
            continue
        of_name = [one for one, other in zip(outcomes, what, strict=True) if other == name]
        named = sum(one in CATEGORIES for one in of_name)
        found = sum(one not in UNNAMED for one in of_name)
        right = len(of_name) - named
        if set(name.split(TOGETHER)) <= {*CATEGORIES}:
            right = sum(is_right(name, one) for one in of_name)
        result[name] = Counts(len(of_name), found, named, right)
    return result


def outcomes_of(said: Answers, leaning: float) -> list[str]:
    """Return what each window is said to be at the constant exp(leaning)."""
    shares = leant(said.probabilities, leaning)
    return said._replace(probabilities=shares).outcomes([*CATEGORIES, NO_CLASS])


def draw(said: list[Asked], leaning: float, folder: Path) -> None:
    """Draw the spectrogram of everything that has samples, with what is said of each window:
    refused-NAME.png."""
    for one in said:
        if one.twin is None or one.baseband is None:
            continue
        starts_s = one.answers.starts_s.tolist()
        outcomes = list(zip(starts_s, outcomes_of(one.answers, leaning), strict=True))
        name = one.what[0]
        length_s = window_s(one.twin)
        image = picture(one.baseband, one.twin.carrier_hz, [], name, length_s, {"said": outcomes})
        write_file(folder / f"refused-{name.replace(' ', '-')}.png", image)


def simulated_names(facts: Facts) -> list[str]:
    """Return what each simulated window is: its class, or the kind of what belongs to none."""
    return [
        CATEGORIES[label] if label < len(CATEGORIES) else str(subtype)
        for label, subtype in zip(facts.label.tolist(), facts.subtype.tolist(), strict=True)
    ]


def refusals(
    known: np.ndarray,
    simulated: tuple[np.ndarray, list[str]],
    said: list[Asked],
    kept_percents: list[float],
) -> dict[Key, Counts]:
    """Return the counts of a network, by the first columns of `REFUSED`.

    known: probabilities (n, classes) for simulated windows of known classes, which set the
    constant; simulated: those for other simulated windows, and what each is.
    """
    classes = [*CATEGORIES, NO_CLASS]
    result: dict[Key, Counts] = {}
    for kept_percent in kept_percents:
        leaning = leaning_for(known, kept_percent)
        named = np.array(classes)[leant(simulated[0], leaning).argmax(axis=1)].tolist()
        for name, counts in _counted(simulated[1], named).items():
            result[kept_percent, "random radars", SIMULATED, name] = counts
        for one in said:
            outcomes = outcomes_of(one.answers, leaning)
            for name, counts in _counted(one.what, outcomes).items():
                key = kept_percent, one.radar, one.half, name
                before = result.get(key, Counts(0, 0, 0, 0))
                sums = [int(a + b) for a, b in zip(before, counts, strict=True)]
                result[key] = Counts(*sums)
    return result


def over_seeds(of_seeds: list[dict[Key, Counts]]) -> list[list]:
    """Return the rows of `REFUSED` of networks of several training seeds."""
    rows = []
    # Numbers of windows and what the detector finds do not depend on the network.
    for key, first in of_seeds[0].items():
        counts = [of_seed[key] for of_seed in of_seeds]
        named = [100 * one.named / one.windows for one in counts]
        right = [100 * one.right / one.windows for one in counts]
        found_percent = 100 * first.found / first.windows
        row = [*key, first.windows, found_percent, float(np.mean(named))]
        rows.append([*row, min(named), max(named), float(np.mean(right))])
    return rows
