"""The loss of a training batch: all stations together and, by a weight, each station alone; and its
gradient.
"""

import contextlib

import torch
from torch import nn

from lowalt.recognition.inference import Machine


def objective(
    model: nn.Module, images: torch.Tensor, labels: torch.Tensor, block: dict, machine: Machine
) -> torch.Tensor:
    """Return the loss of a batch: cross entropy of all views together and, by `alone`, of each
    station alone.

    images (B, K * V, S, S) uint8, labels (B,); block: the training settings. The two parts are
    averaged by weight.
    """
    criterion = nn.CrossEntropyLoss(label_smoothing=block["label_smoothing"])
    stations = images.shape[1] // unwrapped(model).shape[1]
    weight = block["alone"] if stations > 1 else 0
    with machine.autocast():
        logits = model(images, alone=bool(weight))
    if not weight:
        return criterion(logits.float(), labels)
    together, alone = logits
    of_stations = criterion(alone.float(), labels.repeat_interleave(stations))
    return (criterion(together.float(), labels) + weight * of_stations) / (1 + weight)


def descent(
    model: nn.Module, images: torch.Tensor, labels: torch.Tensor, block: dict, machine: Machine
) -> torch.Tensor:
    """Add the gradient of a batch's loss to the weights' gradients, and return the loss, which has
    none itself.

    images, labels, block: as `objective`. The batch goes through the network in `accumulate` parts,
    each weighted by its share of the samples, so the gradient is that of the whole batch except for
    rounding and batch norms. The ranks exchange gradients once, with the last part.
    """
    parts = list(
        zip(images.chunk(block["accumulate"]), labels.chunk(block["accumulate"]), strict=True)
    )
    total = torch.zeros((), device=machine.device)
    for number, (part, part_labels) in enumerate(parts, start=1):
        alone = (
            contextlib.nullcontext()
            if machine.ranks == 1 or number == len(parts)
            else model.no_sync()
        )
        with alone:
            loss = objective(model, part, part_labels, block, machine) * (
                len(part_labels) / len(labels)
            )
            loss.backward()
        total += loss.detach()
    return total


def unwrapped(model: nn.Module) -> nn.Module:
    """Return the network inside wrappers of gradient exchange and compilation."""
    for name in ("module", "_orig_mod"):
        model = getattr(model, name, model)
    return model
