"""The renderer on any PyTorch device, batched: the same pixels as `lowalt.tiles.render`, bit for bit.

Every step is one elementwise operation of IEEE 754 (add, multiply, divide, square root, compare) in the order of the
compiled kernels, and eager PyTorch rounds after each. These functions must run eagerly: a compiler may fuse products
and sums, which changes the last digit. This is the only module of the stage that needs PyTorch.
"""

import functools

import numpy as np
import torch
from torch import Tensor

from lowalt.common.errors import InputError
from lowalt.spectra import spectrum
from lowalt.spectra.interface import OfProfiles, OnDevice
from lowalt.tiles.render import Renderer, levels


def _power_of_two(exponent: Tensor) -> Tensor:
    """2^exponent as float32, exactly, for exponents from -126 to 127."""
    return ((exponent + 127) << 23).to(torch.int32).view(torch.float32)


def _normalised(parts: Tensor) -> Tensor:
    """Signals (..., 2, symbols), real and imaginary part, divided by the power of two that brings them below 1."""
    largest = parts.abs().amax(dim=(-2, -1), keepdim=True)
    exponent = torch.where(largest > 0, torch.frexp(largest).exponent, 0)
    # Two steps: for the smallest signals, a single power of two would be outside the range of float32.
    half = exponent // 2
    return parts * _power_of_two(-half) * _power_of_two(half - exponent)


class DeviceRenderer:
    """Renders batches on a device with the tables of a `Renderer`."""

    def __init__(self, renderer: Renderer, device: str | torch.device = "cpu") -> None:
        """Copy the tables of `renderer` to `device`.

        Raises: InputError for spectra of range profiles, or that know the instants of symbols: processors make both.
        """
        if renderer.spectra.times != "even":
            raise InputError(f"spectra.times is {renderer.spectra.times!r}, expected even on a device")
        if any(isinstance(spectrum(name), OfProfiles) for name in renderer.spectra):
            raise InputError(f"spectra: {list(renderer.spectra)}, expected none of range profiles on a device")
        self.renderer, self.device = renderer, torch.device(device)
        self._plans = {name: [self._put(table) for table in renderer.plan(name)] for name in renderer.spectra}
        self._tables = {
            name: [self._put(np.stack(tables)) for tables in zip(*renderer.tables(name), strict=True)]
            for name in renderer.spectra
        }
        scale = renderer.images.scale
        self._thresholds = {
            name: self._put(scale.thresholds(levels(name)).astype(np.float32)) for name in renderer.spectra
        }

    def _put(self, table: np.ndarray) -> Tensor:
        """Copy a table to the device; integers become int64."""
        table = table.astype(np.int64) if table.dtype.kind in "iu" else table
        return torch.from_numpy(np.ascontiguousarray(table)).to(self.device)

    def images(self, signals: Tensor | np.ndarray) -> Tensor:
        """Return the index images of a batch: (B, stations, symbols) complex64 -> (B, stations spectra, S, S) uint8.

        Raises: InputError where the shape does not fit the network or a value is not finite.
        """
        network = self.renderer.network
        signals = torch.as_tensor(signals).to(self.device)
        shape = (len(network.stations), network.symbols)
        if signals.dtype != torch.complex64 or signals.ndim != 3 or tuple(signals.shape[1:]) != shape:
            raise InputError(f"images: {signals.dtype} {tuple(signals.shape)}, expected complex64 (batch, *{shape})")
        parts = torch.view_as_real(signals).movedim(-1, -2)
        if not torch.isfinite(parts).all():
            raise InputError("images: signals have a NaN or infinite value")
        re, im = _normalised(parts).unbind(-2)
        views = [self._index(self._resampled(self._values(re, im, name), name), name) for name in self.renderer.spectra]
        return torch.stack(views, dim=2).flatten(1, 2)

    def _values(self, re: Tensor, im: Tensor, name: str) -> Tensor:
        """The spectrum `name` of signals (B, stations, symbols): (B, stations, rows, starts)."""
        kind, settings, starts = spectrum(name), self.renderer.spectra[name], self.renderer.starts(name)
        if isinstance(kind, OnDevice):
            return kind.on_device(re, im, settings, self._tables[name], starts)
        values = np.empty((*re.shape[:2], kind.rows(settings), starts), np.float32)
        for number, station in np.ndindex(*re.shape[:2]):
            first, second = (np.ascontiguousarray(part[number, station].cpu().numpy()) for part in (re, im))
            kind.fill(first, second, settings, self.renderer.tables(name)[station], values[number, station])
        return self._put(values)

    def _resampled(self, values: Tensor, name: str) -> Tensor:
        """Values (B, stations, points, starts) at the image's size, the axes in the order of the compiled path."""
        source, weights, columns, shares = self._plans[name]
        steps = [self._across, self._along] if self.renderer.rows_first(name) else [self._along, self._across]
        for step in steps:
            values = step(values, source, weights) if step == self._across else step(values, columns, shares)
        return values

    @staticmethod
    def _across(values: Tensor, source: Tensor, weights: Tensor) -> Tensor:
        """Rows of the image from rows of the spectrum `source` (size, taps) with `weights` (size, taps)."""
        result = weights[:, 0, None] * values[..., source[:, 0], :]
        for tap in range(1, source.shape[1]):
            result = result + weights[:, tap, None] * values[..., source[:, tap], :]
        return result

    @staticmethod
    def _along(values: Tensor, columns: Tensor, shares: Tensor) -> Tensor:
        """Columns of the image from `columns` (taps, size) of the spectrum weighted by `shares` (taps, size)."""
        pairs = (shares[tap] * values[..., columns[tap]] + shares[tap + 1] * values[..., columns[tap + 1]]
                 for tap in range(0, columns.shape[0], 2))  # fmt: skip
        return functools.reduce(torch.add, pairs)

    def _index(self, values: Tensor, name: str) -> Tensor:
        """Index images (uint8) of values (..., S, S), each relative to its own largest magnitude."""
        largest = values.abs().amax(dim=(-2, -1), keepdim=True)
        x = values.abs() / torch.where(largest > 0, largest, 1)
        steps = torch.searchsorted(self._thresholds[name], x, right=True)
        if spectrum(name).SIGNED:
            steps = torch.where(values < 0, 128 - steps, 128 + steps)
        return steps.to(torch.uint8)
