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
from lowalt.scene.laws.fast_fading import Link
from lowalt.scene.view import Still, View

SOURCE = (
    "3GPP TR 38.901 V19.4, clause 7.9.4.2 (TRP monostatic, Table 7.9.4.2-1, Eq. 7.9.4-15), steps 3 "
    "to 12 of clause 7.5 "
    "without line of sight and with one polarisation, clause 7.6.9 (absolute delay) and, on "
    "request, 7.9.5.5 (weak "
    "clusters); arrival angles are those of departure, as agreed in 3GPP RAN1"
)
DEFAULTS = {"environment": "UMa", "weak_clusters": False}
UNMODELLED = ("links",)
STILL = True

PLACES = {
    "UMi": ((6.1996, 0.1558, 15.2697), (12.0487, 2.3261, 0.0157)),
    "UMa": ((10.3370, 0.1317, 68.7778), (16.2253, 1.9218, 2.6142)),
}
"""Shape, rate and offset of the gamma laws of a reference point's distance and height (m). Source:
Table 7.9.4.2-1.
"""
POINTS = 3
"""Points of reference round a station."""
WEAK = 360, -25.0
"""Number of weak clusters, of one ray each, and their power over that of the strongest cluster
(dB).
"""
USUAL = 64
"""Draws whose median is the usual level."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a station in the ground."""
    above_ground("background_channel", scene.network)


def reference_points(environment: str, rng: np.random.Generator) -> np.ndarray:
    """Return the reference points (3, 3): distance (m), height (m), azimuth (rad); azimuths are
    equally far apart.
    """
    uniform = rng.random((2, POINTS))
    first = 2 * np.pi * (float(rng.random()) - 0.5)
    columns = [
        gammaincinv(shape, drawn) / rate + offset
        for (shape, rate, offset), drawn in zip(PLACES[environment], uniform, strict=True)
    ]
    return np.stack([*columns, first + 2 * np.pi * np.arange(POINTS) / POINTS], axis=1)


def drawn(
    settings: dict, station: Station, ghz: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all rays: delays (K,) s, complex amplitudes (K,) for isotropic antennas, unit
    directions (K, 3).
    """
    environment = settings["environment"]
    delays = []
    amplitudes = []
    directions = []
    for flat, height, azimuth in reference_points(environment, rng):
        link = Link(float(flat), float(station.position_m[2]), float(height), ghz)
        large = fast_fading.large_scale(environment, link, rng)
        level = 10 ** ((large.shadow_db - fast_fading.path_loss_db(environment, link)) / 20)
        first = link.range_m / SPEED_OF_LIGHT + fast_fading.later_s(environment, rng)
        for clusters, below_db in (None, 0.0), WEAK:
            rays = fast_fading.rays(environment, link, large, rng, clusters)
            if clusters is None:
                strongest = rays.power.max() * len(fast_fading.OFFSETS)
            share = 1.0 if clusters is None else strongest * 10 ** (below_db / 10)
            phase = np.exp(2j * np.pi * rng.random(len(rays.power)))
            delays.append(first + rays.delay_s)
            amplitudes.append(level * np.sqrt(share * rays.power) * phase)
            directions.append(
                _directions(azimuth + np.radians(rays.azimuth_deg), np.radians(rays.zenith_deg))
            )
            if not settings["weak_clusters"]:
                break
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
    return Still(
        np.broadcast_to(
            (sums[:, None] * turned).sum(axis=0), (len(view.times_s), network.subcarriers)
        ).copy()
    )


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the mean power (W) of a subcarrier of the surroundings' echoes, the median of `USUAL`
    draws.
    """
    drawn = [
        scatter(settings, view.at(view.times_s[:1]), np.random.default_rng(number))
        for number in range(USUAL)
    ]
    usual_w = float(np.median([np.mean(abs(still.response) ** 2) for still in drawn]))
    return [(f"background, {view.network.bin_name}, median of draws", usual_w, "W")]


def _antennas(view: View, direction: np.ndarray) -> np.ndarray:
    """Amplitude factor (K,) of sending and receiving along unit vectors (K, 3), in the units of the
    echo.
    """
    network = view.network
    station = view.station
    places = np.asarray(station.position_m) + direction
    elements = np.prod(network.transmit) * np.prod(network.receive)
    result = np.sqrt(network.power / elements) * toward(view, station, network.transmit, places)
    result = result * toward(view, station, network.receive, places)
    return result if view.element is None else result * gain(view.element, station, places)
