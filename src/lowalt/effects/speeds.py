"""Bounds of how fast a target's points move, from its rates and sizes instead of two of its positions.

Two positions give a chord, and a rotor's chord says nothing about how often it turned in between. So every bound here
adds the body's speed and, for each turning part, its angular rate times the largest distance from its axis.
For complex times the same sums bound how far positions leave the real space, which decides how many instants an
interpolation in time needs.
"""

import math
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lowalt.effects.view import View


class Speeds:
    """Bounds of a target's motion during the look; shapes (P,) are by part."""

    def __init__(self, view: "View"):
        self.view, self.cloud, self.row = view, view.cloud, view.row

    @cached_property
    def body_mps(self) -> float:
        """Largest speed of the target's origin: its own velocity plus that of the motion effects (m/s)."""
        own = float(np.linalg.norm([self.row["vx_mps"], self.row["vy_mps"], self.row["vz_mps"]]))
        return own + self._largest_rate([item.offset_m for item in self.view.perturbations])

    @cached_property
    def tilt_radps(self) -> float:
        """Largest angular rate of the body's attitude (rad/s)."""
        tilts = [item.tilt_rad for item in self.view.perturbations if item.tilt_rad is not None]
        return sum(self._largest_rate([tilt[:, axis : axis + 1] for tilt in tilts]) for axis in range(3))

    @cached_property
    def node_mps(self) -> np.ndarray:
        """Largest speed (P,) of each node of a recording in the body's frame, zero for other targets (m/s)."""
        if not self.view.nodes:
            return np.zeros(len(self.cloud.kinds))
        steps = np.linalg.norm(np.roll(self.cloud.track, -1, axis=0) - self.cloud.track, axis=2).max(axis=0)
        return abs(self.row["playback"]) * self.cloud.record["track_rate_hz"] * steps

    @cached_property
    def reach_m(self) -> np.ndarray:
        """Largest distance (P,) of a part's points from the target's origin, summed along the hinges (m)."""
        if self.view.nodes:
            return np.linalg.norm(self.cloud.track, axis=2).max(axis=0)
        return np.array([sum(lengths) for lengths in self._lengths])

    def travel_m(self, duration_s: float) -> np.ndarray:
        """Return a bound (P,) of the path that any point of each part covers in `duration_s`, along its arc (m)."""
        turning = np.zeros(len(self.cloud.kinds))
        for part, chain in enumerate(self._chains):
            for order, moving in enumerate(chain):
                turning[part] += self._rate(moving) * self._lever(part, order)
        return duration_s * (self.body_mps + self.node_mps + self.tilt_radps * self.reach_m + turning)

    def imaginary_m(self, imaginary_s: np.ndarray | float) -> np.ndarray:
        """Return a bound (..., P) of the imaginary part of positions at complex times, |Im t| <= `imaginary_s` (m).

        imaginary_s: any shape (...).
        A turn by a complex angle a + jb is cosh(b) times a turn plus j sinh(b) times another, so several in a row have
        an imaginary part of at most sinh of the sum of their |b|, times what they turn: the attitude turns the whole
        reach, the hinges only what lies beyond the first of them.
        """
        even, amplitudes, beats = self._turns
        imaginary_s = np.asarray(imaginary_s, np.float64)[..., None]
        swung = amplitudes * np.sinh(np.minimum(beats * imaginary_s[..., None], 700.0))
        tilt = np.minimum(self.tilt_radps * imaginary_s, 700.0)
        angle = np.minimum(tilt + even * imaginary_s + swung.sum(axis=-1), 700.0)
        turned = self.reach_m * np.sinh(tilt) + self._hinged_m * np.sinh(angle)
        return imaginary_s * (self.body_mps + self.node_mps) + turned

    def _largest_rate(self, tables: list) -> float:
        """Sum of the largest rates of tables (G, K) given at the motion effects' times."""
        tables = [table for table in tables if table is not None]
        if not tables:
            return 0.0
        step = np.diff(self.view.grid_s)
        return sum(float((np.linalg.norm(np.diff(table, axis=0), axis=1) / step).max()) for table in tables)

    @cached_property
    def _factors(self) -> np.ndarray:
        """How many times the row's rate each part turns (P,)."""
        return self.cloud.rate_factors

    @cached_property
    def _chains(self) -> list[list[int]]:
        """Moving parts that carry each part, the part itself last."""
        result = []
        for part, kind in enumerate(self.cloud.kinds):
            chain = [part] if kind in ("rotor", "wing", "wheel") else []
            while chain and self.cloud.parents[chain[0]] >= 0:
                chain.insert(0, int(self.cloud.parents[chain[0]]))
            result.append(chain)
        return result

    @cached_property
    def _lengths(self) -> list[list[float]]:
        """Distances along each part's hinges: origin to first hinge, hinge to hinge, last hinge to farthest point."""
        stops = [[np.zeros(3), *(self.cloud.hinges[moving] for moving in chain)] for chain in self._chains]
        hops = [[math.dist(a, b) for a, b in pairwise(places)] for places in stops]
        away = self.cloud.points - np.array([places[-1] for places in stops])[self.cloud.part]
        return [[*mine, last] for mine, last in zip(hops, self._largest_of(away), strict=True)]

    def _largest_of(self, vectors: np.ndarray) -> list[float]:
        """The largest length of the points' vectors (L, 3) in each part, zero for a part without points."""
        result = np.zeros(len(self.cloud.kinds))
        np.maximum.at(result, self.cloud.part, np.sqrt(np.einsum("li,li->l", vectors, vectors)))
        return result.tolist()

    def _lever(self, part: int, order: int) -> float:
        """Largest distance (m) that the turn about a hinge of a part's chain, the order-th, carries its points by."""
        # Only the last hinge's distance is measured from the axis; earlier ones may turn it any way.
        last = order == len(self._chains[part]) - 1
        return self._arms[part] if last else sum(self._lengths[part][order + 1 :])

    @cached_property
    def _hinged_m(self) -> np.ndarray:
        """Largest distance (P,) that the first hinge of each part's chain turns, zero without one (m)."""
        return np.array([self._lever(part, 0) if chain else 0.0 for part, chain in enumerate(self._chains)])

    @cached_property
    def _arms(self) -> list[float]:
        """Largest distance of each part's points from its own axis (m), zero for parts that do not turn."""
        turning = np.array([bool(chain) for chain in self._chains])
        hinges, axes = np.where(turning[:, None], [self.cloud.hinges, self.cloud.axes], 0.0)
        part = self.cloud.part
        return self._largest_of(np.cross(self.cloud.points - hinges[part], axes[part]))

    def _added(self, part: int) -> float:
        """Largest angular rate that motion effects add to a part (rad/s)."""
        angles = [(item.angle_rad or {}).get(part) for item in self.view.perturbations]
        return self._largest_rate([None if angle is None else angle[:, None] for angle in angles])

    def _beat(self, part: int) -> tuple[float, float]:
        """Amplitude (rad) and angular frequency (rad/s) of a wing's flapping."""
        flap = self.cloud.record["flap"]
        name = "amplitude_deg" if self.cloud.parents[part] < 0 else "fold_amplitude_deg"
        return abs(np.radians(flap[name])), 2 * np.pi * abs(self.row["rate_hz"])

    def _rate(self, part: int) -> float:
        """Largest angular rate of a part about its own axis (rad/s)."""
        if self.cloud.kinds[part] == "wing":
            amplitude, beat = self._beat(part)
            return amplitude * beat + self._added(part)
        return 2 * np.pi * abs(self.row["rate_hz"]) * self._factors[part] + self._added(part)

    @cached_property
    def _turns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Each part's even angular rate, summed along its hinges (P,) (rad/s), and its wings' beats as in `_beat`.

        Amplitudes and angular frequencies are (P, D), zero where a part hangs on fewer than D moving parts.
        """
        chains = self._chains
        even, beats = np.zeros(len(chains)), np.zeros((2, len(chains), max(map(len, chains), default=0)))
        for part, chain in enumerate(chains):
            for order, moving in enumerate(chain):
                if self.cloud.kinds[moving] == "wing":
                    beats[:, part, order] = self._beat(moving)
                    even[part] += self._added(moving)
                else:
                    even[part] += self._rate(moving)
        return even, beats[0], beats[1]
