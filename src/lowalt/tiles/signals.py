"""Reads the noisy signals from which tiles and shards are made."""

from pathlib import Path

import numpy as np

from lowalt.config.network import Network
from lowalt.files.array_files import array_of
from lowalt.files.errors import InputError


def load_signals(path: str | Path, network: Network) -> np.ndarray:
    """Return noisy signals as a memory map, (models, snrs, stations, symbols) complex64.

    Raises: InputError naming the file and what does not fit.
    """
    signals = array_of(path, "noisy signals", mapped=True)
    shape = (len(network.stations), network.symbols)
    if signals.dtype != np.complex64 or signals.ndim != 4 or signals.shape[2:] != shape:
        raise InputError(
            f"{path}: {signals.dtype} {signals.shape}, expected complex64 (models, snrs, {shape})"
        )
    return signals
