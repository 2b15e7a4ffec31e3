"""IQ imbalance: the two branches of a direct-conversion mixer differ, so every subcarrier gains its mirror's image."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.effects.waveform import Frame

SOURCE = (
    "T. Schenk, RF Imperfections in High-rate Wireless Systems: Impact and Digital Compensation, Springer 2008, ch. 5 "
    "(frequency-independent IQ mismatch)"
)
DEFAULTS = {"gain_db": 0.5, "phase_deg": 2.0}
DRAWS_NOTHING = NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return True where both branches are equal and in quadrature."""
    return settings["gain_db"] == 0 and settings["phase_deg"] == 0


def coefficients(settings: dict) -> tuple[complex, complex]:
    """Return mu and nu of r -> mu r + nu conj(r), for a Q branch of gain g that lags quadrature by phi.

    mu = (1 + g exp(-j phi)) / 2, nu = (1 - g exp(j phi)) / 2; the image rejection ratio is |mu|^2 / |nu|^2.
    """
    branch = 10 ** (settings["gain_db"] / 20) * np.exp(1j * np.radians(settings["phase_deg"]))
    return (1 + branch.conjugate()) / 2, (1 - branch) / 2


def amplifies(settings: dict) -> float:
    """Return the largest stretch of a sample, |mu| + |nu|."""
    mu, nu = coefficients(settings)
    return float(abs(mu) + abs(nu))


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return mu r + nu conj(r) of the samples r (N, M); the mirror is the oscillator's, at subcarrier M // 2.

    Source: Schenk 2008, ch. 5; nothing is drawn.
    """
    mu, nu = coefficients(settings)
    out = np.empty(samples.shape, np.complex128)
    _mixed(np.ascontiguousarray(samples, np.complex128).reshape(-1), complex(mu), complex(nu), out.reshape(-1))
    return out


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    mu, nu = coefficients(settings)
    _mirrored(tones, complex(mu), complex(nu))
    return tones


@LEAN
def _mirrored(tones, mu, nu):
    """Give tones (N, M) in the transform's order their mirrors about the oscillator: mu R[k] + nu conj(R[-k])."""
    count = tones.shape[1]
    for n in range(len(tones)):
        row = tones[n]
        row[0] = mu * row[0] + nu * complex(row[0].real, -row[0].imag)
        for k in range(1, count // 2 + 1):
            one, other = row[k], row[count - k]
            row[k] = mu * one + nu * complex(other.real, -other.imag)
            row[count - k] = mu * other + nu * complex(one.real, -one.imag)


@LEAN
def _mixed(samples, mu, nu, out):
    """Fill out (K,) with mu r + nu conj(r) of samples r (K,)."""
    a, b, c, d = mu.real, mu.imag, nu.real, nu.imag
    for i in range(np.uint64(len(out))):
        x, y = samples[i].real, samples[i].imag
        out[i] = complex((a + c) * x + (d - b) * y, (b + d) * x + (a - c) * y)
