"""From symbol-domain signals to index images in one pass: spectra, resampling, scaling, all in float32.

The arithmetic is fixed (additions, products, divisions, square roots and comparisons in one order), so the pixels
depend on the signal alone: not on the batch, the worker or the machine. A signal is first divided by a power of
two, which changes no digit and keeps its squares inside float32; images are scaled by their own largest value,
so nothing is lost.
"""

import numpy as np
from numba import njit

from lowalt.errors import InputError
from lowalt.network import SPEED_OF_LIGHT, Network
from lowalt.spectra.settings import Spectra, windows
from lowalt.spectra.sliding import fourier_magnitudes, transfer, turns
from lowalt.tiles.resample import taps
from lowalt.tiles.scale import lookup
from lowalt.tiles.settings import Images

VIEWS = ("vrp", "trp", "vt")
"""Columns of a tile, left to right; its rows are the stations in the network's order."""


@njit(cache=True)
def _resample(values, source, weights, columns, shares, rows, out):
    """Rows, then columns: values (points, starts) -> out (S, S); every sum runs in ascending order of its taps."""
    size = out.shape[0]
    starts = values.shape[1]
    for j in range(size):
        for t in range(starts):
            rows[t] = weights[j, 0] * values[source[j, 0], t]
        for k in range(1, weights.shape[1]):
            w = weights[j, k]
            line = values[source[j, k]]
            for t in range(starts):
                rows[t] += w * line[t]
        line = out[j]
        for c in range(size):
            line[c] = shares[0, c] * rows[columns[0, c]]
        for k in range(1, shares.shape[0]):
            for c in range(size):
                line[c] += shares[k, c] * rows[columns[k, c]]


@njit(cache=True)
def _index(values, signed, lowest, shift, base, cut, out):
    """Index values of one image (S, S) float32 -> out (S, S) uint8; see `lowalt.tiles.scale`."""
    size = values.shape[0]
    bits = values.view(np.int32)
    top = np.int32(0)
    # Non-negative floats order like their bits, which keeps the search for the largest free of branches.
    for j in range(size):
        for c in range(size):
            top = max(top, bits[j, c] & np.int32(0x7FFFFFFF))
    peak = np.empty(1, np.int32)
    peak[0] = top
    largest = peak.view(np.float32)[0]
    if top == 0:
        out[:] = 128 if signed else 0
        return
    x = np.empty(size, np.float32)
    keys = x.view(np.int32)
    for j in range(size):
        row = out[j]
        for c in range(size):
            x[c] = np.abs(values[j, c]) / largest
        for c in range(size):
            key = np.uint32(max(keys[c] - lowest, 0) >> shift)
            step = base[key] + np.int32(x[c] >= cut[key])
            if signed:
                row[c] = 128 - step if values[j, c] < 0 else 128 + step
            else:
                row[c] = step


