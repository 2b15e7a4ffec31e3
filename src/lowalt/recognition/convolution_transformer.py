"""A transformer behind depthwise convolutions as a backbone: `dc_former_micro`, as near to DC-Former as can be said.

Source: Xue, Zhang, Ma and Wei, DC-Former Network Empowered UAV and Bird Recognition, ICCCS 2025 (IEEE 11069481). The
paper could not be read. A survey says that depth convolutions find local features and a transformer with multi-head
self-attention sees all of the spectrogram (Bai et al., arXiv 2604.02680, as a public note quotes it). Widths, depths
and the order of blocks are ours.
"""

import torch
from timm.models._efficientnet_blocks import DepthwiseSeparableConv
from timm.models.vision_transformer import VisionTransformer
from torch import nn

from lowalt.common.errors import InputError

NAMES = ("dc_former_micro",)
"""Backbones of this module."""
STRIDE = 4
"""Pixels from token to token."""


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


def backbone(name: str, size: int) -> VisionTransformer:
    """Return `dc_former_micro` as a feature extractor for size x size RGB images.

    Raises: InputError where images are smaller than 8 pixels.
    """
    if size < 2 * STRIDE:
        raise InputError(f"network: backbone {name!r} at {size} pixels, expected at least {2 * STRIDE}")
    model = VisionTransformer(
        size, STRIDE, num_classes=0, embed_dim=48, depth=3, num_heads=4, embed_layer=ConvolutionTokens
    )
    model.pretrained_cfg = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
    return model
