"""One moving target as one station sees it: poses, places and normals, each computed when first needed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo import Rigid
from lowalt.motion.poses import Perturbation, poses
from lowalt.scene.antenna import Element, gain
from lowalt.scene.geometry import carry
from lowalt.scene.perturbations import at_times, summed
from lowalt.scene.sampling import Sampling
from lowalt.targets.cloud import Cloud


class Beams(NamedTuple):
    """Where a station's beams point: at aims_m (K, 3) m, each from starts_s (K,) s on, rising from 0."""

    starts_s: np.ndarray
    aims_m: np.ndarray


@dataclass(frozen=True, eq=False)
class View:
    """A target's motion as one station sees it.

    row: its row of the motion table; times_s: (N,) s; perturbations: those of the motion effects, given at `grid_s`
    (G,) s, which spans the look and one symbol more; occluders: a target's surfaces (see `occlusion`) or None.
    """

    network: Network
    station: Station
    cloud: Cloud
    row: dict
    times_s: np.ndarray
    grid_s: np.ndarray
    perturbations: tuple[Perturbation, ...] = ()
    occluders: dict | None = field(default=None, repr=False)
    element: Element | None = None
    """The antenna elements' pattern, None for isotropic ones."""
    beams: Mapping[str, Beams] | None = None
    """Where each station's beams point, by its name; None for the target's origin at the first symbol."""
    sampling: Sampling | None = None
    """Instants of all symbols and which are received, None for all at n T_r."""

    @cached_property
    def motion(self) -> Rigid:
        """Poses of all parts: rotation (N, P, 3, 3), translation (N, P, 3) m, with the cloud's points."""
        moved = summed([at_times(item, self.grid_s, self.times_s) for item in self.perturbations])
        return Rigid(*poses(self.cloud, self.row, self.times_s, moved), self.cloud.points, self.cloud.part)

    @cached_property
    def places(self) -> np.ndarray:
        """Every point's place (N, L, 3) in metres, global frame."""
        if self.nodes:
            return np.ascontiguousarray(self.motion.translation.swapaxes(1, 2)).swapaxes(1, 2)
        return self._carried(self.cloud.points, self.motion.translation)

    @cached_property
    def normals(self) -> np.ndarray:
        """Every point's unit normal (N, L, 3), global frame, NaN where unknown."""
        if self.nodes:
            return np.full(self.places.shape, np.nan)
        return self._carried(self.cloud.normals, np.zeros_like(self.motion.translation))

    def _carried(self, vectors: np.ndarray, translation: np.ndarray) -> np.ndarray:
        """Vectors (L, 3) of the parts' own frames in the global frame, (N, L, 3), moved by translation (N, P, 3) m."""
        result = np.empty((len(self.times_s), 3, len(vectors)))
        rotation = np.ascontiguousarray(self.motion.rotation)
        carry(
            rotation, np.ascontiguousarray(translation), np.ascontiguousarray(vectors.T),
            np.asarray(self.cloud.part, np.int64), result,
        )  # fmt: skip
        return result.swapaxes(1, 2)

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

    def at_rows(self, rows: np.ndarray) -> "View":
        """Return the same target seen at the symbols `rows` (K,) alone, with what is known of its places."""
        return self.at(self.times_s[rows])._knowing(places=self.places[rows])

    def of(self, station: Station) -> "View":
        """Return the same target, at the same instants and under the same beams, as another station hears it."""
        # The motion does not depend on the station.
        return replace(self, station=station)._knowing(motion=self.motion, places=self.places)

    def _knowing(self, **known: object) -> "View":
        """This new view, with values of its cached properties."""
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

    def ends(self) -> list["View"]:
        """Return the target as the sender and as the receiver of a link see it alone; a station's own view is both."""
        own = self.station
        if own.transmitter is None:
            return [self]
        hears = replace(own, name=own.receiver.name, transmitter=None, receiver=None)
        return [self.of(own.transmitter), self.of(hears)]
