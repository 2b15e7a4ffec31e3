"""A target's echo with all that leaks between subcarriers: motion inside a symbol, and echoes beyond the cyclic prefix.

Within a symbol the response is a series in time of few orders (`time_series`). Its order zero leaks nowhere and stays a
response; every further order costs one transform to time samples. Points that lose equally many samples to the prefix
form a group, which costs one more transform an order, for the samples in which the previous symbol stands in.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lowalt.effects import gain_times, interpolation, lit_points, time_series, transforms, waveform
from lowalt.effects.gain_times import Instant
from lowalt.effects.near_field import SYMBOLS
from lowalt.effects.response import ImagePath
from lowalt.effects.steering import SameSymbols, Steered, at_rows, rows_of
from lowalt.effects.tone_loops import carried_before, weighed
from lowalt.effects.view import View

if TYPE_CHECKING:
    from lowalt.effects.target_echo import TargetEcho

TOGETHER = 40_000
"""Points times symbols that go through all instants together, so that their factors stay in the processor's caches."""


def arriving(
    echo: TargetEcho, view: View, on: frozenset[str], factor: np.ndarray | float, rows: slice | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the echo of the symbols `rows` as a response (N, M) and the time samples (N, M) to add to its own.

    view, factor, on: as in `samples`. The response has no leakage between subcarriers; the samples have all of it.
    """
    held = echo.paths if view is echo.view else echo.paths_of(view)
    if "symbol_motion" not in on:
        return _in_orders(echo, view, held, on, factor, rows)
    moving = echo.by_need["symbol_motion"].module
    # Half of the error is for the instants, the other half for the orders that are left out.
    allowed = 0.5 * max(echo.error, moving.rounding(view))
    strengths = echo.strengths
    shares = strengths.max(axis=0) / max(float(strengths.sum(axis=1).max()), 1e-300)
    motion = moving.complex_motion(view)
    count = moving.count_of(view, motion, allowed, shares)
    farther_m = moving.farther_m(view)
    if (
        1 < count < view.network.subcarriers
        and np.isfinite(farther_m)
        and not held
        and time_series.alone(view, lit_points.lit(factor), on)
    ):
        still, samples = time_series.arrived(
            view, moving.nodes_s(view, count), np.ascontiguousarray(echo.sending.aired[rows]), factor,
            allowed * float(strengths.sum(axis=1).max()), farther_m, squint="squint" in on, error=echo.error,
        )  # fmt: skip
    elif count < view.network.subcarriers and np.isfinite(farther_m):
        within = _within(echo, view, on, count, motion)
        numbers, found = np.arange(len(echo.view.times_s))[rows], []
        together = SYMBOLS * max(1, TOGETHER // (SYMBOLS * view.places.shape[1]))
        for first in range(0, len(numbers), together):
            some = np.arange(first, min(first + together, len(numbers)))
            paths = [at_rows(path, some) for path in held]
            given = view.at_symbols(some), paths, on, rows_of(factor, some), numbers[some]
            found.append(_in_orders(echo, *given, within, allowed))
        still, samples = found[0] if len(found) == 1 else (np.concatenate(every) for every in zip(*found, strict=True))
    else:
        still = np.zeros((len(view.times_s), view.network.subcarriers), np.complex128)
        samples = _at_instants(echo, view, on, factor, rows, moving.instants(view, echo.error))
    bent = np.flatnonzero(moving.bent(view))
    if len(bent):
        part = view.at(view.times_s[bent])
        own = factor if np.ndim(factor) == 0 else _every_row(factor, len(samples))[..., bent, :]
        numbers = np.arange(len(echo.view.times_s))[rows][bent]
        samples[bent] = _at_instants(echo, part, on, own, numbers, moving.pieces(part, echo.error))
        still[bent] = 0.0
    return still, samples


class Within(NamedTuple):
    """Instants of a symbol: order: their numbers, as they are computed, and how each gets its array sums.

    delays_s: (Q,) or (Q, N) s after a symbol's beginning; farther_m: bound of how much ranges differ between instants
    (m), by which all get moments of the same functions; None for instants that are on their own.
    """

    order: list[tuple[int, Instant | None]]
    delays_s: np.ndarray
    farther_m: float | None


def _within(echo: TargetEcho, view: View, on: frozenset[str], count: int, motion: tuple | None) -> Within:
    """A symbol's `count` Chebyshev points; motion: as `symbol_motion.complex_motion` returns it."""
    moving = echo.by_need["symbol_motion"].module
    order = [(number, None) for number in range(count)]
    if "wavefront" in on:
        order = gain_times.order(view, motion, count, echo.error / 10)
    return Within(order, moving.nodes_s(view, count), moving.farther_m(view))


def _in_orders(
    echo: TargetEcho, view: View, held: Sequence[ImagePath], on: frozenset[str], factor: np.ndarray | float, rows,
    within: Within | None = None, allowed: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """The result of `arriving` from series in time over the instants `within`, or of fewer orders that err little.

    held: all paths but the direct one; within: None for the symbols' beginnings; allowed: largest error of orders left
    out, relative to the largest sum of amplitudes.
    """
    groups, turned = _groups(echo, view, on, factor)
    within = within or Within([(0, None)], np.zeros(1), 0.0)
    count = len(within.order)
    found: list[list[time_series.Moments]] = [[[]] * count for _ in groups]
    first, paired, lit = None, [], lit_points.lit(factor)
    each = _rays(echo, view, held, on, within, lit, len(groups) == 1)
    for (number, _), rays in zip(within.order, each, strict=True):
        if first is None:
            first, paired = rays, [rays.paired(strength) for _, strength, _ in groups]
        for mine, own in zip(found, paired, strict=True):
            mine[number] = rays.moments(own)
    series = [time_series.orders(mine) for mine in found]
    now = np.ascontiguousarray(echo.sending.aired[rows]) if turned is not None or count > 1 else None
    before = None if turned is None else np.ascontiguousarray(echo.sending.aired_before[rows])
    orders = 1
    if count > 1:
        share = allowed if turned is None else 0.5 * allowed
        orders = time_series.kept(series, first, share * float(echo.strengths.sum(axis=1).max()))
    samples = (np.empty if orders > 1 else np.zeros)((len(view.times_s), view.network.subcarriers), np.complex128)
    every = np.arange(len(samples))
    shapes = interpolation.polynomials(orders, interpolation.samples(samples.shape[1]))
    for order, shape in zip(range(orders)[::-1], shapes[::-1], strict=True):
        if order > 0 and turned is None:
            tones = first.tones(series[0][order], now)
            weighed(transforms.inverse(tones, out=tones), shape, order == orders - 1, every, samples)
            continue
        spectra = [first.spectrum(mine[order]) for mine in series]
        whole = sum(spectra[1:], spectra[0])
        if order == 0:
            still = whole
        else:
            weighed(waveform.transmit(whole, now), shape, order == orders - 1, every, samples)
        for (cut, _, lit), spectrum in zip(groups, spectra, strict=True):
            if cut:
                tones = np.empty((len(every[lit]), len(shape)), np.complex128)
                carried_before(spectrum, turned, before, now, every[lit], tones)
                weighed(transforms.inverse(tones, out=tones), shape[:cut], False, every[lit], samples)
    return still, samples


def _groups(
    echo: TargetEcho, view: View, on: frozenset[str], factor: np.ndarray | float
) -> tuple[list[tuple[int, np.ndarray | float, np.ndarray | slice]], np.ndarray | None]:
    """Points in groups that lose equally many samples to the prefix, and the previous symbol's phase factor (M,).

    A group: the samples that carry the previous symbol, the points' factors, the symbols in which it has points.
    """
    if "cyclic_prefix" not in on:
        return [(0, factor, slice(None))], None
    cut = echo.by_need["cyclic_prefix"]
    first = cut.module.first_samples(cut.settings, view)
    chosen = [(count, first == count) for count in range(int(first.min()), int(first.max()) + 1)]
    groups = [(count, factor * mine, _any_of(mine)) for count, mine in chosen if mine.any()]
    return groups, cut.module.turn(cut.settings, view.network, waveform.baseband_hz(view.network))


def _rays(
    echo: TargetEcho, view: View, held: Sequence[ImagePath], on: frozenset[str], within: Within,
    lit: np.ndarray | None = None, once: bool = True,
) -> Iterator[Steered]:  # fmt: skip
    """Yield the one-way factors at each instant of `within`, in its order.

    held: all paths but the direct one; lit, once: as in `Steered`. Visibility and reflection coefficients stay during a
    symbol; only places move.
    """
    kept: dict = {}
    asked = {"squint": "squint" in on, "wavefront": "wavefront" in on, "error": echo.error, "kept": kept}
    first, span = None, None
    if within.farther_m is not None:
        span = SameSymbols(view.beam_rows() if view.turning else [], within.farther_m)
    delays = within.delays_s[[number for number, _ in within.order]]
    each = view.at_each(view.times_s + delays.reshape(len(delays), -1)) if "symbol_motion" in on else [view]
    for later, (_, instant) in zip(each, within.order, strict=True):
        paths, own = held, lit
        if first is not None and lit is not None:
            # The first instant has gathered all that stays during a symbol.
            later, own = later.with_places(lit_points.places_at(later.places, lit)), None
            paths = first.paths
        if held and later is not view:
            paths = echo.moved(later, paths)
        rays = Steered(later, paths, **asked, like=first, span=span, instant=instant, lit=own, once=once)
        if span is not None:
            first = first or rays
        yield rays


def _at_instants(
    echo: TargetEcho,
    view: View,
    on: frozenset[str],
    factor: np.ndarray | float,
    rows,
    times: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Time samples (N, M) of the target's echo from its response at instants of a symbol.

    times: the instants (Q,) or (Q, N) s and their interpolation weights (Q, M) or (Q, N, M). Points are summed in
    groups that lose equally many samples.
    """
    delays, weights = times
    groups, turned = _groups(echo, view, on, factor)
    samples = np.zeros((len(view.times_s), view.network.subcarriers), np.complex128)
    now, before = echo.sending.aired[rows], echo.sending.aired_before[rows] if turned is not None else None
    held = echo.paths if view is echo.view else echo.paths_of(view)
    within = Within([(number, None) for number in range(len(delays))], delays, None)
    each = _rays(echo, view, held, on, within, once=len(groups) == 1)
    for rays, weight in zip(each, weights, strict=True):
        for count, strength, lit in groups:
            spectrum = rays.echo(strength)[lit]
            heard = waveform.transmit(spectrum, now[lit])
            if count:
                heard[:, :count] = waveform.transmit(spectrum * turned, before[lit])[:, :count]
            heard *= weight[lit] if weight.ndim == 2 else weight
            samples[lit] += heard
    return samples


def _every_row(factor: np.ndarray, count: int) -> np.ndarray:
    """A factor (N or 1, L) or (R, N or 1, L) with a row for each of `count` symbols."""
    return np.broadcast_to(factor, (*factor.shape[:-2], count, factor.shape[-1]))


def _any_of(chosen: np.ndarray) -> np.ndarray | slice:
    """Return the symbols (K,) in which any point (N, L) is chosen, as a slice where these are all."""
    found = chosen.any(axis=1)
    return slice(None) if found.all() else np.flatnonzero(found)
