"""Checkpoints: written atomically; one that is damaged or of another run is refused with an error that names it.

A file holds {"identity": JSON text, "digest": SHA-256 of every tensor, ...state}. The identity holds everything that
determines the weights (settings, scheme, protocol, samples); a file of another identity is never resumed.
"""

import hashlib
import json
from pathlib import Path

import torch

from lowalt.common.errors import InputError
from lowalt.common.files import existing, replacing


def _digest(state: object) -> str:
    """SHA-256 of all values of a state, in their order."""
    hasher = hashlib.sha256()

    def walk(value: object) -> None:
        """Feed a value, and all values inside it, to the hasher."""
        if isinstance(value, torch.Tensor):
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
    # Pass an open file: torch would write the name of a path, which here holds a process id, into the archive.
    with replacing(path) as temporary, temporary.open("wb") as file:
        torch.save({"identity": name, "digest": _digest(state), "state": state}, file)


def load(path: str | Path, name: str | None = None) -> tuple[str, dict]:
    """Return the identity and the state of a checkpoint.

    name: the identity it must have, or None for any.
    Raises: InputError naming the file where it is missing, damaged, or of another run (with the parts that differ).
    """
    existing(path, "checkpoint")
    try:
        # Load tensors and plain values only, so that a checkpoint from elsewhere cannot run code.
        content = torch.load(path, map_location="cpu", weights_only=True)
        found, digest, state = content["identity"], content["digest"], content["state"]
    except Exception as error:
        # torch's reader meets damaged bytes with nearly any exception.
        raise InputError(f"{path}: not a checkpoint ({str(error)[:200]})") from error
    if _digest(state) != digest:
        raise InputError(f"{path}: checkpoint is damaged, its values do not match their SHA-256")
    if name is not None and found != name:
        theirs, ours = json.loads(found), json.loads(name)
        differs = sorted(key for key in theirs.keys() | ours.keys() if theirs.get(key) != ours.get(key))
        raise InputError(f"{path}: checkpoint of another run, its {', '.join(differs)} differ")
    return found, state
