"""Fusion: how the tokens of all views become one decision.

Attention is the paper's proposal, mean its baseline.
Axes: B samples, K stations, V views of a station, then features. A fusion offers
    forward    tokens (B, K, V, features) -> fused feature (B, width)
    decided    tokens and the classifier -> logits (B, classes)
    both       the logits of all stations together, and of each as if it were the only one
"""

from collections.abc import Callable

import torch
from torch import nn

from lowalt.files.errors import InputError

EMBEDDING_STD = 0.02
"""Standard deviation of the first values of embeddings, as in vision transformers."""


def encoder(width: int, depth: int, heads: int, feed_forward: float, dropout: float) -> nn.Module:
    """Return a transformer encoder of `depth` layers over tokens of `width` features.

    It is the identity for depth 0.
    """
    if depth == 0:
        return nn.Identity()
    layer = nn.TransformerEncoderLayer(
        width,
        heads,
        round(width * feed_forward),
        dropout,
        activation="gelu",
        batch_first=True,
        norm_first=True,
    )
    # Pre-norm layers leave their sum unnormalised: the stack needs a norm of its own.
    return nn.TransformerEncoder(layer, depth, norm=nn.LayerNorm(width), enable_nested_tensor=False)


class Fusion(nn.Module):
    """Any fusion of tokens into one feature of `width` values, which the classifier then reads."""

    def __init__(self, width: int) -> None:
        """width: values of the fused feature."""
        super().__init__()
        self.width = width

    def decided(self, tokens: torch.Tensor, classifier: nn.Module) -> torch.Tensor:
        """Tokens (B, K, V, features) -> logits (B, classes)."""
        return classifier(self(tokens))

    def both(
        self, tokens: torch.Tensor, classifier: nn.Module
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Tokens (B, K, V, features) -> logits (B, classes), and (B * K, classes) per station."""
        of_all = self.decided(tokens, classifier)
        # B * K samples of one station each.
        alone = tokens.flatten(0, 1).unsqueeze(1)
        of_each = self.decided(alone, classifier)
        return of_all, of_each


class AttentionFusion(Fusion):
    """The paper's fusion: encoder and mean pool over spectra, then encoder and max pool."""

    def __init__(self, width: int, views: int, block: dict) -> None:
        """width: features of a token; views: of a station; block: the network's settings.

        Raises: InputError for heads that do not divide the features.
        """
        super().__init__(width)
        if width % block["heads"]:
            raise InputError(
                f"network: heads is {block['heads']}, expected a divisor of the {width} features"
            )
        self.modality = nn.Parameter(torch.empty(views, width))
        nn.init.trunc_normal_(self.modality, std=EMBEDDING_STD)
        self.draws = block["dropout"] > 0
        shape = (block["heads"], block["feed_forward"], block["dropout"])
        self.intra = encoder(width, block["intra_depth"], *shape)
        self.inter = encoder(width, block["inter_depth"], *shape)

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> fused feature (B, features).

        Source: paper, section IV-F.
        """
        return self.inter(self.stations(tokens)).amax(dim=1)

    def stations(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> one token per station (B, K, features)."""
        station = self.intra((tokens + self.modality).flatten(0, 1)).mean(dim=1)
        return station.unflatten(0, tokens.shape[:2])

    def both(
        self, tokens: torch.Tensor, classifier: nn.Module
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Compute `Fusion.both`.

        The encoder over spectra runs once, except where dropout draws anew for the two results.
        """
        if self.draws and self.training:
            return super().both(tokens, classifier)
        station = self.stations(tokens)
        alone = station.flatten(0, 1).unsqueeze(1)
        of_all = classifier(self.inter(station).amax(dim=1))
        of_each = classifier(self.inter(alone).amax(dim=1))
        return of_all, of_each


class MeanFusion(Fusion):
    """The paper's baseline: the mean of all tokens."""

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> their mean (B, features)."""
        return tokens.mean(dim=(1, 2))


FUSIONS: dict[str, Callable[[int, tuple[int, int], dict], Fusion]] = {
    "attention": lambda width, shape, block: AttentionFusion(width, shape[1], block),
    "mean": lambda width, shape, block: MeanFusion(width),
}
"""How each fusion is made of the features of a token, (stations, views of a station) and the
network's settings.
"""


class Fused(nn.Module):
    """A network of tokens, fusion and classifier.

    A subclass makes `backbone` and says how inputs become tokens.
    """

    def add_head(
        self, name: str, width: int, shape: tuple[int, int], block: dict, classes: int
    ) -> None:
        """Add fusion and classifier behind the tokens.

        name: a key of FUSIONS; width: features of a token; shape: stations, views of a station;
        block: `recognition.network`.
        Raises: InputError for heads that do not divide the features.
        """
        self.shape = shape
        self.classes = classes
        self.fusion = FUSIONS[name](width, shape, block)
        width = self.fusion.width
        if block["hidden"]:
            self.classifier = nn.Sequential(
                nn.Linear(width, block["hidden"]),
                nn.GELU(),
                nn.Dropout(block["dropout"]),
                nn.Linear(block["hidden"], classes),
            )
        else:
            self.classifier = nn.Linear(width, classes)

    def tokens(self, inputs: torch.Tensor) -> torch.Tensor:
        """Inputs of all views -> tokens (B, K, V, features)."""
        raise NotImplementedError

    def forward(
        self, inputs: torch.Tensor, alone: bool = False
    ) -> torch.Tensor | tuple[torch.Tensor, torch.Tensor]:
        """Inputs of all views (B, K * V, ...), station-major -> logits (B, classes).

        alone: return as well the logits (B * K, classes) of each station as if it were the only
        one; the backbone runs once.
        """
        decide = self.fusion.both if alone else self.fusion.decided
        return decide(self.tokens(inputs), self.classifier)
