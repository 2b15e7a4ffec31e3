"""The weights that a file brings: finite numbers that fit their network, which is built without memory first."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

from lowalt.files.errors import InputError


def refuse_unfinite(weights: Any, path: str | Path) -> None:
    """Raise InputError naming the file where its weights are no tensors by name, or one has a NaN or an infinity."""
    if not isinstance(weights, Mapping) or not all(isinstance(value, torch.Tensor) for value in weights.values()):
        raise InputError(f"{path}: its weights are no tensors by name, expected a trained model")
    for name, value in weights.items():
        if not torch.isfinite(value).all():
            raise InputError(f"{path}: {name} has a NaN or an infinity, expected finite weights")


def refuse_unfit(weights: Mapping[str, torch.Tensor], model: nn.Module, path: str | Path) -> None:
    """Raise InputError naming the file where weights differ from those of a network in names, shapes or kind."""
    wanted = model.state_dict()
    wrong = sorted(map(str, wanted.keys() ^ weights.keys())) or [
        name for name, value in weights.items()
        if value.shape != wanted[name].shape or value.is_floating_point() != wanted[name].is_floating_point()
    ]  # fmt: skip
    if wrong:
        raise InputError(f"{path}: {len(wrong)} weights do not fit its network, first {wrong[0][:80]!r}")


def filled(make: Callable[[], nn.Module], example: Callable[[], Any], weights: Mapping[str, torch.Tensor],
           path: str | Path) -> nn.Module:  # fmt: skip
    """Return the network of `make` with the weights of a file.

    It is built, and answers `example`, on torch's device without memory first: a network that its weights do not fill
    takes none. Raises: InputError naming the file where they do not fit.
    """
    with torch.device("meta"), torch.inference_mode():
        trial = make().eval()
        refuse_unfit(weights, trial, path)
        trial(example())
    model = make()
    model.load_state_dict(weights)
    return model
