"""The echo's public functions: the strongest range cell's signal of one station or of all."""

from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo import refine
from lowalt.echo.echo_input import EchoInput, Rigid, Target, check, named, target
from lowalt.echo.pointwise import results
from lowalt.echo.pointwise.reference_range import reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import radar
from lowalt.echo.refine import Method
from lowalt.echo.rounding import nearest
from lowalt.files.errors import BelowFloor, InputError


class EchoResult(NamedTuple):
    """Signal of one station.

    signal: (N,) complex128, the strongest range cell's value; cell: (N,) int64, its index in
    0..M-1; near_ties: number of symbols whose two strongest cells differ by less than a relative
    1e-12, so that rounding decides; bound: proved bound of the error relative to max |signal|, inf
    if none is proved; method: how it was computed, and why; gap: (N,) float64, proved lower bound
    of |Y| at the strongest cell minus |Y| at any other, 0 if there is none; totals: (N,) float64,
    sum of all points' |amplitudes|, array gains included. With a tolerance it is an upper bound
    that exceeds the sum by at most the tolerance times the largest value.
    """

    signal: np.ndarray
    cell: np.ndarray
    near_ties: int
    bound: float
    method: Method
    gap: np.ndarray
    totals: np.ndarray


def echo_signal(
    network: Network,
    station: Station,
    motion: Rigid | Target | np.ndarray,
    rcs_m2: np.ndarray | float | None,
    aim_m: np.ndarray,
    tolerance: float | None = None,
    sample: str = "",
) -> EchoResult:
    """Return the symbol-domain signal Y_bin of `station`, the strongest range cell of each symbol.

    motion: `Rigid`, positions (N, L, 3) in metres, or an already checked `echo_input.Target`, with
    rcs_m2 None; rcs_m2: (L,) m2 or one number; aim_m: (3,) m, where both beams point; tolerance:
    largest error allowed, relative to the sample's max |Y_bin|, None for the exact closed form;
    sample: a name for error messages.
    Raises: InputError naming the argument, its value and the sample; BelowFloor (a subclass) for a
    tolerance below the error bound that float64 can prove for this sample. Source: paper Eqs. 7 and
    22 to 25.

    A point of 0.01 m2 that stands 226 m from station A, in cell 46 of 4.9 m each:

        >>> from lowalt.config.layers import overlaid
        >>> network = Network.from_settings(overlaid([])["network"])
        >>> point = np.array([200.0, 100.0, 60.0])
        >>> still = np.tile(point, (network.symbols, 1, 1))
        >>> result = echo_signal(network, network.stations[0], still, 0.01, point)
        >>> result.signal.shape, int(result.cell[0]), result.bound < 1e-12
        ((400,), 46, True)
    """
    _check_tolerance(tolerance, sample)
    scene, radio, refs, aims = prepared(network, station, motion, rcs_m2, aim_m, sample)
    found, left, method, seen = refine.compute(scene, radio, refs, aims, tolerance)
    if len(left):
        fault = results.bounded(scene, radio, refs, left, aims, method.pointwise_bound, found)
        check_fault(fault, scene, station, sample)
    if tolerance is None:
        recomputed = nearest.correct(seen, refs, found, method.pointwise_bound)
        method = method._replace(again=recomputed)
    largest = float(abs(found.values).max())
    worst = float(found.bounds.max())
    bound = np.inf if worst > 0 else 0.0
    if largest > 0:
        bound = worst / largest
    if tolerance is not None and not bound <= tolerance:
        raise BelowFloor(
            f"{named(sample)}tolerance is {tolerance}, below the floor of this sample: float64 "
            f"promises {bound:.1e} of its largest value, expected a larger tolerance or null"
        )
    return EchoResult(
        found.values, found.cells, int(found.ties.sum()), bound, method, found.gaps, found.totals
    )


def echo_signals(
    network: Network,
    motion: Rigid | np.ndarray,
    rcs_m2: np.ndarray | float,
    aim_m: np.ndarray,
    tolerance: float | None = None,
    sample: str = "",
) -> np.ndarray:
    """Return the signals of all the network's stations, complex128 (stations, symbols).

    Arguments, errors and source as for `echo_signal`; the motion is checked once.
    """
    seen = target(motion, rcs_m2, sample)
    signals = []
    for station in network.stations:
        result = echo_signal(network, station, seen, None, aim_m, tolerance, sample=sample)
        signals.append(result.signal)
    return np.stack(signals)


def _check_tolerance(tolerance, sample: str) -> None:
    """Raise InputError unless the tolerance is None or a number between 0 and 1."""
    good = tolerance is None or (isinstance(tolerance, (int, float)) and 0 < tolerance < 1)
    if not good:
        raise InputError(
            f"{named(sample)}tolerance is {tolerance!r}, expected null or a number between 0 and 1"
        )


def prepared(network, station, motion, rcs_m2, aim_m, sample):
    """Return what the kernels take: checked scene, radar, reference ranges, beams' cosines.

    Arguments and errors as for `echo_signal`.
    """
    if station.transmitter is not None:
        raise InputError(
            f"{named(sample)}station {station.name} is a link between two stations, expected a "
            "station that hears itself; only scenes with effects have links"
        )
    scene = check(network, station, motion, rcs_m2, aim_m, sample)
    radio = radar(network, station)
    refs = reference(scene.translation[:, scene.first], radio)
    aims = aim_cosines(scene.aim, radio.station, radio.sine, radio.cosine)
    return scene, radio, refs, aims


def check_fault(fault: int, scene: EchoInput, station: Station, sample: str) -> None:
    """Raise InputError for a point l in the station at symbol n.

    A kernel reports it as `fault` = 1 + n L + l, and none as 0.
    """
    if not fault:
        return
    points = len(scene.part) or scene.translation.shape[1]
    symbol, point = divmod(fault - 1, points)
    raise InputError(
        f"{named(sample)}position of point {point} at symbol {symbol} is {station.position_m}, "
        f"the place of station {station.name} (r = 0), expected r > 0"
    )
