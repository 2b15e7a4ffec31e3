"""Looks for the tests of receiver and detection effects: a network, a frame, and echoes of one point."""

from types import SimpleNamespace

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.effects import waveform


def network(symbols: int = 400, subcarriers: int = 256, interval_s: float = 2.5e-3) -> Network:
    """The default signal with stations A, B and C at one place."""
    spacing = 120e3
    step = (subcarriers - 1 + 10) * spacing
    stations = tuple(Station(name, (0.0, 0.0, 25.0), 0.0, 4.9e9 + i * step) for i, name in enumerate("ABC"))
    return Network(4.9e9, spacing, subcarriers, 10, interval_s, symbols, (16, 4), (16, 4), 1.0, stations)


def frame(radar: Network, station: str = "A", seed: int = 7, delay_s: float = 0.0) -> waveform.Frame:
    """A frame with random data."""
    data = waveform.sent(np.random.default_rng(seed), radar.symbols, radar.subcarriers)
    return waveform.Frame(radar, radar.station(station), data, 1.0, delay_s)


def point(look: waveform.Frame, cell: float, doppler_hz: float = 0.0) -> np.ndarray:
    """Responses (N, M) of one point of unit amplitude, `cell` range cells away, its line at doppler_hz."""
    radar = look.network
    delay = cell * 2 * radar.cell_m / SPEED_OF_LIGHT
    slow = np.exp(2j * np.pi * doppler_hz * look.symbol_times_s)
    return np.outer(slow, np.exp(-2j * np.pi * np.arange(radar.subcarriers) * radar.subcarrier_spacing_hz * delay))


def received(module, given: dict, look: waveform.Frame, responses: np.ndarray, seed: int = 1) -> np.ndarray:
    """Responses (N, M) after one receiver effect."""
    samples = waveform.transmit(responses, look.sent)
    samples = module.receive({**module.DEFAULTS, **given}, samples, look, np.random.default_rng(seed))
    return waveform.demodulate(samples, look.sent)


def checked(radar: Network, **effects: dict) -> SimpleNamespace:
    """The scene that `check` looks at."""
    return SimpleNamespace(network=radar, effects=effects)
