"""Light augmentation of slow-time signals: those changes of `augment` that a signal can undergo.

Of the settings, `mirror` turns all Doppler frequencies around and `shift_time` shifts cyclically in time; the others
are changes of images. Each station's signal is also turned by a random phase, which a target's range decides.
"""

import numpy as np


def augment_signals(signals: np.ndarray, block: dict, generator: np.random.Generator) -> np.ndarray:
    """Return changed copies of signals (samples, stations, symbols) complex64; equal generators give equal changes."""
    samples, stations, symbols = signals.shape
    draws = generator.random((samples, 2))
    phases = np.exp(2j * np.pi * generator.random((samples, stations, 1)))
    result = signals * phases.astype(np.complex64)
    for number, (mirror, shift) in enumerate(draws):
        if mirror < block["mirror"]:
            result[number] = result[number].conj()
        result[number] = np.roll(result[number], round((2 * shift - 1) * block["shift_time"] * symbols), axis=-1)
    return result
