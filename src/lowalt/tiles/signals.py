"""Reads the noisy signals from which tiles and shards are made."""

from pathlib import Path

import numpy as np

from lowalt.config.network import Network
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError


def load_signals(path: str | Path, network: Network) -> np.ndarray:
    """Return noisy signals as a memory map, (models, snrs, stations, symbols) complex64.

    Raises: InputError naming the file and what does not fit.
    """
    try:
        signals = np.load(existing(path, "noisy signals"), mmap_mode="r")
    except (ValueError, EOFError) as error:
        raise InputError(f"{path}: not a NumPy array ({error})") from error
    shape = (len(network.stations), network.symbols)
    if signals.dtype != np.complex64 or signals.ndim != 4 or signals.shape[2:] != shape:
        raise InputError(
            f"{path}: {signals.dtype} {signals.shape}, expected complex64 (models, snrs, {shape})"
        )
    return signals
