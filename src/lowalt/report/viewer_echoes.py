"""The echoes of the viewer's samples: power and phase over slow time, and the speed that is shown.

Both curves are kept as bytes, 0.8 kB per station: the eye sees no finer step in a panel 70 pixels
high.
"""

import base64
import math

import numpy as np

from lowalt.config.network import Network

FLOOR_DB = 40.0
"""Powers this far below a station's largest one, or further, stand on the lower edge of their
panel.
"""


def _bytes(values: np.ndarray) -> str:
    """Values 0..255 (symbols) as base64 of uint8."""
    return base64.b64encode(np.asarray(values, dtype=np.uint8).tobytes()).decode()


def power(signal: np.ndarray) -> str:
    """Return the power of each symbol of a station's signal, (symbols,) complex, in base64.

    The values are uint8, 255 (1 + dB / FLOOR_DB), where dB is the power over the station's largest
    one; a signal of zeros gives zeros.
    """
    size = np.abs(signal).astype(float)
    most = size.max(initial=0.0)
    if most == 0:
        return _bytes(np.zeros(len(size)))
    decibel = 20 * np.log10(np.maximum(size / most, 1e-9))
    return _bytes((255 * np.clip(1 + decibel / FLOOR_DB, 0, 1)).round())


def phase(signal: np.ndarray) -> str:
    """Return the phase of each symbol of a station's signal, (symbols,) complex, in base64.

    The values are uint8, in 1/256 turns.
    """
    return _bytes(np.round(np.angle(signal) / (2 * math.pi) * 256).astype(int) % 256)


def echoes(
    signals: np.ndarray, geometry: dict[str, dict[str, float]], network: Network
) -> list[dict]:
    """Return the page's entry for each station of a sample's signals (stations, symbols) complex.

    geometry: of the sample's record, with `range_m` and `radial_mps` of each station, receding
    positive; None where the target has no position.
    """
    entries = []
    for station, signal in zip(network.stations, signals, strict=True):
        speed = geometry[station.name]["radial_mps"]
        entry: dict = {"power": power(signal), "phase": phase(signal)}
        if speed is not None and math.isfinite(speed):
            shown = float(network.folded_mps(np.asarray(speed), station))
            folds = round(abs(speed - shown) / (2 * network.largest_mps(station)))
            entry |= {"speed": round(speed, 2), "shown": round(shown, 2), "folds": folds}
            entry["range"] = round(geometry[station.name]["range_m"], 1)
        entries.append(entry)
    return entries
