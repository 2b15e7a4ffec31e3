"""`python -m lowalt.tiles`: noisy signals of a chunk in, its encoded tiles out, and reduced images where asked for."""

from collections.abc import Callable, Iterator

import numpy as np

from lowalt.common.command import parser, run
from lowalt.common.progress import reported
from lowalt.tiles import files, reduced
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer
from lowalt.tiles.signals import load_signals


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
    tiles = Renderer.from_settings(given.settings)
    signals = load_signals(given.signals, tiles.network)
    targets = [reduced.target(text) for text in given.reduced]
    with reduced.writing(targets, len(signals) * signals.shape[1], signals.shape[2], len(tiles.spectra)) as seen:
        files.write(given.out, encoded(signals, tiles, seen))


if __name__ == "__main__":
    run(main)
