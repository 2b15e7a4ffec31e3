"""Ground reflection: a second path by the flat, possibly rough plane z = 0 (two-ray model).

The station sees the image of every point below the ground, weighted by the complex Fresnel
coefficient. The direct and the reflected path, out and back, give four echoes, which the response
adds. Points are assumed to be above the ground.
"""

import numpy as np
from scipy.special import i0e

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.numerics import chebyshev_series, portable
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.fresnel import fresnel
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "Fresnel coefficients of a lossy half space: ITU-R P.527, and Balanis, Advanced Engineering "
    "Electromagnetics, section 5.3; medium dry ground: ITU-R P.2040-3, Table 3; rough surface: "
    "Miller, Brown & Vegh, New derivation for the rough-surface reflection coefficient and for the "
    "distribution of sea-wave elevations, IEE Proc. F 131, 1984"
)
DEFAULTS = {
    "permittivity": None,
    "conductivity_s_m": None,
    "roughness_m": 0.0,
    "polarisation": "vertical",
}
IDLE = [{"permittivity": 1, "conductivity_s_m": 0}]
WAVES = ("reflected by the ground",)
KNOWN_GHZ = (1.0, 10.0)
"""Carriers between which the properties of medium dry ground are known.

They stand for those not given.
"""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground.

    Raise it also at a carrier whose ground must be given.
    """
    above_ground("ground_reflection", scene.network)
    low, high = KNOWN_GHZ
    if None not in (settings["permittivity"], settings["conductivity_s_m"]):
        return
    for station in scene.network.stations:
        carrier_ghz = radar(scene.network, station).centre_hz / 1e9
        if not low <= carrier_ghz <= high:
            raise InputError(
                f"effects.ground_reflection: medium dry ground is known from {low:g} to {high:g} "
                f"GHz, station {station.name} sends at {carrier_ghz:.3g} GHz: expected "
                "permittivity and conductivity_s_m"
            )


def ground(settings: dict, frequency_hz: float) -> tuple[float, float]:
    """Return permittivity and conductivity (S/m) of the ground.

    They are those given, or else medium dry ground's at this frequency.

    Source: ITU-R P.2040-3, Table 3: 15 f^-0.1 and 0.035 f^1.63 S/m, f in GHz.
    """
    ghz = frequency_hz / 1e9
    permittivity = settings["permittivity"]
    if permittivity is None:
        permittivity = 15.0 * ghz**-0.1
    conductivity_s_m = settings["conductivity_s_m"]
    if conductivity_s_m is None:
        conductivity_s_m = 0.035 * ghz**1.63
    return permittivity, conductivity_s_m


def roughness(sine: np.ndarray, height_m: float, frequency_hz: float) -> np.ndarray:
    """Return the factor on the coherent reflection of a rough surface.

    height_m: standard deviation of its heights.

    exp(-x) I_0(x) with x = 2 (k sigma sin psi)^2; the rest of the power is scattered in other
    directions.
    Source: Miller et al. 1984.
    """
    return i0e(2.0 * (2 * np.pi * frequency_hz / SPEED_OF_LIGHT * height_m * sine) ** 2)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return the one further path: images (N, L, 3) m below the ground and coefficients (N, L).

    The coefficient at the middle of the station's band is used for the whole band.
    """
    frequency = radar(view.network, view.station).centre_hz
    station_m = np.asarray(view.station.position_m)
    mirror = np.array([1.0, 1.0, -1.0])
    images = view.places * mirror
    ray = images - station_m
    sine = np.clip(-ray[..., 2] / portable.norm(ray), 0.0, 1.0)

    def reflected(sine: np.ndarray) -> np.ndarray:
        """Coefficient of the rough ground at grazing angles of this sine."""
        smooth = fresnel(sine, *ground(settings, frequency), frequency, settings["polarisation"])
        return smooth * roughness(sine, settings["roughness_m"], frequency)

    coefficient = chebyshev_series.at(reflected, sine) * view.relative_gain(images)
    return [ImagePath(images, coefficient, station_m * mirror)]
