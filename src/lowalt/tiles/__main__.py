"""`python -m lowalt.tiles`: noisy signals of a chunk in, its encoded tiles out, and reduced images where asked for."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import existing
from lowalt.common.network import Network
from lowalt.common.progress import reported
from lowalt.spectra import Spectra
from lowalt.tiles import files, reduced
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


def encoded(signals: np.ndarray, tiles: Renderer, seen: Callable[[int, np.ndarray], None]) -> Iterator[bytes]:
    """Yield the PNG of every sample, model by model, SNR by SNR; `seen` is called with its number and its tile."""
    palette, models = tiles.images.palette, reported(signals, len(signals), "models")
    for number, sample in enumerate(sample for model in models for sample in model):
        tile = tiles.tile(sample)
        seen(number, tile)
        yield encode(tile, palette)


def main(arguments: list[str]) -> None:
    """Render one chunk."""
    options = parser("lowalt.tiles", "Render signals to tiles of spectra.")
    options.add_argument("--signals", required=True, help="noisy signals (.npy, complex64)")
    options.add_argument("--out", required=True, help="tiles file to write (.npz)")
    options.add_argument(
        "--reduced",
        nargs="*",
        default=[],
        metavar="SIZE=PATH",
        help="also write the images at SIZE pixels a side (.npy)",
    )
    given = options.parse_args(arguments)
    tiles = renderer(given.settings)
    signals = load_signals(given.signals, tiles.network)
    targets = [reduced.target(text) for text in given.reduced]
    with reduced.writing(targets, len(signals) * signals.shape[1], signals.shape[2]) as seen:
        files.write(given.out, encoded(signals, tiles, seen))


if __name__ == "__main__":
    run(main)
