"""Echoes of the ground: a patch of land in every range cell, still as a whole and stirred by the wind.

A cell's mean power follows from its area under both beams, with a reflectivity gamma sin(grazing angle). Its amplitude
is compound Gaussian: a texture, drawn once and correlated between neighbours, times speckle whose still part stays and
whose moving part has Billingsley's exponential Doppler spectrum. Each patch has range side lobes (`patches`). On a link
cells are of the range sum (`land_between`), and Doppler is that along the bisector.
"""

from functools import lru_cache

import numpy as np
from scipy.special import gamma, gammaincinv

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import radar
from lowalt.effects import transforms
from lowalt.effects.antenna import Element, gain, local_gain
from lowalt.effects.channel import clutter_loops, land_between, patches
from lowalt.effects.channel.windblown import parts, windblown
from lowalt.effects.checks import CheckedScene, above_ground
from lowalt.effects.view import View
from lowalt.motion.cross_section import mean_cross_section

SOURCE = (
    "constant-gamma land: Barton, Land clutter models for radar design and analysis, Proc. IEEE 73, 1985; amplitude "
    "laws: Ward, Tough & Watts, Sea Clutter, 2006, and Kanter, Stable densities under change of scale, Ann. Prob. 3, "
    "1975; texture from cell to cell: Tough & Ward, J. Phys. D 32, 1999, its correlation length: estimate; "
    "windblown clutter: Billingsley, Low-Angle Radar Land Clutter, 2002, chapter 6; on links: gamma "
    "(sin psi_1 sin psi_2)^(1/2), Willis, Bistatic Radar, 2nd ed. 1995, ch. 9, measured in the plane of both grazing "
    "rays; at other angles out of plane, and the spectrum narrowed by cos(beta / 2): estimates"
)
DEFAULTS = {
    "gamma": 0.03, "clutter_to_signal_db": None, "reach_m": 1000.0, "law": "weibull", "shape": 1.5, "wind_mps": 4.5,
    "correlation_m": 20.0,
}  # fmt: skip

OFFSET_CELLS = patches.OFFSET
"""How far all of this effect's echoes stand beyond the centres of their range cells."""


