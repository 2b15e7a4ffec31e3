"""The paper's fusion network on any timm backbone: images of stations and spectra to classes.

Axes of every tensor: B samples, K stations, V spectra of a station, then channels, rows, columns.
The same code serves any subset of stations and spectra; a view is a (station, spectrum) pair,
station-major. Settings are the block `recognition.network` of workflow/schemas/config.schema.yaml.
"""

from pathlib import Path
from pickle import UnpicklingError

import numpy as np
import timm
import torch
from safetensors import SafetensorError
from torch import nn

from lowalt.config.command import pick
from lowalt.config.named_code import file_of
from lowalt.files.errors import InputError
from lowalt.recognition import own_backbone
from lowalt.recognition.fusion import Fused
from lowalt.recognition.schemes import SPECTRA, Scheme
from lowalt.tiles import colour_map

KEYS = (
    "backbone",
    "weights",
    "intra_depth",
    "inter_depth",
    "heads",
    "feed_forward",
    "dropout",
    "hidden",
)


def backbone(name: str, weights: str, size: int) -> nn.Module:
    """Return a feature extractor for size x size RGB images.

    name: of a timm model, or the user's own FILE.py:FUNCTION.
    weights: "none", "hub" or a local file. Models with a fixed input size are built for `size`
    where timm can.
    Raises: InputError for an unknown name, a missing file, or weights that do not fit.
    """
    if file_of(name) is not None:
        if weights != "none":
            raise InputError(
                f"network: backbone {name!r} has no weights {weights!r}, expected 'none'"
            )
        return own_backbone.backbone(name, size)
    if not timm.is_model(name):
        raise InputError(
            f"network: backbone {name!r} is not a timm model (timm {timm.__version__})"
        )
    options: dict = {"num_classes": 0}
    if weights not in ("none", "hub"):
        if not Path(weights).is_file():
            raise InputError(
                f"network: weights {weights!r}, expected 'none', 'hub' or an existing file"
            )
        options["pretrained_cfg_overlay"] = {"file": weights}
    options["pretrained"] = weights != "none"
    extras: tuple[dict, ...] = ({"img_size": size}, {})
    for extra in extras:
        try:
            return timm.create_model(name, **options, **extra)
        except TypeError:
            # Convolutional models take any size and refuse the argument.
            continue
        except (RuntimeError, OSError, ValueError, UnpicklingError, SafetensorError) as error:
            raise InputError(
                f"network: backbone {name!r} with weights {weights!r}: {error}"
            ) from error
    raise InputError(f"network: timm cannot build {name!r} without its classifier")


class Palettes(nn.Module):
    """Turns index images into normalised RGB by a table per spectrum; colours are never stored.

    table (spectra, 256, 3) float32: (colour - mean) / deviation, colours in 0..1, both of the
    backbone's channels.
    """

    def __init__(
        self, palettes: np.ndarray, spectra: tuple[int, ...], mean: tuple, std: tuple
    ) -> None:
        """palettes: (spectra, 256, 3) uint8 by SPECTRA; mean, std: of each channel, in 0..1."""
        super().__init__()
        shape = np.shape(palettes)
        # The palettes of the first spectra are enough where the scheme sees no later one.
        if len(shape) != 3 or shape[1:] != (256, 3) or not max(spectra) < shape[0] <= len(SPECTRA):
            raise InputError(
                f"palettes have shape {np.shape(palettes)}, expected ({len(SPECTRA)}, 256, 3)"
            )
        colours = torch.as_tensor(np.asarray(palettes, dtype=np.float32)[list(spectra)] / 255)
        self.register_buffer("table", (colours - torch.tensor(mean)) / torch.tensor(std))
        self.register_buffer(
            "offset", torch.arange(len(spectra), dtype=torch.int32) * 256, persistent=False
        )

    def forward(self, index: torch.Tensor) -> torch.Tensor:
        """Index images (B, K, V, rows, columns) uint8 -> (B, K, V, 3, rows, columns) float.

        Channels are last in memory.
        """
        shifted = index.int() + self.offset[:, None, None]
        colour = nn.functional.embedding(shifted, self.table.flatten(0, 1))
        return colour.movedim(-1, -3)


class Recogniser(Fused):
    """Index images of a scheme's views to logits: palettes, shared backbone, fusion, classifier."""

    def __init__(
        self, scheme: Scheme, block: dict, size: int, palettes: np.ndarray, classes: int
    ) -> None:
        """Build the network of a scheme.

        scheme: views and fusion; block: `recognition.network`; size: pixels; palettes (3, 256, 3)
        uint8; classes: their number.
        Raises: InputError for an unknown or missing key, a backbone timm does not have, or heads
        that do not fit.
        """
        super().__init__()
        pick(block, *KEYS)
        self.backbone = backbone(scheme.backbone_of(block), block["weights"], size)
        # Number of features that enter the classifier: some networks have a wider layer after their
        # last features.
        width = getattr(self.backbone, "head_hidden_size", self.backbone.num_features)
        pre = self.backbone.pretrained_cfg
        self.palettes = Palettes(palettes, scheme.spectra, pre["mean"], pre["std"])
        self.add_head(
            scheme.fusion, width, (len(scheme.stations), len(scheme.spectra)), block, classes
        )

    def tokens(self, index: torch.Tensor) -> torch.Tensor:
        """Index images (B, K * V, rows, columns) uint8 -> tokens (B, K, V, features)."""
        samples, views = index.shape[:2]
        stations = views // self.shape[1]
        spectra = self.shape[1]
        images = self.palettes(index.unflatten(1, (stations, spectra)))
        # All views go through at once: batch norm must see every kind of view in one batch.
        features = self.backbone(images.flatten(0, 2))
        return features.view(samples, stations, spectra, -1)

    @staticmethod
    def mirrored(index: torch.Tensor) -> torch.Tensor:
        """Return index images (..., rows, columns) mirrored along Doppler: the target reversed."""
        return index.flip(-2)


def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int) -> nn.Module:
    """Return a network with fresh weights.

    block: `recognition.network`; size: pixels per side; colours: name of the colour map; classes:
    their number.
    Raises: InputError for a setting that does not fit.
    """
    return Recogniser(scheme, block, size, np.stack([colour_map(colours)] * len(SPECTRA)), classes)


def checkpoint_activations(model: Recogniser) -> None:
    """Let the backbone keep few activations and compute the others again for the same gradient.

    Raises: InputError for a backbone that cannot, or that has batch norms, whose running means a
    second pass would move a second time. Source: Chen et al., Training Deep Nets with Sublinear
    Memory Cost, 2016.
    """
    name = type(model.backbone).__name__
    if any(
        isinstance(layer, nn.modules.batchnorm._BatchNorm) for layer in model.backbone.modules()
    ):
        raise InputError(
            f"training.activation_checkpointing: the backbone {name} has batch norms, whose "
            "running means would move twice a step; expected a backbone without, such as Swin, "
            "ConvNeXt or ViT"
        )
    try:
        model.backbone.set_grad_checkpointing(True)
    except (AttributeError, AssertionError) as error:
        raise InputError(
            f"training.activation_checkpointing: timm's {name} cannot ({error})"
        ) from error


def parameters(model: nn.Module) -> int:
    """Return the number of trainable values."""
    return sum(value.numel() for value in model.parameters() if value.requires_grad)
