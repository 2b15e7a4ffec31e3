"""One moving target as one station sees it: its parts and points at each instant, and the beams."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo import Rigid
from lowalt.machine.jit import LEAN
from lowalt.motion.poses import Perturbation, poses
from lowalt.numerics import portable
from lowalt.scene.antenna import Element, gain
from lowalt.targets.cloud import Cloud


class Beams(NamedTuple):
    """Where a station's beams point.

    starts_s: (K,), rising from 0; aims_m: (K, 3), each from its start on.
    """

    starts_s: np.ndarray
    aims_m: np.ndarray


class Sampling(NamedTuple):
    """times_s: (N,) s, start of each symbol; present: (N,) bool, which symbols are received."""

    times_s: np.ndarray
    present: np.ndarray


class Displacement(NamedTuple):
    """Delay (s) and frequency shift (Hz) with which an effect lets an echo appear.

    Each is a number, or one per symbol (N,).
    """

    delay_s: np.ndarray | float = 0.0
    rise_hz: np.ndarray | float = 0.0


class Still(NamedTuple):
    """Echoes of something other than a target, which do not move within a symbol.

    response: (N, M) complex128, in sqrt(W) a subcarrier; offset_cells: how far the echoes stand
    beyond the centres of their range cells, in cells.
    """

    response: np.ndarray
    offset_cells: float = 0.0


class Perturbations(NamedTuple):
    """Changes of a target's motion by several effects, each given at grid_s (G,) s."""

    grid_s: np.ndarray
    changes: tuple[Perturbation, ...]

    def at(self, times_s: np.ndarray) -> Perturbation | None:
        """Return their sum at times_s (K,) s.

        It is linear between the given instants and exact on them; None if there is no change.
        """
        if not self.changes:
            return None
        angles: dict[int, np.ndarray] = {}
        for change in self.changes:
            for part, angle in (change.angle_rad or {}).items():
                angles[part] = angles.get(part, 0.0) + np.interp(times_s, self.grid_s, angle)
        offset_m = self._total("offset_m", times_s)
        return Perturbation(angles, offset_m, self._total("tilt_rad", times_s))

    def _total(self, name: str, times_s: np.ndarray) -> np.ndarray | None:
        """The sum (K, 3) of a table (G, 3) over the changes that have it, None if none of them has."""
        result = None
        for change in self.changes:
            table = getattr(change, name)
            if table is None:
                continue
            columns = [np.interp(times_s, self.grid_s, column) for column in table.T]
            interpolated = np.stack(columns, axis=1)
            result = interpolated if result is None else result + interpolated
        return result


@LEAN
def _carry(rotation, translation, vectors, part, result):
    """Fill result (N, 3, L) with vectors (3, L) turned and moved, by part.

    rotation: (N, P, 3, 3); translation: (N, P, 3), which is added.
    """
    # Points of a part stand next to each other.
    first = 0
    while first < len(part):
        p = part[first]
        last = first + 1
        while last < len(part) and part[last] == p:
            last += 1
        for n in range(len(result)):
            for axis in range(3):
                turn = rotation[n, p, axis]
                row = result[n, axis]
                shift = translation[n, p, axis]
                a = turn[0]
                b = turn[1]
                c = turn[2]
                for i in range(np.uint64(first), np.uint64(last)):
                    row[i] = a * vectors[0, i] + b * vectors[1, i] + c * vectors[2, i] + shift
        first = last


def _carried(vectors: np.ndarray, motion: Rigid, translation: np.ndarray) -> np.ndarray:
    """Return vectors (L, 3) of the parts' own frames in the global frame: (N, L, 3).

    translation: (N, P, 3) m, which is added.

    Coordinates of a symbol's points stand together in memory, (N, 3, L).
    """
    result = np.empty((len(motion.rotation), 3, len(vectors)))
    _carry(
        np.ascontiguousarray(motion.rotation),
        np.ascontiguousarray(translation),
        np.ascontiguousarray(vectors.T),
        np.asarray(motion.part, np.int64),
        result,
    )
    return result.swapaxes(1, 2)


def located(
    cloud: Cloud, row: dict, times_s: np.ndarray, moved: Perturbations
) -> tuple[Rigid, np.ndarray]:
    """Return the poses of a target's parts and the places (N, L, 3) m of its points, global frame.

    times_s: (N,).

    The nodes of a recording have places but no attitude. Raises: InputError as
    `lowalt.motion.poses.poses`.
    """
    motion = Rigid(*poses(cloud, row, times_s, moved.at(times_s)), cloud.points, cloud.part)
    if "node" in cloud.kinds:
        return motion, np.ascontiguousarray(motion.translation.swapaxes(1, 2)).swapaxes(1, 2)
    return motion, _carried(cloud.points, motion, motion.translation)


