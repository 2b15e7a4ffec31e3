"""The network of a scheme, by its method: on images of spectra or on slow-time signals."""

import numpy as np
from torch import nn

from lowalt.common.errors import InputError
from lowalt.recognition.network import Recogniser
from lowalt.recognition.schemes import SPECTRA, Scheme
from lowalt.recognition.signal_networks import SignalRecogniser
from lowalt.tiles import colour_map


def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int) -> nn.Module:
    """Return a network with fresh weights.

    block: `recognition.network`; size: pixels a side, or symbols of a signal; colours: name of the colour map; classes:
    their number. Raises: InputError for a setting that does not fit, or a method that is no network.
    """
    if scheme.sees == "signals":
        return SignalRecogniser(scheme, block, size, classes)
    if scheme.sees == "features":
        raise InputError(f"scheme {scheme.name!r}: method {scheme.method!r} is no network")
    palettes = np.stack([colour_map(colours)] * len(SPECTRA))
    return Recogniser(scheme, block, size, palettes, classes)
