"""Checkpoints, written atomically; a damaged one, or one of another run, is refused.

A file holds {"identity": JSON text, "digest": SHA-256 of every tensor, ...state}. The identity
holds everything that determines the weights (settings, scheme, protocol, samples). A training
resumes only from a file of its own identity.
"""

import hashlib
import json
import math
import zipfile
from pathlib import Path

import torch

from lowalt.config.schema import check_brought
from lowalt.files.array_files import most_expanded
from lowalt.files.atomic import existing, replacing
from lowalt.files.errors import InputError, in_one_line, shown
from lowalt.files.json_objects import json_object

VALUE_BYTES = 100
"""A value of a state counts as at least this many bytes."""


def _digest(state: object, most: float = math.inf) -> str:
    """SHA-256 of all values of a state, in their order.

    Raises: ValueError for more than `most` bytes: lists that hold one list twice, level upon level,
    make billions of values of a few bytes.
    """
    hasher = hashlib.sha256()
    total = 0

    def walk(value: object) -> None:
        """Feed a value, and all values inside it, to the hasher."""
        nonlocal total
        total += VALUE_BYTES
        if isinstance(value, torch.Tensor):
            total += value.numel() * value.element_size()
        if total > most:
            raise ValueError(f"values of more than {most} bytes")
        if isinstance(value, torch.Tensor):
            # A tensor with stride 0 can claim more elements than its storage has; refuse it.
            if value.numel() * value.element_size() > value.untyped_storage().nbytes():
                raise ValueError(f"a tensor of shape {tuple(value.shape)} in fewer bytes")
            raw = value.detach().cpu().contiguous()
            hasher.update(f"{raw.dtype}{tuple(raw.shape)}".encode())
            hasher.update(raw.flatten().view(torch.uint8).numpy().tobytes())
        elif isinstance(value, dict):
            for key, entry in value.items():
                hasher.update(repr(key).encode())
                walk(entry)
        elif isinstance(value, (list, tuple)):
            for entry in value:
                walk(entry)
        else:
            hasher.update(repr(value).encode())

    walk(state)
    return hasher.hexdigest()


def identity(**parts: object) -> str:
    """Return the JSON text that names a run; equal parts give equal text."""
    return json.dumps(parts, sort_keys=True)


def save(path: str | Path, name: str, state: dict) -> None:
    """Write `state` (tensors, numbers, text, nested dicts and lists) of the run `name`."""
    # Pass an open file: torch would write the name of a path, which here holds a process id, into
    # the archive.
    with replacing(path) as temporary, temporary.open("wb") as file:
        torch.save({"identity": name, "digest": _digest(state), "state": state}, file)


def _facts(identity: str) -> dict:
    """The parts of an identity (JSON text); empty where it is not JSON."""
    try:
        return json_object(identity, "checkpoint", "an identity")
    except InputError:
        return {}


def load(path: str | Path, name: str | None = None) -> tuple[str, dict]:
    """Return the identity and the state of a checkpoint.

    name: the identity it must have, or None for any.
    Raises: InputError naming the file where it is missing, damaged, or of another run (with the
    parts that differ).
    """
    most = most_expanded(existing(path, "checkpoint").stat().st_size)
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                if sum(member.file_size for member in archive.infolist()) > most:
                    raise ValueError(f"its members expand to more than {most} bytes")
        # Load tensors and plain values only, so that a checkpoint from elsewhere cannot run code.
        content = torch.load(path, map_location="cpu", weights_only=True)
        stored = content["identity"]
        digest = content["digest"]
        state = content["state"]
        computed = _digest(state, most)
        named = isinstance(stored, str)
    except Exception as error:
        # For damaged bytes torch's reader raises almost any exception.
        raise InputError(f"{path}: not a checkpoint ({in_one_line(error)})") from error
    if not named:
        raise InputError(
            f"{path}: not a checkpoint (its identity is {type(stored).__name__}, expected text)"
        )
    if computed != digest:
        raise InputError(f"{path}: checkpoint is damaged, its values do not match their SHA-256")
    if name is not None and stored != name:
        theirs = _facts(stored)
        ours = _facts(name)
        differs = sorted(
            key for key in theirs.keys() | ours.keys() if theirs.get(key) != ours.get(key)
        )
        raise InputError(f"{path}: checkpoint of another run, its {', '.join(differs)} differ")
    return stored, state


def check_model(facts: dict, settings: dict, path: str | Path) -> None:
    """Refuse a model file whose settings are wrong or contradict the identity of its training.

    facts: its identity; settings: of its network; path: the file. Raises: InputError naming the
    setting that is wrong.
    """
    check_brought("model", settings, path)
    trained = facts.get("settings")
    if not isinstance(trained, dict):
        trained = {}
    named = {
        "network": trained,
        "size": trained,
        "colour_map": trained,
        "classes": trained,
        "protocol": facts,
    }
    if isinstance(facts.get("scheme"), dict):
        named["scheme"] = facts
    for key, block in named.items():
        said = block.get(key)
        meant = json.loads(json.dumps(settings.get(key)))
        if None in (said, meant) or said == meant:
            continue
        if isinstance(said, dict) and isinstance(meant, dict):
            inner = next(name for name in {**meant, **said} if meant.get(name) != said.get(name))
            key = f"{key}.{inner}"
            said = said.get(inner)
            meant = meant.get(inner)
        raise InputError(
            f"{path}: {key} is {shown(meant)}, expected {shown(said)}, with which it was trained"
        )
