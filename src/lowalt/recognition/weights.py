"""The weights that a file brings: finite numbers that fit their network.

The network is built in limited memory.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

from lowalt.files.errors import InputError
from lowalt.machine.memory import at_most


def refuse_unfinite(weights: Any, path: str | Path) -> None:
    """Refuse weights of a file that are no tensors by name, or have a NaN or an infinity.

    Raises: InputError naming the file.
    """
    if not isinstance(weights, Mapping) or not all(
        isinstance(value, torch.Tensor) for value in weights.values()
    ):
        raise InputError(f"{path}: its weights are no tensors by name, expected a trained model")
    for name, value in weights.items():
        if not torch.isfinite(value).all():
            raise InputError(f"{path}: {name} has a NaN or an infinity, expected finite weights")


def refuse_unfit(weights: Mapping[str, torch.Tensor], model: nn.Module, path: str | Path) -> None:
    """Refuse weights of a file that differ from a network's in names, shapes or kind.

    Raises: InputError naming the file.
    """
    wanted = model.state_dict()
    wrong = sorted(map(str, wanted.keys() ^ weights.keys())) or [
        name
        for name, value in weights.items()
        if value.shape != wanted[name].shape
        or value.is_floating_point() != wanted[name].is_floating_point()
    ]
    if wrong:
        raise InputError(
            f"{path}: {len(wrong)} weights do not fit its network, first {wrong[0][:80]!r}"
        )


ROOM_BYTES = 1_500_000_000
"""Memory that a network of a file may take to be built and to answer once, beyond a few copies of
its weights.
"""


def filled(
    make: Callable[[], nn.Module],
    example: Callable[[], Any],
    weights: Mapping[str, torch.Tensor],
    path: str | Path,
) -> nn.Module:
    """Return the network of `make` with the weights of a file, once it has answered `example`.

    A file of a few bytes may name a network that no machine holds, so memory is limited by what its
    weights take.
    Raises: InputError naming the file where they do not fit, or its network would take more.
    """
    sizes = sum(value.numel() * value.element_size() for value in weights.values())
    try:
        with at_most(ROOM_BYTES + 4 * sizes):
            model = make().eval()
            refuse_unfit(weights, model, path)
            model.load_state_dict(weights)
            with torch.inference_mode():
                model(example())
    except (MemoryError, RuntimeError, InputError) as error:
        if isinstance(error, MemoryError) or "allocate memory" in str(error):
            raise InputError(
                f"{path}: its weights do not fit its network, which needs far more memory"
            ) from error
        raise
    return model
