"""The interface of an effect: the names that its module must offer, and those that it may offer.

An effect is a module, `effects/{place}/{name}.py`. It must offer everything in `Effect` and the functions of exactly
one protocol that names its place below; those marked optional come in addition. The chain asks by `isinstance`.
N symbols, L points, P parts, M subcarriers. Arrays are complex128 or float64. `settings` holds every key of `DEFAULTS`.
`rng` is the stream (seed, "effect", name, subtype, model[, station]), so no effect moves another's draws. Types only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy as np

    from lowalt.common.network import Network
    from lowalt.effects.antenna import Element as AntennaElement
    from lowalt.effects.catalogue import NamedEffect
    from lowalt.effects.checks import CheckedScene
    from lowalt.effects.listening import Listening
    from lowalt.effects.range_noise import RangeNoise
    from lowalt.effects.response import ImagePath
    from lowalt.effects.transmitter.slow_time import Sampling
    from lowalt.effects.view import Beams, View
    from lowalt.effects.waveform import Frame
    from lowalt.motion.poses import Perturbation
    from lowalt.targets.cloud import Cloud


@runtime_checkable
class Effect(Protocol):
    """The names that every effect's module offers."""

    SOURCE: str
    """Where the model comes from; `lowalt explain` prints it."""
    DEFAULTS: dict
    """Every parameter with its default; a scene's values replace them."""

    def idle(self, settings: dict) -> bool:
        """Return whether these settings change nothing; the effect is then dropped, and every bit stays."""


@runtime_checkable
class Checks(Protocol):
    """Optional: an effect whose settings can contradict the rest of the scene."""

    def check(self, settings: dict, scene: CheckedScene) -> None:
        """Raise InputError that names the effect, the value and what was expected."""


@runtime_checkable
class Amplifies(Protocol):
    """Optional, not motion or channel: an effect that can make an error of its input larger."""

    def amplifies(self, settings: dict) -> float:
        """Return the largest factor on an error's 2-norm, or sum over symbols; inf if not continuous, 1 if absent."""


@runtime_checkable
class Quantises(Protocol):
    """Optional, receiver: a staircase of equal steps, whose `amplifies` is infinite."""

    def step(self, settings: dict, samples: np.ndarray) -> float:
        """Return the height of a step for these samples (N, M) (their units)."""


@runtime_checkable
class PerturbsMotion(Protocol):
    """Motion: an effect that moves the target or its parts; all stations see the same motion."""

    def perturb(
        self, settings: dict, cloud: Cloud, row: dict, times_s: np.ndarray, rng: np.random.Generator
    ) -> Perturbation:
        """Return the angles, offsets (m) and tilts (rad) added to the motion of `row` at `times_s` (N,)."""


@runtime_checkable
class DrawsData(Protocol):
    """Transmitter: an effect that chooses the data."""

    def data(self, settings: dict, symbols: int, subcarriers: int, rng: np.random.Generator) -> np.ndarray:
        """Return the data (symbols, subcarriers) of mean power one."""


@runtime_checkable
class ChangesWaveform(Protocol):
    """Transmitter: an effect between the data and the air."""

    def aired(self, settings: dict, sent: np.ndarray) -> np.ndarray:
        """Return the subcarriers (N, M) on the air for the data `sent` (N, M), their 2-norm no larger."""


@runtime_checkable
class PicksSubcarriers(Protocol):
    """Transmitter: an effect that leaves the receiver some of the subcarriers."""

    def range_cells(self, settings: dict, response: np.ndarray) -> np.ndarray:
        """Return the range cells of responses (N, M)."""


@runtime_checkable
class SamplesTime(Protocol):
    """Transmitter: an effect on the instants of the symbols."""

    def sampling(self, settings: dict, network: Network, rng: np.random.Generator) -> Sampling:
        """Return the instants of a look, and which symbols are received."""

    def regridded(self, settings: dict, signal: np.ndarray, given: Sampling, network: Network) -> np.ndarray:
        """Return the evenly spaced signal (N,) made of the received symbols."""


@runtime_checkable
class PointsBeams(Protocol):
    """Channel: an effect on where the beams point."""

    def beams(self, settings: dict, view: View, rng: np.random.Generator) -> Beams:
        """Return where both beams point in the look, and from when on."""


@runtime_checkable
class SetsCrossSections(Protocol):
    """Channel: an effect that replaces the points' mean cross sections."""

    def cross_sections(self, settings: dict, cloud: Cloud, wavelength_m: float) -> np.ndarray:
        """Return each point's cross section (L,) in m2."""


