"""Noise floors of raw recordings, before any filter of ours: measured-noise.csv, one row a recording.

    floor_F_db     noise floor from F to F times `SPAN` Hz, over that of white noise
    slow_db        what a floor of white noise and 1 / f^2 has at `AT_HZ` over white noise, fitted to the floor
    left_db        rms of what the fit leaves
The floor at a frequency is the mean of noise whose least tenth over windows of 0.4 s has that power (as
`presence.noise_floor`), Hann window; of a band its median. White noise is the median from 1.2 to 2.8 kHz.
"""

from itertools import pairwise

import numpy as np
from recorded_sets import Measured
from scipy.optimize import least_squares

from lowalt.extensions.recordings.presence import noise_floor
from lowalt.files.errors import InputError

BANDS_HZ = (5.0, 10.0, 20.0, 40.0, 75.0, 150.0, 300.0, 600.0, 1200.0)
NOISE = ("set", "half", "file", "windows", *(f"floor_{band:.0f}_db" for band in BANDS_HZ), "slow_db", "left_db")
SPAN = 1.4
WHITE_HZ = (1200.0, 2800.0)
FITTED_HZ = (15.0, 2800.0)
AT_HZ = 100.0
WINDOW_S = 0.4


def floor_db(values: np.ndarray, rate_hz: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Return frequencies (n,) Hz, the noise floor (n,) dB at each, and the number of windows of samples (samples,)."""
    count = round(WINDOW_S * rate_hz)
    windows = values[: len(values) // count * count].reshape(-1, count)
    if not len(windows):
        raise InputError(f"{len(values)} samples at {rate_hz:.6g} Hz, expected a window of {WINDOW_S} s")
    windows = windows - windows.mean(axis=1, keepdims=True)
    power = np.abs(np.fft.rfft(windows * np.hanning(count), axis=1)) ** 2
    # One cell to either side: the floor is not smoothed over frequency, so that its slope stays.
    return np.fft.rfftfreq(count, 1 / rate_hz), 10 * np.log10(noise_floor(power, np.inf)), len(windows)


def row(recording: Measured) -> list:
    """Return the row of `NOISE` of a recording with one real channel."""
    baseband = recording.read()
    hertz, level, windows = floor_db(baseband.values, baseband.rate_hz)
    white = np.median(level[(hertz >= WHITE_HZ[0]) & (hertz < WHITE_HZ[1])])
    bands = [float(np.median(level[(hertz >= low) & (hertz < SPAN * low)]) - white) for low in BANDS_HZ]
    edges = np.geomspace(*FITTED_HZ, 25)
    middle = np.sqrt(edges[1:] * edges[:-1])
    found = np.array([np.median(level[(hertz >= low) & (hertz < high)])
                      for low, high in pairwise(edges)])  # fmt: skip

    def left(parameters: np.ndarray) -> np.ndarray:
        """What a floor of white noise (dB) and slow noise (dB over it at `AT_HZ`) leaves of the bands."""
        return parameters[0] + 10 * np.log10(1 + 10 ** (parameters[1] / 10) * (AT_HZ / middle) ** 2) - found

    fit = least_squares(left, [white, 10.0], loss="soft_l1")
    about = [recording.set, recording.half, recording.name, windows]
    return [*about, *bands, float(fit.x[1]), float(np.sqrt(np.mean(left(fit.x) ** 2)))]
