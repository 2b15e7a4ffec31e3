"""The echo of one moving target at one station over all paths, as subcarriers or as time samples of each symbol."""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from lowalt.effects import arrivals, lit_points, need, steering, strongest_cell, waveform
from lowalt.effects.catalogue import BY_END, NamedEffect, providing
from lowalt.effects.interface import AddsPaths, BoundsItself, MovesImages, WeighsPoints, WeighsRoutes
from lowalt.effects.lit_points import SkipsDarkPoints
from lowalt.effects.response import ImagePath
from lowalt.effects.sending import Sending
from lowalt.effects.view import View

EXACT = 1e-13
"""Error of interpolation, relative to the sum of peak amplitudes, where nothing is approximated."""


class TargetEcho:
    """Computes one target's echo with any subset of its physics by need.

    channel: the scene's channel effects; draws: as in `chain.Chain`; sending: what the station sends. `error` is the
    largest error of interpolation over frequencies and over instants, each relative to the sum of peak amplitudes.
    """

    def __init__(
        self, channel: list[NamedEffect], view: View, draws: Callable[..., np.random.Generator], sending: Sending
    ):
        self.channel, self.view, self.draws, self.sending = channel, view, draws, sending
        self.error = EXACT
        self.by_need = {effect.name: effect for effect in providing(channel, BoundsItself)}
        self._seen: dict[str, np.ndarray] = {}
        self._products: dict[tuple[str, ...], np.ndarray | float] = {}
        self._strongest: list[np.ndarray] | None = None
        self._tones: np.ndarray | None = None
        self.factor: np.ndarray | float = self.weight(view)

    def weight(self, view: View) -> np.ndarray | float:
        """Return the product (N, L) of all factors on the points' amplitudes, as the station of `view` hears them."""
        return self._product(providing(self.channel, WeighsPoints), view)

    def _product(self, effects: Sequence[NamedEffect], view: View) -> np.ndarray | float:
        """The product (N, L) of the factors of some effects on the points' amplitudes, seen as in `view`."""
        names = tuple(effect.name for effect in effects)
        if view is self.view and names in self._products:
            return self._products[names]
        result: np.ndarray | float = 1.0
        for effect in effects:
            # A product stays zero whatever the effects after it say of the point.
            whole = view.station.transmitter is None and np.shape(result) == view.places.shape[:2]
            dark = result == 0.0 if whole else None
            result = result * self._visible(effect, view, dark)
        if view is self.view:
            self._products[names] = result
        return result

    @property
    def bent(self) -> bool:
        """Whether `direct` is not the whole echo: the scene has further paths or physics by need."""
        return bool(self.by_need or providing(self.channel, AddsPaths))

    @cached_property
    def strengths(self) -> np.ndarray:
        """Largest sum of amplitudes (N, P) that each part can have in a range cell before the receiver."""
        back = _amplitude(self.paths)
        out = _amplitude([path.sender or path for path in self.paths])
        return need.part_amplitudes(self.view) * (out * back) * float(np.max(self.routes))

    @cached_property
    def routes(self) -> np.ndarray | float:
        """Factor on the points' amplitudes: `factor`, or that of each route where the scene tells them apart."""
        told = providing(self.channel, WeighsRoutes)
        if not told or not self.paths:
            return self.factor
        weighing = providing(self.channel, WeighsPoints)
        return told[0].module.routes(told[0].settings, self.view, self.paths, weighing, self._product)

    @cached_property
    def _alone(self) -> tuple[steering.Steered, list[list[np.ndarray]]]:
        """The direct path alone, without physics by need, to rounding, and its moments."""
        rays = steering.Steered(self.view, error=EXACT, lit=lit_points.lit(self.factor))
        return rays, rays.moments(rays.paired(self.factor))

    @cached_property
    def direct(self) -> np.ndarray:
        """The target's subcarriers (N, M) on the direct path alone, without physics by need, to rounding."""
        rays, moments = self._alone
        if self._strongest is not None:
            return rays.spectrum(moments)
        result, *self._strongest = rays.searched(moments, None)
        return result

    @property
    def strongest(self) -> tuple[np.ndarray, np.ndarray]:
        """The strongest range cells of `direct`: their values (N,) and numbers (N,)."""
        value, cell = self._strongest or strongest_cell.strongest(self.direct)
        return value, cell

    @property
    def near(self) -> int | None:
        """The first symbol's strongest range cell of `direct`, None where it is not known."""
        return None if self._strongest is None or not len(self._strongest[1]) else int(self._strongest[1][0])

    def send(self) -> None:
        """Make the tones of `direct` in the pass that finds its strongest cells, for `sent`; the data are QPSK."""
        rays, moments = self._alone
        self._tones, *self._strongest = rays.searched(moments, self.sending.signs)

    def sent(self) -> np.ndarray | None:
        """Return the tones (N, M) that `send` made, once: whoever gets them may overwrite them."""
        tones, self._tones = self._tones, None
        return tones

    @cached_property
    def own_response(self) -> np.ndarray:
        """Subcarriers (N, M) of this target with every effect of the scene, to rounding."""
        return self.subcarriers(self.view, frozenset(self.by_need), self.routes)

    @cached_property
    def own_samples(self) -> np.ndarray:
        """Time samples (N, M) of this target with every effect of the scene, to rounding."""
        return self.samples(self.view, frozenset(self.by_need), self.routes, slice(None))

    def subcarriers(self, view: View, on: frozenset[str], factor: np.ndarray | float) -> np.ndarray:
        """Return the subcarriers (N, M) with the physics `on`, summed over all paths."""
        paths = self.paths if view is self.view else self.paths_of(view)
        plain, known = view is self.view and not on & {"squint", "wavefront"}, None
        if plain and factor is self.factor and not paths:
            return self.direct
        if plain and factor is self.routes and paths and view.station.transmitter is None:
            # The way there and back by the direct path has the same factors.
            known = self.__dict__.get("direct")
        return steering.echo(
            view, paths, factor, known, squint="squint" in on, wavefront="wavefront" in on, error=self.error
        )  # fmt: skip

    def samples(
        self, view: View, on: frozenset[str], factor: np.ndarray | float, rows: slice | np.ndarray
    ) -> np.ndarray:
        """Return the time samples (N, M) of the symbols `rows` of the look, with the physics `on`.

        view, factor: the target and its points' factors at these symbols alone.
        """
        still, samples = self.arriving(view, on, factor, rows)
        return samples + waveform.transmit(still, self.sending.aired[rows])

    def arriving(
        self, view: View, on: frozenset[str], factor: np.ndarray | float, rows: slice | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the echo as a response (N, M) and time samples to add to its own (`arrivals.arriving`)."""
        return arrivals.arriving(self, view, on, factor, rows)

    def paths_of(self, view: View) -> list[ImagePath]:
        """All paths except the direct one, without those that carry nothing in the whole look."""
        return [path for path, lit in zip(self._every_path(view), self._lit, strict=True) if lit]

    def _every_path(self, view: View) -> list[ImagePath]:
        """All paths except the direct one; on a link those of its receiver, each with its sender's."""
        ends = [
            [path for one in providing(self.channel, AddsPaths) for path in one.module.paths(one.settings, end)]
            for end in view.ends()
        ]
        return ends[0] if len(ends) == 1 else _paired(*ends)

    def moved(self, view: View, held: list[ImagePath]) -> list[ImagePath]:
        """The paths `held`, with the images at the instants of `view`."""
        senders = [path.sender or path for path in held]
        ends = [
            [ImagePath(new, old.coefficient) for new, old in zip(self._images_of(end), olds, strict=True)]
            for end, olds in zip(view.ends(), (senders, held), strict=False)
        ]
        return ends[0] if len(ends) == 1 else _paired(*ends)

    def _images_of(self, view: View) -> list[np.ndarray]:
        """The points' images (N, L, 3) m of all paths except the direct one."""
        found = []
        for effect in providing(self.channel, AddsPaths):
            if providing([effect], MovesImages):
                found += effect.module.images(effect.settings, view)
            else:
                found += [path.places for path in effect.module.paths(effect.settings, view)]
        return [images for images, lit in zip(found, self._lit, strict=True) if lit]

    @cached_property
    def _whole(self) -> list[ImagePath]:
        """All paths except the direct one, over the whole look."""
        return self._every_path(self.view)

    @cached_property
    def _lit(self) -> list[bool]:
        """Whether each of these paths carries anything in the look."""
        return [any(np.any(one.coefficient) for one in (path, path.sender) if one is not None) for path in self._whole]

    @cached_property
    def paths(self) -> list[ImagePath]:
        """The paths over the whole look that carry anything, except the direct one."""
        return [path for path, lit in zip(self._whole, self._lit, strict=True) if lit]

    def _visible(self, effect: NamedEffect, view: View, dark: np.ndarray | None = None) -> np.ndarray:
        """The factor of one effect on the points' amplitudes, seen as in `view`; its draws are the same each time.

        dark: points (N, L) whose factor does not matter, None for no such.
        """
        if dark is not None and providing([effect], SkipsDarkPoints):
            return effect.module.visible_of(effect.settings, view, dark)
        if view is self.view and effect.name in self._seen:
            return self._seen[effect.name]
        if view.station.transmitter is not None and effect.name in BY_END:
            out, back = (
                effect.module.visible(effect.settings, end, self.draws(effect.name, end.station)) for end in view.ends()
            )
            found = np.sqrt(out * back)
        else:
            found = effect.module.visible(effect.settings, view, self.draws(effect.name))
        if view is self.view:
            self._seen[effect.name] = found
        return found


def _paired(out: list[ImagePath], back: list[ImagePath]) -> list[ImagePath]:
    """The paths of a link's receiver, each with its sender's."""
    return [there._replace(sender=here) for here, there in zip(out, back, strict=True)]


def _amplitude(paths: list[ImagePath]) -> float:
    """Largest sum of the amplitudes of one way over the direct path and all others."""
    return 1.0 + sum(_largest(np.asarray(path.coefficient, np.complex128)) for path in paths)


def _largest(values: np.ndarray) -> float:
    """Largest magnitude of complex values; one root of a sum of squares takes less time than every magnitude."""
    return float(np.sqrt(np.max(values.real**2 + values.imag**2)))
