"""A backbone of the user's own: a function of a Python file, named as FILE.py:FUNCTION.

The function takes the pixels per side of an image and returns a torch module, RGB images (B, 3,
size, size) float32 to features (B, features). The file runs with the rights of the user, so it is
to be trusted like any program: its name comes from the user's configuration or command line. A
model keeps the name, which is never followed.
"""

import importlib.util
import sys

import torch
from torch import nn

from lowalt.config.named_code import file_and_function, file_of
from lowalt.files.errors import InputError, running

MIDDLE = {"mean": (0.5, 0.5, 0.5), "std": (0.5, 0.5, 0.5)}
"""How colours in 0..1 are shifted and scaled for a module that has no `pretrained_cfg` of its own.
"""


def backbone(name: str, size: int) -> nn.Module:
    """Return the module that FILE.py:FUNCTION makes for size x size images.

    Its number of features is noted in it.
    Raises: InputError where the file is missing, has no such function or ends in an error, or where
    the module gives no features (B, features).
    """
    path = file_of(name)
    if path is None or not path.is_file():
        raise InputError(
            f"network: backbone {name!r}: no file {path}, expected FILE.py:FUNCTION of a file that "
            "exists"
        )
    _, function = file_and_function(name)
    specification = importlib.util.spec_from_file_location(f"lowalt_own_{path.stem}", path)
    if specification is None or specification.loader is None:
        raise InputError(f"network: backbone {name!r}: {path} is no Python file")
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    with running(f"network: backbone {name!r}", str(path)):
        specification.loader.exec_module(module)
        if not callable(getattr(module, function, None)):
            raise InputError(f"network: backbone {name!r}: {path} has no function {function!r}")
        network = getattr(module, function)(size)
        with torch.no_grad():
            features = network.eval()(torch.zeros(2, 3, size, size))
    if not isinstance(features, torch.Tensor) or features.ndim != 2 or len(features) != 2:
        given: object = type(features).__name__
        if isinstance(features, torch.Tensor):
            given = tuple(features.shape)
        raise InputError(
            f"network: backbone {name!r} gives {given} for two images, expected (2, features)"
        )
    network.num_features = features.shape[1]
    if not hasattr(network, "pretrained_cfg"):
        network.pretrained_cfg = MIDDLE
    return network.train()
