"""A second path by the ground: the wave reflected by a flat, possibly rough plane z = 0 (two-ray model).

The station sees every point's image below the ground, weighted with the complex Fresnel coefficient. There and
back by either path gives four echoes; the response forms them. Points are taken to be above the ground.
"""

import numpy as np
from scipy.special import i0e

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.scene import series
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.fresnel import fresnel
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "materials: ITU-R P.2040-3, Table 3, permittivity a f^b and conductivity c f^d S/m with f in GHz, each within its "
    "range of frequencies; "
    "Fresnel coefficients of a lossy half space: ITU-R P.527, and Balanis, Advanced Engineering Electromagnetics, "
    "section 5.3; rough surface: Miller, Brown & Vegh, New derivation for the rough-surface reflection coefficient "
    "and for the distribution of sea-wave elevations, IEE Proc. F 131, 1984"
)
DEFAULTS = {
    "material": "medium_dry_ground", "permittivity": None, "conductivity_s_m": None, "roughness_m": 0.0,
    "polarisation": "vertical",
}  # fmt: skip

MATERIALS = {
    "very_dry_ground": (3.0, 0.0, 0.00015, 2.52, 1.0, 10.0),
    "medium_dry_ground": (15.0, -0.1, 0.035, 1.63, 1.0, 10.0),
    "wet_ground": (30.0, -0.4, 0.15, 1.30, 1.0, 10.0),
    "concrete": (5.24, 0.0, 0.0462, 0.7822, 1.0, 100.0),
}
"""Each material's a, b, c and d, and the lowest and highest frequency (GHz) for which they hold."""


def idle(settings: dict) -> bool:
    """Return whether the ground has the air's permittivity and no conductivity, and so reflects nothing."""
    return settings["permittivity"] == 1 and settings["conductivity_s_m"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground, or properties that no material has."""
    above_ground("ground_reflection", scene.network)
    _, _, _, _, lowest, highest = MATERIALS[settings["material"]]
    given = {key: value for key, value in settings.items() if key in ("permittivity", "conductivity_s_m")}
    for station in scene.network.stations:
        frequency = radar(scene.network, station).centre_hz / 1e9
        if None in given.values() and not lowest <= frequency <= highest:
            raise InputError(
                f"effects.ground_reflection: material {settings['material']} is known from {lowest:g} to {highest:g} "
                f"GHz, station {station.name} sends at {frequency:.3g} GHz: expected permittivity and conductivity_s_m"
            )
    for key, low in (("permittivity", 1), ("conductivity_s_m", 0), ("roughness_m", 0)):
        if settings[key] is None:
            continue
        if not low <= settings[key] < np.inf:
            raise InputError(f"effects.ground_reflection: {key} is {settings[key]}, expected at least {low}")
    if settings["polarisation"] not in ("vertical", "horizontal"):
        raise InputError(
            f"effects.ground_reflection: polarisation is {settings['polarisation']!r}, expected vertical or horizontal"
        )


def ground(settings: dict, frequency_hz: float) -> tuple[float, float]:
    """Return permittivity and conductivity (S/m) of the ground: those given, or the material's at this frequency."""
    a, b, c, d, _, _ = MATERIALS[settings["material"]]
    given, frequency = (settings["permittivity"], settings["conductivity_s_m"]), frequency_hz / 1e9
    found = (a * frequency**b, c * frequency**d)
    return tuple(one if value is None else value for value, one in zip(given, found, strict=True))


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
        smooth = fresnel(sine, *ground(settings, frequency), frequency, settings["polarisation"])
        return smooth * roughness(sine, settings["roughness_m"], frequency)

    coefficient = series.at(reflected, sine) * view.relative_gain(images)
    return [ImagePath(images, coefficient, station_m * mirror)]
