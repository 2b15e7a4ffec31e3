"""The network of a scheme."""

import numpy as np
from torch import nn

from lowalt.recognition.network import Recogniser
from lowalt.recognition.schemes import SPECTRA, Scheme
from lowalt.tiles import colour_map


def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int) -> nn.Module:
    """Return a network with fresh weights.

    block: `recognition.network`; size: pixels a side; colours: name of the colour map; classes:
    their number. Raises: InputError for a setting that does not fit.
    """
    palettes = np.stack([colour_map(colours)] * len(SPECTRA))
    return Recogniser(scheme, block, size, palettes, classes)
