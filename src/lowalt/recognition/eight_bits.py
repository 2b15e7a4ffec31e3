"""Weights in 8 bits: each row of a matrix as whole numbers -127..127 and one scale, a quarter of the bytes of float32.

A row holds the weights of one output of a layer; the rest (biases, norms, running means, colours) stays as it is. A
weight moves by at most half a step, 1/254 of the largest weight of its row.
Source: per-channel symmetric weights of Krishnamoorthi, Quantizing deep convolutional networks, arXiv:1806.08342, 2018.
"""

from collections.abc import Collection, Mapping

import torch

SCALE = ".scale"
"""Added to the name of a matrix: the name of its scales, (rows,) float32."""
LARGEST = 127


def rounded(weights: Mapping[str, torch.Tensor], matrices: Collection[str]) -> dict[str, torch.Tensor]:
    """Return weights by name, those named in `matrices` as int8 of the same shape, their scales with them.

    weights: float32 (rows, ...) where they are to be rounded.
    """
    stored = {}
    for name, value in weights.items():
        if name not in matrices:
            stored[name] = value
            continue
        rows = value.contiguous().flatten(1)
        scale = rows.abs().amax(1) / LARGEST
        # A row of zeros keeps them with any scale.
        steps = rows / torch.where(scale > 0, scale, 1)[:, None]
        stored[name] = steps.round().clamp(-LARGEST, LARGEST).to(torch.int8).view(value.shape)
        stored[name + SCALE] = scale
    return stored


def restored(tensors: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return the weights by name, all as the network takes them: rows times scales.

    Raises: KeyError for an int8 matrix without scales.
    """
    scales = {name + SCALE for name, value in tensors.items() if value.dtype == torch.int8}
    weights = {}
    for name, value in tensors.items():
        if value.dtype == torch.int8:
            weights[name] = (value.flatten(1).float() * tensors[name + SCALE][:, None]).view(value.shape)
        elif name not in scales:
            weights[name] = value
    return weights
