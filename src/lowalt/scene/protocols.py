"""The functions that an effect may offer, by the place where it acts.

An effect is a module `scene/effects/PLACE/NAME.py` with SOURCE (where its model comes from), DEFAULTS (every parameter)
and `idle(settings)`, which says whether settings change nothing; an idle effect is dropped. It may offer
`check(settings, scene)`, which raises InputError where its settings contradict the rest of a scene (`checks`). All else
that it does is one or more of the functions below. `chain` calls them in the order of `catalogue.ORDER`.

N symbols, L points, M subcarriers or range cells. Arrays are complex128 or float64. `settings` holds every key of
DEFAULTS. `rng` is the effect's own stream of this sample (and station), so no effect moves another's draws.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from lowalt.config.network import Network
from lowalt.motion.poses import Perturbation
from lowalt.scene.antenna import Element
from lowalt.scene.listening import Listening
from lowalt.scene.response import ImagePath
from lowalt.scene.sampling import Sampling
from lowalt.scene.view import Beams, View
from lowalt.scene.waveform import Look
from lowalt.targets.cloud import Cloud


@runtime_checkable
class PerturbsMotion(Protocol):
    """Motion: moves the target or its parts."""

    def perturb(self, settings: dict, cloud: Cloud, row: dict, times_s: np.ndarray, rng: np.random.Generator) -> Perturbation:  # fmt: skip  # noqa: E501
        """Return the angles, offsets (m) and tilts (rad) added to the motion of `row` at `times_s` (N,)."""


@runtime_checkable
class DrawsData(Protocol):
    """Transmitter: chooses the data."""

    def data(self, settings: dict, symbols: int, subcarriers: int, rng: np.random.Generator) -> np.ndarray:
        """Return the data (symbols, subcarriers) of mean power one."""


@runtime_checkable
class ChangesWaveform(Protocol):
    """Transmitter: stands between the data and the air."""

    def aired(self, settings: dict, sent: np.ndarray) -> np.ndarray:
        """Return the subcarriers (N, M) on the air for the data `sent` (N, M)."""


@runtime_checkable
class PicksSubcarriers(Protocol):
    """Transmitter: leaves the receiver some of the subcarriers."""

    def range_cells(self, settings: dict, response: np.ndarray) -> np.ndarray:
        """Return the range cells of responses (N, M)."""


@runtime_checkable
class SamplesTime(Protocol):
    """Transmitter: sets the instants of the symbols."""

    def sampling(self, settings: dict, network: Network, rng: np.random.Generator) -> Sampling:
        """Return the instants of a look, and which symbols are received."""

    def regridded(self, settings: dict, signal: np.ndarray, given: Sampling, network: Network) -> np.ndarray:
        """Return the evenly spaced signal (N,) made of the received symbols."""


@runtime_checkable
class PointsBeams(Protocol):
    """Channel: points the beams."""

    def beams(self, settings: dict, view: View, rng: np.random.Generator) -> Beams:
        """Return where both beams point in the look, and from when on."""


@runtime_checkable
class ShapesElements(Protocol):
    """Channel: gives antenna elements a pattern."""

    def element(self, settings: dict) -> Element:
        """Return the element."""


@runtime_checkable
class SetsCrossSections(Protocol):
    """Channel: replaces the points' mean cross sections."""

    def cross_sections(self, settings: dict, cloud: Cloud, wavelength_m: float) -> np.ndarray:
        """Return each point's cross section (L,) in m2."""


@runtime_checkable
class WeighsPoints(Protocol):
    """Channel: changes the points' amplitudes (occlusion, aspect)."""

    def visible(self, settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
        """Return the real factor on every point's two-way amplitude, (N, L) or (N, 1)."""


@runtime_checkable
class AddsPaths(Protocol):
    """Channel: opens further one-way paths between the station and the points."""

    def paths(self, settings: dict, view: View) -> list[ImagePath]:
        """Return the further paths; waves go out by any path and come back by any."""


@runtime_checkable
class WeighsRoutes(Protocol):
    """Channel: tells the points' amplitudes on further paths from those on the direct one."""

    def routes(self, settings: dict, view: View, paths: list[ImagePath], weight: Callable[[View, Iterable[str] | None], np.ndarray]) -> np.ndarray:  # fmt: skip  # noqa: E501
        """Return the factors (R, R, N, L) on two-way amplitudes, out by path a and back by path b; direct first.

        weight(view, names): product (N, L) of the factors of the named effects (None: all) as `view` sees them.
        """


@runtime_checkable
class AddsEchoes(Protocol):
    """Channel: adds echoes of something other than the target (clutter)."""

    def scatter(self, settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
        """Return a frequency response (N, M) in the units of the target's, sqrt(W) a subcarrier."""


@runtime_checkable
class AddsTargets(Protocol):
    """Channel: puts other targets next to the primary one; all stations see the same."""

    def companions(self, settings: dict, cloud: Cloud, row: dict, clouds: Mapping[str, Cloud], rng: np.random.Generator) -> list[tuple[Cloud, dict]]:  # fmt: skip  # noqa: E501
        """Return the other targets' clouds and rows of the motion table; clouds: by subtype."""


@runtime_checkable
class AddsSignals(Protocol):
    """Channel: makes the receiver hear what it does not know (other stations)."""

    def heard(self, settings: dict, given: Listening) -> np.ndarray | None:
        """Return time samples (N, M) to add to the look's, None for none."""


@runtime_checkable
class ChangesSamples(Protocol):
    """Receiver: acts on the time samples of the useful part of each OFDM symbol."""

    def receive(self, settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
        """Return the samples (N, M) after the effect."""


@runtime_checkable
class FiltersCells(Protocol):
    """Detection: acts on all range cells before one is chosen (canceller)."""

    def process(self, settings: dict, cells: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
        """Return the range cells (N, M) after the effect."""


@runtime_checkable
class ChoosesCells(Protocol):
    """Detection: chooses the range cell."""

    def choose(self, settings: dict, chosen: np.ndarray, cells: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:  # fmt: skip  # noqa: E501
        """Return the chosen cells (N,) int64, given those chosen so far and all cells (N, M)."""
