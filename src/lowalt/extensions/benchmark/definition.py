"""The frozen definition of the benchmark: its version, its parts, and the samples of each part.

A part is one configuration: the main part, and smaller ones that tracks only test on. Keys, labels
and folds follow from it by rule, so that a submission is scored without any data.
"""

import hashlib
import itertools
from functools import cache
from typing import NamedTuple

import numpy as np

from lowalt.config.layers import overlaid
from lowalt.recognition.samples import Facts
from lowalt.shards.plan import Plan
from lowalt.shards.sample_list import SampleList
from lowalt.targets.records import records_of

VERSION = "lowalt-40 v1"
RUN = VERSION.replace(" ", "-")
REFERENCE = f"results/reference/{RUN}"
"""Folder of what is kept of this version: checksums, the table, and what the baselines got right.
"""
MAIN = "main"
PARTS = (MAIN, "low-snr", "clutter", "fr2")
SEEDED_AS = {"clutter": "town"}
"""Word from which a part's root seed is drawn, where it is not the part's name."""


def root_seed(text: str | bytes) -> int:
    """Return the root seed that a text stands for: eight hexadecimal digits of its SHA-256.

    They are the first ones.

    >>> root_seed("lowalt-40 v1")
    467398228
    """
    if isinstance(text, str):
        text = text.encode()
    return int(hashlib.sha256(text).hexdigest()[:8], 16)


def named_seed(part: str) -> int:
    """Return the root seed of a part.

    It is that of the version's name, followed by a word unless the part is the main one.
    """
    if part == MAIN:
        return root_seed(VERSION)
    return root_seed(f"{VERSION} {SEEDED_AS.get(part, part)}")


def overlays(part: str) -> list[str]:
    """Return the overlays on the default that make up a part's configuration."""
    main = f"config/{RUN}.yaml"
    if part == MAIN:
        return [main]
    return [main, f"config/{RUN}/{part}.yaml"]


def config_of(part: str) -> dict:
    """Return the merged configuration of a part."""
    return overlaid(overlays(part))


def run_name(part: str) -> str:
    """Return the name of the run that makes a part's data, results/NAME."""
    if part == MAIN:
        return RUN
    return f"{RUN}-{part}"


class Truth(NamedTuple):
    """The samples of a part in a fixed order: facts without positions, and classes by label."""

    facts: Facts
    classes: tuple[str, ...]


@cache
def listed(part: str) -> SampleList:
    """Return the list of a part's samples, which is read without any data."""
    config = config_of(part)
    records = records_of(config["targets"])
    published = {name: record["published"] for name, record in records.items()}
    return SampleList(Plan.of(config, published), published)


@cache
def truth(part: str) -> Truth:
    """Return the samples of a part and its classes, by subtype, then model, then SNR."""
    samples = listed(part)
    stations = len(config_of(part)["network"]["stations"])
    unknown = np.full((len(samples), stations), np.nan)
    facts = Facts(**samples.columns(), range_m=unknown, aspect_rad=unknown)
    # The list goes model by model, and this order subtype by subtype.
    subtypes = itertools.chain.from_iterable(samples.plan.groups.values())
    numbers = {name: number for number, name in enumerate(subtypes)}
    order = np.argsort([numbers[name] for name in facts.subtype.tolist()], kind="stable")
    return Truth(facts.take(order), samples.classes)
