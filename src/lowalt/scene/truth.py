"""What is true of a target in a look: where it is (geometric truth) and where its echo appears
(observed truth).

The echo of a target at range r turns by 2 f r / c at the effective carrier f, less the phase of the
arrays' middles, since elements are counted from the one at the station's place. An effect that
moves echoes in delay or in frequency offers `displaced`, which says by how much.
"""

from collections.abc import Callable, Iterable

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.numerics import portable
from lowalt.scene.response import cosines
from lowalt.scene.view import Displacement, View

FEWEST = 3
"""Symbols that a difference between symbols needs to be exact to the second order at both ends."""
STEP_S = 1e-6
"""Half the time over which rates are taken where they are not differences between symbols."""


def rate(quantity: Callable[[View], np.ndarray], view: View) -> np.ndarray:
    """Return the change per second at each symbol, (N, ...), of a quantity (N, ...) of a view.

    It is the difference between neighbouring symbols. One or two symbols have no such difference of
    second order, so the target is then placed twice more, STEP_S apart: after the first symbol, and
    before the second, since a recording may end with the look.
    """
    here = quantity(view)
    count = len(view.times_s)
    if count >= FEWEST:
        return np.gradient(here, view.times_s, axis=0, edge_order=2)
    steps_s = np.array([STEP_S, -STEP_S])[:count]
    near = quantity(view.at(view.times_s + steps_s))
    far = quantity(view.at(view.times_s + 2 * steps_s))
    change = -3 * here + 4 * near - far
    return (change.T / (2 * steps_s)).T


def middle_of(view: View) -> np.ndarray:
    """Return the place (N, 3) m of a target's middle, the mean of its points."""
    return view.places.mean(axis=1)


def geometric(view: View) -> np.ndarray:
    """Return range (m), radial speed (m/s) and direction cosines of the target's middle at each
    symbol, (N, 4).
    """
    station = view.station
    middle = middle_of(view)
    moved = rate(middle_of, view)
    ends = [station] if station.transmitter is None else [station, station.transmitter]
    ways = [middle - np.asarray(end.position_m) for end in ends]
    ranges = [portable.norm(way) for way in ways]
    speeds = [(way * moved).sum(axis=1) / length for way, length in zip(ways, ranges, strict=True)]
    return np.column_stack(
        [np.mean(ranges, axis=0), np.mean(speeds, axis=0), cosines(station, middle)]
    )


def array_turns(view: View) -> np.ndarray:
    """Return the turns (N,) of phase by which the arrays' middles hear a target's middle before
    their first elements.

    Elements are half a wavelength of the carrier apart. Source: paper, Eq. 3 and 4.
    """
    network = view.network
    station = view.station
    middle = view.places.mean(axis=1)
    kappa = station.frequency_hz / network.carrier_hz
    sender = station.transmitter or station
    ends = (sender, network.transmit), (station, network.receive)
    return sum(
        0.25 * kappa * portable.dot(cosines(end, middle), np.array(shape) - 1.0)
        for end, shape in ends
    )


def observed(
    view: View, displacements: Iterable[Displacement], cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the range cell (N,), 0 to `cells` with its fraction, and the folded speed (N,) m/s of
    an echo.

    The echo is that of the middle of a view's target on the direct path, moved by the effects'
    displacements.
    Source: paper, Eq. 3 to 7 (array phases); M. I. Skolnik, Introduction to Radar Systems, 3rd ed.
    2001, 3.1.
    """
    network = view.network
    station = view.station
    wavelength_m = SPEED_OF_LIGHT / network.effective_hz(station)
    way_m = view.ways_m(middle_of(view))

    def turns(seen: View) -> np.ndarray:
        """The turns (N,) of the echo's phase."""
        return array_turns(seen) - seen.ways_m(middle_of(seen)) / wavelength_m

    doppler_hz = rate(turns, view)
    for displacement in displacements:
        way_m = way_m + SPEED_OF_LIGHT * displacement.delay_s
        doppler_hz = doppler_hz + displacement.rise_hz
    return way_m / (2 * network.cell_m) % cells, network.folded_mps(
        -doppler_hz * wavelength_m / 2, station
    )


def of_parts(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the range (N, P) m of the middle of each of a target's parts, and the lowest and the
    highest radial speed (N, P) m/s of its points at each symbol, not folded, positive away from the
    station.

    Rotors turn far between two symbols, so speeds are taken over twice STEP_S.
    """
    before = view.ways_m(view.at(view.times_s - STEP_S).places)
    after = view.ways_m(view.at(view.times_s + STEP_S).places)
    # Ways are there and back.
    speeds = (after - before) / (4 * STEP_S)
    parts = [view.cloud.part == part for part in range(len(view.cloud.names))]
    ranges = [view.ways_m(view.places[:, part].mean(axis=1)) / 2 for part in parts]
    low, high = ([bound(speeds[:, part], axis=1) for part in parts] for bound in (np.min, np.max))
    return tuple(np.stack(columns, axis=1) for columns in (ranges, low, high))
