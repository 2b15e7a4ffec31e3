"""One sample as a picture with axes, a row per station, a column per spectrum; and examples."""

from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.report.figures.style import plt, png
from lowalt.shards import ShardSet
from lowalt.spectra import Fourier, Transfer, spectrum
from lowalt.spectra.interface import OfCells
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer, split


class Axes(NamedTuple):
    """The scales of an image: name, first and last value of its columns, and of its rows.

    Rows are counted from below.
    """

    across: tuple[str, float, float]
    upwards: tuple[str, float, float]


def times_s(settings: Fourier | Transfer, network: Network) -> tuple[float, float]:
    """Return the times (s) of a spectrum's first and last column, at their windows' middles."""
    middle = (settings.window - 1) / 2
    return network.symbol_interval_s * middle, network.symbol_interval_s * (
        network.symbols - 1 - middle
    )


def axes_of(name: str, station: Station, renderer: Renderer) -> Axes:
    """Return the axes of the images of one spectrum at one station.

    A tile has a spectrum's first row at the bottom.
    """
    settings = renderer.spectra[name]
    network = renderer.network
    kind = spectrum(name)
    if isinstance(kind, OfCells):
        return Axes(*kind.axes(settings, network, station))
    first, last = kind.speeds(settings, network, station)
    return Axes(
        ("time (s)", *times_s(settings, network)),
        ("radial speed (m/s)\nreceding upwards", first, last),
    )


def figure(tile: np.ndarray, renderer: Renderer, title: str) -> bytes:
    """Return the picture (PNG bytes) of a tile of index values (rows, columns) uint8, with axes.

    Where a spectrum's top row approaches, its image is turned over, so that receding is upwards
    everywhere. Speeds beyond the largest that a spectrum shows fold back into it: the phase then
    turns by more than half a circle from symbol to symbol.
    """
    network = renderer.network
    names = list(renderer.spectra)
    shape = len(network.stations), len(names)
    images = split(tile, len(names))
    drawn, panels = plt.subplots(
        *shape, figsize=(3.3 * shape[1], 2.6 * shape[0]), squeeze=False, layout="constrained"
    )
    drawn.suptitle(title, fontsize=10)
    for number, panel in enumerate(panels.flat):
        row, column = divmod(number, shape[1])
        station = network.stations[row]
        name = names[column]
        axes = axes_of(name, station, renderer)
        panel.imshow(
            images[number],
            cmap=renderer.images.colour_map,
            vmin=0,
            vmax=255,
            aspect="auto",
            interpolation="nearest",
            extent=(*axes.across[1:], *axes.upwards[1:]),
        )
        panel.set_ylim(sorted(axes.upwards[1:]))
        own_axes = isinstance(spectrum(name), OfCells)
        title = f"{station.name}: {spectrum(name).TITLE}\n"
        if not own_axes:
            title += f"folds beyond {max(map(abs, axes.upwards[1:])):.1f} m/s"
        panel.set_title(title, fontsize=8)
        if own_axes or column == 0:
            panel.set_ylabel(axes.upwards[0], fontsize=8)
        if own_axes or row == shape[0] - 1:
            panel.set_xlabel(axes.across[0], fontsize=8)
        panel.tick_params(labelsize=7)
        panel.locator_params(axis="x", nbins=6)
    return png(drawn)


def example_tiles(shards: ShardSet) -> list[tuple[str, bytes]]:
    """Return (caption, PNG bytes) of one sample of each category.

    It is the one of highest SNR of the category's first motion model in the set.
    """
    chosen = []
    for label, category in enumerate(shards.classes):
        numbers = np.flatnonzero(shards.labels == label)
        if len(numbers):
            order = np.lexsort((shards.keys[numbers], -shards.snrs_db[numbers]))
            best = int(numbers[order[0]])
            record = shards.record(best)
            snr_db = shards.snrs_db[best]
            noise = "no noise" if np.isinf(snr_db) else f"SNR {snr_db:g} dB"
            caption = f"{category}: {record['subtype']}, motion model {record['model']}, {noise}"
            if shards.kind == "image":
                picture = shards.png(best)
            else:
                picture = encode(shards.tile(best), shards.palette)
            chosen.append((caption, picture))
    return chosen
