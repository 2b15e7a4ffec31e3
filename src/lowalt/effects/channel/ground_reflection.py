"""A second path by the ground: the wave reflected by a flat, possibly rough plane z = 0 (two-ray model).

The station sees every point's image below the ground, by the Fresnel coefficient weaker and turned in phase. There and
back by either path gives four echoes; the response forms them. Points are taken to be above the ground.
"""

import numpy as np
from scipy.special import i0e

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.effects.checks import CheckedScene, above_ground
from lowalt.effects.response import ImagePath
from lowalt.effects.view import View

SOURCE = (
    "default: medium dry ground at 4.9 GHz, 15 f^-0.1 and 0.035 f^1.63 S/m with f in GHz, ITU-R P.2040-1, Table 3; "
    "Fresnel coefficients of a lossy half space: ITU-R P.527, and Balanis, Advanced Engineering Electromagnetics, "
    "section 5.3; rough surface: Miller, Brown & Vegh, New derivation for the rough-surface reflection coefficient "
    "and for the distribution of sea-wave elevations, IEE Proc. F 131, 1984"
)
DEFAULTS = {"permittivity": 12.8, "conductivity_s_m": 0.47, "roughness_m": 0.0, "polarisation": "vertical"}

VACUUM_F_M = 8.8541878128e-12
"""Permittivity of the vacuum (F/m), CODATA 2018."""


def idle(settings: dict) -> bool:
    """Return whether the ground has the air's permittivity and no conductivity, and so reflects nothing."""
    return settings["permittivity"] == 1 and settings["conductivity_s_m"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground, or properties that no material has."""
    above_ground("ground_reflection", scene.network)
    for key, low in (("permittivity", 1), ("conductivity_s_m", 0), ("roughness_m", 0)):
        if not low <= settings[key] < np.inf:
            raise InputError(f"effects.ground_reflection: {key} is {settings[key]}, expected at least {low}")
    if settings["polarisation"] not in ("vertical", "horizontal"):
        raise InputError(
            f"effects.ground_reflection: polarisation is {settings['polarisation']!r}, expected vertical or horizontal"
        )


def fresnel(
    sine: np.ndarray, permittivity: float, conductivity_s_m: float, frequency_hz: float, polarisation: str
) -> np.ndarray:
    """Return the complex reflection coefficient at grazing angles of `sine` (any shape, 0 to 1).

    Fields go as exp(+j 2 pi f t), so a wave's phase is exp(-j 2 pi f r / c) and the complex permittivity
    eps - j sigma / (2 pi f eps0). Vertical polarisation counts the field's vertical component, and is -1 at grazing.
    """
    epsilon = permittivity - 1j * conductivity_s_m / (2 * np.pi * frequency_hz * VACUUM_F_M)
    inside = np.sqrt(epsilon - 1.0 + sine * sine)
    outside = sine * (epsilon if polarisation == "vertical" else 1.0)
    return (outside - inside) / (outside + inside)


def roughness(sine: np.ndarray, height_m: float, frequency_hz: float) -> np.ndarray:
    """Return the factor on the coherent reflection of a surface with heights of standard deviation `height_m`.

    exp(-x) I_0(x) with x = 2 (k sigma sin psi)^2; the rest of the power is scattered in other directions.
    Source: Miller et al. 1984.
    """
    return i0e(2.0 * (2 * np.pi * frequency_hz / SPEED_OF_LIGHT * height_m * sine) ** 2)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return the one further path: images (N, L, 3) m and coefficients (N, L)."""
    images = view.places * [1.0, 1.0, -1.0]
    away = images - np.asarray(view.station.position_m)
    sine = -away[..., 2] / np.sqrt(np.einsum("nli,nli->nl", away, away))
    # The middle of the station's band stands for all of it.
    frequency = radar(view.network, view.station).centre_hz
    ground = settings["permittivity"], settings["conductivity_s_m"], frequency, settings["polarisation"]
    coefficient = fresnel(np.clip(sine, 0.0, 1.0), *ground)
    if settings["roughness_m"] > 0:
        coefficient *= roughness(sine, settings["roughness_m"], frequency)
    return [ImagePath(images, coefficient * view.relative_gain(images))]
