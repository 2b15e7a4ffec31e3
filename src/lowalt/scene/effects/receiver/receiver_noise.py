"""Thermal noise of the receiver from a link budget.

It acts before range compression: the strongest cell may be a wrong one.
"""

import numpy as np

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.set_noise import white
from lowalt.scene.waveform import Look

SOURCE = (
    "H. T. Friis, Noise Figures of Radio Receivers, Proc. IRE 32(7), 1944, Eqs. 1 and 8 (noise k T "
    "B F); S. M. Kay, Fundamentals of Statistical Signal Processing II, 1998, 4.3 (matched-filter "
    "gain)"
)
DEFAULTS = {"noise_figure_db": 7.0, "temperature_k": 290.0}
IDLE = [{"temperature_k": 0}]

BOLTZMANN = 1.380649e-23
"""J/K, exact by definition of the kelvin."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for noise at set SNRs as well."""
    if scene.noisy:
        raise InputError(
            f"effects.receiver_noise: noise.snr_db is {list(scene.snr_db)}, expected [.inf]: a "
            "scene has a link budget or set SNRs, not both"
        )


def noise_w(settings: dict, network: Network) -> float:
    """Return the noise power k T B F (W) of one subcarrier.

    A range cell, the mean of M of them, has 1/M of it.
    """
    bandwidth_hz = network.noise_bandwidth_hz
    factor = 10 ** (settings["noise_figure_db"] / 10)
    return BOLTZMANN * settings["temperature_k"] * bandwidth_hz * factor


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the samples (N, M) plus circular white Gaussian noise.

    Its power is k T df F per subcarrier.

    A subcarrier is the sum of M samples, and a range cell is the mean of M subcarriers, so a sample
    and a cell both have 1/M of the noise of a subcarrier. In an FMCW sweep a sample takes the place
    of a subcarrier, and the sample rate that of df. The receive weights have unit norm, so the
    noise is that of one antenna. Source: Friis 1944.
    """
    power = noise_w(settings, look.network) / look.network.subcarriers
    return samples + white(rng, power, samples.shape)