@runtime_checkable
class WeighsPoints(Protocol):
    """Channel: an effect that changes the points' amplitudes (occlusion, aspect)."""

    def visible(self, settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
        """Return the real factor on every point's two-way amplitude, (N, L) or (N, 1)."""


@runtime_checkable
class WeighsRoutes(Protocol):
    """Channel: an effect that tells the points' amplitudes on further paths from those on the direct one."""

    def routes(
        self, settings: dict, view: View, paths: Sequence[ImagePath], weighing: Sequence[NamedEffect],
        product: Callable[[Sequence[NamedEffect], View], np.ndarray | float],
    ) -> np.ndarray:  # fmt: skip
        """Return the factors (R, N, L) on two-way amplitudes by each path; product: that of some of `weighing`."""


@runtime_checkable
class ShapesElements(Protocol):
    """Channel, optional: an effect that gives antenna elements a pattern, which `View.element` passes to the others."""

    def element(self, settings: dict) -> AntennaElement:
        """Return the element (`antenna.Element`)."""


@runtime_checkable
class AddsPaths(Protocol):
    """Channel: an effect that opens further one-way paths between the station and the points."""

    def paths(self, settings: dict, view: View) -> list[ImagePath]:
        """Return the further paths; `response` forms every pair of a path out and a path back."""


@runtime_checkable
class MovesImages(Protocol):
    """Optional, channel: further paths whose images alone are asked for, where the coefficients are known."""

    def images(self, settings: dict, view: View) -> list[np.ndarray]:
        """Return the images (N, L, 3) m of the paths, in the order of `paths`."""


@runtime_checkable
class AddsEchoes(Protocol):
    """Channel: an effect that adds echoes of something other than the target (clutter)."""

    def scatter(self, settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
        """Return a frequency response (N, M) in the units of the target's, sqrt(W) a subcarrier."""


@runtime_checkable
class AddsSignals(Protocol):
    """Channel: an effect by which the receiver hears what it does not know (other stations)."""

    def heard(self, settings: dict, given: Listening) -> np.ndarray | None:
        """Return time samples (N, M) to add to the look's, None for none."""


@runtime_checkable
class AddsTargets(Protocol):
    """Channel: an effect that puts other targets next to the primary one; all stations see the same."""

    def companions(
        self, settings: dict, cloud: Cloud, row: dict, clouds: Mapping[str, Cloud], rng: np.random.Generator
    ) -> list[tuple[Cloud, dict]]:
        """Return the other targets' clouds and rows of the motion table; clouds: by subtype."""


@runtime_checkable
class BoundsItself(Protocol):
    """Channel: physics beyond Eq. 7 that is left out where its bound allows it; `target_echo` computes it."""

    def bound(self, settings: dict, view: View, others: frozenset[str]) -> np.ndarray:
        """Return the largest change of any range cell relative to each part's peak amplitudes; (N, P) or broadcast.

        others: names of the scene's other effects beyond motion; physics by need among them may be left out or not.
        """


@runtime_checkable
class ChangesSamples(Protocol):
    """Receiver: an effect on the time samples of the useful part of each OFDM symbol."""

    def receive(self, settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
        """Return the samples (N, M) after the effect."""


@runtime_checkable
class ChangesResponse(Protocol):
    """Optional, receiver: an effect that can also act on subcarriers before there are samples, in less time."""

    def respond(
        self, settings: dict, response: np.ndarray, frame: Frame, rng: np.random.Generator
    ) -> np.ndarray | None:
        """Return the response (N, M) with the samples of `receive`, None for none; frame: ones instead of its data."""


@runtime_checkable
class AddsNoise(Protocol):
    """Optional, receiver: white noise, of which few numbers are made where nothing comes behind it."""

    def noise(self, settings: dict, frame: Frame, rng: np.random.Generator) -> RangeNoise | None:
        """Return the noise of all range cells (`range_noise.RangeNoise`), None for none; frame: ones for its data."""


@runtime_checkable
class FiltersCells(Protocol):
    """Detection: an effect on all range cells before the strongest is chosen (canceller)."""

    def process(self, settings: dict, cells: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
        """Return the range cells (N, M) after the effect; frame: the look with ones instead of its data."""


@runtime_checkable
class ChoosesCells(Protocol):
    """Detection: an effect on the choice of the range cell."""

    def choose(self, settings: dict, chosen: np.ndarray, cells: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the chosen cells (N,) int64, given those chosen so far and all cells (N, M)."""
