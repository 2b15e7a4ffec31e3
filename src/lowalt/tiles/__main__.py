"""`python -m lowalt.tiles`: renders the noisy signals of a chunk as encoded tiles.

It writes reduced images, too, where they are asked for.
"""

import argparse
from collections.abc import Callable, Iterator

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.machine.progress import reported
from lowalt.spectra.cube import Cube
from lowalt.tiles import reduced, tile_files
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer
from lowalt.tiles.signals import load_signals


def encoded(
    signals: np.ndarray,
    tiles: Renderer,
    seen: Callable[[int, np.ndarray], None],
    late: Callable[[int], np.ndarray | None] = lambda model: None,
    cubes: Callable[[int, int, np.ndarray], list[Cube] | None] = lambda model, level, sample: None,
) -> Iterator[bytes]:
    """Yield the PNG of every sample, model by model, SNR by SNR.

    seen: called with a sample's number and its tile; late: how late a model's symbols are, cubes:
    those of a model at an SNR, both as in `Renderer.tile`.
    """
    palette = tiles.images.palette
    number = 0
    for model, of_model in enumerate(reported(signals, len(signals), "models")):
        for level, sample in enumerate(of_model):
            tile = tiles.tile(sample, late=late(model), cubes=cubes(model, level, sample))
            seen(number, tile)
            number += 1
            yield encode(tile, palette)


def main(arguments: list[str]) -> None:
    """Render one chunk."""
    line = parser("lowalt.tiles", "Render signals to tiles of spectra.")
    line.add_argument("--signals", required=True, help="noisy signals (.npy, complex64)")
    line.add_argument("--out", required=True, help="tiles file to write (.npz)")
    line.add_argument(
        "--reduced",
        nargs="*",
        default=[],
        metavar="SIZE=PATH",
        help="also write the images at SIZE pixels per side (.npy)",
    )
    line.add_argument("--motion", help="the chunk's motion table, for late symbols and range cells")
    line.add_argument("--clouds", nargs="*", help="clouds of the chunk's subtypes, for range cells")
    line.add_argument(
        "--occluders", nargs="*", default=[], help="surface files of the chunk's subtypes, likewise"
    )
    options = line.parse_args(arguments)
    drawn = options.settings.pop("drawn", None)
    seen_in = options.settings.pop("cubes", None)
    tiles = Renderer.from_settings(options.settings)
    more: dict = {}
    if drawn:
        more["late"] = _late(options.settings["spectra"], drawn, tiles, options.motion)
    if seen_in:
        more["cubes"] = _cubes(seen_in, tiles, options)
    signals = load_signals(options.signals, tiles.network)
    models, snrs, stations, _ = signals.shape
    targets = [reduced.target(text) for text in options.reduced]
    with reduced.writing(targets, models * snrs, stations, len(tiles.spectra)) as seen:
        tile_files.write(options.out, encoded(signals, tiles, seen, **more))


def _late(
    spectra: dict, drawn: dict, tiles: Renderer, motion: str
) -> Callable[[int], np.ndarray | None]:
    """Return a function that gives the delays of a model's symbols.

    drawn: {seed, effects}, from which the scene draws them.
    """
    from lowalt.motion import read_table
    from lowalt.scene.lateness import lateness

    rows = read_table(motion)
    seed, effects = pick(drawn, "seed", "effects")
    return lambda model: lateness(spectra, effects, tiles.network, seed, rows[model])


def _cubes(
    settings: dict, tiles: Renderer, options: argparse.Namespace
) -> Callable[[int, int, np.ndarray], list[Cube] | None]:
    """Return a function that gives the cubes of a sample by model, SNR and signals.

    settings: {seed, tolerance, effects, snr_db}.
    """
    from lowalt.motion import read_table
    from lowalt.targets.cloud import read_clouds
    from lowalt.targets.occluders import read_all
    from lowalt.tiles.cubes import Cubes

    rows = read_table(options.motion)
    snrs = settings.pop("snr_db")
    stations = tiles.network.stations
    clouds = read_clouds(options.clouds)
    scene = settings | {"network": options.settings["network"]}
    maker = Cubes.from_settings(scene, clouds, read_all(options.occluders))

    def of_sample(model: int, level: int, sample: np.ndarray) -> list[Cube]:
        """The cubes of one sample, a station each."""
        snr_db = float(snrs[level])
        heard = zip(stations, sample, strict=True)
        return [maker.of(rows[model], snr_db, station, signal) for station, signal in heard]

    return of_sample


if __name__ == "__main__":
    run(main)
