"""Signals of three stations and the renderer of their tiles: inputs of the tests of tiles and
shards.
"""

import numpy as np

from lowalt.config.network import Network
from lowalt.spectra import Spectra
from lowalt.tiles import Images, Renderer, Scale

NETWORK = {
    "carrier_hz": 4.9e9,
    "subcarrier_spacing_hz": 120e3,
    "subcarriers": 256,
    "guard_subcarriers": 10,
    "symbol_interval_s": 2.5e-3,
    "symbols": 400,
    "transmit_array": [16, 4],
    "receive_array": [16, 4],
    "power_w": 1.0,
    "stations": {
        "A": {"position_m": [0.0, 0.0, 25.0], "normal_deg": 30.0},
        "B": {"position_m": [500.0, 0.0, 25.0], "normal_deg": 150.0},
        "C": {"position_m": [250.0, 433.0, 25.0], "normal_deg": 270.0},
    },
}
SPECTRA = {
    "vrp": {"window": 256, "hop": 1, "points": 256},
    "trp": {"window": 8, "hop": 1, "points": 1024},
    "vt": {
        "window": 8,
        "hop": 1,
        "speed_min_mps": -6.1,
        "speed_max_mps": 6.1,
        "speed_step_mps": 0.1,
    },
}
IMAGES = {"size": 256, "scale": "decibel", "floor_db": 40.0, "gamma": 1.0, "colour_map": "viridis"}
SCALES = [
    Scale("linear"),
    Scale("decibel", 40.0),
    Scale("decibel", 60.0),
    Scale("power", gamma=0.5),
]


def renderer(scale=None, **changes):
    """A renderer of the test network with these changes."""
    network = Network.from_settings({**NETWORK, **changes})
    return Renderer(network, Spectra(), Images(256, scale or Scale()))


def echoes(seed=0, level=1e-7, snr=0.05):
    """A rotor-like phase modulation with noise, (3, 400) complex64."""
    rng = np.random.default_rng(seed)
    times = np.arange(400) * 2.5e-3
    tones = np.exp(1j * 8 * np.sin(2 * np.pi * rng.uniform(2, 12, (3, 1)) * times)) * np.exp(
        60j * np.pi * times
    )
    grain = rng.standard_normal((2, 3, 400))
    return (level * (tones + snr * (grain[0] + 1j * grain[1]))).astype(np.complex64)
