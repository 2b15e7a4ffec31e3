"""Fusion: how the tokens of all views become one decision. Attention is the paper's proposal, mean its baseline.

Axes: B samples, K stations, V views of a station (spectra; one for a signal), then features. A fusion offers
    forward        tokens (B, K, V, features) -> fused feature (B, width)
    decided        tokens and the classifier -> logits (B, classes)
    each_station   tokens (B, K, V, features) -> tokens of B * K samples, each as if one station were the only one
    both           the logits of all stations together, and of each alone
"""

import math

import torch
from torch import nn

from lowalt.common.errors import InputError


def encoder(width: int, depth: int, heads: int, feed_forward: float, dropout: float) -> nn.Module:
    """Return a transformer encoder of `depth` layers over tokens of `width` features; the identity for depth 0."""
    if depth == 0:
        return nn.Identity()
    layer = nn.TransformerEncoderLayer(
        width, heads, round(width * feed_forward), dropout, activation="gelu", batch_first=True, norm_first=True
    )
    # Pre-norm layers leave their sum unnormalised: the stack needs a norm of its own.
    return nn.TransformerEncoder(layer, depth, norm=nn.LayerNorm(width), enable_nested_tensor=False)


class Fusion(nn.Module):
    """Any fusion of tokens into one feature of `width` values, which the classifier then reads."""

    def __init__(self, width: int) -> None:
        """width: values of the fused feature."""
        super().__init__()
        self.width = width

    def decided(self, tokens: torch.Tensor, classifier: nn.Module, cue: torch.Tensor | None = None) -> torch.Tensor:
        """Tokens (B, K, V, features), perhaps with cues (B, K, features) -> logits (B, classes)."""
        return classifier(self(tokens) if cue is None else self(tokens, cue))

    def each_station(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> (B * K, 1, V, features), station by station."""
        return tokens.flatten(0, 1).unsqueeze(1)

    def both(
        self, tokens: torch.Tensor, classifier: nn.Module, cue: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Tokens (B, K, V, features), perhaps with cues -> logits (B, classes), and (B * K, classes) of each station
        as if it were the only one."""
        own = None if cue is None else cue.flatten(0, 1).unsqueeze(1)
        return self.decided(tokens, classifier, cue), self.decided(self.each_station(tokens), classifier, own)


class AttentionFusion(Fusion):
    """The paper's fusion: spectra of a station by encoder and mean pool, stations by encoder and max pool."""

    def __init__(self, width: int, views: int, block: dict) -> None:
        """width: features of a token; views: of a station; block: the network's settings.

        Raises: InputError for heads that do not divide the features.
        """
        super().__init__(width)
        if width % block["heads"]:
            raise InputError(f"network: heads is {block['heads']}, expected a divisor of the {width} features")
        self.modality = nn.Parameter(torch.empty(views, width))
        nn.init.trunc_normal_(self.modality, std=0.02)
        self.draws = block["dropout"] > 0
        shape = (block["heads"], block["feed_forward"], block["dropout"])
        self.intra = encoder(width, block["intra_depth"], *shape)
        self.inter = encoder(width, block["inter_depth"], *shape)

    def forward(self, tokens: torch.Tensor, cue: torch.Tensor | None = None) -> torch.Tensor:
        """Tokens (B, K, V, features) -> fused feature (B, features). Source: paper, section IV-F.

        cue (B, K, features): added to the station's token before the stations meet; the paper has none.
        """
        return self.inter(self._stations(tokens, cue)).amax(dim=1)

    def _stations(self, tokens: torch.Tensor, cue: torch.Tensor | None) -> torch.Tensor:
        """Tokens (B, K, V, features), perhaps with cues -> one token a station (B, K, features)."""
        station = self.intra((tokens + self.modality).flatten(0, 1)).mean(dim=1)
        station = station.unflatten(0, tokens.shape[:2])
        return station if cue is None else station + cue

    def both(
        self, tokens: torch.Tensor, classifier: nn.Module, cue: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """As `Fusion.both`. The encoder over spectra runs once, except where dropout draws anew for each part."""
        if self.draws and self.training:
            return super().both(tokens, classifier, cue)
        station = self._stations(tokens, cue)
        alone = station.flatten(0, 1).unsqueeze(1)
        return classifier(self.inter(station).amax(dim=1)), classifier(self.inter(alone).amax(dim=1))


class MeanFusion(Fusion):
    """The paper's baseline: the mean of all tokens."""

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V, features) -> their mean (B, features)."""
        return tokens.mean(dim=(1, 2))


class ConcatenationFusion(Fusion):
    """All tokens one after the other: the classifier has weights of its own for each view, and an order of stations."""

    def __init__(self, width: int, stations: int, views: int) -> None:
        """width: features of a token; stations, views of a station: their numbers."""
        super().__init__(width * stations * views)

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

    def decided(self, tokens: torch.Tensor, classifier: nn.Module, cue: torch.Tensor | None = None) -> torch.Tensor:
        """Tokens (B, K, V, features) -> log of the mean class probabilities (B, classes)."""
        votes = classifier(tokens).float().log_softmax(-1).flatten(1, 2)
        return votes.logsumexp(1) - math.log(votes.shape[1])


def fusion(name: str, width: int, shape: tuple[int, int], block: dict) -> Fusion:
    """Return the fusion of a scheme; width: features of a token; shape: stations, views of a station; block: settings.

    Raises: InputError for heads that do not divide the features.
    """
    if name == "attention":
        return AttentionFusion(width, shape[1], block)
    if name == "concatenation":
        return ConcatenationFusion(width, *shape)
    return {"mean": MeanFusion, "voting": VotingFusion}[name](width)


class Fused(nn.Module):
    """A network of tokens, fusion and classifier; a subclass makes `backbone` and says how inputs become tokens."""

    def add_head(self, name: str, width: int, shape: tuple[int, int], block: dict, classes: int) -> None:
        """Add fusion and classifier behind the tokens.

        name: fusion; width: features of a token; shape: stations, views of a station; block: `recognition.network`.
        """
        self.shape, self.classes = shape, classes
        self.fusion = fusion(name, width, shape, block)
        width = self.fusion.width
        if block["hidden"]:
            self.classifier = nn.Sequential(
                nn.Linear(width, block["hidden"]), nn.GELU(), nn.Dropout(block["dropout"]),
                nn.Linear(block["hidden"], classes),
            )  # fmt: skip
        else:
            self.classifier = nn.Linear(width, classes)

    def tokens(self, inputs: torch.Tensor) -> torch.Tensor:
        """Inputs of all views -> tokens (B, K, V, features)."""
        raise NotImplementedError

    def cue(self, inputs: torch.Tensor) -> torch.Tensor | None:
        """Inputs -> cues (B, K, features) that are added to the stations' tokens; None for a network without cues."""
        return None

    def forward(self, inputs: torch.Tensor, alone: bool = False) -> torch.Tensor | tuple[torch.Tensor, torch.Tensor]:
        """Inputs of all views (B, K * V, ...), station-major -> logits (B, classes).

        alone: return as well the logits (B * K, classes) of each station as if it were the only one; the backbone runs
        once.
        """
        tokens, cue = self.tokens(inputs), self.cue(inputs)
        decide = self.fusion.both if alone else self.fusion.decided
        return decide(tokens, self.classifier, cue)
