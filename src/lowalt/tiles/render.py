"""From symbol-domain signals to index images in one pass: spectra, resampling, scaling.

All of it is in float32.

The arithmetic is fixed (additions, products, divisions, square roots and comparisons in one order),
so the pixels depend on the signal alone: not on the batch, the worker or the machine. A signal is
first divided by a power of two, which changes no digit and keeps its squares inside float32; images
are scaled by their own largest value, so nothing is lost.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.config.command import pick
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.spectra import Spectra, spectrum, windows
from lowalt.spectra.cube import Cube
from lowalt.spectra.interface import KnowsTimes, OfCells
from lowalt.spectra.known_times import even
from lowalt.tiles.image_settings import Images
from lowalt.tiles.pixels import index_image
from lowalt.tiles.resample import across_rows, along_rows, column_taps, row_taps
from lowalt.tiles.scale import lookup

Source = np.ndarray | Cube
"""What an image is made of: a normalised signal (symbols,) or a normalised cube."""
MOST_PIXELS = 2**29
"""Pixels of a tile."""


class Resampling(NamedTuple):
    """How one spectrum is resampled to S x S pixels, and its work arrays.

    source, weights: rows of the spectrum and their weights, (S, taps); columns, shares: (taps, S);
    values: the spectrum, (points, starts); between: what stands between the two axes; rows_first:
    whether the resampling begins with the rows.
    """

    source: np.ndarray
    weights: np.ndarray
    columns: np.ndarray
    shares: np.ndarray
    values: np.ndarray
    between: np.ndarray
    rows_first: bool


class Renderer:
    """Makes tiles: it holds twiddles, weights, tables and work arrays for all samples.

    Three stations' tones:

        >>> from lowalt.config.blocks import render_blocks
        >>> from lowalt.config.layers import overlaid
        >>> renderer = Renderer.from_settings(render_blocks(overlaid([])))
        >>> signals = np.exp(0.8j * np.arange(1200).reshape(3, 400))
        >>> tile = renderer.tile(signals.astype(np.complex64))
        >>> tile.shape, split(tile, spectra=3).shape
        ((768, 768), (9, 256, 256))
    """

    def __init__(self, network: Network, spectra: Spectra, images: Images) -> None:
        """Prepare for the stations and the number of symbols of `network`.

        Raises: InputError naming the spectrum whose window is no shorter than the signal, or what
        is too large.
        """
        self.network = network
        self.spectra = spectra
        self.images = images
        spectra.check(network.symbols, len(network.stations), network.subcarriers)
        pixels = len(network.stations) * len(spectra) * images.size**2
        if pixels > MOST_PIXELS:
            raise InputError(
                f"images.size is {images.size}: a tile of {pixels} pixels, expected at most "
                f"{MOST_PIXELS}"
            )
        self._of_cells = {name for name in spectra if isinstance(spectrum(name), OfCells)}
        self._plans = {name: self._plan(name) for name in spectra}
        self._tables = {
            name: self._tables_of(name) for name in spectra if name not in self._of_cells
        }
        self._lookup = {}
        for name in spectra:
            found = lookup(images.scale, levels(name))
            self._lookup[name] = (found.lowest, found.shift, found.base, found.cut.view(np.int32))
        self._image = np.empty((images.size, images.size), np.float32)

    @classmethod
    def from_settings(cls, settings: dict) -> "Renderer":
        """Return the renderer of a settings object with exactly `network`, `spectra` and `images`.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        network, spectra, images = pick(settings, "network", "spectra", "images")
        return cls(
            Network.from_settings(network),
            Spectra.from_settings(spectra),
            Images.from_settings(images),
        )

    def _tables_of(self, name: str) -> list[tuple[np.ndarray, ...]]:
        """Tables of one spectrum, a tuple of arrays a station."""
        interval_s = self.network.symbol_interval_s
        settings = self.spectra[name]
        result = []
        for station in self.network.stations:
            result.append(spectrum(name).tables(settings, station.frequency_hz, interval_s))
        return result

    def _plan(self, name: str) -> Resampling:
        """Return the plan of one spectrum."""
        setting = self.spectra[name]
        kind = spectrum(name)
        symbols = self.network.symbols
        size = self.images.size
        points = kind.rows(setting)
        hop = getattr(setting, "hop", 1)
        if name in self._of_cells:
            starts = kind.columns(setting, symbols)
            count = (starts - 1) // hop + 1
        else:
            count = windows(symbols, setting.window, hop, name)
            starts = (count - 1) * hop + 1
        source, weights = row_taps(points, size)
        # Row 0 is the most positive value, so rows count down; FFT rows start at frequency zero.
        source = points - 1 - source
        if kind.ZERO_FIRST:
            source = (source + points // 2) % points
        columns, shares = column_taps(count, size, hop)
        # Rows that become fewer go first, so that there is less to do along time.
        rows_first = points > size
        shape = (points, size)
        if rows_first:
            shape = (size, starts)
        between = np.empty(shape, np.float32)
        values = np.empty((points, starts), np.float32)
        return Resampling(source, weights, columns, shares, values, between, rows_first)

    def plan(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return rows and weights (S, taps), columns and shares (taps, S) of one spectrum."""
        plan = self._plans[name]
        return plan.source, plan.weights, plan.columns, plan.shares

    def rows_first(self, name: str) -> bool:
        """Whether the resampling of one spectrum begins with its rows."""
        return self._plans[name].rows_first

    def starts(self, name: str) -> int:
        """Number of symbols, from the first, at which a window of one spectrum is computed."""
        return self._plans[name].values.shape[1]

    def tables(self, name: str) -> list[tuple[np.ndarray, ...]]:
        """Tables of one spectrum, a tuple of arrays a station."""
        return self._tables[name]

    def values(
        self,
        signal: Source,
        station: int,
        name: str,
        out: np.ndarray,
        late: np.ndarray | None = None,
    ) -> None:
        """Fill out (S, S) float32 with the resampled spectrum `name` of one signal or cube.

        signal: normalised (symbols,), or a cube where the spectrum is made of range cells; late:
        (symbols,), how many symbol intervals after its nominal instant each symbol came, None for
        0. Where `spectra.times` is "known", symbols that are exactly zero were not received.
        """
        plan = self._plans[name]
        setting = self.spectra[name]
        kind = spectrum(name)
        if isinstance(signal, Cube):
            plan.values[:] = kind.definition(signal, setting)
        elif self.spectra.times == "even" or even(signal, late):
            re = np.ascontiguousarray(signal.real)
            im = np.ascontiguousarray(signal.imag)
            kind.fill(re, im, setting, self._tables[name][station], plan.values)
        else:
            times = np.arange(len(signal), dtype=np.float64)
            if late is not None:
                times += late
            frequency_hz = self.network.stations[station].frequency_hz
            interval_s = self.network.symbol_interval_s
            assert isinstance(kind, KnowsTimes)  # as `Spectra` has checked
            kind.fill_known(signal, times, setting, frequency_hz, interval_s, plan.values)
        if plan.rows_first:
            across_rows(plan.values, plan.source, plan.weights, plan.between)
            along_rows(plan.between, plan.columns, plan.shares, out)
        else:
            along_rows(plan.values, plan.columns, plan.shares, plan.between)
            across_rows(plan.between, plan.source, plan.weights, out)

    def check(self, signals: np.ndarray) -> None:
        """Refuse signals that are not (stations, symbols) of this network, or not finite.

        Raises: InputError naming the shape.
        """
        shape = (len(self.network.stations), self.network.symbols)
        if np.shape(signals) != shape:
            raise InputError(f"tile: signals have shape {np.shape(signals)}, expected {shape}")
        if not np.isfinite(signals).all():
            raise InputError("tile: signals have a NaN or infinite value")

    def image(
        self,
        signal: Source,
        station: int,
        name: str,
        out: np.ndarray,
        late: np.ndarray | None = None,
    ) -> None:
        """Fill out (S, S) uint8 with the index image of one normalised signal (symbols,).

        late: as in `values`.
        """
        self.values(signal, station, name, self._image, late)
        index_image(self._image, spectrum(name).SIGNED, *self._lookup[name], out)

    def _source(
        self, name: str, signal: np.ndarray, cubes: Sequence[Cube] | None, station: int
    ) -> Source:
        """What the spectrum `name` is made of at a station: its normalised signal, or its cube."""
        if name not in self._of_cells:
            return signal
        if cubes is None:
            raise InputError(
                f"spectrum {name}: made of range cells, and a signal alone does not hold them"
            )
        return cubes[station]._replace(cells=normalised(cubes[station].cells))

    def tile(
        self,
        signals: np.ndarray,
        out: np.ndarray | None = None,
        late: np.ndarray | None = None,
        cubes: Sequence[Cube] | None = None,
    ) -> np.ndarray:
        """Return the tile of one sample.

        signals: (stations, symbols) complex64; the tile is (stations S, spectra S) uint8.

        late: (stations, symbols), as in `values`, None for symbols on time; cubes: a cube a
        station, where spectra are made of range cells.
        Raises: InputError where the shape does not fit the network or a value is not finite.
        """
        self.check(signals)
        stations = len(self.network.stations)
        size = self.images.size
        if out is None:
            out = np.empty((stations * size, len(self.spectra) * size), np.uint8)
        for station in range(stations):
            signal = normalised(signals[station])
            row = out[station * size : (station + 1) * size]
            delay = _of_station(late, station)
            for view, name in enumerate(self.spectra):
                image = row[:, view * size : (view + 1) * size]
                source = self._source(name, signal, cubes, station)
                self.image(source, station, name, image, delay)
        return out

    def some(
        self,
        signals: np.ndarray,
        numbers: Sequence[int],
        late: np.ndarray | None = None,
        cubes: Sequence[Cube] | None = None,
    ) -> np.ndarray:
        """Return images of one sample by number, spectra station + view: (n, S, S) uint8.

        signals: (stations, symbols).

        They are those of `tile`, and only these are computed.
        Raises: InputError where the shape does not fit the network or a value is not finite.
        """
        self.check(signals)
        out = np.empty((len(numbers), self.images.size, self.images.size), np.uint8)
        names = list(self.spectra)
        for image, number in zip(out, numbers, strict=True):
            station, view = divmod(int(number), len(names))
            delay = _of_station(late, station)
            source = self._source(names[view], normalised(signals[station]), cubes, station)
            self.image(source, station, names[view], image, delay)
        return out


def _of_station(late: np.ndarray | None, station: int) -> np.ndarray | None:
    """The delays of one station's symbols, None for symbols on time."""
    if late is None:
        return None
    return late[station]


def normalised(signal: np.ndarray) -> np.ndarray:
    """Return a signal of any shape as complex64.

    It is divided by the power of two that brings it just below 1.
    """
    signal = np.asarray(signal)
    largest = max(np.abs(signal.real).max(), np.abs(signal.imag).max())
    if largest == 0:
        return signal.astype(np.complex64)
    exponent = int(np.frexp(largest)[1])
    result = np.empty(signal.shape, np.complex64)
    result.real = np.ldexp(signal.real, -exponent)
    result.imag = np.ldexp(signal.imag, -exponent)
    return result


def levels(name: str) -> int:
    """Return the number of index values above that of zero: values with a sign use half of them."""
    return 127 if spectrum(name).SIGNED else 255


def split(tile: np.ndarray, spectra: int) -> np.ndarray:
    """Return the images of a tile, (stations S, spectra S) -> (stations spectra, S, S).

    They come station by station.

    Raises: InputError where the tile is not made of rows of so many squares.
    """
    rows, columns = tile.shape
    size = columns // spectra
    if not size or columns != spectra * size or not rows or rows % size:
        raise InputError(
            f"tile: {rows} x {columns} pixels, expected rows of {spectra} square images"
        )
    grid = tile.reshape(tile.shape[0] // size, size, spectra, size)
    return np.ascontiguousarray(grid.swapaxes(1, 2)).reshape(-1, size, size)


def join(images: np.ndarray, spectra: int) -> np.ndarray:
    """Return the tile (stations S, spectra S) of images (stations spectra, S, S).

    It is the inverse of `split`.
    """
    size = images.shape[-1]
    grid = images.reshape(-1, spectra, size, size).swapaxes(1, 2)
    return np.ascontiguousarray(grid).reshape(-1, spectra * size)
