"""Thermal noise of the receiver from a link budget, before range compression: the strongest cell may be a wrong one."""

import numpy as np

from lowalt.scene.set_noise import white
from lowalt.scene.waveform import Look

SOURCE = (
    "H. T. Friis, Noise Figures of Radio Receivers, Proc. IRE 32(7), 1944, Eqs. 1 and 8 (noise k T B F); "
    "S. M. Kay, Fundamentals of Statistical Signal Processing II, 1998, 4.3 (matched-filter gain)"
)
DEFAULTS = {"noise_figure_db": 7.0, "temperature_k": 290.0}
IDLE = [{"temperature_k": 0}]

BOLTZMANN = 1.380649e-23
"""J/K, exact by definition of the kelvin."""


def variance(settings: dict, bandwidth_hz: float) -> float:
    """Return the noise power k T B F of one subcarrier (W); a range cell, the mean of M subcarriers, has 1/M of it."""
    return BOLTZMANN * settings["temperature_k"] * bandwidth_hz * 10 ** (settings["noise_figure_db"] / 10)


def receive(settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus circular white Gaussian noise, k T df F a subcarrier.

    A subcarrier is the sum of M samples and a range cell the mean of M subcarriers: both a sample and a cell have 1/M
    of a subcarrier's noise. A sample of an FMCW sweep takes a subcarrier's place, and the sample rate that of df.
    Unit-norm receive weights leave one antenna's noise; the link budget's power is the network's `power_w` a
    subcarrier. Source: Friis 1944 (noise figure).
    """
    power = variance(settings, look.network.noise_bandwidth_hz) / look.network.subcarriers
    return samples + white(rng, power, samples.shape)
