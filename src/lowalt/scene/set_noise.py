"""Noise at set SNRs in a scene: added in all range cells before compression, or by the noise stage behind a canceller.

The workflow asks this module before any effect is imported, so nothing is imported here at the top.
"""

import numpy as np


def white(rng: np.random.Generator, variance: float, shape: tuple[int, ...]) -> np.ndarray:
    """Return circular complex white Gaussian noise of this variance, complex128 of `shape`."""
    return np.sqrt(variance / 2) * rng.standard_normal((*shape, 2)).view(np.complex128)[..., 0]


def in_all_cells(effects: dict) -> bool:
    """Return whether a configuration's `effects` add the noise of noise.snr_db themselves, before range compression."""
    return "cell_noise" in effects and (effects["cell_noise"] or {}).get("snr_db") is None


def behind_canceller(noise: np.ndarray, canceller: dict) -> np.ndarray:
    """Return noise (N,) of one range cell as a canceller (its parameters) leaves it: its spectrum is not flat.

    Cancellers are linear and act on each range cell by itself, so this is the noise that the cell would hold if it had
    been there before. A pulse canceller shapes it as |2 sin(pi f T_r)|^(2 k) over the noise gain C(2 k, k).
    Source: M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 5.2.
    """
    from lowalt.scene.effects import called

    for effect in called({"canceller": canceller}):
        noise = effect.module.filtered(effect.settings, noise[:, None])[:, 0]
    return noise
