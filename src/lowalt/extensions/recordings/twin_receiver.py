"""A cheap continuous-wave receiver: wander, leak, noise, flicker, hum, high pass and clipping, a
setting each.

Everything is relative to the echo's own mean power over the stretch, behind the high pass, so that
a setting means the same near and far.
The order is that of the parts: antenna and mixer (wander, leak), noise of the mixer, hum that the
amplifier picks up, the amplifier's coupling capacitors (high pass), its supply rails (clipping),
its gain control, the converter.
"""

from dataclasses import MISSING, dataclass, fields
from functools import lru_cache

import numpy as np
from scipy.signal import butter, lfilter, sosfilt

from lowalt.config.command import pick
from lowalt.noise.awgn import add_noise
from lowalt.numerics.portable import rms


@dataclass(frozen=True)
class Receiver:
    """snr_db: echo over white noise within the receiver's band; flicker_db and flicker_hz: slow
    noise with a 1/f^2 spectrum above its corner, over the white noise's density at the corner;
    wander_db: rms of a slow change of the amplitude; leak_db: a constant, over the echo; hum_db and
    hum_hz: a line, over the echo.

    May be left out: hum_lines, how many harmonics the line has, each 1 / number as strong;
    highpass_hz, corner of a Butterworth high pass, 0 Hz for none; clip_rms, the largest amplitude
    over the rms of all samples, 0 for no limit; flicker_slope, exponent of the slow noise's fall;
    gain_control, the share in decibels by which an automatic gain makes strong and weak stretches
    alike, and gain_s, over which time it measures; bits, of the converter at full scale, 0 for
    none.
    """

    snr_db: float
    flicker_db: float
    flicker_hz: float
    wander_db: float
    leak_db: float
    hum_db: float
    hum_hz: float
    hum_lines: float = 1.0
    highpass_hz: float = 0.0
    clip_rms: float = 0.0
    flicker_slope: float = 2.0
    gain_control: float = 0.0
    gain_s: float = 0.1
    bits: float = 0.0

    @classmethod
    def from_settings(cls, block: dict) -> "Receiver":
        """Build from a block with the fields' names.

        Raises: InputError naming a missing or unknown key.
        """
        defaults = {
            field.name: field.default for field in fields(cls) if field.default is not MISSING
        }
        return cls(*map(float, pick(defaults | block, *(field.name for field in fields(cls)))))


ORDER = 2
"""Order of the high pass: two coupling capacitors."""


def shaped(
    count: int, rate_hz: float, corner_hz: float, rng: np.random.Generator, slope: float = 2.0
) -> np.ndarray:
    """Return complex Gaussian noise (count,) whose density falls as 1 / (1 + (f / corner)^slope)
    from unity at f = 0.

    Unity is the density of white noise of unit power.
    """
    white = rng.standard_normal((2, count))
    frequency = np.fft.fftfreq(count, 1 / rate_hz)
    spectrum = np.fft.fft(white[0] + 1j * white[1]) * np.sqrt(
        0.5 / (1 + np.abs(frequency / corner_hz) ** slope)
    )
    return np.fft.ifft(spectrum)


def received(
    echo: np.ndarray,
    rate_hz: float,
    settings: Receiver,
    real: bool,
    rng: np.random.Generator,
    target: bool = True,
) -> np.ndarray:
    """Return the receiver's samples (N,) of a complex echo (N,): float64 where the channel is real,
    else complex128.

    target: False leaves the echo out; everything else stays as with the echo, except clipping.
    """
    count = len(echo)
    # The coupling capacitors suppress the echo of a slow target, so its power is measured behind
    # them.
    power = rms(highpassed(echo, rate_hz, settings.highpass_hz)) ** 2
    slow = shaped(count, rate_hz, 0.5, rng).real
    spread = slow.std() or 1.0
    result = (echo if target else 0 * echo) * 10 ** (settings.wander_db / 20 * slow / spread)
    level = np.sqrt(power) * 10 ** (-settings.snr_db / 20)
    slow_noise = shaped(count, rate_hz, settings.flicker_hz, rng, settings.flicker_slope)
    flicker = 10 ** (settings.flicker_db / 20) * level * slow_noise
    angle = rng.uniform(0, 2 * np.pi, 2)
    static = np.sqrt(power) * 10 ** (settings.leak_db / 20) * np.exp(1j * angle[0])
    time = np.arange(count) / rate_hz
    hum = sum(
        np.cos(number * (2 * np.pi * settings.hum_hz * time + angle[1])) / number
        for number in range(1, round(settings.hum_lines) + 1)
    )
    hum = np.sqrt(power) * 10 ** (settings.hum_db / 20) * hum
    result = add_noise(result, settings.snr_db, rng, power) + flicker + static + hum
    result = result.real if real else result
    result = clipped(highpassed(result, rate_hz, settings.highpass_hz), settings.clip_rms)
    return quantised(
        controlled(result, rate_hz, settings.gain_control, settings.gain_s), round(settings.bits)
    )


def controlled(values: np.ndarray, rate_hz: float, share: float, time_s: float) -> np.ndarray:
    """Return samples (N,) behind an automatic gain that takes `share` of the decibels by which
    their level, a running mean of the power over about `time_s`, differs from its median; share 0
    for a constant gain."""
    if not share:
        return values
    kept = np.exp(-1 / (time_s * rate_hz))
    power = lfilter([1 - kept], [1, -kept], np.abs(values) ** 2, zi=[kept * rms(values) ** 2])[0]
    return values * (power / np.median(power)) ** (-share / 2)


def quantised(values: np.ndarray, bits: int) -> np.ndarray:
    """Return samples (N,) as a converter of `bits` gives them whose full scale is their largest
    component; 0 for no converter."""
    if not bits:
        return values
    components = np.stack([values.real, values.imag]) if np.iscomplexobj(values) else values[None]
    step = np.abs(components).max() / 2 ** (bits - 1)
    steps = np.rint(components / step) * step
    return steps[0] + 1j * steps[1] if np.iscomplexobj(values) else steps[0]


def highpassed(values: np.ndarray, rate_hz: float, corner_hz: float) -> np.ndarray:
    """Return samples (N,) behind a Butterworth high pass of order 2, 0 Hz for none.

    Audio amplifiers and sound cards with coupling capacitors have one (Horowitz and Hill 2015,
    section 1.7). In the recordings at 24 GHz it lies below 12 Hz (0.08 m/s), where it shows at all.
    """
    if not corner_hz:
        return values
    # Subtract the first value, so that a constant part causes no transient at the start.
    return sosfilt(_high_pass(corner_hz, rate_hz), values - values[0])


@lru_cache(maxsize=8)
def _high_pass(corner_hz: float, rate_hz: float) -> np.ndarray:
    """Sections (1, 6) of the high pass. A receiver uses its own several times, and a design takes
    longer than its use.
    """
    return butter(ORDER, corner_hz, "highpass", fs=rate_hz, output="sos")


def clipped(values: np.ndarray, limit_rms: float) -> np.ndarray:
    """Return samples (N,) with each component limited to `limit_rms` times the rms of all samples;
    0 for no limit.
    """
    if not limit_rms:
        return values
    limit = limit_rms * rms(values)
    if np.iscomplexobj(values):
        return np.clip(values.real, -limit, limit) + 1j * np.clip(values.imag, -limit, limit)
    return np.clip(values, -limit, limit)
