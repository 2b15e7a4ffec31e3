"""White noise in all range cells at set SNRs, added before range compression: the strongest cell may be a wrong one.

The paper's SNRs say how far the noise is below the target in its range cell, which is then known. Here the same SNR
holds in that cell, the other cells have as much noise, and cancellers and detectors act on both. The noise stage adds
none. An SNR refers to the target's echo as it arrives (`Frame.reference`).
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.checks import CheckedScene
from lowalt.effects.range_noise import RangeNoise
from lowalt.effects.receiver._white import range_noise, tones_with_noise, with_noise
from lowalt.effects.waveform import Frame

SOURCE = (
    "M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 6.2 (noise in all range cells); S. M. Kay, "
    "Fundamentals of Statistical Signal Processing II, 1998, 4.3 (matched-filter gain M of M subcarriers)"
)
DEFAULTS = {"snr_db": None}


def idle(settings: dict) -> bool:
    """Return True at an SNR of infinity."""
    return settings["snr_db"] == math.inf


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for two sources of noise."""
    if "receiver_noise" in scene.effects:
        raise InputError(
            "effects.cell_noise: effects.receiver_noise is named too, expected one of them: set SNRs or a link budget"
        )
    if settings["snr_db"] is not None and scene.snr_db != (math.inf,):
        raise InputError(
            f"effects.cell_noise: snr_db is {settings['snr_db']} and noise.snr_db {list(scene.snr_db)}, expected "
            "noise.snr_db [.inf] together with a number, or snr_db null for those of noise.snr_db"
        )


def noise(settings: dict, frame: Frame, rng: np.random.Generator) -> RangeNoise | None:
    """Return circular white Gaussian noise of all range cells, `snr_db` below the target's echo in each.

    None while snr_db is null: `received.Scene.at_snr` gives each of noise.snr_db in turn.
    """
    if settings["snr_db"] is None:
        return None
    return range_noise("cell_noise", math.sqrt(frame.reference * 10 ** (-settings["snr_db"] / 10) / 2), frame, rng)


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus those of `noise`.

    A range cell is the mean of M subcarriers and each of these the sum of M samples, so a sample has a cell's noise.
    """
    found = noise(settings, frame, rng)
    return samples if found is None else with_noise(samples, found, frame)


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    found = noise(settings, frame, rng)
    return tones if found is None else tones_with_noise(tones, found, frame)
