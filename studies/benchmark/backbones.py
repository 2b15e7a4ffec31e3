"""Transformers as backbones: on patches that overlap (audio-spectrogram transformer), and behind convolutions.

Neighbouring patches share rows and columns, so a spectral line at the edge of one patch lies inside the next.
Source: Gong, Chung and Glass, AST: Audio Spectrogram Transformer, Interspeech 2021 (patches of 16, 10 apart; 768
features, 12 layers, 12 heads: `ast_base`). Ours sees colours of one spectrum where theirs sees one channel of 128 mel
bands, and starts from random weights where theirs come from ImageNet. `ast_micro` is a small version of it.
"""

from functools import partial
from typing import NamedTuple

import torch
from timm.models._efficientnet_blocks import DepthwiseSeparableConv
from timm.models.vision_transformer import VisionTransformer
from torch import nn


class Shape(NamedTuple):
    """Pixels a side of a patch, pixels from patch to patch, features, layers and attention heads."""

    patch: int
    stride: int
    width: int
    depth: int
    heads: int


STRIDE = 4
"""Pixels from token to token behind convolutions."""


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


def transformer(shape: Shape, size: int) -> VisionTransformer:
    """Return a transformer on overlapping patches as a feature extractor for size x size RGB images."""
    model = VisionTransformer(
        size, shape.patch, num_classes=0, embed_dim=shape.width, depth=shape.depth, num_heads=shape.heads,
        embed_layer=partial(OverlappingPatches, stride=shape.stride),
    )  # fmt: skip
    model.pretrained_cfg = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
    return model


def ast_micro(size: int) -> VisionTransformer:
    """Return the small audio-spectrogram transformer for images of at least 6 pixels a side."""
    return transformer(Shape(6, 3, 48, 3, 4), size)


def ast_base(size: int) -> VisionTransformer:
    """Return the published audio-spectrogram transformer's size for images of at least 16 pixels a side."""
    return transformer(Shape(16, 10, 768, 12, 12), size)


class ConvolutionTokens(nn.Module):
    """Tokens of an image by one dense and two depthwise convolutions; a token is STRIDE pixels from the next."""

    def __init__(self, img_size: int, in_chans: int, embed_dim: int, **_: object) -> None:
        """Take the arguments of timm's patch embeddings; those not named here change nothing."""
        super().__init__()
        self.num_patches = (-(-img_size // STRIDE)) ** 2
        self.stem = nn.Conv2d(in_chans, embed_dim // 2, 3, 2, 1)
        self.local = nn.Sequential(
            DepthwiseSeparableConv(embed_dim // 2, embed_dim, dw_kernel_size=3, stride=2, pad_type=""),
            DepthwiseSeparableConv(embed_dim, embed_dim, dw_kernel_size=3, pad_type=""),
        )

    def feat_ratio(self) -> int:
        """Return the pixels between neighbouring tokens."""
        return STRIDE

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Images (B, channels, rows, columns) -> tokens (B, patches, features)."""
        return self.local(self.stem(images)).flatten(2).transpose(1, 2)


def dc_former_micro(size: int) -> VisionTransformer:
    """Return a transformer behind depthwise convolutions for images of at least 8 pixels a side.

    As near to DC-Former as can be said. Source: Xue, Zhang, Ma and Wei, DC-Former Network Empowered UAV and Bird
    Recognition, ICCCS 2025 (IEEE 11069481). The paper could not be read. A survey says that depth convolutions find
    local features and a transformer with multi-head self-attention sees all of the spectrogram (Bai et al., arXiv
    2604.02680, as a public note quotes it). Widths, depths and the order of blocks are ours.
    """
    model = VisionTransformer(
        size, STRIDE, num_classes=0, embed_dim=48, depth=3, num_heads=4, embed_layer=ConvolutionTokens
    )
    model.pretrained_cfg = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
    return model
