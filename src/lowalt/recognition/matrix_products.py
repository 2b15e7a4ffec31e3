"""Convolutions computed as one matrix product: with 1 x 1 kernels, or an output of one pixel.

A small backbone on small images ends in convolutions of a few pixels, most of whose weights only
meet the padding. In float32 on a processor, the gradients of these took a sixth of a step's time.
"""

from typing import Any

import torch
from torch import nn


def _span(size: int, kernel: int, stride: int, padding: int) -> tuple[int, int] | None:
    """Return how many input pixels meet the kernel along an axis, and the first weight that does.

    None where the output along this axis has another number of pixels than one.
    """
    if padding >= kernel or (size + 2 * padding - kernel) // stride:
        return None
    return min(size, kernel - padding), padding


class _OnePixel(torch.autograd.Function):
    """The product of all input pixels with the weights that meet them: the only output pixel."""

    @staticmethod
    def forward(
        context: Any, images: torch.Tensor, weight: torch.Tensor, at: tuple[slice, ...]
    ) -> torch.Tensor:
        """Images (B, C, r, c) and weight (O, C, kernel) -> (B, O).

        at: the kernel's rows and columns that meet the images.
        """
        seen = images.permute(0, 2, 3, 1).flatten(1)
        met = weight[at].permute(0, 2, 3, 1).flatten(1)
        context.save_for_backward(seen, met, weight)
        context.at = at
        context.images = images.shape
        return seen @ met.t()

    @staticmethod
    def backward(
        context: Any, gradient: torch.Tensor
    ) -> tuple[torch.Tensor | None, torch.Tensor, None]:
        """Return the gradients of images and weights, zero for weights that meet only padding."""
        seen, met, weight = context.saved_tensors
        _, channels, rows, columns = context.images
        spread = (-1, rows, columns, channels)
        of_weight = torch.zeros_like(weight)
        of_weight[context.at] = (gradient.t() @ seen).view(spread).permute(0, 3, 1, 2)
        of_images = None
        if context.needs_input_grad[0]:
            of_images = (gradient @ met).view(spread).permute(0, 3, 1, 2)
        return of_images, of_weight, None


class MatrixProduct(nn.Conv2d):
    """`nn.Conv2d`, as a matrix product where it is one.

    Results differ by the order of sums only.
    """

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Images (B, C, rows, columns) -> (B, O, rows, columns)."""
        if self.kernel_size == self.stride == (1, 1) and self.padding == (0, 0):
            return nn.functional.linear(
                images.permute(0, 2, 3, 1), self.weight.flatten(1), self.bias
            ).movedim(-1, 1)
        axes = zip(images.shape[2:], self.kernel_size, self.stride, self.padding, strict=True)
        down, across = (_span(*axis) for axis in axes)
        if down is None or across is None:
            return super().forward(images)
        rows, top = down
        columns, left = across
        at = (slice(None), slice(None), slice(top, top + rows), slice(left, left + columns))
        product = _OnePixel.apply(images[:, :, :rows, :columns], self.weight, at)
        if self.bias is not None:
            product = product + self.bias
        return product[:, :, None, None]


def as_products(model: nn.Module) -> nn.Module:
    """Let every plain 2-D convolution of a model be a `MatrixProduct`, in place.

    Weights and their names stay.
    """
    for layer in model.modules():
        plain = type(layer) is nn.Conv2d and layer.groups == 1 and layer.padding_mode == "zeros"
        if plain and not isinstance(layer.padding, str) and layer.dilation == (1, 1):
            layer.__class__ = MatrixProduct
    return model