class Renderer:
    """Everything that is the same for all samples: twiddles, weights, tables. Reusable, holds its work arrays."""

    def __init__(self, network: Network, spectra: Spectra, images: Images) -> None:
        """Prepare for the stations and the number of symbols of `network`.

        Raises: InputError naming the spectrum whose window is no shorter than the signal.
        """
        self.network, self.spectra, self.images = network, spectra, images
        spectra.check(network.symbols)
        self._plans = {name: self._plan(name) for name in VIEWS}
        self._fourier = {name: turns(getattr(spectra, name).points, np.float32) for name in ("vrp", "trp")}
        length = spectra.vt.window
        steps = np.outer(spectra.vt.speeds_mps, np.arange(length + 1))
        self._matched = []
        for station in network.stations:
            phase = 4 * np.pi * station.frequency_hz * network.symbol_interval_s / SPEED_OF_LIGHT * steps
            self._matched.append((np.cos(phase).astype(np.float32), np.sin(phase).astype(np.float32)))
        self._share = np.array([(length / (length + 1)) ** 2], np.float32)
        tables = {name: lookup(images.scale, 127 if name == "vt" else 255) for name in VIEWS}
        self._lookup = {name: (t.lowest, t.shift, t.base, t.cut) for name, t in tables.items()}
        self._image = np.empty((images.size, images.size), np.float32)

    def _plan(self, name: str) -> tuple:
        """Taps of one spectrum's rows and columns, its buffer of values and of one row."""
        setting = getattr(self.spectra, name)
        symbols, size = self.network.symbols, self.images.size
        count = windows(symbols, setting.window, setting.hop, name)
        points = len(setting.speeds_mps) if name == "vt" else setting.points
        first, weights = taps(points, size)
        # Row 0 is the most positive value, so rows count down; FFT rows start at frequency zero.
        source = points - 1 - (first[:, None] + np.arange(weights.shape[1]))
        if name != "vt":
            source = (source + points // 2) % points
        left, shares = taps(count, size)
        columns = (left[:, None] + np.arange(shares.shape[1])) * setting.hop
        starts = (count - 1) * setting.hop + 1
        return (
            np.ascontiguousarray(source), weights.astype(np.float32),
            np.ascontiguousarray(columns.T.astype(np.uintp)), np.ascontiguousarray(shares.T.astype(np.float32)),
            np.empty((points, starts), np.float32), np.empty(starts, np.float32),
        )  # fmt: skip

    def values(self, signal: np.ndarray, station: int, name: str, out: np.ndarray) -> None:
        """Fill out (S, S) float32 with the resampled spectrum `name` of one normalised signal (symbols,)."""
        re, im = np.ascontiguousarray(signal.real), np.ascontiguousarray(signal.imag)
        source, weights, columns, shares, values, row = self._plans[name]
        if name == "vt":
            transfer(re, im, self.spectra.vt.window, *self._matched[station], self._share, values)
        else:
            setting = getattr(self.spectra, name)
            fourier_magnitudes(re, im, setting.window, setting.points, *self._fourier[name], values)
        _resample(values, source, weights, columns, shares, row, out)

    def tile(self, signals: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """Return the tile of one sample: (stations, symbols) complex64 -> (stations S, 3 S) uint8.

        Raises: InputError where the shape does not fit the network or a value is not finite.
        """
        stations, size = len(self.network.stations), self.images.size
        if np.shape(signals) != (stations, self.network.symbols):
            raise InputError(
                f"tile: signals have shape {np.shape(signals)}, expected {(stations, self.network.symbols)}"
            )
        if not np.isfinite(signals).all():
            raise InputError("tile: signals have a NaN or infinite value")
        out = np.empty((stations * size, len(VIEWS) * size), np.uint8) if out is None else out
        for station in range(stations):
            signal = normalised(signals[station])
            for view, name in enumerate(VIEWS):
                self.values(signal, station, name, self._image)
                part = out[station * size : (station + 1) * size, view * size : (view + 1) * size]
                _index(self._image, name == "vt", *self._lookup[name], part)
        return out


def normalised(signal: np.ndarray) -> np.ndarray:
    """Return a signal (symbols,) as complex64, divided by the power of two that brings it just below 1."""
    signal = np.asarray(signal)
    largest = max(np.abs(signal.real).max(), np.abs(signal.imag).max())
    if largest == 0:
        return signal.astype(np.complex64)
    exponent = int(np.frexp(largest)[1])
    parts = (np.ldexp(signal.real, -exponent), np.ldexp(signal.imag, -exponent))
    return (parts[0] + 1j * parts[1]).astype(np.complex64)


def split(tile: np.ndarray) -> np.ndarray:
    """Return the images of a tile, (3 S, 3 S) -> (9, S, S): station by station, VRP, TRP, VT."""
    size = tile.shape[1] // len(VIEWS)
    grid = tile.reshape(tile.shape[0] // size, size, len(VIEWS), size)
    return np.ascontiguousarray(grid.swapaxes(1, 2)).reshape(-1, size, size)


def join(images: np.ndarray) -> np.ndarray:
    """Return the tile of images, (9, S, S) -> (3 S, 3 S): the inverse of `split`."""
    size = images.shape[-1]
    grid = images.reshape(-1, len(VIEWS), size, size).swapaxes(1, 2)
    return np.ascontiguousarray(grid).reshape(-1, len(VIEWS) * size)
