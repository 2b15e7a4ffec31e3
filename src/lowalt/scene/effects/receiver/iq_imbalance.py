"""IQ imbalance: the two branches of a direct-conversion mixer differ.

Every subcarrier gains its mirror's image.
"""

import numpy as np

from lowalt.scene.waveform import Look

SOURCE = (
    "T. Schenk, RF Imperfections in High-rate Wireless Systems: Impact and Digital Compensation, "
    "Springer 2008, ch. 5 (frequency-independent IQ mismatch)"
)
DEFAULTS = {"gain_db": 0.5, "phase_deg": 2.0}
IDLE = [{"gain_db": 0, "phase_deg": 0}]


def coefficients(settings: dict) -> tuple[complex, complex]:
    """Return mu and nu of r -> mu r + nu conj(r).

    They are those of a Q branch of gain g that lags quadrature by phi.

    mu = (1 + g exp(-j phi)) / 2, nu = (1 - g exp(j phi)) / 2; the image rejection ratio is |mu|^2 /
    |nu|^2.
    """
    branch = 10 ** (settings["gain_db"] / 20) * np.exp(1j * np.radians(settings["phase_deg"]))
    return (1 + branch.conjugate()) / 2, (1 - branch) / 2


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return mu r + nu conj(r) of the samples r (N, M).

    The mirror is the oscillator's, at subcarrier M // 2.

    Source: Schenk 2008, ch. 5; nothing is drawn.
    """
    mu, nu = coefficients(settings)
    return mu * samples + nu * samples.conj()
