"""Clutter: the echo of a patch of land in every range cell, part of which the wind moves.

The mean power of a cell follows from its area under both beams and a reflectivity of gamma
sin(grazing angle) (`land`). The amplitude is compound Gaussian, texture times speckle. The texture
is drawn once and correlated between neighbouring cells. The speckle has a constant part and a
moving part with Billingsley's exponential Doppler spectrum (`windblown`). On a link, range cells
are those of the range sum, and the Doppler frequency is that along the bisector.
"""

import math

import numpy as np
from scipy import fft
from scipy.special import gamma, gammaincinv, ndtr, ndtri

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene import land
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.laws.windblown import speckle, windblown
from lowalt.scene.view import Still, View

SOURCE = (
    "constant-gamma land: Barton, Land clutter models for radar design and analysis, Proc. IEEE "
    "73, 1985; amplitude laws: Ward, Tough & Watts, Sea Clutter, 2006, and Kanter, Stable "
    "densities under change of scale, Ann. Prob. 3, 1975; texture from cell to cell: Tough & Ward, "
    "J. Phys. D 32, 1999, its correlation length: estimate; windblown clutter: Billingsley, "
    "Low-Angle Radar Land Clutter, 2002, chapter 6; on links: gamma (sin psi_1 sin psi_2)^(1/2), "
    "Willis, Bistatic Radar, 2nd ed. 1995, ch. 9, measured in the plane of both grazing rays; at "
    "other angles out of plane, and the spectrum narrowed by cos(beta / 2): estimates"
)
DEFAULTS = {
    "gamma": 0.03,
    "reach_m": 1000.0,
    "law": "weibull",
    "shape": 1.5,
    "wind_mps": 4.5,
    "correlation_m": 20.0,
}
IDLE = [{"gamma": 0}]
UNMODELLED = ("cw",)
STILL = True


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground.

    Raise it also for an amplitude law without that shape.
    """
    above_ground("clutter", scene.network)
    if settings["law"] == "weibull" and not settings["shape"] <= 2:
        raise InputError(
            f"effects.clutter: shape is {settings['shape']} for law weibull, expected above 0 to 2"
        )


def alike(uniform: np.ndarray, correlation: float) -> np.ndarray:
    """Return uniforms (2, cells) whose normal scores are correlated between cells.

    Their correlation at a lag is `correlation`^lag.

    Each stays uniform, so textures made from them keep their distribution. Source: memoryless
    non-linear transform, Tough & Ward, The correlation properties of gamma and other non-Gaussian
    processes, J. Phys. D 32, 1999.
    """
    if correlation == 0:
        return uniform
    score = ndtri(uniform)
    score[:, 1:] *= np.sqrt(1 - correlation**2)
    # `scipy.signal.lfilter` gives the same bytes, but its import takes as long as all other imports
    # of a scene together.
    for cell in range(1, score.shape[1]):
        score[:, cell] += correlation * score[:, cell - 1]
    return ndtr(score)


def texture(law: str, shape: float, uniform: np.ndarray) -> np.ndarray:
    """Return textures (cells,) of mean 1 from uniforms (2, cells).

    The root of the texture times speckle has the law.

    rayleigh: 1; k: gamma variates of order `shape`; weibull: a Weibull power of shape c/2 is an
    exponential over a positive stable variate of index c/2 (Kanter 1975). Amplitudes, not powers,
    have the Weibull shape c.
    """
    if law == "rayleigh" or (law == "weibull" and shape == 2):
        return np.ones(uniform.shape[1])
    if law == "k":
        return gammaincinv(shape, uniform[0]) / shape
    index = 0.5 * shape
    angle = np.pi * uniform[0]
    wait = -portable.log(uniform[1])
    first = portable.power(portable.sin(index * angle), index)
    second = portable.power(portable.sin((1 - index) * angle), 1 - index)
    kanter = first * second / portable.sin(angle)
    stable = portable.power(portable.power(kanter, 1 / (1 - index)) / wait, (1 - index) / index)
    return 1.0 / (stable * gamma(1.0 + 1.0 / index))


def mean_power(settings: dict, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean power (cells,) W of the land in each slant-range cell.

    The factor on its Doppler comes second.
    """
    aims_m = np.stack([view.aim_of(view.station.transmitter or view.station), view.aim_m])
    return land.cell_power(settings, view.network, view.station, aims_m, view.element)


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the mean power (W) of the land in all range cells, and in that of the target.

    Side lobes are included.
    """
    power = mean_power(settings, view)[0]
    network = view.network
    cell = round(float(view.ways_m(view.origin_m)) / (2 * network.cell_m)) % network.subcarriers
    there = land.with_side_lobes(power, network.subcarriers)[cell]
    return [
        ("land, all range cells", float(power.sum()), "W"),
        ("land, the target's range cell", float(there), "W"),
    ]


def scatter(settings: dict, view: View, rng: np.random.Generator) -> Still:
    """Return the echoes of the land; samples and stations have independent draws."""
    network = view.network
    frequency = radar(network, view.station).centre_hz
    power, slow = mean_power(settings, view)
    correlation = 0.0
    if settings["correlation_m"] > 0:
        correlation = math.exp(-network.cell_m / settings["correlation_m"])
    uniform = alike(1.0 - rng.random((2, len(power))), correlation)
    lit = np.sqrt(power * texture(settings["law"], settings["shape"], uniform))
    waves = speckle(
        rng,
        len(power),
        len(view.times_s),
        network.symbol_interval_s,
        windblown(settings["wind_mps"], frequency),
        SPEED_OF_LIGHT / frequency,
        slow if view.station.transmitter else 1.0,
    )
    cells = land.folded(lit[:, None] * waves, network.subcarriers)
    response = fft.fft(cells, axis=0, overwrite_x=True).T * land.ramp(network.subcarriers)
    return Still(response, land.OFFSET)
