"""Phase noise of the oscillator.

One random phase that changes from symbol to symbol and within each symbol.

The slow part, a sum of spectral lines, rotates whole symbols: the common phase error, seen in
Doppler. The fast part, above SPLIT times the symbol rate, leaks between subcarriers. Its spectrum
varies little over a symbol rate, so symbols are independent, and the samples of a symbol are
Gaussian with the covariance of the fast part.
"""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy import fft
from scipy.linalg import toeplitz

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.chebyshev_series import chebyshev_points, interpolation
from lowalt.numerics.large_matrices import matrix_product, upper_root
from lowalt.scene.checks import CheckedScene
from lowalt.scene.laws.offsets import turned
from lowalt.scene.waveform import Look

SOURCE = (
    "IEEE Std 1139-2008 (L(f)); D. Petrovic, W. Rave, G. Fettweis, Effects of phase noise on OFDM "
    "systems with and without PLL, IEEE Trans. Commun. 55(8), 2007; M. C. Budge, M. P. Burt, Range "
    "correlation effects on phase and amplitude noise, IEEE Southeastcon 1993; default: 3GPP TR "
    "38.803, Table 6.1.10-1, scaled from 29.55 to 4.9 GHz by 20 log10; loop: F. M. Gardner, "
    "Phaselock Techniques, 3rd ed. 2005, ch. 6; reference: an oven-controlled crystal of -100, "
    "-130, -150 dBc/Hz at 1, 10, 100 Hz from 10 MHz, raised by 20 log10(490): estimate"
)
DEFAULTS = {
    "points": [
        [1.0, 13.4], [2.0, 6.0], [4.0, -3.5], [10.0, -16.6], [100.0, -49.6], [1e3, -82.3], [3e3, -95.3], [1e4, -103.0],
        [1e5, -112.5], [3e5, -116.2], [5.5e5, -116.6], [1.6e6, -114.2], [3e6, -116.3], [1e7, -124.6], [3e7, -133.7],
    ],
    "level_db": 0.0,
    "shared": True,
    "loop_hz": 100.0,
    "reference": [[1.0, -46.0], [10.0, -76.0], [100.0, -96.0]],
}  # fmt: skip
IDLE: list[dict] = [{"points": []}]
"""Settings with which the effect changes nothing.

Of DEFAULTS, points: offset (Hz) and L(f) (dBc/Hz) of the oscillator; reference: those of what its
loop follows up to loop_hz.
"""

SPLIT = 16
"""Offset between the slow and the fast part, in symbol rates."""
OCTAVE = 64
EVENLY = 12
"""Frequencies of the fast part per octave, and per subcarrier spacing above EVENLY spacings."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for offsets that do not rise.

    Raise it also for symbols too close together to tell slow from fast.
    """
    for key in ("points", "reference"):
        offsets = [offset for offset, _ in settings[key]]
        rising = all(earlier < later for earlier, later in pairwise(offsets))
        if not offsets or offsets[0] <= 0 or not rising:
            raise InputError(
                f"effects.phase_noise.{key}: offsets {offsets}, expected positive and rising (Hz)"
            )
    least_s = 4 * SPLIT / (scene.network.subcarriers * scene.network.symbol_rate_hz)
    if scene.network.symbol_interval_s < least_s:
        raise InputError(
            "effects.phase_noise: network.symbol_interval_s is "
            f"{scene.network.symbol_interval_s:g}, expected at least {4 * SPLIT} samples, "
            f"{least_s:g}"
        )


