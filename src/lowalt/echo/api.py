"""The echo's public calls: input checked, reference ranges in double-double, one kernel, three answers."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import BelowFloor, InputError
from lowalt.common.network import Network, Station
from lowalt.echo import refine
from lowalt.echo.pointwise import sums
from lowalt.echo.pointwise.reference_range import reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.echo.refine import Choice
from lowalt.echo.scene import Rigid, Scene, check, target


class Path(NamedTuple):
    """One way of the wave to every point and back, beside or instead of the direct one.

    delay_s: extra delay (s), gain: complex factor, each a number or an array that broadcasts to (N, L).
    The direct path is Path(0.0, 1.0).
    """

    delay_s: float | np.ndarray = 0.0
    gain: complex | np.ndarray = 1.0


class EchoResult(NamedTuple):
    """Signal of one station.

    signal: (N,) complex128, the strongest range cell's value; cell: (N,) int64, its index in 0..M-1; near_ties: how
    many symbols have a second cell within a relative 1e-12 (their arg max is a coin toss of rounding); bound: proved
    bound of the error relative to max |signal|, inf where nothing can be said; choice: what was decided, and why;
    gap: (N,) float64, certified lower bound of |Y| at the strongest cell less |Y| at any other, 0 where none is known;
    totals: (N,) float64, sum of all points' and paths' |amplitudes|, array gains included; where points were
    interpolated in slow time, a little above it.
    """

    signal: np.ndarray
    cell: np.ndarray
    near_ties: int
    bound: float
    choice: Choice
    gap: np.ndarray
    totals: np.ndarray


def echo_signal(
    network: Network,
    station: Station,
    motion: Rigid | np.ndarray,
    rcs_m2: np.ndarray | float,
    aim_m: np.ndarray,
    tolerance: float | None = None,
    paths: Sequence[Path] | None = None,
    sample: str = "",
) -> EchoResult:
    """Return the symbol-domain signal Y_bin of `station`: for each symbol the strongest of all M range cells.

    motion: `Rigid`, positions (N, L, 3) in metres, or a `motion.Target` that was checked before, with rcs_m2 None;
    rcs_m2: (L,) m2 or one number; aim_m: (3,) m, where both beams point; tolerance: largest error allowed, relative to
    the sample's max |Y_bin|, None for the exact closed form; paths: all ways of the wave (default: the direct one
    alone); sample: a name for error messages.
    Raises: InputError naming the argument, its value and the sample; BelowFloor, a kind of it, for a tolerance smaller
    than the bound that float64 can prove for this sample. Source: paper Eqs. 7 and 22 to 25.
    """
    _check_tolerance(tolerance, sample)
    scene, radio, refs, aims, ways = _prepare(network, station, motion, rcs_m2, aim_m, paths, sample)
    found, again, choice = refine.climb(scene, radio, refs, aims, tolerance)
    if paths is not None:
        again = np.arange(len(refs))
        choice = choice._replace(error=None, single=False, cheap=0, exact=0, general=len(refs))
    if len(again):
        risks = np.zeros(len(refs))
        fault = sums.signal(
            scene,
            radio,
            refs,
            again,
            aims,
            *ways,
            found.values,
            found.cells,
            found.ties,
            found.totals,
            found.gaps,
            risks,
        )
        _check_fault(fault, scene, station, sample)
        share, direction = choice.general_share
        found.bounds[again] = found.totals[again] * share + risks[again] * direction
        found.gaps[again] = np.maximum(found.gaps[again] - 2 * found.bounds[again], 0.0)
    largest = float(abs(found.values).max())
    bound = float(found.bounds.max()) / largest if largest > 0 else np.inf
    if tolerance is not None and not bound <= tolerance:
        where = f"{sample}: " if sample else ""
        raise BelowFloor(
            f"{where}tolerance is {tolerance}, below the floor of this sample: float64 can promise {bound:.1e} of its "
            f"largest value, expected a larger tolerance or null"
        )
    return EchoResult(
        found.values, found.cells, int(found.ties.sum()), bound, choice, found.gaps, found.totals
    )  # fmt: skip


def echo_signals(
    network: Network,
    motion: Rigid | np.ndarray,
    rcs_m2: np.ndarray | float,
    aim_m: np.ndarray,
    tolerance: float | None = None,
    sample: str = "",
) -> np.ndarray:
    """Return the symbol-domain signals of all the network's stations, complex128 (stations, symbols).

    Arguments, errors and source as `echo_signal`, which also says how each was computed; the motion is checked once.
    """
    seen = target(motion, rcs_m2, sample)
    return np.stack([
        echo_signal(network, station, seen, None, aim_m, tolerance, sample=sample).signal
        for station in network.stations
    ])  # fmt: skip


def explain(result: EchoResult) -> str:
    """Return in words how a signal was computed and which bounds allowed it."""
    choice = result.choice
    kind = "float32 after the phase" if choice.single else "float64"
    aim = "exact mode" if choice.error is None else f"plan for {choice.error:.1e} of the sum of amplitudes"
    return "\n".join([
        f"target radius {choice.size_m:.3g} m, at most {choice.spread:.3g} of the range",
        f"{aim}: {kind}, ranges by {'polynomials' if choice.near else 'roots'}, orders of cosine {choice.orders[0]}, "
        f"sine {choice.orders[1]}, cell kernel {choice.orders[2]}",
        f"symbols: {choice.cheap} by that plan, {choice.exact} by the exact one, "
        f"{choice.general} by the general kernel",
        f"points interpolated in slow time: {choice.slow[0]}, from {choice.slow[1]} nodes",
        f"error proved below {result.bound:.1e} of the largest value; near-ties {result.near_ties}",
    ])  # fmt: skip


def range_cells(
    network: Network,
    station: Station,
    motion: Rigid | np.ndarray,
    rcs_m2: np.ndarray | float,
    aim_m: np.ndarray,
    paths: Sequence[Path] | None = None,
    sample: str = "",
) -> np.ndarray:
    """Return all range cells Y_k,r (N, M) complex128; arguments and errors as `echo_signal`. Source: Eq. 25."""
    return _matrix(network, station, motion, rcs_m2, aim_m, paths, sample, True)


def subcarrier_matrix(
    network: Network,
    station: Station,
    motion: Rigid | np.ndarray,
    rcs_m2: np.ndarray | float,
    aim_m: np.ndarray,
    paths: Sequence[Path] | None = None,
    sample: str = "",
) -> np.ndarray:
    """Return Y_k (N, M) complex128, the known symbol removed; arguments and errors as `echo_signal`. Source: Eq. 24."""
    return _matrix(network, station, motion, rcs_m2, aim_m, paths, sample, False)


def _check_tolerance(tolerance, sample: str) -> None:
    good = tolerance is None or (isinstance(tolerance, (int, float)) and 0 < tolerance < 1)
    if not good:
        where = f"{sample}: " if sample else ""
        raise InputError(f"{where}tolerance is {tolerance!r}, expected null or a number between 0 and 1")


def _matrix(network, station, motion, rcs_m2, aim_m, paths, sample, cells: bool) -> np.ndarray:
    scene, radio, refs, aims, ways = _prepare(network, station, motion, rcs_m2, aim_m, paths, sample)
    out = np.empty((len(refs), network.subcarriers), np.complex128)
    _check_fault(sums.matrix(scene, radio, refs, aims, *ways, cells, out), scene, station, sample)
    return out


def _prepare(network, station, motion, rcs_m2, aim_m, paths, sample):
    scene = check(network, station, motion, rcs_m2, aim_m, sample)
    radio: Radar = radar(network, station)
    first = scene.part[0] if len(scene.part) else 0
    refs = reference(
        scene.translation[:, first], radio.station, radio.turns, radio.turns_lo, radio.cells, radio.cells_lo
    )
    aims = aim_cosines(scene.aim, radio.station, radio.sine, radio.cosine)
    points = len(scene.part) or scene.translation.shape[1]
    return scene, radio, refs, aims, _ways(paths, (len(refs), points), sample)


def _ways(paths: Sequence[Path] | None, shape: tuple[int, int], sample: str) -> tuple[np.ndarray, np.ndarray]:
    """Delays and gains of all paths as (K, N or 1, L or 1) arrays; K = 0 for the direct path alone."""
    if paths is None:
        return np.empty((0, 1, 1)), np.empty((0, 1, 1), np.complex128)
    where = f"{sample}: " if sample else ""
    if len(paths) == 0:
        raise InputError(f"{where}paths is empty, expected at least one path")
    result = []
    for name, kind in (("delay_s", np.float64), ("gain", np.complex128)):
        arrays = [np.asarray(getattr(path, name), kind) for path in paths]
        for index, array in enumerate(arrays):
            if not np.isfinite(array).all():
                raise InputError(f"{where}paths[{index}].{name} has a NaN or infinite value, expected finite numbers")
            try:
                np.broadcast_to(array, shape)
            except ValueError:
                raise InputError(
                    f"{where}paths[{index}].{name} has shape {array.shape}, expected to broadcast to {shape}"
                ) from None
        widest = np.broadcast_shapes((1, 1), *(array.shape for array in arrays))
        result.append(np.stack([np.broadcast_to(array, widest) for array in arrays]))
    return result[0], result[1]


def _check_fault(fault: int, scene: Scene, station: Station, sample: str) -> None:
    if fault:
        points = len(scene.part) or scene.translation.shape[1]
        n, l = divmod(fault - 1, points)  # noqa: E741
        where = f"{sample}: " if sample else ""
        raise InputError(
            f"{where}position of point {l} at symbol {n} is {station.position_m}, the place of station {station.name} "
            f"(r = 0), expected r > 0"
        )