def idle(settings: dict) -> bool:
    """Return whether the land reflects nothing."""
    return settings["gamma"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in or below the ground, or an amplitude law without that shape."""
    above_ground("clutter", scene.network)
    if settings["law"] == "weibull" and not settings["shape"] <= 2:
        raise InputError(f"effects.clutter: shape is {settings['shape']} for law weibull, expected above 0 to 2")


def cell_power(
    settings: dict, network: Network, station: Station, aim_m: np.ndarray, element: Element | None = None
) -> np.ndarray:
    """Return the mean power (cells,) (W) of the land in the ring of every slant-range cell up to `reach_m`.

    Cells beyond the M unambiguous ones are included.

    element: the antenna elements' pattern, None for isotropic ones. The integral of G_T G_R sigma0 / r^4 over the
    cell's ring: Gauss-Legendre over its range, and over azimuth the trapezoidal rule, exact for the arrays'
    trigonometric patterns. Source: radar equation, sigma0 = gamma h / r.
    """
    radio = radar(network, station)
    height = float(station.position_m[2])
    psi0, omega0 = aim_cosines(np.asarray(aim_m, float), radio.station, radio.sine, radio.cosine)
    wide = network.transmit[0], network.receive[0]
    rings, r, across = _rings(height, settings["reach_m"], radio.cells, radio.kappa, wide, element)
    order = np.arange(len(across))
    around = (np.exp(-1j * np.pi * radio.kappa * psi0 * order) @ across).real.reshape(r.shape)
    around *= _pattern(radio.kappa * (-height / r - omega0), network.transmit[1], network.receive[1])
    return radio.scale**2 * settings["gamma"] * np.maximum((around * rings).sum(axis=1), 0.0)


@lru_cache(maxsize=8)
def _rings(
    height: float, reach_m: float, cells_per_m: float, kappa: float, wide: tuple[int, int], element: Element | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return weights and ranges (cells, 6) of the rings' nodes, and across (K, nodes) complex; none depends on the aim.

    Along its line the arrays' pattern is a trigonometric polynomial, sum over k of c_k exp(j pi k kappa (Psi - Psi0)):
    across holds its terms without Psi0, integrated over azimuth; negative k are the others' conjugates.
    """
    cells = int(np.ceil(reach_m * cells_per_m + 0.5 - patches.OFFSET))
    node, weight = np.polynomial.legendre.leggauss(6)
    edge = (np.arange(cells)[:, None] + [-0.5, 0.5] + patches.OFFSET) / cells_per_m
    low, high = np.clip(edge, height, reach_m).T
    r = 0.5 * (high + low)[:, None] + 0.5 * (high - low)[:, None] * node
    # The pattern is even in azimuth about the array's line, so half a circle holds all of it.
    turns = int(np.pi * kappa * sum(wide)) + 24
    azimuth = np.pi * (np.arange(turns) + 0.5) / turns
    level = np.sqrt(np.maximum(1.0 - (height / r.ravel()) ** 2, 0.0))
    step = np.exp(1j * np.pi * kappa * level[:, None] * np.cos(azimuth))
    term = np.full(step.shape, 2 * np.pi / turns, np.complex128)
    if element is not None:
        term *= _element_gain(element, height, r.ravel(), azimuth)
    one, other = (np.bartlett(2 * count + 1)[1:-1] * count for count in wide)
    factors = np.convolve(one, other)[sum(wide) - 2 :]
    across = np.empty((len(factors), r.size), np.complex128)
    for order, factor in enumerate(factors):
        across[order] = (1.0 if order == 0 else 2.0) * factor * term.sum(axis=1)
        term *= step
    return height * 0.5 * (high - low)[:, None] * weight / r**4, r, across


def _element_gain(element: Element, height: float, ranges: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Two-way element gain (ranges, azimuths) toward the land, mean of the front's and the back's, which share Psi."""
    r = ranges[:, None]
    flat = np.sqrt(np.maximum(r * r - height * height, 0.0))
    side, ahead = flat * np.cos(azimuth), flat * np.sin(azimuth)
    down = np.broadcast_to(-height, side.shape)
    return 0.5 * (local_gain(element, ahead, side, down) ** 2 + local_gain(element, -ahead, side, down) ** 2)


def _pattern(x: np.ndarray, transmit: int, receive: int) -> np.ndarray:
    """Squared product of both arrays' sums at direction cosines x (times kappa) off the beam.

    Unlike the compiled `terms.dirichlet`, it takes whole arrays; it drops the sums' signs, as only squares are needed.
    """
    with np.errstate(divide="ignore", invalid="ignore"):

        def one(count: int) -> np.ndarray:
            """Sum of `count` elements, sin(count v) / sin(v) with v = pi x / 2."""
            below = np.sin(0.5 * np.pi * x)
            return np.where(abs(below) < 1e-12, float(count), np.sin(0.5 * np.pi * count * x) / below)

        out = one(transmit)
        return (out * (out if receive == transmit else one(receive))) ** 2


def texture(law: str, shape: float, uniform: np.ndarray) -> np.ndarray:
    """Return positive textures (cells,) of mean 1 from uniforms (2, cells); sqrt(texture) times speckle has the law.

    rayleigh: 1; k: gamma variates of order `shape`; weibull: a Weibull power of shape c/2 is an exponential over a
    positive stable variate of index c/2 (Kanter 1975). Amplitudes, not powers, have the Weibull shape c.
    """
    if law == "rayleigh" or (law == "weibull" and shape == 2):
        return np.ones(uniform.shape[1])
    if law == "k":
        return gammaincinv(shape, uniform[0]) / shape
    index = 0.5 * shape
    angle, wait = np.pi * uniform[0], -np.log(uniform[1])
    kanter = np.sin(index * angle) ** index * np.sin((1 - index) * angle) ** (1 - index) / np.sin(angle)
    stable = (kanter ** (1 / (1 - index)) / wait) ** ((1 - index) / index)
    return 1.0 / (stable * gamma(1.0 + 1.0 / index))


def target_power(view: View) -> float:
    """Return the mean power (W) of the target in the middle of both beams, over aspects and motion."""
    radio, ends, shaped = radar(view.network, view.station), view.ends(), [1.0, 1.0]
    elements = float(np.prod(view.network.transmit) * np.prod(view.network.receive))
    ways_m = [float(np.linalg.norm(end.aim_m - np.asarray(end.station.position_m))) for end in ends]
    if view.element is not None:
        shaped = [float(gain(view.element, end.station, end.aim_m)) for end in ends]
    total = mean_cross_section(view.cloud, SPEED_OF_LIGHT / view.network.carrier_hz)
    if len(ends) == 1:
        return (radio.scale * elements * shaped[0]) ** 2 * total / ways_m[0] ** 4
    return (radio.scale * elements) ** 2 * shaped[0] * shaped[1] * total / (ways_m[0] * ways_m[1]) ** 2


def mean_power(settings: dict, view: View) -> np.ndarray:
    """Return the mean power (cells,) (W) of the land in every slant-range cell, at the level that settings ask for."""
    return _land(settings, view)[0]


def _land(settings: dict, view: View) -> tuple[np.ndarray, np.ndarray | None]:
    """Mean power (cells,) (W), and on a link how much each cell's Doppler is slowed."""
    slow = None
    if view.station.transmitter is None:
        power = cell_power(settings, view.network, view.station, view.aim_m, view.element)
    else:
        power, slow = land_between.cell_power(settings, view.network, view.station, view.aims_m, view.element)
    if settings["clutter_to_signal_db"] is None:
        return power, slow
    wanted = target_power(view) * 10 ** (settings["clutter_to_signal_db"] / 10)
    total = power.sum()
    return power * (wanted / total) if total > 0 else power, slow


def scatter(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the land's frequency response (N, M), independent from sample to sample and station to station."""
    network, station = view.network, view.station
    power, slow = _land(settings, view)
    frequency = radar(network, station).centre_hz
    correlation = np.exp(-network.cell_m / settings["correlation_m"]) if settings["correlation_m"] > 0 else 0.0
    uniform = patches.alike(1.0 - rng.random((2, len(power))), correlation)
    lit = np.sqrt(power * texture(settings["law"], settings["shape"], uniform))
    still, beta = windblown(settings["wind_mps"], frequency)
    constant, waves = parts(
        rng, len(power), len(view.times_s), network.symbol_interval_s, still, beta, SPEED_OF_LIGHT / frequency, slow
    )
    # Land beyond the unambiguous range folds into the cells it shares with nearer land.
    cells = np.zeros((len(view.times_s), network.subcarriers), np.complex128)
    clutter_loops.folded(lit, constant, waves, cells)
    transforms.forward(cells, out=cells)
    cells *= patches.ramp(network.subcarriers)
    return cells
