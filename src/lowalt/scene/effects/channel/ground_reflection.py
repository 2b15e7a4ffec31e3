"""A second path by the ground: the wave reflected by a flat, possibly rough plane z = 0 (two-ray model).

The station sees every point's image below the ground, weighted with the complex Fresnel coefficient. There and
back by either path gives four echoes; the response forms them. Points are taken to be above the ground.
"""

import numpy as np
from scipy.special import i0e

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.scene import series
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.fresnel import fresnel
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "Fresnel coefficients of a lossy half space: ITU-R P.527, and Balanis, Advanced Engineering Electromagnetics, "
    "section 5.3; medium dry ground at 4.9 GHz: ITU-R P.2040-3, Table 3; rough surface: Miller, Brown & Vegh, New "
    "derivation for the rough-surface reflection coefficient and for the distribution of sea-wave elevations, IEE "
    "Proc. F 131, 1984"
)
DEFAULTS = {"permittivity": 12.8, "conductivity_s_m": 0.467, "roughness_m": 0.0, "polarisation": "vertical"}


def idle(settings: dict) -> bool:
    """Return whether the ground has the air's permittivity and no conductivity, and so reflects nothing."""
    return settings["permittivity"] == 1 and settings["conductivity_s_m"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground."""
    above_ground("ground_reflection", scene.network)


def roughness(sine: np.ndarray, height_m: float, frequency_hz: float) -> np.ndarray:
    """Return the factor on the coherent reflection of a surface with heights of standard deviation `height_m`.

    exp(-x) I_0(x) with x = 2 (k sigma sin psi)^2; the rest of the power is scattered in other directions.
    Source: Miller et al. 1984.
    """
    return i0e(2.0 * (2 * np.pi * frequency_hz / SPEED_OF_LIGHT * height_m * sine) ** 2)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return the one further path: images (N, L, 3) m below the ground and coefficients (N, L).

    The coefficient at the middle of the station's band is used for the whole band.
    """
    frequency = radar(view.network, view.station).centre_hz
    station_m, mirror = np.asarray(view.station.position_m), np.array([1.0, 1.0, -1.0])
    images = view.places * mirror
    ray = images - station_m
    sine = np.clip(-ray[..., 2] / np.sqrt(np.einsum("nli,nli->nl", ray, ray)), 0.0, 1.0)

    def reflected(sine: np.ndarray) -> np.ndarray:
        """Coefficient of the rough ground at grazing angles of this sine."""
        material = settings["permittivity"], settings["conductivity_s_m"], frequency, settings["polarisation"]
        return fresnel(sine, *material) * roughness(sine, settings["roughness_m"], frequency)

    coefficient = series.at(reflected, sine) * view.relative_gain(images)
    return [ImagePath(images, coefficient, station_m * mirror)]
