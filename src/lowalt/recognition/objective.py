"""The loss of a training batch: all stations together and, by a weight, each station alone."""

import torch
from torch import nn

from lowalt.recognition.inference import Machine


def objective(
    model: nn.Module, images: torch.Tensor, labels: torch.Tensor, block: dict, machine: Machine
) -> torch.Tensor:
    """Return the loss of a batch: cross entropy of all views together and, by `alone`, of each station alone.

    images (B, K * V, S, S) uint8, labels (B,); block: the training settings. The two parts are averaged by weight.
    """
    criterion = nn.CrossEntropyLoss(label_smoothing=block["label_smoothing"])
    stations = images.shape[1] // unwrapped(model).shape[1]
    weight = block["alone"] if stations > 1 else 0
    with machine.autocast():
        found = model(images, alone=bool(weight))
    if not weight:
        return criterion(found.float(), labels)
    together, alone = found
    each = criterion(alone.float(), labels.repeat_interleave(stations))
    return (criterion(together.float(), labels) + weight * each) / (1 + weight)


def unwrapped(model: nn.Module) -> nn.Module:
    """Return the network inside wrappers of gradient exchange and compilation."""
    for name in ("module", "_orig_mod"):
        model = getattr(model, name, model)
    return model
