"""The wind in the land's echoes: how much of them moves, and unit-power speckle with the moving part's spectrum."""

from functools import lru_cache

import numpy as np
from scipy.fft import next_fast_len

from lowalt.common import raw_words
from lowalt.common.normals import circular
from lowalt.effects.channel import clutter_loops

MPH = 0.44704
"""Metres per second in a statute mile per hour, the unit of Billingsley's formulas."""
TAIL = 1e-3
"""Largest correlation left where the synthesised moving part wraps round."""
FAINT = 1e-11
"""Share of the moving part's power in each of the frequencies that are not drawn."""


def windblown(wind_mps: float, frequency_hz: float) -> tuple[float, float]:
    """Return the ratio of still to moving power and the exponential spectrum's slope beta (s/m).

    The formula for the slope ends at a wind of one mile an hour; below, the slope keeps its value there.
    Source: Billingsley 2002, chapter 6 (wind in miles per hour, frequency in GHz).
    """
    miles = wind_mps / MPH
    if miles == 0:
        return np.inf, np.inf
    still = 489.8 * miles**-1.55 * (frequency_hz / 1e9) ** -1.21
    return still, 1.0 / (0.1048 * (np.log10(max(miles, 1.0)) + 0.4147))


@lru_cache(maxsize=32)
def _shape(count: int, step_s: float, beta: float, wavelength_m: float) -> np.ndarray:
    """Root of the moving part's power (K,) in each of K >= count frequencies, aliased by sampling every `step_s`."""
    decay = beta * wavelength_m / (4 * np.pi)
    long = next_fast_len(count + int(decay / np.sqrt(TAIL) / step_s))
    return _aliased(long, step_s, np.array([0.5 * beta * wavelength_m]))[0]


def _aliased(count: int, step_s: float, slope: np.ndarray) -> np.ndarray:
    """Root of the power (cells, count) of spectra exp(-slope |f|), slope (cells,) s, sampled every `step_s`.

    The images of a spectrum, 1 / step_s apart, are a geometric series.
    """
    frequency, period, slope = abs(np.fft.fftfreq(count, step_s)), 1.0 / step_s, slope[:, None]
    power = np.exp(-slope * frequency) + np.exp(-slope * (period - frequency))
    power /= -np.expm1(-slope * period)
    return np.sqrt(power / power.sum(axis=1, keepdims=True))


def _normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Circular complex normals of unit power."""
    return rng.standard_normal((*shape, 2)).view(np.complex128)[..., 0] * np.sqrt(0.5)


def speckle(
    rng: np.random.Generator, cells: int, count: int, step_s: float, still: float, beta: float, wavelength_m: float,
    slow: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """Return unit-power speckle (cells, count): a constant part plus a part with a two-sided exponential spectrum.

    still: ratio of their powers; beta: slope of the spectrum over radial speed (s/m); slow: (cells,) factor on Doppler
    frequencies, None for 1.
    """
    constant, moving = parts(rng, cells, count, step_s, still, beta, wavelength_m, slow)
    return moving + constant[:, None]


def parts(
    rng: np.random.Generator, cells: int, count: int, step_s: float, still: float, beta: float, wavelength_m: float,
    slow: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the parts of `speckle`, whose sum it is: the constant one (cells,), the moving one (cells, count)."""
    kept = _normal(rng, cells)
    if not np.isfinite(still):
        return kept, np.zeros((cells, count), np.complex128)
    shape = _shape(count, step_s, beta, wavelength_m)
    lines = np.empty((cells, len(shape)), np.complex128)
    # Draw only lines near zero frequency, positive and negative; the power of all others is negligible.
    strong = shape > np.sqrt(FAINT)
    words = raw_words.words(rng.bit_generator, 2 * cells * int(strong.sum()))
    if slow is not None:
        # A factor of 0 leaves all power at zero frequency.
        shape = _aliased(len(shape), step_s, 0.5 * beta * wavelength_m / np.maximum(slow, 1e-6))
    shape = np.ascontiguousarray(np.atleast_2d(np.sqrt(1 / (1 + still)) * shape))
    clutter_loops.lines(*circular(words, np.sqrt(0.5)), shape, strong, lines)
    moving = np.fft.ifft(lines, axis=1, norm="forward", out=lines)[:, :count]
    return np.sqrt(still / (1 + still)) * kept, moving
