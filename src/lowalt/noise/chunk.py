"""Noisy signals of a chunk: every motion model at every SNR and station."""

import numpy as np

from lowalt.common.streams import stream
from lowalt.noise.awgn import add_noise


def noisy_signals(
    echoes: np.ndarray,
    rows: list[dict],
    stations: list[str],
    snrs: list[float],
    seed: int,
    powers: np.ndarray | None = None,
) -> np.ndarray:
    """Return noisy signals (models, snrs, stations, N) complex64 of clean `echoes` (stations, models, N).

    rows: the motion table; powers: (stations, models) W that SNRs refer to, each echo's own by default.
    Each (subtype, model, station, SNR) has a noise stream of its own.
    """
    result = np.empty((len(rows), len(snrs), len(stations), echoes.shape[-1]), np.complex64)
    for model, row in enumerate(rows):
        for level, snr_db in enumerate(snrs):
            for place, name in enumerate(stations):
                rng = None if np.isposinf(snr_db) else stream(seed, "noise", row["subtype"], row["model"], name, snr_db)
                power = None if powers is None else float(powers[place, model])
                result[model, level, place] = add_noise(echoes[place, model], snr_db, rng, power)
    return result
