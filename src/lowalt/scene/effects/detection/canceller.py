"""Canceller of the land's echoes on range cells, over the symbols of a look.

`mean` and `pulse` cancel what stands still; land that the wind moves passes them. `clutter` is made
for the spectrum of windblown land at one carrier and symbol interval: of the covariance that land
has over the symbols, it removes every component that lies less than `depth_db` below the land's
power, and leaves all else as it is. What it costs a target follows from the target's radial speed
alone. `pulse` and `clutter` are scaled to unit noise gain, so that a set SNR means the same before
and behind them. `mean` is not scaled: of N symbols it takes one part in N of the noise's power,
0.01 dB of 400.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.linalg import toeplitz

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.large_matrices import matrix_product, principal_axes
from lowalt.scene.checks import CheckedScene
from lowalt.scene.effects import with_offer
from lowalt.scene.laws.markov import root_of
from lowalt.scene.laws.windblown import windblown

SOURCE = (
    "M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 5.2 (pulse cancellers, "
    "their response and noise gain); A. M. Haimovich, Y. Bar-Ness, An eigenanalysis interference "
    "canceler, IEEE Trans. Signal Process. 39(1), 1991 (clutter); its covariance: Billingsley, "
    "Low-Angle Radar Land Clutter, 2002, chapter 6; depth: estimate"
)
DEFAULTS = {
    "kind": "mean",
    "order": 1,
    "wind_mps": 4.5,
    "depth_db": 50.0,
    "carrier_hz": 4.9e9,
    "symbol_interval_s": 2.5e-3,
}
IDLE = [{"kind": "none"}, {"kind": "pulse", "order": 0}]
KINDS = {
    "none": {"kind": "none"},
    "mean": {"kind": "mean"},
    "pulse, order 1": {"kind": "pulse", "order": 1},
    "pulse, order 2": {"kind": "pulse", "order": 2},
    "clutter": {"kind": "clutter"},
}


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError where nothing stands still, or `clutter` does not fit the symbols.

    Symbols may be missing, or be those of another radar.
    """
    if not scene.offering("STILL"):
        raise InputError(
            "effects.canceller: there is no clutter to cancel, expected an effect in the same "
            f"scene whose echoes stand still: {with_offer('STILL')}"
        )
    if settings["kind"] != "clutter":
        return
    if leaving := scene.saying("gaps"):
        raise InputError(
            f"effects.canceller.kind: 'clutter' needs all symbols, and effects.{leaving[0]} leaves "
            "gaps, expected mean or pulse"
        )
    for key in ("carrier_hz", "symbol_interval_s"):
        if settings[key] != getattr(scene.network, key):
            raise InputError(
                f"effects.canceller.{key}: {settings[key]:g}, expected the network's "
                f"{getattr(scene.network, key):g}, for which kind 'clutter' is made"
            )


def filtered(settings: dict, cells: np.ndarray) -> np.ndarray:
    """Return range cells (N, M) without the echoes of land.

    mean: subtracts the look's mean. pulse: `order` first differences over symbols, which start as
    if the first symbol had lasted forever, so that clutter leaves no transient. clutter: projects
    on what `land` leaves.
    Source: Richards 2014, 5.2; Haimovich and Bar-Ness 1991.
    """
    if settings["kind"] == "mean":
        # Without the first symbol before the mean, an echo that stands still cancels to the last
        # bit.
        moved = cells - cells[0]
        return moved - moved.mean(axis=0)
    if settings["kind"] == "pulse":
        for _ in range(settings["order"]):
            cells = np.diff(cells, axis=0, prepend=cells[:1])
        # The noise gain of k differences is the sum of squared binomials, C(2k, k).
        return cells / math.sqrt(math.comb(2 * settings["order"], settings["order"]))
    radar = settings["carrier_hz"], settings["symbol_interval_s"]
    basis = land(len(cells), *radar, settings["wind_mps"], settings["depth_db"])
    parts = np.ascontiguousarray(cells, np.complex128).view(np.float64)
    left = (parts - matrix_product(basis, matrix_product(basis.T, parts))).view(np.complex128)
    return left * math.sqrt(len(cells) / max(len(cells) - basis.shape[1], 1))


@lru_cache(maxsize=8)
def land(
    symbols: int, carrier_hz: float, interval_s: float, wind_mps: float, depth_db: float
) -> np.ndarray:
    """Return the components (N, K) of windblown land's echoes over N symbols.

    They are those that lie above the land's power less `depth_db`.

    They are orthonormal: the constant, in which all that stands still lies however loud it is, and
    the eigenvectors of the moving part's covariance beside it. The exponential Doppler spectrum of
    slope beta has the covariance 1 / (1 + (4 pi t / (beta lambda))^2) at a lag t.
    """
    constant = np.full((symbols, 1), symbols**-0.5)
    still, beta = windblown(wind_mps, carrier_hz)
    if not np.isfinite(still):
        return constant
    decay_s = beta * SPEED_OF_LIGHT / carrier_hz / (4 * np.pi)
    lag_s = interval_s * np.arange(symbols)
    moving = toeplitz(1 / (1 + (lag_s / decay_s) ** 2)) / (1 + still)
    beside = moving - portable.mean(moving, axis=0)
    covariance = beside - portable.mean(beside)[:, None]
    root = root_of(covariance)
    # Rounding would leave a little of the constant in faint axes, and what stands still may be
    # loud.
    power, basis = principal_axes(root - portable.mean(root, axis=0))
    return np.hstack([constant, basis[:, power > 10 ** (-depth_db / 10)]])
