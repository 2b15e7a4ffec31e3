"""Windblown land: the ratio of still to moving echoes, and speckle of unit power with both."""

import numpy as np
from scipy import fft

from lowalt.numerics import portable
from lowalt.scene.set_noise import white

MPH = 0.44704
"""Metres per second in a statute mile per hour, the unit of Billingsley's formulas."""
TAIL = 1e-3
"""Largest correlation left where the synthesised moving part wraps round."""
FAINT = 1e-11
"""Share of the moving part's power in each of the frequencies that are not drawn."""
LARGEST = 700.0
"""Exponent beyond which a share of power is nothing."""


def windblown(wind_mps: float, frequency_hz: float) -> tuple[float, float]:
    """Return the ratio of still to moving power and the exponential spectrum's slope beta (s/m).

    Below a wind of one mile per hour, where the formula ends, the slope keeps its value at that
    wind.
    Source: Billingsley 2002, chapter 6 (wind in miles per hour, frequency in GHz).
    """
    miles = wind_mps / MPH
    if miles == 0:
        return np.inf, np.inf
    still = 489.8 / (portable.power(miles, 1.55) * portable.power(frequency_hz / 1e9, 1.21))
    slope = 0.1048 * (portable.log(max(miles, 1.0)) / portable.LN_10 + 0.4147)
    return float(still), float(1.0 / slope)


def spectrum(count: int, step_s: float, slope_s: np.ndarray) -> np.ndarray:
    """Return the root of the power (cells, count) of spectra exp(-slope |f|).

    They are sampled every step; slope_s: (cells,).

    The images of a spectrum, 1 / step_s apart, are a geometric series. The powers of a cell add to
    1.
    """
    frequency = abs(fft.fftfreq(count, step_s))
    period = 1.0 / step_s
    slope_s = slope_s[:, None]
    near = slope_s * frequency
    far = slope_s * (period - frequency)
    power = portable.exp(-np.minimum(near, LARGEST)) + portable.exp(-np.minimum(far, LARGEST))
    return np.sqrt(power / power.sum(axis=1, keepdims=True))


def speckle(
    rng: np.random.Generator,
    cells: int,
    count: int,
    step_s: float,
    wind: tuple[float, float],
    wavelength_m: float,
    slow: np.ndarray | float = 1.0,
) -> np.ndarray:
    """Return unit-power speckle (cells, count): a constant and a moving component.

    The moving one has a two-sided exponential spectrum.

    wind: ratio of their powers and slope beta of the spectrum over radial speed (s/m), as of
    `windblown`; slow: factor on Doppler frequencies, a number or (cells,).
    """
    still, beta = wind
    constant = white(rng, 1.0, (cells,))[:, None]
    if not np.isfinite(still):
        return np.repeat(constant, count, axis=1)
    decay_s = beta * wavelength_m / (4 * np.pi)
    slope_s = 0.5 * beta * wavelength_m
    long = fft.next_fast_len(count + int(decay_s / np.sqrt(TAIL) / step_s))
    # Lines whose power is negligible, with any `slow` up to 1, are not drawn.
    strong = spectrum(long, step_s, np.array([slope_s]))[0] ** 2 > FAINT
    # A factor of 0 leaves all power at zero frequency.
    shape = spectrum(long, step_s, slope_s / np.maximum(np.atleast_1d(slow), 1e-6))[:, strong]
    lines = np.zeros((cells, long), np.complex128)
    lines[:, strong] = white(rng, 1.0, (cells, int(strong.sum()))) * shape
    moving = fft.ifft(lines, axis=1, norm="forward", overwrite_x=True)[:, :count]
    return np.sqrt(still / (1 + still)) * constant + np.sqrt(1 / (1 + still)) * moving
