"""The echoes of the viewer's samples: power and phase of each station over slow time, and the speed that is shown.

Both curves are kept as bytes, 0.8 kB a station: the eye sees no finer step in a panel 70 pixels high.
"""

import base64
import math

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network

FLOOR_DB = 40.0
"""Powers this far below a station's largest one, or further, stand on the lower edge of their panel."""


def _bytes(values: np.ndarray) -> str:
    """Values 0..255 (symbols) as base64 of uint8."""
    return base64.b64encode(np.asarray(values, dtype=np.uint8).tobytes()).decode()


def power(signal: np.ndarray) -> str:
    """Return 255 (1 + dB / FLOOR_DB) of each symbol of one station's signal, (symbols,) complex, as base64 of uint8.

    dB is the power over the station's largest one; a signal of zeros gives zeros.
    """
    size = np.abs(signal).astype(float)
    most = size.max(initial=0.0)
    if most == 0:
        return _bytes(np.zeros(len(size)))
    decibel = 20 * np.log10(np.maximum(size / most, 1e-9))
    return _bytes((255 * np.clip(1 + decibel / FLOOR_DB, 0, 1)).round())


def phase(signal: np.ndarray) -> str:
    """Return the phase of each symbol of a station's signal, (symbols,) complex, in 1/256 turns, base64 of uint8."""
    return _bytes(np.round(np.angle(signal) / (2 * math.pi) * 256).astype(int) % 256)


def largest_speed(frequency_hz: float, interval_s: float) -> float:
    """Return c / (4 f T), the radial speed (m/s) beyond which speeds fold: a phase turns half a circle a symbol."""
    return SPEED_OF_LIGHT / (4 * frequency_hz * interval_s)


def folded(speed_mps: float, frequency_hz: float, interval_s: float) -> tuple[float, int]:
    """Return the radial speed (m/s) at which a spectrum shows a speed, and how often it is folded.

    A phase that turns once more from symbol to symbol is the same phase, so speeds repeat after c / (2 f T).
    """
    span = 2 * largest_speed(frequency_hz, interval_s)
    folds = round(speed_mps / span)
    return speed_mps - folds * span, abs(folds)


def echoes(signals: np.ndarray, geometry: dict[str, dict[str, float]], network: Network) -> list[dict]:
    """Return the page's entries of a sample's signals (stations, symbols) complex, station by station.

    geometry: of the sample's record, with `radial_mps` of each station, receding positive; None where it has no place.
    """
    entries = []
    for station, signal in zip(network.stations, signals, strict=True):
        speed = geometry[station.name]["radial_mps"]
        entry: dict = {"power": power(signal), "phase": phase(signal)}
        if speed is not None and math.isfinite(speed):
            shown, folds = folded(speed, station.frequency_hz, network.symbol_interval_s)
            entry |= {"speed": round(speed, 2), "shown": round(shown, 2), "folds": folds}
        entries.append(entry)
    return entries
