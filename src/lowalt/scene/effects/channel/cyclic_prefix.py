"""Echoes later than the cyclic prefix: the receive window then begins with the end of the previous symbol.

Symbols follow each other without a pause. An echo of delay tau has its own symbol from tau - T_cp on; before that it
still carries the previous one, whose data are random too. The echo loses a share e = (tau - T_cp) / T_u of its window:
its amplitude falls to 1 - e, and 1 - (1 - e)^2 of its power becomes interference, spread over all range cells. Every
point is cut at its direct delay, on the reflected paths too; other echoes are cut at the delay of their range cell.
"""

import numpy as np
from scipy import fft

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.scene.prefix import length_s as length_s
from lowalt.scene.prefix import turn as turn
from lowalt.scene.view import View

SOURCE = (
    "3GPP TS 38.211, 5.3.1 (normal cyclic prefix, 144 of 2048 samples); interference beyond it: D. Kim, G. L. Stuber, "
    "Residual ISI cancellation for OFDM with applications to HDTV broadcasting, IEEE J. Sel. Areas Commun. 16(8), 1998"
)
DEFAULTS = {"prefix_s": None}


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect gets it wherever an echo is later than the prefix."""
    return False


def lost(delay_s: np.ndarray | float, prefix_s: float, network: Network) -> np.ndarray | float:
    """Return the share of the receive window that an echo of this delay loses, 0 to 1; any shape."""
    return np.clip((delay_s - prefix_s) * network.subcarrier_spacing_hz, 0.0, 1.0)


def late_samples(settings: dict, view: View) -> np.ndarray:
    """Return the number (N, L) of each point's samples, at the window's start, that carry the previous symbol."""
    network, ends = view.network, (view.station.transmitter or view.station, view.station)
    ways_m = sum(np.linalg.norm(view.places - np.asarray(end.position_m), axis=2) for end in ends)
    late_s = ways_m / SPEED_OF_LIGHT - length_s(settings, network)
    rate_hz = network.subcarriers * network.subcarrier_spacing_hz
    return np.clip(np.ceil(late_s * rate_hz), 0, network.subcarriers).astype(np.int64)


def convolved(
    settings: dict, network: Network, response: np.ndarray, symbols: tuple[np.ndarray, np.ndarray],
    offset_cells: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Return the time samples (N, M) of echoes in range cells: the linear convolution of the sent stream with them.

    response: (N, M) of all echoes; symbols: subcarriers (N, M) on the air of the symbol and of the one before it;
    offset_cells: distance of the echoes beyond their cells' centres. The prefix counts in whole samples.
    """
    count = response.shape[1]
    prefix = min(round(length_s(settings, network) * count * network.subcarrier_spacing_hz), count)
    later = np.exp(-2j * np.pi * offset_cells * np.arange(count) / count)
    now, before = (fft.ifft(fft.ifftshift(symbol * later, axes=1), axis=1) for symbol in symbols)
    # Frequencies count from the lowest subcarrier in range cells, from the oscillator's, M // 2 higher, in samples.
    cells = fft.ifft(fft.ifftshift(response * later.conj(), axes=1), axis=1)
    # From one symbol length before the window: the previous symbol's end, the prefix, and the symbol itself.
    stream = np.concatenate([before[:, prefix:], now[:, count - prefix :], now], axis=1)
    spectrum = fft.fft(stream, axis=1) * fft.fft(cells, 2 * count, axis=1)
    return fft.ifft(spectrum, axis=1)[:, count:]
