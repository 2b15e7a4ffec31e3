"""Pairs of pictures: a stretch of a recording and the scene of a twin that stands for it, by the same transform.

Both sides of a pair: signal at the symbol rate, its mean removed, the short-time transform of `lowalt.spectra`, in
decibels below the picture's own largest value. Axes are seconds and m/s, positive approaching.
"""

from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recordings.figures import spectrogram, speeds_shown
from lowalt.recordings.files import read
from lowalt.recordings.scenes import clouds_of, heard, samples, stretch
from lowalt.recordings.sets import Measured, sampled
from lowalt.recordings.twin import Twin

FLOOR_DB = -45.0


class Picture(NamedTuple):
    """times_s: (T,); speeds_mps: (V,), ascending; level_db: (V, T), 0 at the largest value, `FLOOR_DB` the smallest."""

    times_s: np.ndarray
    speeds_mps: np.ndarray
    level_db: np.ndarray


def picture(signal: np.ndarray, twin: Twin, window: int, hop: int) -> Picture:
    """Return the picture of a signal (symbols,) at the twin's symbol rate."""
    moving = signal - signal.mean()
    times, frequencies, shown = spectrogram(moving, 1 / twin.symbol_interval_s, window, hop)
    rows, speeds = speeds_shown(frequencies * SPEED_OF_LIGHT / twin.carrier_hz / 2, twin.edge_mps, twin.sides)
    level = 20 * np.log10(shown[rows] / shown[rows].max() + 1e-300)
    return Picture(times, speeds, np.maximum(level, FLOOR_DB))


def measured_stretch(one: Measured, twin: Twin, start_s: float, seconds: float) -> np.ndarray:
    """Return a stretch of a recording at the twin's symbol rate.

    Raises: InputError where the recording ends before.
    """
    values, rate = baseband = read(one.record)
    first, count = round(start_s * rate), round(seconds * rate)
    if first + count > len(values):
        raise InputError(f"{one.record.file}: {len(values) / rate:.3g} s, expected at least {start_s + seconds:.3g} s")
    signal = sampled(one.record, twin, baseband)
    first = round(start_s / twin.symbol_interval_s)
    return signal[first : first + round(seconds / twin.symbol_interval_s)]


def simulated_stretch(name: str, pair: dict, records: dict, seed: int, again: int = 0) -> np.ndarray:
    """Return the same stretch of the pair's scene, simulated; `name` and `again` key its random stream."""
    twin = Twin.from_settings(pair["radar"])
    clouds = clouds_of(records, pair["scene"]["subtypes"], seed)
    rng = stream(seed, "picture", name, again)
    signal, _ = heard(twin, pair["scene"], clouds, rng, pair["seconds"])
    return stretch(samples(twin, pair["scene"]["receiver"], signal, rng), twin, pair["seconds"])


def pair_of(name: str, pair: dict, found: list[Measured], records: dict, seed: int) -> tuple[Picture, Picture] | None:
    """Return the measured and the simulated picture of a pair, None where its recording is not there."""
    for one in found:
        if one.set == pair["set"] and one.name == pair["file"]:
            break
    else:
        return None
    twin = Twin.from_settings(pair["radar"])
    signals = (
        measured_stretch(one, twin, pair["start_s"], pair["seconds"]),
        simulated_stretch(name, pair, records, seed),
    )
    return tuple(picture(signal, twin, pair["window"], pair["hop"]) for signal in signals)
