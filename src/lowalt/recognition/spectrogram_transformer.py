"""An audio-spectrogram transformer as a backbone: timm's vision transformer on patches that overlap.

Neighbouring patches share rows and columns, so a spectral line at the edge of one patch lies inside the next.
Source: Gong, Chung and Glass, AST: Audio Spectrogram Transformer, Interspeech 2021 (patches of 16, 10 apart; 768
features, 12 layers, 12 heads: `ast_base`). Ours sees colours of one spectrum where theirs sees one channel of 128 mel
bands, and starts from random weights where theirs come from ImageNet. `ast_micro` is a small version of it.
"""

from typing import NamedTuple

import torch
from timm.models.vision_transformer import VisionTransformer
from torch import nn

from lowalt.common.errors import InputError


class Shape(NamedTuple):
    """Pixels a side of a patch, pixels from patch to patch, features, layers and attention heads."""

    patch: int
    stride: int
    width: int
    depth: int
    heads: int


SHAPES = {"ast_micro": Shape(6, 3, 48, 3, 4), "ast_base": Shape(16, 10, 768, 12, 12)}
"""Backbones of this module by name."""


class OverlappingPatches(nn.Module):
    """Patches of an image as tokens; `stride` pixels from one to the next."""

    def __init__(
        self, img_size: int, patch_size: int, in_chans: int, embed_dim: int, stride: int, **_: object
    ) -> None:  # fmt: skip
        """Take the arguments of timm's patch embeddings; those not named here change nothing."""
        super().__init__()
        self.stride, self.grid = stride, (img_size - patch_size) // stride + 1
        self.num_patches = self.grid**2
        self.proj = nn.Conv2d(in_chans, embed_dim, patch_size, stride)

    def feat_ratio(self) -> int:
        """Return the pixels between neighbouring tokens."""
        return self.stride

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Images (B, channels, rows, columns) -> tokens (B, patches, features)."""
        return self.proj(images).flatten(2).transpose(1, 2)


def backbone(name: str, size: int) -> VisionTransformer:
    """Return the transformer `name` of `SHAPES` as a feature extractor for size x size RGB images.

    Raises: InputError where images are smaller than a patch.
    """
    shape = SHAPES[name]
    if size < shape.patch:
        raise InputError(f"network: backbone {name!r} at {size} pixels, expected at least {shape.patch}")

    def patches(**given: object) -> OverlappingPatches:
        """The patch embedding that timm asks for, with this transformer's stride."""
        return OverlappingPatches(**given, stride=shape.stride)

    model = VisionTransformer(
        size, shape.patch, num_classes=0, embed_dim=shape.width, depth=shape.depth, num_heads=shape.heads,
        embed_layer=patches,
    )  # fmt: skip
    model.pretrained_cfg = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
    return model
