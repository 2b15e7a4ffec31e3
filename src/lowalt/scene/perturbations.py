"""Changes of a target's motion at the instants of a view, and the sum of several."""

import numpy as np

from lowalt.motion.poses import Perturbation


def at_times(item: Perturbation, grid_s: np.ndarray, times_s: np.ndarray) -> Perturbation:
    """Return a perturbation given at grid_s (G,) s at times_s (K,) s: linear between the symbols, exact on them."""

    def table(values: np.ndarray | None) -> np.ndarray | None:
        """Values (G, 3) at the times (K,): (K, 3)."""
        if values is None:
            return None
        return np.stack([np.interp(times_s, grid_s, values[:, axis]) for axis in range(3)], axis=1)

    angles = {part: np.interp(times_s, grid_s, angle) for part, angle in (item.angle_rad or {}).items()}
    return Perturbation(angles, table(item.offset_m), table(item.tilt_rad))


def summed(items: list[Perturbation]) -> Perturbation | None:
    """Return the sum of perturbations, None for none."""
    if not items:
        return None
    angles: dict[int, np.ndarray] = {}
    for item in items:
        for part, angle in (item.angle_rad or {}).items():
            angles[part] = angles[part] + angle if part in angles else angle
    offsets = [item.offset_m for item in items if item.offset_m is not None]
    tilts = [item.tilt_rad for item in items if item.tilt_rad is not None]
    return Perturbation(angles, sum(offsets) if offsets else None, sum(tilts) if tilts else None)
