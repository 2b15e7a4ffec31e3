"""Networks on the complex slow-time signals of the stations, without spectra: tokens, fusion and
classifier.

A backbone turns signals (B, N) complex of unit power into features (B, width); the stations share
it, and fuse as the images' views do. A scheme names one as its backbone:
    cnn          real convolutions over time, real and imaginary part as two channels
    complex      complex convolutions, whose features do not depend on the signal's phase
    transformer  an encoder over short pieces of the signal
"""

from collections.abc import Callable
from dataclasses import replace

import torch
from torch import nn

from lowalt.config.command import pick
from lowalt.files.errors import InputError
from lowalt.recognition.fusion import Fused, encoder
from lowalt.recognition.recogniser import KEYS
from lowalt.recognition.schemes import Scheme

# Channels, symbols of the kernel and symbols from output to output of each layer.
LAYERS = ((24, 9, 2), (48, 7, 2), (64, 5, 2), (96, 5, 2))
COMPLEX_LAYERS = ((16, 9, 2), (32, 7, 2), (48, 5, 2), (64, 5, 2))
PIECE = 16
"""Symbols of a piece of the signal that the transformer takes as one token."""
TOKEN = 64
DEPTH = 3


class Convolutions(nn.Module):
    """A one-dimensional convolutional network with mean and maximum over time.

    Source: Wang, Yan and Oates, Time Series Classification from Scratch with Deep Neural Networks,
    IJCNN 2017. Group norm instead of batch norm: statistics of one signal are the same on any
    number of ranks.
    """

    def __init__(self, symbols: int) -> None:
        """symbols: of a signal; any number works."""
        super().__init__()
        layers = []
        channels = 2
        for count, kernel, stride in LAYERS:
            layers += [
                nn.Conv1d(channels, count, kernel, stride, kernel // 2),
                nn.GroupNorm(8, count),
                nn.GELU(),
            ]
            channels = count
        self.layers = nn.Sequential(*layers)
        self.width = 2 * channels

    def forward(self, signals: torch.Tensor) -> torch.Tensor:
        """Signals (B, N) complex -> features (B, width)."""
        found = self.layers(torch.view_as_real(signals).transpose(1, 2))
        return torch.cat([found.mean(-1), found.amax(-1)], dim=-1)


class ComplexConvolution(nn.Module):
    """One complex convolution, normalised to unit power per channel group, with modReLU as its
    nonlinearity.

    No bias and no mean is taken off, so a signal turned by a phase gives the same output turned by
    that phase.
    Source: Trabelsi et al., Deep Complex Networks, ICLR 2018 (initial weights); Arjovsky, Shah and
    Bengio, Unitary Evolution Recurrent Neural Networks, ICML 2016 (modReLU).
    """

    def __init__(self, channels: int, count: int, kernel: int, stride: int) -> None:
        """channels, count: of input and output; kernel, stride: in symbols."""
        super().__init__()
        self.stride = stride
        self.padding = kernel // 2
        # Rayleigh magnitudes and uniform phases are independent normal real and imaginary parts.
        deviation = (2 * channels * kernel) ** -0.5
        self.real = nn.Parameter(deviation * torch.randn(count, channels, kernel))
        self.imaginary = nn.Parameter(deviation * torch.randn(count, channels, kernel))
        self.scale = nn.Parameter(torch.ones(count, 1))
        self.threshold = nn.Parameter(torch.full((count, 1), -0.1))

    def forward(self, signals: torch.Tensor) -> torch.Tensor:
        """Signals (B, channels, N) complex -> (B, count, N / stride) complex."""
        weight = torch.complex(self.real, self.imaginary)
        found = nn.functional.conv1d(signals, weight, stride=self.stride, padding=self.padding)
        power = torch.view_as_real(found).square().sum(-1).mean((1, 2), keepdim=True)
        found = found * (self.scale * torch.rsqrt(power + 1e-6))
        # The square root's slope is endless at zero.
        size = torch.sqrt(torch.view_as_real(found).square().sum(-1) + 1e-6)
        return found * (torch.relu(size + self.threshold) / size)


class ComplexConvolutions(nn.Module):
    """A complex-valued convolutional network; mean and maximum of the magnitudes over time are its
    features.
    """

    def __init__(self, symbols: int) -> None:
        """symbols: of a signal; any number works."""
        super().__init__()
        counts = [1, *(count for count, _, _ in COMPLEX_LAYERS)]
        layers = [
            ComplexConvolution(before, *layer)
            for before, layer in zip(counts, COMPLEX_LAYERS, strict=False)
        ]
        self.layers = nn.Sequential(*layers)
        self.width = 2 * counts[-1]

    def forward(self, signals: torch.Tensor) -> torch.Tensor:
        """Signals (B, N) complex -> features (B, width), the same for signals turned by a phase."""
        found = self.layers(signals.unsqueeze(1))
        size = torch.sqrt(torch.view_as_real(found).square().sum(-1) + 1e-6)
        return torch.cat([size.mean(-1), size.amax(-1)], dim=-1)


class Pieces(nn.Module):
    """A small transformer: pieces of PIECE symbols as tokens, their places learned, the mean of all
    as the feature.

    Source: Vaswani et al., Attention Is All You Need, NeurIPS 2017; pieces as in Nie et al., A Time
    Series is Worth 64 Words, ICLR 2023.
    """

    def __init__(self, symbols: int) -> None:
        """symbols: of a signal; symbols after the last whole piece are left out.

        Raises: InputError where signals are shorter than a piece.
        """
        super().__init__()
        if symbols < PIECE:
            raise InputError(f"network: signals of {symbols} symbols, expected at least {PIECE}")
        self.count = symbols // PIECE
        self.width = TOKEN
        self.embed = nn.Linear(2 * PIECE, TOKEN)
        self.place = nn.Parameter(0.02 * torch.randn(self.count, TOKEN))
        self.encode = encoder(TOKEN, DEPTH, 4, 2, 0.0)

    def forward(self, signals: torch.Tensor) -> torch.Tensor:
        """Signals (B, N) complex -> features (B, width)."""
        pieces = torch.view_as_real(signals[:, : self.count * PIECE].contiguous())
        tokens = self.embed(pieces.reshape(len(signals), self.count, 2 * PIECE)) + self.place
        return self.encode(tokens).mean(1)


BACKBONES = {"cnn": Convolutions, "complex": ComplexConvolutions, "transformer": Pieces}


class SignalRecogniser(Fused):
    """Slow-time signals of a scheme's stations to a logit for each class: shared backbone, fusion,
    classifier.
    """

    def __init__(self, scheme: Scheme, block: dict, symbols: int, classes: int) -> None:
        """scheme: stations, backbone and fusion; block: `recognition.network`; symbols: of a
        signal; classes: their number.

        Raises: InputError for an unknown or missing key, or heads that do not fit.
        """
        super().__init__()
        pick(block, *KEYS)
        self.backbone = BACKBONES[scheme.backbone](symbols)
        self.add_head(scheme.fusion, self.backbone.width, (len(scheme.stations), 1), block, classes)

    def tokens(self, signals: torch.Tensor) -> torch.Tensor:
        """Signals (B, K, N) complex64 -> tokens (B, K, 1, features); each signal is brought to unit
        power.
        """
        power = torch.view_as_real(signals).square().sum(-1).mean(-1, keepdim=True)
        scaled = signals * torch.rsqrt(torch.where(power > 0, power, 1))
        return self.backbone(scaled.flatten(0, 1)).unflatten(0, signals.shape[:2]).unsqueeze(2)

    @staticmethod
    def mirrored(signals: torch.Tensor) -> torch.Tensor:
        """Return the signals with the opposite Doppler frequencies: the target turned by 180
        degrees.
        """
        return signals.conj().resolve_conj()


def builder(backbone: str) -> Callable[[Scheme, dict, int, str, int], SignalRecogniser]:
    """Return the function that builds a network on signals with fresh weights; backbone: a name of
    BACKBONES.
    """

    def built(
        scheme: Scheme, block: dict, size: int, colours: str, classes: int
    ) -> SignalRecogniser:
        """Return a network on signals of `size` symbols."""
        return SignalRecogniser(replace(scheme, backbone=backbone), block, size, classes)

    return built
