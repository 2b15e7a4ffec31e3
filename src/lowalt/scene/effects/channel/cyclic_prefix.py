"""Echoes later than the cyclic prefix.

The receive window then begins with the end of the previous symbol.

Symbols follow each other without a pause. In the receive window, an echo of delay tau > T_cp
carries the previous symbol, with other random data, until tau - T_cp, and its own symbol from then
on. It loses a share

    e = (tau - T_cp) / T_u

of the window: its amplitude falls to 1 - e, and 1 - (1 - e)^2 of its power becomes interference in
all range cells. Each point of a target is cut at its direct delay, on reflected paths too; still
echoes are cut at the delay of their range cell.
"""

from collections.abc import Callable

import numpy as np
from scipy import fft

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.scene.view import View
from lowalt.scene.waveform import normal_prefix_s

SOURCE = (
    "3GPP TS 38.211, 5.3.1 (normal cyclic prefix, 144 of 2048 samples); interference beyond it: D. "
    "Kim, G. L. Stuber, Residual ISI cancellation for OFDM with applications to HDTV broadcasting, "
    "IEEE J. Sel. Areas Commun. 16(8), 1998"
)
DEFAULTS = {"prefix_s": None}
UNMODELLED = ("fmcw", "cw")


def lost(delay_s: np.ndarray | float, prefix_s: float, network: Network) -> np.ndarray | float:
    """Return the share of the receive window that an echo of this delay loses, 0 to 1.

    Delays may have any shape.
    """
    return np.clip((delay_s - prefix_s) * network.subcarrier_spacing_hz, 0.0, 1.0)


def prefix_s(settings: dict, network: Network) -> float:
    """Return the prefix's length (s)."""
    if settings["prefix_s"] is None:
        return normal_prefix_s(network)
    return settings["prefix_s"]


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return what the echo of the target's middle keeps of its power."""
    delay_s = float(view.ways_m(view.origin_m)) / SPEED_OF_LIGHT
    kept = 1 - float(lost(delay_s, prefix_s(settings, view.network), view.network))
    return [("loss beyond the cyclic prefix", kept**2, "1")]


def late_samples(settings: dict, view: View) -> np.ndarray:
    """Return how many samples (N, L) of each point's echo carry the previous symbol.

    They stand at the start of the window.
    """
    network = view.network
    late_s = view.ways_m(view.places) / SPEED_OF_LIGHT - prefix_s(settings, network)
    rate_hz = network.subcarriers * network.subcarrier_spacing_hz
    return np.clip(np.ceil(late_s * rate_hz), 0, network.subcarriers).astype(np.int64)


def convolved(
    settings: dict,
    network: Network,
    response: np.ndarray,
    on_air: Callable[[str], np.ndarray],
    offset_cells: float,
) -> np.ndarray:
    """Return the time samples (N, M) of still echoes.

    They are the linear convolution of the sent stream with the range cells.

    response: (N, M) of all echoes; on_air: subcarriers (N, M) on the air in the "waveform" and the
    "previous waveform"; offset_cells: distance of the echoes beyond their cells' centres. The
    prefix counts in whole samples.
    """
    count = response.shape[1]
    samples = prefix_s(settings, network) * count * network.subcarrier_spacing_hz
    prefix = min(round(samples), count)
    later = np.exp(-2j * np.pi * offset_cells * np.arange(count) / count)
    now = fft.ifft(fft.ifftshift(on_air("waveform") * later, axes=1), axis=1)
    before = fft.ifft(fft.ifftshift(on_air("previous waveform") * later, axes=1), axis=1)
    # Frequencies count from the lowest subcarrier in range cells, from the oscillator's, M // 2
    # higher, in samples.
    cells = fft.ifft(fft.ifftshift(response * later.conj(), axes=1), axis=1)
    # From one symbol length before the window: the previous symbol's end, the prefix, and the
    # symbol itself.
    stream = np.concatenate([before[:, prefix:], now[:, count - prefix :], now], axis=1)
    spectrum = fft.fft(stream, axis=1) * fft.fft(cells, 2 * count, axis=1)
    return fft.ifft(spectrum, axis=1)[:, count:]
