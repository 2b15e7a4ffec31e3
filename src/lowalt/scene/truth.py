"""What is true of a target in a look: where it is, and where its echo appears.

We call the first the geometric truth, the second the observed truth.

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
    """Return range (m), radial speed (m/s) and direction cosines at each symbol, (N, 4).

    They are those of the target's middle.
    """
    middle = middle_of(view)
    moved = rate(middle_of, view)
    ranges = []
    speeds = []
    for mast_m in view.masts_m:
        way = middle - mast_m
        length = portable.norm(way)
        ranges.append(length)
        speeds.append((way * moved).sum(axis=1) / length)
    range_m = np.mean(ranges, axis=0)
    radial_mps = np.mean(speeds, axis=0)
    return np.column_stack([range_m, radial_mps, cosines(view.station, middle)])


def array_turns(view: View) -> np.ndarray:
    """Return the turns (N,) of phase by which the arrays' middles hear a target's middle first.

    They are counted against their first elements.

    Elements are half a wavelength of the carrier apart. Source: paper, Eq. 3 and 4.
    """
    network = view.network
    station = view.station
    middle = middle_of(view)
    kappa = station.frequency_hz / network.carrier_hz
    sender = station.transmitter or station
    sent = portable.dot(cosines(sender, middle), np.array(network.transmit) - 1.0)
    received = portable.dot(cosines(station, middle), np.array(network.receive) - 1.0)
    return 0.25 * kappa * sent + 0.25 * kappa * received


def observed(
    view: View, displacements: Iterable[Displacement], cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the range cell (N,) and the folded speed (N,) m/s of an echo.

    The cell is 0 to `cells`, with its fraction.

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
    cell = way_m / (2 * network.cell_m) % cells
    speed_mps = -doppler_hz * wavelength_m / 2
    return cell, network.folded_mps(speed_mps, station)


def of_parts(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ranges (N, P) m, and lowest and highest radial speeds (N, P) m/s of a target's parts.

    The ranges are those of the parts' middles, the speeds those of their points at each symbol, not
    folded, positive away from the station.

    Rotors turn far between two symbols, so speeds are taken over twice STEP_S.
    """
    before = view.ways_m(view.at(view.times_s - STEP_S).places)
    after = view.ways_m(view.at(view.times_s + STEP_S).places)
    # Ways are there and back.
    speeds = (after - before) / (4 * STEP_S)
    ranges = []
    lowest = []
    highest = []
    for part in range(len(view.cloud.names)):
        mine = view.cloud.part == part
        ranges.append(view.ways_m(view.places[:, mine].mean(axis=1)) / 2)
        lowest.append(speeds[:, mine].min(axis=1))
        highest.append(speeds[:, mine].max(axis=1))
    return np.stack(ranges, axis=1), np.stack(lowest, axis=1), np.stack(highest, axis=1)
