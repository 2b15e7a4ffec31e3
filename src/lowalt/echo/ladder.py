"""Bound, compute, compare, and compute finer where cancellation ate the margin: how a tolerance is kept."""

from typing import NamedTuple

import numpy as np

from lowalt.echo import fast
from lowalt.echo.fits import folding
from lowalt.echo.lanes import ROW
from lowalt.echo.layout import layout
from lowalt.echo.motion import Scene
from lowalt.echo.plan import SPREAD_LIMIT, Plan, plan, rules
from lowalt.echo.radar import Radar
from lowalt.echo.spans import SIZE, segments, spans

LONGEST = 64
"""Most symbols of a segment."""


class Found(NamedTuple):
    """What is known of every symbol, each (N,): see `fast.run`."""

    values: np.ndarray
    cells: np.ndarray
    state: np.ndarray
    totals: np.ndarray
    bounds: np.ndarray
    ties: np.ndarray

    @classmethod
    def empty(cls, count: int) -> "Found":
        """Return room for `count` symbols, none of them computed."""
        return cls(
            np.zeros(count, np.complex128), np.zeros(count, np.int64), np.ones(count, np.int64), np.zeros(count),
            np.zeros(count), np.zeros(count, np.bool_),
        )  # fmt: skip


def climb(scene: Scene, radar: Radar, refs: np.ndarray, aims, tolerance: float | None) -> tuple[Found, np.ndarray]:
    """Return what the fast kernel found and the symbols left for the general kernel."""
    found = Found.empty(len(refs))
    everyone = np.arange(len(refs))
    peak = radar.scale * radar.transmit_h * radar.transmit_v * radar.receive_h * radar.receive_v
    lay = layout(scene, peak)
    first = scene.part[0] if len(scene.part) else 0
    span = np.empty((len(refs), 5))
    spread = spans(scene.rotation, scene.translation, first, lay.parts, lay.radii, refs, radar.sine, radar.cosine, span)
    if not spread < SPREAD_LIMIT:
        return found, everyone
    size_m = span[:, SIZE].max()
    exact = plan(radar, spread, size_m, len(lay.amplitude), 0.0)
    _run(scene, lay, radar, refs, span, everyone, aims, exact, True, found)
    return found, np.flatnonzero(found.state)


def _run(scene, lay, radar, refs, span, symbols, aims, chosen: Plan, final: bool, found: Found) -> None:
    if len(symbols) < len(refs):
        refs, span = refs[symbols], span[symbols]
    table = rules(radar)
    segs = np.empty((len(symbols), 8))
    count = segments(span, radar.cells, table[1][0], table[3][0], LONGEST, segs)
    # Separate arrays of odd length: rows of one array would be views, a counted reference each time they are passed.
    work = tuple(np.empty(ROW) for _ in range(6))
    small = tuple(np.empty(ROW, np.float32 if chosen.single else np.float64) for _ in range(10))
    fast.run(
        scene, lay, radar, refs, span, segs[:count], symbols, aims, table, chosen.fits, folding(),
        (chosen.fit, chosen.share, chosen.peak, float(final)), work, small, tuple(found),
    )  # fmt: skip
