"""The renderer on any PyTorch device, batched: the same pixels as `lowalt.tiles.render`, bit for bit.

Every step is one elementwise operation of IEEE 754 (add, multiply, divide, square root, compare) in the order of the
compiled kernels, and eager PyTorch rounds after each. Compiling this would let products and sums be fused, which
changes the last digit, so it must run eagerly. This is the only module of the stage that needs PyTorch.
"""

import numpy as np
import torch
from torch import Tensor

from lowalt.common.errors import InputError
from lowalt.tiles.render import VIEWS, Renderer


def _power_of_two(exponent: Tensor) -> Tensor:
    """2^exponent as float32, exactly, for exponents from -126 to 127."""
    return ((exponent + 127) << 23).to(torch.int32).view(torch.float32)


def _normalised(parts: Tensor) -> Tensor:
    """Signals (..., 2, symbols), real and imaginary part, divided by the power of two that brings them below 1."""
    largest = parts.abs().amax(dim=(-2, -1), keepdim=True)
    exponent = torch.where(largest > 0, torch.frexp(largest).exponent, 0)
    # In two steps, since a single power would leave the range of float32 for the smallest signals.
    half = exponent // 2
    return parts * _power_of_two(-half) * _power_of_two(half - exponent)


class DeviceRenderer:
    """Renders batches on a device with the tables of a `Renderer`."""

    def __init__(self, renderer: Renderer, device: str | torch.device = "cpu") -> None:
        """Copy the tables of `renderer` to `device`."""
        self.renderer, self.device = renderer, torch.device(device)
        self._plans = {name: [self._put(table) for table in renderer.plan(name)] for name in VIEWS}
        self._turns = {name: [self._put(table)[:, None] for table in renderer.turns(name)] for name in ("vrp", "trp")}
        self._matched = [self._put(np.stack(tables)) for tables in zip(*renderer.matched, strict=True)]
        levels = {name: 127 if name == "vt" else 255 for name in VIEWS}
        scale = renderer.images.scale
        self._thresholds = {n: self._put(scale.thresholds(k).astype(np.float32)) for n, k in levels.items()}

    def _put(self, table: np.ndarray) -> Tensor:
        table = table.astype(np.int64) if table.dtype.kind in "iu" else table
        return torch.from_numpy(np.ascontiguousarray(table)).to(self.device)

    def images(self, signals: Tensor | np.ndarray) -> Tensor:
        """Return the index images of a batch: (B, stations, symbols) complex64 -> (B, 3 stations, S, S) uint8.

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
        views = [self._index(self._resampled(self._values(re, im, name), name), name) for name in VIEWS]
        return torch.stack(views, dim=2).flatten(1, 2)

    def _values(self, re: Tensor, im: Tensor, name: str) -> Tensor:
        """The spectrum `name` of signals (B, stations, symbols): (B, stations, points, starts)."""
        setting = getattr(self.renderer.spectra, name)
        starts = self.renderer.starts(name)
        if name == "vt":
            return self._transfer(re, im, setting.window, starts)
        cosine, sine = self._turns[name]
        re, im = re.unsqueeze(-2), im.unsqueeze(-2)
        stride, rows = setting.window // 2, setting.points // setting.window
        while stride:
            count = starts + stride - 1
            which = torch.arange(rows, device=self.device) * stride % setting.points
            c, s = cosine[which], sine[which]
            far_re, far_im = re[..., stride : stride + count], im[..., stride : stride + count]
            b_re, b_im = far_re * c - far_im * s, far_re * s + far_im * c
            a_re, a_im = re[..., :count], im[..., :count]
            re = torch.cat([a_re + b_re, a_re - b_re], dim=-2)
            im = torch.cat([a_im + b_im, a_im - b_im], dim=-2)
            stride, rows = stride // 2, 2 * rows
        # torch's float32 square root is not correctly rounded on every processor (AVX2); a double's, rounded once, is.
        return torch.sqrt((re * re + im * im).double()).float()

    def _transfer(self, re: Tensor, im: Tensor, window: int, starts: int) -> Tensor:
        """The velocity-transfer spectrum, (B, stations, speeds, starts)."""
        cosine, sine = self._matched
        re, im = re.unsqueeze(-2), im.unsqueeze(-2)
        x = re[..., :starts].expand(-1, -1, cosine.shape[1], -1)
        y = im[..., :starts].expand_as(x)
        for step in range(1, window + 1):
            c, s = cosine[..., step, None], sine[..., step, None]
            near, far = re[..., step : step + starts], im[..., step : step + starts]
            ahead_x, ahead_y = x + (near * c - far * s), y + (near * s + far * c)
            if step < window:
                x, y = ahead_x, ahead_y
        share = float(self.renderer.share[0])
        return (ahead_x * ahead_x + ahead_y * ahead_y) * share - (x * x + y * y)

    def _resampled(self, values: Tensor, name: str) -> Tensor:
        """Values (B, stations, points, starts) at the image's size, the axes in the order of the compiled path."""
        source, weights, columns, shares = self._plans[name]
        steps = [self._across, self._along] if self.renderer.rows_first(name) else [self._along, self._across]
        for step in steps:
            values = step(values, source, weights) if step == self._across else step(values, columns, shares)
        return values

    @staticmethod
    def _across(values: Tensor, source: Tensor, weights: Tensor) -> Tensor:
        result = weights[:, 0, None] * values[..., source[:, 0], :]
        for tap in range(1, source.shape[1]):
            result = result + weights[:, tap, None] * values[..., source[:, tap], :]
        return result

    @staticmethod
    def _along(values: Tensor, columns: Tensor, shares: Tensor) -> Tensor:
        result = None
        for tap in range(0, columns.shape[0], 2):
            pair = shares[tap] * values[..., columns[tap]] + shares[tap + 1] * values[..., columns[tap + 1]]
            result = pair if result is None else result + pair
        return result

    def _index(self, values: Tensor, name: str) -> Tensor:
        largest = values.abs().amax(dim=(-2, -1), keepdim=True)
        x = values.abs() / torch.where(largest > 0, largest, 1)
        steps = torch.searchsorted(self._thresholds[name], x, right=True)
        if name == "vt":
            steps = torch.where(values < 0, 128 - steps, 128 + steps)
        return steps.to(torch.uint8)
