"""`python -m lowalt.tiles`: noisy signals of a chunk in, the encoded tiles of the chunk out."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import existing
from lowalt.common.network import Network
from lowalt.common.progress import reported
from lowalt.spectra import Spectra
from lowalt.tiles import files
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer
from lowalt.tiles.settings import Images


def renderer(settings: dict) -> Renderer:
    """Return the renderer of a settings object with exactly `network`, `spectra` and `images`.

    Raises: InputError naming the key and value that is missing, unknown or out of range.
    """
    network, spectra, images = pick(settings, "network", "spectra", "images")
    return Renderer(Network.from_settings(network), Spectra.from_settings(spectra), Images.from_settings(images))


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
        raise InputError(f"{path}: {signals.dtype} {signals.shape}, expected complex64 (models, snrs, {shape})")
    return signals


def encoded(signals: np.ndarray, tiles: Renderer) -> Iterator[bytes]:
    """Yield the PNG of every sample, model by model, SNR by SNR."""
    palette = tiles.images.palette
    for model in reported(signals, len(signals), "models"):
        for sample in model:
            yield encode(tiles.tile(sample), palette)


def main(arguments: list[str]) -> None:
    """Render one chunk."""
    options = parser("lowalt.tiles", "Render signals to tiles of spectra.")
    options.add_argument("--signals", required=True, help="noisy signals (.npy, complex64)")
    options.add_argument("--out", required=True, help="tiles file to write (.npz)")
    given = options.parse_args(arguments)
    tiles = renderer(given.settings)
    signals = load_signals(given.signals, tiles.network)
    files.write(given.out, encoded(signals, tiles))


if __name__ == "__main__":
    run(main)
