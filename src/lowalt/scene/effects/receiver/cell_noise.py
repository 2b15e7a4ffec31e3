"""White noise in all range cells at set SNRs.

It is added before range compression: the strongest cell may be a wrong one.

The paper's SNRs say how far the noise is below the target in its range cell, which is then known.
Here the same SNR holds in that cell, the other cells have as much noise, and cancellers and
detectors act on both. The noise stage adds none. An SNR refers to the target's echo as it arrives
(`Look.reference`).
"""

import math

import numpy as np

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.set_noise import white
from lowalt.scene.waveform import Look

SOURCE = (
    "M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 6.2 (noise in all "
    "range cells); S. M. Kay, Fundamentals of Statistical Signal Processing II, 1998, 4.3 "
    "(matched-filter gain M of M subcarriers)"
)
DEFAULTS = {"snr_db": None}
IDLE = [{"snr_db": math.inf}]
SET_SNR = "snr_db"


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for two sources of noise."""
    if others := scene.offering("noise_w"):
        raise InputError(
            f"effects.cell_noise: effects.{others[0]} is named too, expected one of them: set SNRs "
            "or a link budget"
        )
    if settings["snr_db"] is not None and scene.snr_db != (math.inf,):
        raise InputError(
            f"effects.cell_noise: snr_db is {settings['snr_db']} and noise.snr_db "
            f"{list(scene.snr_db)}, expected noise.snr_db [.inf] together with a number, or snr_db "
            "null for those of noise.snr_db"
        )


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (N, M) plus circular white Gaussian noise, the same in each range cell.

    Its power in a cell is `snr_db` below that of the target's echo.

    A range cell is the mean of M subcarriers and each of these the sum of M samples, so a sample
    has a cell's noise. Nothing is added while snr_db is null: the scene gives each of noise.snr_db
    in turn.
    """
    if settings["snr_db"] is None:
        return samples
    power = look.reference * 10 ** (-settings["snr_db"] / 10)
    return samples + white(rng, power, samples.shape)