def _stood(station: Station, place_m: np.ndarray) -> Station:
    """The same station at another place (3,) m."""
    x, y, z = map(float, place_m)
    return replace(station, position_m=(x, y, z))


def masts_of(station: Station) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions of a station's sender and receiver, (3,) m each.

    They differ on a link only.
    """
    sender = station.transmitter or station
    return np.asarray(sender.position_m), np.asarray(station.position_m)


def ways_by(station: Station, places: np.ndarray) -> np.ndarray:
    """Return the way from a station's sender by places (..., 3) m to its receiver, (...) m."""
    sender_m, receiver_m = masts_of(station)
    return portable.norm(places - sender_m) + portable.norm(places - receiver_m)


@dataclass(frozen=True, eq=False)
class View:
    """A target's motion as one station sees it."""

    network: Network
    station: Station
    cloud: Cloud
    row: dict
    """The target's row of the motion table."""
    times_s: np.ndarray
    """(N,) s."""
    motion: Rigid
    """Poses of all parts: rotation (N, P, 3, 3), translation (N, P, 3) m, with the cloud's points.
    """
    places: np.ndarray
    """Every point's place (N, L, 3) m, global frame."""
    moved: Perturbations
    """What the motion effects add to the target's motion."""
    origin_m: np.ndarray
    """(3,) m, the labelled target's origin at the first symbol.

    Beams point there, or as `beams` says.
    """
    beams: Mapping[str, Beams] = field(default_factory=dict)
    """Where stations' beams point, by their names."""
    element: Element | None = None
    """The antenna elements' pattern, None for isotropic ones."""
    occluders: dict | None = field(default=None, repr=False)
    """The target's surfaces, where an effect needs them."""
    sampling: Sampling | None = None
    """Instants of all symbols and which are received, None for all at n T_r."""

    @cached_property
    def normals(self) -> np.ndarray:
        """Every point's unit normal (N, L, 3), global frame, NaN where unknown."""
        if "node" in self.cloud.kinds:
            return np.full(self.places.shape, np.nan)
        return _carried(self.cloud.normals, self.motion, np.zeros_like(self.motion.translation))

    def beams_of(self, station: Station) -> Beams:
        """Return where a station's beams point; of a link, where its receiver's do."""
        name = (station.receiver or station).name
        return self.beams.get(name) or Beams(np.zeros(1), self.origin_m[None])

    def aim_of(self, station: Station) -> np.ndarray:
        """Return where a station's beams point at first, (3,) m."""
        return self.beams_of(station).aims_m[0]

    @property
    def aim_m(self) -> np.ndarray:
        """Where the receiver's beams point at first, (3,) m.

        Without pointing errors this is the target's origin.
        """
        return self.aim_of(self.station)

    @property
    def masts_m(self) -> tuple[np.ndarray, np.ndarray]:
        """Places of the sender and the receiver, (3,) m each; those of a station are one."""
        return masts_of(self.station)

    def ways_m(self, places: np.ndarray) -> np.ndarray:
        """Return the way from the sender by places (..., 3) m to the receiver, (...) m."""
        return ways_by(self.station, places)

    def relative_gain(self, images: np.ndarray) -> np.ndarray | float:
        """Return the element's amplitude gain toward images (N, L, 3), over that toward the points.

        The result is (N, L) or 1.
        """
        if self.element is None:
            return 1.0
        return np.sqrt(gain(self.element, self.station, images) / self._gain)

    @cached_property
    def _gain(self) -> np.ndarray:
        """The element's power gain (N, L) toward the points."""
        assert self.element is not None  # as `relative_gain` has asked
        return gain(self.element, self.station, self.places)

    def at(self, times_s: np.ndarray) -> "View":
        """Return the same target seen at other times (K,) s of the look."""
        motion, places = located(self.cloud, self.row, times_s, self.moved)
        return replace(self, times_s=times_s, motion=motion, places=places)

    def of(self, station: Station) -> "View":
        """Return the same target as another station hears it.

        Instants and beams stay the same.
        """
        return replace(self, station=station)

    def seen_from(self, place_m: np.ndarray, sender_m: np.ndarray | None = None) -> "View":
        """Return the same target seen from another place (3,) m.

        Instants and beams stay the same.

        sender_m: (3,) m, on a link where its sender stands then, None for where it stands.
        """
        station = _stood(self.station, place_m)
        if sender_m is not None:
            assert station.transmitter is not None  # a link has one
            station = replace(station, transmitter=_stood(station.transmitter, sender_m))
        return self.of(station)

    def ends(self) -> list["View"]:
        """Return the target as the sender and as the receiver of a link see it alone.

        A station's own view is both.
        """
        link = self.station
        if link.transmitter is None or link.receiver is None:
            return [self]
        hears = replace(link, name=link.receiver.name, transmitter=None, receiver=None)
        return [self.of(link.transmitter), self.of(hears)]
