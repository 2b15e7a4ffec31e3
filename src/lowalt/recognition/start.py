"""A training that starts from the weights of another, finished one, where nothing of a test sample can come with them.

Weights carry over by name and shape; the embedding of a spectrum follows the spectrum. Layers that only one of the two
networks has, or has in another shape, stay fresh. The start may have seen no sample in training that this training does
not train on, and may have been chosen by none that does not validate it; both are checked on the samples themselves.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from lowalt.common.classes import stated
from lowalt.common.errors import InputError
from lowalt.common.files import sha256
from lowalt.recognition import checkpoint
from lowalt.recognition.schemes import Scheme, of_record

EMBEDDING = "fusion.modality"
"""Weights with a row a spectrum."""
TABLE = "palettes.table"
"""Values that follow from the settings and are not trained."""


@dataclass(frozen=True)
class Start:
    """A finished training: what it sees, what determined its weights, what its model.pt keeps, and what names it."""

    scheme: Scheme
    identity: dict
    state: dict
    sha256: str

    @property
    def name(self) -> str:
        """Protocol and scheme, as the configuration's `recognition.start` writes them."""
        return f"{self.state['protocol']}/{self.scheme.name}"

    @property
    def about(self) -> dict:
        """What a started training keeps of its start: name, training seed and SHA-256 of its model.pt."""
        return {"training": self.name, "seed": self.state["seed"], "sha256": self.sha256}


def opened(path: str | Path) -> Start:
    """Return the finished training of a model.pt.

    Raises: InputError where the file is missing, damaged, or no network.
    """
    identity, state = checkpoint.model(path)
    scheme = of_record(state["scheme"])
    if scheme.sees == "features":
        raise InputError(f"--start: {path} is of the method {scheme.method!r}, expected a network")
    return Start(scheme, identity, state, sha256(path))


def check_settings(start: Start, scheme: Scheme, settings: dict) -> None:
    """Refuse a start whose network is built otherwise than this training's.

    settings: network, size, colour_map and classes of this training. Raises: InputError naming what differs.
    """
    own = {**{key: settings[key] for key in ("network", "size", "colour_map")}, "classes": list(settings["classes"]),
           "method": scheme.method, "backbone": scheme.backbone, "cues": scheme.cues}  # fmt: skip
    theirs = {**start.state, "classes": list(stated(start.state)), "method": start.scheme.method,
              "backbone": start.scheme.backbone, "cues": start.scheme.cues}  # fmt: skip
    differ = sorted(key for key, value in own.items() if theirs[key] != value)
    if differ:
        raise InputError(f"--start: {start.name} has another {', '.join(differ)}, expected this training's")


def check_samples(start: Start, theirs: dict[str, Any], own: dict[str, Any]) -> None:
    """Refuse a start that was trained on, or chosen by, a sample that has no such part in this training.

    theirs, own: sources of the parts "train" and "validation", of the start's scheme and protocol and of this
    training's. Own parts and test samples are disjoint, so a start that passes has met no test sample.
    Raises: InputError naming the start and the first such sample, or samples that are not those it was trained on.
    """
    for part, source in theirs.items():
        if start.identity["samples"].get(part) != source.sha256():
            raise InputError(f"--start: {start.name} was trained on other samples ({part}) than these, expected these")
        facts = source.facts
        foreign = np.flatnonzero(~np.isin(facts.key, own[part].facts.key))
        if len(foreign):
            first = foreign[0]
            raise InputError(
                f"--start: {start.name} has {len(foreign)} samples in its part {part!r} that this training has not "
                f"there, first {facts.subtype[first]} motion model {facts.model[first]} (group {facts.group[first]!r}, "
                f"fold {facts.fold[first]!r}); expected a start whose samples are all among its own"
            )


def carry(start: Start, scheme: Scheme, model: nn.Module) -> list[str]:
    """Copy the start's weights into a network, in place; return, and print, the names of those that stay fresh.

    scheme: what the network sees. Raises: InputError where nothing carries over.
    """
    given, spectra = start.state["weights"], start.scheme.spectra
    fresh, state = [], model.state_dict()
    for name, value in state.items():
        if name == TABLE:
            continue
        if name == EMBEDDING and name in given and scheme.spectra:
            common = [(row, spectra.index(kind)) for row, kind in enumerate(scheme.spectra) if kind in spectra]
            for row, place in common:
                value[row].copy_(given[name][place])
            fresh += [name] if len(common) < len(scheme.spectra) else []
        elif name in given and given[name].shape == value.shape:
            value.copy_(given[name])
        else:
            fresh.append(name)
    if len(fresh) == len(state):
        raise InputError(f"--start: {start.name} has no weights that fit this network")
    print(f"training: starts from {start.name}, fresh weights: {fresh or 'none'}", file=sys.stderr)
    return fresh
