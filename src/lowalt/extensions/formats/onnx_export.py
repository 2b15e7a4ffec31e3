"""A trained model as ONNX: index images in, class probabilities out."""

from pathlib import Path

import torch
from torch import nn

from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError, install_command
from lowalt.recognition.runs import Trained


class Probabilities(nn.Module):
    """The network with its softmax.

    Index images (B, views, size, size) uint8 -> probabilities (B, classes).
    """

    def __init__(self, model: nn.Module) -> None:
        """model: a Recogniser in evaluation mode."""
        super().__init__()
        self.model = model

    def forward(self, index: torch.Tensor) -> torch.Tensor:
        """Index images of the scheme's views, station-major -> class probabilities."""
        return self.model(index).softmax(1)


def export(trained: Trained, out: str | Path) -> None:
    """Write the model as ONNX, for any batch size.

    Raises: InputError where the packages of ONNX are not installed.
    """
    model = Probabilities(trained.model).eval()
    # Two samples, since a batch of one would be taken for a constant.
    example = torch.zeros(
        2, len(trained.scheme.columns), trained.size, trained.size, dtype=torch.uint8
    )
    dynamic = {"index": {0: torch.export.Dim("batch")}}
    with torch.no_grad(), replacing(out) as temporary:
        try:
            torch.onnx.export(
                model,
                (example,),
                temporary,
                dynamic_shapes=dynamic,
                dynamo=True,
                external_data=False,
            )
        except ImportError as error:
            raise InputError(
                f"--out {out}: ONNX needs onnx and onnxscript ({error}), expected "
                f"`{install_command('export')}`"
            ) from error
