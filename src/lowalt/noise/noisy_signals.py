"""Noisy signals of a chunk: every motion model at every SNR and station."""

from collections.abc import Callable

import numpy as np

from lowalt.noise.awgn import add_noise
from lowalt.numerics.streams import stream


def noisy_signals(
    echoes: np.ndarray,
    rows: list[dict],
    stations: list[str],
    snrs: list[float],
    seed: int,
    powers: np.ndarray | None = None,
    behind: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Return noisy signals (models, snrs, stations, N) complex64 of clean `echoes` (stations, models, N).

    rows: the motion table; powers: (stations, models) W that SNRs refer to, each echo's own by default; behind: returns
    noise (N,) as the scene's canceller leaves it, where there is one. Echoes (stations, models, snrs, N) hold their
    noise already. Each (subtype, model, station, SNR) has a noise stream of its own.
    """
    if np.ndim(echoes) == 4:
        return np.ascontiguousarray(np.moveaxis(echoes, 0, 2), np.complex64)
    result = np.empty((len(rows), len(snrs), len(stations), echoes.shape[-1]), np.complex64)
    for model, row in enumerate(rows):
        for level, snr_db in enumerate(snrs):
            for place, name in enumerate(stations):
                rng = None if np.isposinf(snr_db) else stream(seed, "noise", row["subtype"], row["model"], name, snr_db)
                power = None if powers is None else float(powers[place, model])
                result[model, level, place] = _noisy(echoes[place, model], snr_db, rng, power, behind)
    return result


def _noisy(
    echo: np.ndarray,
    snr_db: float,
    rng: np.random.Generator | None,
    power: float | None,
    behind: Callable[[np.ndarray], np.ndarray] | None,
) -> np.ndarray:
    """Return an echo (N,) with noise at one SNR."""
    if behind is None or rng is None:
        return add_noise(echo, snr_db, rng, power)
    return echo + behind(add_noise(np.zeros(len(echo)), snr_db, rng, power))
