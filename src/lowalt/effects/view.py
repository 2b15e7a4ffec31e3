"""One moving target as one station sees it: poses, places and normals, each computed when first needed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lowalt.common.network import Network, Station
from lowalt.echo import Rigid
from lowalt.effects.antenna import Element, gain
from lowalt.effects.perturbations import at_times, summed
from lowalt.effects.rigid_loops import carry
from lowalt.effects.speeds import Speeds
from lowalt.motion.poses import Perturbation, poses
from lowalt.targets.cloud import Cloud

if TYPE_CHECKING:
    from lowalt.effects.transmitter.slow_time import Sampling


TOGETHER = 16
"""Instants of a look whose poses are computed together."""


class Beams(NamedTuple):
    """Where a station's beams point: at aims_m (K, 3) m, each from starts_s (K,) s on, rising from 0."""

    starts_s: np.ndarray
    aims_m: np.ndarray


@dataclass(frozen=True)
class View:
    """A target's motion as one station sees it.

    row: its row of the motion table; times_s: (N,) s; perturbations: those of the motion effects, given at `grid_s`
    (G,) s, which spans the look and one symbol more; occluders: a target's surfaces (see `channel.occlusion`) or None.
    """

    network: Network
    station: Station
    cloud: Cloud
    row: dict
    times_s: np.ndarray
    grid_s: np.ndarray | None = None
    perturbations: tuple[Perturbation, ...] = ()
    occluders: dict | None = field(default=None, repr=False)
    element: Element | None = None
    """The antenna elements' pattern, None for isotropic ones."""
    reflected: bool = False
    """Whether the station also sees images of the points; their directions are then not bounded by the target's."""
    beams: Mapping[str, Beams] | None = None
    """Where each station's beams point, by its name; None for the target's origin at the first symbol."""
    sampling: "Sampling | None" = None
    """Instants of all symbols and which are received, None for all at n T_r."""

    @cached_property
    def motion(self) -> Rigid:
        """Poses of all parts: rotation (N, P, 3, 3), translation (N, P, 3) m, with the cloud's points."""
        moved = summed([at_times(item, self.grid_s, self.times_s) for item in self.perturbations])
        return Rigid(*poses(self.cloud, self.row, self.times_s, moved), self.cloud.points, self.cloud.part)

    @cached_property
    def speeds(self) -> Speeds:
        """Bounds of the motion, which do not depend on its instants."""
        return Speeds(self)

    @cached_property
    def places(self) -> np.ndarray:
        """Every point's place (N, L, 3) in metres, global frame."""
        if self.nodes:
            return self.motion.translation
        return carry(self.motion.rotation, self.motion.translation, self.cloud.points, self.cloud.part)

    @cached_property
    def normals(self) -> np.ndarray:
        """Every point's unit normal (N, L, 3), global frame, NaN where unknown."""
        if self.nodes:
            return np.full(self.places.shape, np.nan)
        return carry(self.motion.rotation, None, self.cloud.normals, self.cloud.part)

    @property
    def nodes(self) -> bool:
        """Whether the points are the nodes of a recording, which have places but no attitude."""
        return "node" in self.cloud.kinds

    @property
    def origin_m(self) -> np.ndarray:
        """The target's origin at the first symbol, (3,) m."""
        return np.array([self.row["x_m"], self.row["y_m"], self.row["z_m"]])

    def beams_of(self, station: Station) -> Beams:
        """Return where a station's beams point; of a link, where its receiver's do."""
        if self.beams is None:
            return Beams(np.zeros(1), self.origin_m[None])
        return self.beams[(station.receiver or station).name]

    def aim_of(self, station: Station) -> np.ndarray:
        """Return where a station's beams point at first, (3,) m."""
        return self.beams_of(station).aims_m[0]

    @property
    def aim_m(self) -> np.ndarray:
        """Where the receiver's beams point at first, (3,) m: without pointing errors the target's origin."""
        return self.aim_of(self.station)

    @property
    def aims_m(self) -> np.ndarray:
        """Where the sender's and the receiver's beams point at first, (2, 3) m."""
        return np.stack([self.aim_of(self.station.transmitter or self.station), self.aim_m])

    @property
    def turning(self) -> bool:
        """Whether beams are turned during the look."""
        if self.beams is None:
            return False
        ends = self.station.transmitter or self.station, self.station
        return any(len(self.beams_of(end).starts_s) > 1 for end in ends)

    def beam_rows(self) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Return every pair of beams in use: its number, where it points (2, 3) m, and the symbols it lights (indices).

        The sender's beam comes first, then the receiver's.
        """
        out, back = (self.beams_of(end) for end in (self.station.transmitter or self.station, self.station))
        # An instant that is a multiple of the update must not fall before it by rounding.
        sent, heard = (
            np.searchsorted(one.starts_s, self.times_s + 1e-9, side="right") - 1 for one in (out, back)
        )  # fmt: skip
        pairs = sent * len(back.starts_s) + heard
        return [
            (int(pair), np.stack([out.aims_m[pair // len(back.starts_s)], back.aims_m[pair % len(back.starts_s)]]),
             np.flatnonzero(pairs == pair))
            for pair in np.unique(pairs)
        ]  # fmt: skip

    @cached_property
    def element_gain(self) -> np.ndarray:
        """The element's power gain (N, L) toward the points."""
        return gain(self.element, self.station, self.places)

    def relative_gain(self, images: np.ndarray) -> np.ndarray | float:
        """Return the element's amplitude gain toward images (N, L, 3) over that toward the points, (N, L) or 1."""
        if self.element is None:
            return 1.0
        return np.sqrt(gain(self.element, self.station, images) / self.element_gain)

    def at(self, times_s: np.ndarray) -> "View":
        """Return the same target seen at other times (K,) s of the look."""
        return replace(self, times_s=times_s)

    def at_each(self, times_s: np.ndarray) -> Iterator["View"]:
        """Yield the same target seen at each row of times (Q, K) s; poses of TOGETHER rows are computed in one go."""
        for first in range(0, len(times_s), TOGETHER):
            some = times_s[first : first + TOGETHER]
            together, count = self.at(some.ravel()), times_s.shape[1]
            for number, row in enumerate(some):
                rows = slice(number * count, (number + 1) * count)
                yield self.at(row)._knowing(motion=together._motion_at(rows))

    def at_symbols(self, rows: np.ndarray) -> "View":
        """Return the same target seen at the symbols `rows` (K,) alone, with what is known of its motion and places."""
        known = {"motion": self._motion_at(rows)} if "motion" in self.__dict__ else {}
        known |= {"places": self.places[rows]} if "places" in self.__dict__ else {}
        return self.at(self.times_s[rows])._knowing(**known)

    def with_places(self, places: np.ndarray) -> "View":
        """Return the same target with places (N, W, 3) m of other points, and nothing else known of these."""
        return replace(self)._knowing(places=places)

    def _motion_at(self, rows: np.ndarray | slice) -> Rigid:
        """The poses of some symbols."""
        return self.motion._replace(rotation=self.motion.rotation[rows], translation=self.motion.translation[rows])

    def _knowing(self, **known) -> "View":
        """This view, with values of its cached properties that another view has computed."""
        self.__dict__.update(known)
        return self

    def seen_from(self, place_m: np.ndarray, sender_m: np.ndarray | None = None) -> "View":
        """Return the same target, at the same instants and under the same beams, seen from another place (3,) m.

        sender_m: (3,) m, on a link where its sender stands then, None for where it stands.
        """
        station = replace(self.station, position_m=tuple(float(value) for value in place_m))
        if sender_m is not None:
            sender = replace(station.transmitter, position_m=tuple(float(value) for value in sender_m))
            station = replace(station, transmitter=sender)
        return self.of(station)

    def of(self, station: Station) -> "View":
        """Return the same target, at the same instants and under the same beams, as another station hears it."""
        # The motion does not depend on the station.
        known = {name: self.__dict__[name] for name in ("motion", "places", "normals") if name in self.__dict__}
        return replace(self, station=station)._knowing(**known)

    def ends(self) -> list["View"]:
        """Return the target as the sender and as the receiver of a link see it alone; a station's own view is both."""
        own = self.station
        if own.transmitter is None:
            return [self]
        hears = replace(own, name=own.receiver.name, transmitter=None, receiver=None)
        return [self.of(own.transmitter), self.of(hears)]

    @cached_property
    def centres(self) -> np.ndarray:
        """Middle (P, 3) of each part's points, in the part's own frame (m)."""
        return np.array([0.5 * (box[0] + box[1]) for box in self._boxes])

    @cached_property
    def radii(self) -> np.ndarray:
        """Largest distance (P,) of each part's points from the part's middle (m)."""
        if self.nodes:
            return np.zeros(len(self.cloud.kinds))
        away = np.linalg.norm(self.cloud.points - self.centres[self.cloud.part], axis=1)
        result = np.zeros(len(self.cloud.kinds))
        np.maximum.at(result, self.cloud.part, away)
        return result * (1 + 1e-12)

    @cached_property
    def middles(self) -> np.ndarray:
        """Place (N, P, 3) of each part's middle at each symbol (m)."""
        if self.nodes:
            return self.motion.translation
        return self.motion.translation + np.einsum("npij,pj->npi", self.motion.rotation, self.centres)

    @cached_property
    def _boxes(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Lowest and highest corner (3,) of each part's points (m), in the part's own frame; zeros without points."""
        mine = [self.cloud.points[self.cloud.part == part] for part in range(len(self.cloud.kinds))]
        return [(p.min(axis=0), p.max(axis=0)) if len(p) else (np.zeros(3), np.zeros(3)) for p in mine]

    def extent_m(self) -> np.ndarray:
        """Return a bound (N,) of how far any point is from the first part's middle (m)."""
        return (np.linalg.norm(self.middles - self.middles[:, :1], axis=2) + self.radii).max(axis=1)

    def nearest_m(self) -> np.ndarray:
        """Return a lower bound (N, P) of the range of any point of each part (m), on a link from the nearer end."""
        return self._nearest

    @cached_property
    def _nearest(self) -> np.ndarray:
        """What `nearest_m` returns, which several bounds ask for."""
        ends = [end for end in (self.station, self.station.transmitter) if end is not None]
        away = [self.middles - np.asarray(end.position_m) for end in ends]
        squares = np.min([np.einsum("npi,npi->np", one, one) for one in away], axis=0)
        return np.maximum(np.sqrt(squares) - self.radii, 0.0)
