"""The height that each station measures, as a cue next to its images: how it travels and how a network takes it in.

`lowalt.recognition.track` says how it is measured.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from lowalt.common.errors import InputError

SCALE_M = 50.0
"""Height that enters the network as 1: targets on the ground are near 0, craft near 1 to 3."""
HIDDEN = 16
"""Values between the two linear layers."""


class WithHeight(NamedTuple):
    """Index images (B, K * V, S, S) uint8 of samples, and the height (B, K) float32 (m) that each station measured.

    It answers the calls of a tensor that trainings and evaluations make.
    """

    images: torch.Tensor
    height_m: torch.Tensor

    @property
    def shape(self) -> torch.Size:
        """Shape of the images."""
        return self.images.shape

    def to(self, device: torch.device, non_blocking: bool = False) -> "WithHeight":
        """Return both on a device."""
        return WithHeight(*(part.to(device, non_blocking=non_blocking) for part in self))

    def chunk(self, count: int) -> list["WithHeight"]:
        """Return the samples in at most `count` parts, as `torch.Tensor.chunk` cuts them."""
        return [WithHeight(*parts) for parts in zip(*(part.chunk(count) for part in self), strict=True)]


def measured(source: Any, numbers: np.ndarray, images: torch.Tensor) -> torch.Tensor | WithHeight:
    """Return the images of the samples `numbers`, with their heights where the source measures any."""
    heights = getattr(source, "height_m", None)
    return images if heights is None else WithHeight(images, torch.from_numpy(heights[numbers]))


def images_of(inputs: torch.Tensor | WithHeight, wanted: bool) -> torch.Tensor:
    """Return the images of a network's inputs; wanted: whether the network has the cue.

    Raises: InputError where heights are missing, or are given to a network without the cue.
    """
    if isinstance(inputs, WithHeight) != wanted:
        raise InputError(
            "network: no measured heights, expected one of each station"
            if wanted
            else "network: measured heights, expected images alone"
        )
    return inputs.images if isinstance(inputs, WithHeight) else inputs


class HeightCue(nn.Module):
    """Heights to cues for the stations' tokens: two linear layers that all stations share, so they stay a set."""

    def __init__(self, width: int) -> None:
        """width: features of a token."""
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(1, HIDDEN), nn.GELU(), nn.Linear(HIDDEN, width))

    def forward(self, height_m: torch.Tensor) -> torch.Tensor:
        """Heights (B, K) float32 (m) -> cues (B, K, width)."""
        return self.layers(height_m.unsqueeze(-1) / SCALE_M)