def density(settings: dict, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the two-sided spectral density of phase (rad^2/Hz) at offsets (Hz).

    It is that of the oscillator and its reference.

    L(f), half the one-sided density (IEEE Std 1139-2008), has straight lines between points in dB
    over log f and is flat beyond them. A second-order loop passes the reference's noise by 1 / (1 +
    (f / loop)^4) and the oscillator's own by 1 minus that (Gardner 2005); free-running (loop_hz 0),
    there is the oscillator's alone.
    """

    def level(points: list) -> np.ndarray:
        """The density of (offset Hz, dBc/Hz) pairs."""
        offset, decibels = np.array(points, float).T
        level_db = np.interp(portable.log(frequency_hz), portable.log(offset), decibels)
        return portable.from_decibels(level_db)

    oscillator = level(settings["points"]) * 10 ** (settings["level_db"] / 10)
    loop_hz = settings["loop_hz"]
    if not loop_hz:
        return oscillator
    follows = 1.0 / (1.0 + portable.power(frequency_hz / loop_hz, 4))
    return follows * level(settings["reference"]) + (1.0 - follows) * oscillator


def range_factor(
    frequency_hz: np.ndarray, width_hz: np.ndarray | float, delay_s: float
) -> np.ndarray:
    """Return the factor on the density of phi(t) - phi(t - delay).

    It is 4 sin^2(pi f delay), its mean over the widths.

    Source: Budge and Burt 1993 (range correlation).
    """
    half_turns = np.maximum(width_hz * delay_s, 1e-20)
    smooth = portable.sine_cosine_turns(0.5 * half_turns)[0] / (np.pi * half_turns)
    sine = portable.sine_cosine_turns(0.5 * frequency_hz * delay_s)[0]
    return 4.0 * sine * sine * smooth + 2.0 * (1.0 - smooth)


@lru_cache(maxsize=4)
def slow_grid(
    symbols: int, interval_s: float, useful_s: float, samples: int
) -> tuple[np.ndarray, ...]:
    """Return lines (J,) Hz, phasors (J, Q) of their turns at Q instants, and blend (Q, samples).

    The lines reach up to SPLIT / interval.

    The instants are Chebyshev nodes of a symbol's useful part, and the polynomial `blend` carries a
    phase from them to every sample, the fastest line's to 1e-6. Source: Trefethen, Approximation
    Theory and Practice, 2013, ch. 7, 8.
    """
    line_hz = np.arange(1, 2 * SPLIT * symbols + 1) / (2 * symbols * interval_s)
    degree = math.ceil(1.4 * np.pi * line_hz[-1] * useful_s) + 5
    node = chebyshev_points(degree + 1)
    at_samples = 2 * np.arange(samples) / samples - 1
    sine, cosine = portable.sine_cosine_turns(np.outer(line_hz, (node + 1) / 2 * useful_s))
    return line_hz, cosine + 1j * sine, interpolation(degree + 1, at_samples)


@lru_cache(maxsize=4)
def fast_grid(
    lowest_hz: float, spacing_hz: float, samples: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies and widths (K,) Hz, and the cosines (K, samples) at all lags.

    The frequencies reach up to half the sample rate.
    """
    half_hz = samples * spacing_hz / 2
    bend = min(max(EVENLY * spacing_hz, 2 * lowest_hz), half_hz)
    below = math.ceil(OCTAVE * math.log2(bend / lowest_hz))
    above = math.ceil(EVENLY * (half_hz - bend) / spacing_hz)
    by_octaves = portable.exp(np.linspace(math.log(lowest_hz), math.log(bend), below + 1)[:-1])
    evenly = np.linspace(bend, half_hz, above + 1)
    edge = np.concatenate([by_octaves, evenly])
    middle = (edge[1:] + edge[:-1]) / 2
    lag_s = np.arange(samples) / (samples * spacing_hz)
    return middle, np.diff(edge), portable.sine_cosine_turns(np.outer(middle, lag_s))[1]


def phase(settings: dict, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return the drawn phase (N, M) in rad at every sample's instant.

    shared: transmitter and receiver have one oscillator, so that phi(t) - phi(t - tau) is left,
    with the delay tau of the target's reference point; all echoes are taken to have it. On a link
    two oscillators add their noise.
    """
    network = look.network
    symbols = len(look.times_s)
    samples = network.subcarriers
    spacing = network.symbol_rate_hz
    interval_s = network.symbol_interval_s
    line_hz, turns, blend = slow_grid(symbols, interval_s, 1 / spacing, samples)
    frequency, width, cosines = fast_grid(SPLIT / interval_s, spacing, samples)
    slow_power = 2 * density(settings, line_hz) * line_hz[0]
    fast_power = 2 * density(settings, frequency) * width
    if look.station.transmitter is not None:
        slow_power = 2 * slow_power
        fast_power = 2 * fast_power
    elif settings["shared"]:
        slow_power = slow_power * range_factor(line_hz, line_hz[0], look.delay_s)
        fast_power = fast_power * range_factor(frequency, width, look.delay_s)
    lines = np.sqrt(slow_power) * rng.standard_normal((len(line_hz), 2)).view(np.complex128)[:, 0]
    # At the starts of symbols, lines 2 N apart have equal phases: each instant takes one transform
    # of 2 N lines.
    turned = lines[:, None] * turns
    folded = turned.reshape(-1, 2 * symbols, turns.shape[1]).sum(axis=0)
    at_nodes = fft.ifft(np.roll(folded, 1, axis=0), axis=0, norm="forward").real[:symbols]
    slow = matrix_product(at_nodes, blend)
    lags = matrix_product(fast_power[None], cosines)[0]
    # A floor far below any oscillator's noise keeps the matrix positive definite where the spectrum
    # has none.
    lags[0] += 1e-10 * lags[0] + 1e-30
    normals = rng.standard_normal((symbols, samples))
    return slow + matrix_product(normals, upper_root(toeplitz(lags)))


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (N, M) turned by exp(j phi(t)).

    phi has the spectrum `points` raised by `level_db`.

    Noise beyond half the sample rate is filtered out. Source: Petrovic et al. 2007.
    """
    return turned(samples, phase(settings, look, rng) / (2 * np.pi))
