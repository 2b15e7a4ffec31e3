"""Offsets of clocks and oscillators, and what they do to time samples.

An offset has a fixed part and a drawn part. The drawn part is normal and truncated at three
standard deviations, so that the largest offset of a scene is known before it is drawn.
"""

from statistics import NormalDist

import numpy as np
from scipy import fft

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.waveform import Look

CUT = 3.0
"""Standard deviations at which draws are truncated."""


def drawn(rng: np.random.Generator) -> float:
    """Return a standard normal number truncated at +-3 from one uniform draw.

    It follows by the inverse distribution.
    """
    tail = NormalDist().cdf(-CUT)
    return NormalDist().inv_cdf(tail + (1 - 2 * tail) * rng.random())


def largest(fixed: float, sigma: float) -> float:
    """Return the largest magnitude that fixed part and drawn part can reach together."""
    return abs(fixed) + CUT * sigma


def check_slip(effect: str, slip_s: float, slack_s: float) -> None:
    """Raise InputError naming `effect` where a window can slip.

    slip_s: farthest slip; slack_s: what the cyclic prefix allows.
    """
    if slip_s > slack_s:
        raise InputError(
            f"effects.{effect}: the window can be off by {slip_s:g} s, expected at most "
            f"prefix_slack_s = {slack_s:g}: beyond the cyclic prefix it would take in another "
            "symbol's data"
        )


def of_stations(
    settings: dict, network: Network, rng: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Return each station's frequency error (ppm) and clock error (s) in a look, by name.

    There are two draws per station.

    rng: the stream of `link_offset`, which the whole look shares with `interference`.
    """
    names = [station.name for station in network.stations if station.transmitter is None]
    drawn = rng.standard_normal((len(names), 2)) * [settings["sigma_ppm"], settings["sigma_s"]]
    return dict(zip(names, map(tuple, drawn.tolist()), strict=True))


def check_oscillator(effect: str, scene: CheckedScene) -> None:
    """Raise InputError naming `effect` where transmitter and receiver share one oscillator.

    With one oscillator there is no offset.
    """
    noise = scene.effects.get("phase_noise")
    if noise and noise["shared"]:
        raise InputError(
            f"effects.{effect}: effects.phase_noise has shared: true, one oscillator for sending "
            "and receiving, which has no offset against itself; expected shared: false (a receiver "
            "of its own) or no offset"
        )


def turned(samples: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return samples (N, M) times exp(j 2 pi turns), turns (N, M)."""
    return samples * np.exp(2j * np.pi * turns)


def risen(samples: np.ndarray, rise_hz: float, look: Look) -> np.ndarray:
    """Return samples (N, M) with all frequencies raised by `rise_hz`.

    Phases count from the absolute time 0.
    """
    return turned(samples, rise_hz * look.sample_times_s)


def delayed(samples: np.ndarray, delay_s: float, look: Look) -> np.ndarray:
    """Return samples (N, M) delayed by `delay_s` in each symbol's cyclic extension.

    This is a phase linear over subcarriers.
    """
    turn = np.exp(-2j * np.pi * delay_s * fft.ifftshift(look.baseband_hz))
    return fft.ifft(fft.fft(samples, axis=-1) * turn, axis=-1, overwrite_x=True)
