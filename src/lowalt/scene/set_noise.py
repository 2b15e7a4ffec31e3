"""Noise at set SNRs in a scene.

It is added in all range cells before compression, or later, behind the scene's filters.
"""

import functools
from collections.abc import Callable, Mapping

import numpy as np

from lowalt.scene.effects import called, every, offering


def white(rng: np.random.Generator, variance: float, shape: tuple[int, ...]) -> np.ndarray:
    """Return circular complex white Gaussian noise of this variance, complex128 of `shape`."""
    return np.sqrt(variance / 2) * rng.standard_normal((*shape, 2)).view(np.complex128)[..., 0]


def in_all_cells(effects: Mapping[str, dict | None]) -> list[str]:
    """Return the names of those effects that add the noise of noise.snr_db themselves.

    effects: those of a configuration. The noise is added before range compression.
    """
    adding = called(offering(effects, "receiver", "SET_SNR"))
    return [effect.name for effect in adding if effect.snr_db is None]


def filters(effects: Mapping[str, dict | None]) -> dict[str, dict]:
    """Return those effects that filter range cells, and so the noise that is added later.

    effects: those of a configuration.
    """
    return offering(effects, "detection", "filtered")


def filtering(filters: Mapping[str, dict | None]) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return the function that filters noise (N,) as `behind` does, None without any filter."""
    if not filters:
        return None
    return functools.partial(behind, filters=filters)


def behind(noise: np.ndarray, filters: Mapping[str, dict | None]) -> np.ndarray:
    """Return noise (N,) of one range cell as these filters leave it.

    Its spectrum is then not flat.

    Filters are linear and act on each range cell by itself, so this is the noise that the cell
    would hold if it had been there before. A pulse canceller shapes it as |2 sin(pi f T_r)|^(2 k)
    over the noise gain C(2 k, k).
    Source: M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 5.2.
    """
    for filtered in every(called(filters), "filtered").values():
        noise = filtered(noise[:, None])[:, 0]
    return noise
