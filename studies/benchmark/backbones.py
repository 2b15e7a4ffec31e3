"""The audio-spectrogram transformer as a backbone: a transformer on patches that overlap.

Neighbouring patches share rows and columns, so a spectral line at the edge of one patch lies inside
the next.
Source: Gong, Chung and Glass, AST: Audio Spectrogram Transformer, Interspeech 2021 (patches of 16,
10 apart; 768 features, 12 layers, 12 heads). Ours sees colours of one spectrum where theirs sees
one channel of 128 mel bands, and starts from random weights where theirs come from ImageNet.
`ast_micro` is a small version of it.
"""

from functools import partial

import torch
from timm.models.vision_transformer import VisionTransformer
from torch import nn


class OverlappingPatches(nn.Module):
    """Patches of an image as tokens; `stride` pixels from one to the next."""

    def __init__(
        self,
        img_size: int,
        patch_size: int,
        in_chans: int,
        embed_dim: int,
        stride: int,
        **_: object,
    ) -> None:
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


def ast_micro(size: int) -> VisionTransformer:
    """Return the small audio-spectrogram transformer for RGB images of size x size pixels, at least
    6 a side.
    """
    model = VisionTransformer(
        size,
        6,
        num_classes=0,
        embed_dim=48,
        depth=3,
        num_heads=4,
        embed_layer=partial(OverlappingPatches, stride=3),
    )
    model.pretrained_cfg = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
    return model
