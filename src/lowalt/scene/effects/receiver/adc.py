"""Analogue-to-digital converter: a uniform mid-rise quantiser with clipping, on I and Q alike.

The gain is set once per look, by the look's root mean square. In a look whose level changes from
symbol to symbol the strongest symbols clip. A larger `backoff_db` removes the clipping, and every
dB of it costs 1 dB of the ratio of signal to quantisation error. With 8 bits:

| symbols of the look | `backoff_db` | signal over error |
|---|---|---|
| of equal power | 12 (default) | 41 dB |
| one in twenty 6 dB stronger | 12 (default) | 29 dB |
| one in twenty 6 dB stronger | 18 | 35 dB |
"""

import numpy as np

from lowalt.scene.waveform import Look

SOURCE = (
    "W. R. Bennett, Spectra of quantized signals, Bell Syst. Tech. J. 27(3), 1948; A. Gersho, R. "
    "M. Gray, Vector Quantization and Signal Compression, 1992, ch. 5 (mid-rise quantiser, "
    "overload)"
)
DEFAULTS = {"bits": 12, "backoff_db": 12.0}
IDLE = [{"bits": None}, {"bits": 0}]


def quantise(samples: np.ndarray, bits: int, full_scale: float) -> np.ndarray:
    """Return samples with I and Q at the middles of 2^bits steps of [-full_scale, full_scale].

    A component outside the range takes the middle of the outermost step. Source: Gersho and Gray 1992, ch. 5.
    """
    half_of_steps = 2.0 ** (bits - 1)
    # 2 full_scale / 2^bits.
    step = full_scale * 2.0 ** (1 - bits)
    components = np.ascontiguousarray(samples, np.complex128).view(np.float64)
    code = np.clip(np.floor(components / step), -half_of_steps, half_of_steps - 1)
    return ((code + 0.5) * step).view(np.complex128)


def full_scale_of(samples: np.ndarray, backoff_db: float) -> float:
    """Return the full scale of the converter, the largest level of I or Q that does not clip.

    It is the root mean square of I and Q over the look, raised by the back-off.
    """
    power = np.mean(samples.real**2 + samples.imag**2)
    return float(np.sqrt(power / 2)) * 10 ** (backoff_db / 20)


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the converter's output (N, M); the gain before it is set once for the whole look.

    A look of zeros stays zeros. Source: Bennett 1948; nothing is drawn.
    """
    full_scale = full_scale_of(samples, settings["backoff_db"])
    if full_scale == 0:
        return samples
    return quantise(samples, settings["bits"], full_scale)
