"""The loss of a training batch, of all stations together and of each alone, and its gradient."""

import contextlib

import torch
from torch import nn

from lowalt.recognition.inference import Machine


def objective(
    model: nn.Module, images: torch.Tensor, labels: torch.Tensor, block: dict, machine: Machine
) -> torch.Tensor:
    """Return the loss of a batch: cross entropy of all views and, by `alone`, of each station.

    images (B, K * V, S, S) uint8, labels (B,); block: the training settings. The two entropies
    are averaged by weight.
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
    """Add the gradient of a batch's loss to the weights' gradients, and return the loss.

    images, labels, block: as `objective`. The batch goes through the network in `accumulate`
    chunks, each weighted by its share of the samples, so the gradient is that of the whole batch
    except for rounding and batch norms. The ranks exchange gradients once, with the last chunk.
    """
    image_chunks = images.chunk(block["accumulate"])
    label_chunks = labels.chunk(block["accumulate"])
    total = torch.zeros((), device=machine.device)
    for number, chunk in enumerate(zip(image_chunks, label_chunks, strict=True), start=1):
        chunk_images, chunk_labels = chunk
        exchange: contextlib.AbstractContextManager = contextlib.nullcontext()
        if machine.ranks > 1 and number < len(image_chunks):
            exchange = model.no_sync()
        with exchange:
            share = len(chunk_labels) / len(labels)
            loss = objective(model, chunk_images, chunk_labels, block, machine) * share
            loss.backward()
        total += loss.detach()
    return total


def unwrapped(model: nn.Module) -> nn.Module:
    """Return the network inside wrappers of gradient exchange and compilation."""
    for name in ("module", "_orig_mod"):
        model = getattr(model, name, model)
    return model
