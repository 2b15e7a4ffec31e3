"""The paper's three spectra by their definitions in float64, for analysis and for checks.

They are batched over signals.

Frequencies and speeds ascend along the row axis, time along the last axis. Images reverse the rows
and use the single-pass kernels of `lowalt.spectra.sliding`, which compute the same values.
"""

import numpy as np

from lowalt.spectra.catalogue import Spectra, spectrum


def vrp(signals: np.ndarray, settings: Spectra | None = None) -> np.ndarray:
    """Return the velocity-resolution-preferred spectrum.

    By default (..., symbols) becomes (..., 256, 144).

    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 28.

    A tone of 50 Hz, sampled every 2.5 ms, appears an eighth of the rows above zero:

        >>> tone = np.exp(2j * np.pi * 50.0 * 2.5e-3 * np.arange(400))
        >>> vrp(tone).shape, int(vrp(tone)[:, 0].argmax())
        ((256, 144), 160)
    """
    return spectrum("vrp").definition(signals, (settings or Spectra())["vrp"], "vrp", 0.0, 0.0)


def trp(signals: np.ndarray, settings: Spectra | None = None) -> np.ndarray:
    """Return the time-resolution-preferred spectrum, (..., symbols) -> (..., 1024, 392) by default.

    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 29.
    """
    return spectrum("trp").definition(signals, (settings or Spectra())["trp"], "trp", 0.0, 0.0)


def vt(
    signals: np.ndarray,
    frequency_hz: float,
    symbol_interval_s: float,
    settings: Spectra | None = None,
) -> np.ndarray:
    """Return the velocity-transfer spectrum, (..., symbols) -> (..., 123, 392) by default.

    frequency_hz: f_k of the station that received the signals; symbol_interval_s: T_r. Rows are the
    matched speeds (ascending, positive recedes); the unit is that of |signal|^2.
    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 30 to 35.
    """
    return spectrum("vt").definition(
        signals, (settings or Spectra())["vt"], "vt", frequency_hz, symbol_interval_s
    )
