"""Fusions next to the paper's: all tokens one after the other, and a vote of all views."""

import math

import torch
from torch import nn

from lowalt.recognition.fusion import FUSIONS, Fusion


class ConcatenationFusion(Fusion):
    """All tokens one after the other: the classifier has weights of its own for each view, and an order of stations."""

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> (B, K V features)."""
        return tokens.flatten(1)

    def each_station(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> (B * K, K, V, features): one station in its own place, zeros in the others."""
        stations = tokens.shape[1]
        own = torch.eye(stations, dtype=tokens.dtype, device=tokens.device)[:, :, None, None]
        return (tokens.unsqueeze(1) * own).flatten(0, 1)


class VotingFusion(Fusion):
    """Soft voting: every view is classified alone, and the class probabilities are averaged.

    Source: Kuncheva, Combining Pattern Classifiers, 2004, ch. 5.
    """

    def decided(self, tokens: torch.Tensor, classifier: nn.Module) -> torch.Tensor:
        """Tokens (B, K, V, features) -> log of the mean class probabilities (B, classes)."""
        votes = classifier(tokens).float().log_softmax(-1).flatten(1, 2)
        return votes.logsumexp(1) - math.log(votes.shape[1])


FUSIONS["concatenation"] = lambda width, shape, block: ConcatenationFusion(width * math.prod(shape))
FUSIONS["voting"] = lambda width, shape, block: VotingFusion(width)
