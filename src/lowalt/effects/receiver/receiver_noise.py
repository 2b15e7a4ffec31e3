"""Thermal noise of the receiver from a link budget, before range compression: the strongest cell may be a wrong one."""

import math

import numpy as np

from lowalt.effects.range_noise import RangeNoise
from lowalt.effects.receiver._white import range_noise, tones_with_noise, with_noise
from lowalt.effects.waveform import Frame

SOURCE = (
    "H. T. Friis, Noise Figures of Radio Receivers, Proc. IRE 32(7), 1944, Eqs. 1 and 8 (noise k T B F); "
    "S. M. Kay, Fundamentals of Statistical Signal Processing II, 1998, 4.3 (matched-filter gain)"
)
DEFAULTS = {"noise_figure_db": 7.0, "temperature_k": 290.0}

BOLTZMANN = 1.380649e-23
"""J/K, exact by definition of the kelvin."""


def idle(settings: dict) -> bool:
    """Return True at 0 K, where there is no thermal noise."""
    return settings["temperature_k"] == 0


def variance(settings: dict, spacing_hz: float) -> float:
    """Return the noise power k T df F of one subcarrier (W); a range cell, the mean of M subcarriers, has 1/M of it."""
    return BOLTZMANN * settings["temperature_k"] * spacing_hz * 10 ** (settings["noise_figure_db"] / 10)


def noise(settings: dict, frame: Frame, rng: np.random.Generator) -> RangeNoise:
    """Return the noise of all range cells: circular, white and Gaussian, k T df F a subcarrier.

    A range cell is the mean of M subcarriers and has 1/M of it; unit-norm receive weights leave one antenna's noise.
    Source: Friis 1944 (noise figure); the link budget's power is the network's `power_w` a subcarrier.
    """
    subcarrier = variance(settings, frame.network.subcarrier_spacing_hz)
    return range_noise("receiver_noise", math.sqrt(subcarrier / frame.sent.shape[1] / 2), frame, rng)


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus those of `noise`, each with 1/M of k T df F."""
    return with_noise(samples, noise(settings, frame, rng), frame)


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    return tones_with_noise(tones, noise(settings, frame, rng), frame)
