"""Pairs of pictures: a stretch of a recording and the scene of a twin that stands for it, by the
same transform.

Both sides of a pair: signal at the symbol rate, its mean removed, the short-time transform of
`lowalt.spectra`, in decibels below the picture's own largest value. Axes are seconds and m/s,
positive approaching.
"""

from typing import NamedTuple

import numpy as np
from recorded_sets import Measured
from spectral_figures import spectrogram

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.presence import speeds_shown
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import clouds_of, heard, samples, stretch
from lowalt.extensions.recordings.windows import at_symbol_rate
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream

FLOOR_DB = -45.0


class Picture(NamedTuple):
    """times_s: (T,); speeds_mps: (V,), ascending; level_db: (V, T), 0 at the largest value,
    `FLOOR_DB` the smallest.
    """

    times_s: np.ndarray
    speeds_mps: np.ndarray
    level_db: np.ndarray


def picture(signal: np.ndarray, twin: Twin, pair: dict) -> Picture:
    """Return the picture of a signal (symbols,) at the twin's symbol rate; pair: window and hop in
    symbols.
    """
    moving = signal - signal.mean()
    times, frequencies, shown = spectrogram(
        moving, 1 / twin.symbol_interval_s, pair["window"], pair["hop"]
    )
    rows, speeds = speeds_shown(
        frequencies * SPEED_OF_LIGHT / twin.carrier_hz / 2, twin.edge_mps, twin.sides
    )
    level = 20 * np.log10(shown[rows] / shown[rows].max() + 1e-300)
    return Picture(times, speeds, np.maximum(level, FLOOR_DB))


def measured_stretch(recording: Measured, twin: Twin, start_s: float, seconds: float) -> np.ndarray:
    """Return a stretch of a recording at the twin's symbol rate.

    Raises: InputError where the recording ends before.
    """
    baseband = recording.read()
    length_s = len(baseband.values) / baseband.rate_hz
    if round(start_s * baseband.rate_hz) + round(seconds * baseband.rate_hz) > len(baseband.values):
        raise InputError(
            f"{recording.record.file}: {length_s:.3g} s, expected at least"
            f" {start_s + seconds:.3g} s"
        )
    signal = at_symbol_rate(recording.record, twin, baseband)
    first = round(start_s / twin.symbol_interval_s)
    return signal[first : first + round(seconds / twin.symbol_interval_s)]


def simulated_stretch(
    name: str, pair: dict, records: dict, seed: int, again: int = 0
) -> np.ndarray:
    """Return the same stretch of the pair's scene, simulated; `name` and `again` key its random
    stream.
    """
    twin = Twin.from_settings(pair["radar"])
    clouds = clouds_of(records, pair["scene"]["subtypes"], seed)
    rng = stream(seed, "picture", name, again)
    signal, _ = heard(twin, pair["scene"], clouds, rng, pair["seconds"])
    return stretch(samples(twin, pair["scene"]["receiver"], signal, rng), twin, pair["seconds"])
