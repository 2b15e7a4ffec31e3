"""Echoes of the surroundings: the background channel of 3GPP for a monostatic station.

Three reference points stand around the station, 120 degrees apart. Each has a link without line of
sight to the station, which sends and receives the rays of the link in the same directions. Nothing
moves, so a canceller removes these echoes. Without one they hide targets, because the clause counts
the path loss one way. Indoor scenes, links, spatial consistency and blockage are left out.
"""

import numpy as np
from scipy.special import gammaincinv

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.echo.radar import radar
from lowalt.numerics.portable import sine_cosine
from lowalt.scene.antenna import gain
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.crossing import toward
from lowalt.scene.laws import fast_fading
from lowalt.scene.laws.fast_fading import Link, Rays
from lowalt.scene.view import Still, View

SOURCE = (
    "3GPP TR 38.901 V19.4, clause 7.9.4.2 (TRP monostatic, Table 7.9.4.2-1, Eq. 7.9.4-15), steps 3 "
    "to 12 of clause 7.5 without line of sight and with one polarisation, clause 7.6.9 (absolute "
    "delay) and, on request, 7.9.5.5 (weak clusters); arrival angles are those of departure, as "
    "agreed in 3GPP RAN1"
)
DEFAULTS = {"environment": "UMa", "weak_clusters": False}
UNMODELLED = ("links",)
STILL = True

POSITION_LAWS = {
    "UMi": ((6.1996, 0.1558, 15.2697), (12.0487, 2.3261, 0.0157)),
    "UMa": ((10.3370, 0.1317, 68.7778), (16.2253, 1.9218, 2.6142)),
}
"""Shape, rate and offset of the gamma laws of a reference point's distance and height (m). Source:
Table 7.9.4.2-1.
"""
POINTS = 3
"""Points of reference round a station."""
WEAK_CLUSTERS = 360
WEAK_DB = -25.0
"""Number of weak clusters.

Each has one ray; the second is their power over that of the strongest cluster (dB).
"""
USUAL = 64
"""Draws whose median is the usual level."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in the ground."""
    above_ground("background_channel", scene.network)


def reference_points(environment: str, rng: np.random.Generator) -> np.ndarray:
    """Return the reference points (3, 3): distance (m), height (m), azimuth (rad).

    Azimuths are equally far apart.
    """
    uniform = rng.random((2, POINTS))
    first = 2 * np.pi * (float(rng.random()) - 0.5)
    columns = [
        gammaincinv(shape, drawn) / rate + offset
        for (shape, rate, offset), drawn in zip(POSITION_LAWS[environment], uniform, strict=True)
    ]
    return np.stack([*columns, first + 2 * np.pi * np.arange(POINTS) / POINTS], axis=1)


def drawn(
    settings: dict, station: Station, ghz: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all rays: delays (K,) s, complex amplitudes (K,), unit directions (K, 3).

    The amplitudes are those for isotropic antennas.
    """
    environment = settings["environment"]
    delays = []
    amplitudes = []
    directions = []

    def add(rays: Rays, share: float, first_s: float, level: float, azimuth: float) -> None:
        """Add a link's rays, which have this share of its power, with drawn phases."""
        phase = np.exp(2j * np.pi * rng.random(len(rays.power)))
        delays.append(first_s + rays.delay_s)
        amplitudes.append(level * np.sqrt(share * rays.power) * phase)
        at_azimuth = azimuth + np.radians(rays.azimuth_deg)
        directions.append(_directions(at_azimuth, np.radians(rays.zenith_deg)))

    for flat, height, azimuth in reference_points(environment, rng):
        link = Link(float(flat), float(station.position_m[2]), float(height), ghz)
        large = fast_fading.large_scale(environment, link, rng)
        level = 10 ** ((large.shadow_db - fast_fading.path_loss_db(environment, link)) / 20)
        first = link.range_m / SPEED_OF_LIGHT + fast_fading.later_s(environment, rng)
        rays = fast_fading.rays(environment, link, large, rng)
        add(rays, 1.0, first, level, azimuth)
        if settings["weak_clusters"]:
            strongest = rays.power.max() * len(fast_fading.OFFSETS)
            weak = fast_fading.rays(environment, link, large, rng, WEAK_CLUSTERS)
            add(weak, strongest * 10 ** (WEAK_DB / 10), first, level, azimuth)
    return np.concatenate(delays), np.concatenate(amplitudes), np.concatenate(directions)


def _directions(azimuth: np.ndarray, zenith: np.ndarray) -> np.ndarray:
    """Unit vectors (K, 3) of azimuths and zenith angles (K,) rad."""
    flat, up = sine_cosine(zenith)
    sine, cosine = sine_cosine(azimuth)
    return np.stack([flat * cosine, flat * sine, up], axis=1)


def scatter(settings: dict, view: View, rng: np.random.Generator) -> Still:
    """Return the echoes of the surroundings, the same in all symbols.

    Each ray is weighted by both array sums and the element's gain in its direction. Samples and
    stations have independent draws.
    """
    network = view.network
    station = view.station
    ghz = radar(network, station).centre_hz / 1e9
    delay, amplitude, direction = drawn(settings, station, ghz, rng)
    amplitude = amplitude * _antennas(view, direction)
    # The rays of a cluster share a delay.
    late, number = np.unique(delay, return_inverse=True)
    sums = np.bincount(number, amplitude.real) + 1j * np.bincount(number, amplitude.imag)
    steps = np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    turned = np.exp(-2j * np.pi * late[:, None] * steps)
    response = (sums[:, None] * turned).sum(axis=0)
    shape = (len(view.times_s), network.subcarriers)
    return Still(np.broadcast_to(response, shape).copy())


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the mean power (W) of a subcarrier of the surroundings' echoes.

    It is the median of `USUAL` draws.
    """
    first_symbol = view.at(view.times_s[:1])
    powers = []
    for number in range(USUAL):
        still = scatter(settings, first_symbol, np.random.default_rng(number))
        powers.append(np.mean(abs(still.response) ** 2))
    usual_w = float(np.median(powers))
    return [(f"background, {view.network.bin_name}, median of draws", usual_w, "W")]


def _antennas(view: View, direction: np.ndarray) -> np.ndarray:
    """Amplitude factor (K,) of sending and receiving along unit vectors (K, 3).

    It is in the units of the echo.
    """
    network = view.network
    station = view.station
    places = np.asarray(station.position_m) + direction
    elements = np.prod(network.transmit) * np.prod(network.receive)
    result = np.sqrt(network.power / elements) * toward(view, station, network.transmit, places)
    result = result * toward(view, station, network.receive, places)
    if view.element is not None:
        result = result * gain(view.element, station, places)
    return result
