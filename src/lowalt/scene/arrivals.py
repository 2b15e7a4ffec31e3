"""A target's echo as time samples, with all that leaks between subcarriers: motion inside a symbol, late echoes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lowalt.scene.catalogue import NamedEffect
from lowalt.scene.response import ImagePath, response
from lowalt.scene.view import View
from lowalt.scene.waveform import transmit


class Physics(NamedTuple):
    """The physics beyond Eq. 7 that a scene names: two of the response, and two that reach into a symbol's samples."""

    squint: bool
    wavefront: bool
    symbol_motion: NamedEffect | None
    cyclic_prefix: NamedEffect | None

    @property
    def within_symbols(self) -> bool:
        """Whether an echo is more than a response: its subcarriers leak into each other."""
        return self.symbol_motion is not None or self.cyclic_prefix is not None

    def response(self, view: View, paths: list[ImagePath], factor: np.ndarray | float) -> np.ndarray:
        """Return the subcarriers (N, M) of `response.response` with the physics that the scene names."""
        return response(view, paths, factor, squint=self.squint, wavefront=self.wavefront)


def arriving(
    physics: Physics, view: View, factor: np.ndarray | float, paths_of: Callable[[View], list[ImagePath]],
    symbols: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:  # fmt: skip
    """Return the time samples (N, M) of a view's target.

    factor: on the points' amplitudes, as in `response`; paths_of: returns all paths but the direct one at the instants
    of a view; symbols: subcarriers (N, M) on the air of each symbol and of the one before it.
    """
    count = view.network.subcarriers
    moved, weights = view, np.ones((1, count))
    if physics.symbol_motion is not None:
        delays_s, weights = physics.symbol_motion.module.instants(physics.symbol_motion.settings, view)
        # The instants of a symbol stand together, as symbols of their own.
        moved = view.at((view.times_s[:, None] + delays_s).reshape(-1))
    factor, *symbols = (np.repeat(each, len(weights), axis=-2) for each in (factor, *symbols))
    paths = paths_of(moved)
    if physics.cyclic_prefix is None:
        samples = transmit(physics.response(moved, paths, factor), symbols[0])
    else:
        prefix, settings = physics.cyclic_prefix.module, physics.cyclic_prefix.settings
        late = np.repeat(prefix.late_samples(settings, view), len(weights), axis=0)
        samples = np.zeros((len(late), count), np.complex128)
        # Points that lose equally many samples of the window share one response.
        for lost in np.unique(late):
            rows = np.flatnonzero((late == lost).any(axis=1))
            some = [_at_rows(path, rows) for path in paths]
            echo = physics.response(moved.at_rows(rows), some, (factor * (late == lost))[..., rows, :])
            now = transmit(echo, symbols[0][rows])
            if lost:
                before = transmit(echo * prefix.turn(settings, view.network), symbols[1][rows])
                now[:, :lost] = before[:, :lost]
            samples[rows] += now
    return np.einsum("nqm,qm->nm", samples.reshape(len(view.times_s), len(weights), count), weights)


def _at_rows(path: ImagePath, rows: np.ndarray) -> ImagePath:
    """A path at some symbols alone."""
    coefficient = path.coefficient[rows] if np.ndim(path.coefficient) > 1 else path.coefficient
    sender = None if path.sender is None else _at_rows(path.sender, rows)
    return path._replace(places=path.places[rows], coefficient=coefficient, sender=sender)
