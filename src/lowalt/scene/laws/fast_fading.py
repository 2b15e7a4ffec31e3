"""Clusters and rays of a link without line of sight, drawn as the tables of 3GPP TR 38.901 say.

Steps 3 to 8 of clause 7.5 for one link from a base station to a point, and the absolute delay of
clause 7.6.9. Only directions of departure are drawn; one polarisation. Frequencies are in GHz and
angles in degrees, as in the tables.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.numerics import portable
from lowalt.numerics.large_matrices import upper_root

OFFSETS = np.repeat(
    [0.0447, 0.1413, 0.2492, 0.3715, 0.5129, 0.6797, 0.8844, 1.1481, 1.5195, 2.1551], 2
)
OFFSETS[1::2] *= -1
"""Angles (20,) of a cluster's rays, in units of its spread. Source: Table 7.5-3."""
SUB_CLUSTERS = (np.r_[0:8, 18, 19], np.r_[8:12, 16, 17], np.r_[12:16])
"""Rays of the three sub-clusters of each of the two strongest clusters. Source: Table 7.5-5."""
FAINTEST_DB = 25.0
"""Clusters so far below the strongest are left out."""
WIDEST_AZIMUTH_DEG = 104.0
WIDEST_ZENITH_DEG = 52.0
"""Largest spreads in azimuth and zenith."""


class Fading(NamedTuple):
    """One environment's parameters without line of sight; formulas take the frequency (GHz)."""

    lowest_ghz: float
    delay_spread: Callable[[float], tuple[float, float]]
    """Mean and standard deviation of lg(DS / 1 s)."""
    azimuth_spread: Callable[[float], tuple[float, float]]
    """Those of lg(ASD / 1 degree)."""
    zenith_deviation: float
    """Standard deviation of lg(ZSD / 1 degree)."""
    shadow_db: float
    correlation: tuple[float, float, float, float, float, float]
    """DS-SF, ASD-SF, ZSD-SF, ASD-DS, ZSD-DS, ZSD-ASD."""
    stretch: float
    """Delay scaling r_tau."""
    clusters: int
    cluster_azimuth_deg: float
    cluster_delay_ns: Callable[[float], float]
    scale_azimuth: float
    scale_zenith: float
    """C_phi and C_theta without line of sight."""
    later: tuple[float, float]
    """Mean and standard deviation of the lg of the absolute delay beyond the distance's (s)."""


ENVIRONMENTS = {
    "UMa": Fading(
        lowest_ghz=6.0,
        delay_spread=lambda f: (-6.47 - 0.134 * math.log10(f), 0.39),
        azimuth_spread=lambda f: (1.09, 0.44),
        zenith_deviation=0.49,
        shadow_db=6.0,
        correlation=(-0.4, -0.6, 0.0, 0.4, -0.5, 0.5),
        stretch=2.3,
        clusters=20,
        cluster_azimuth_deg=1.8,
        cluster_delay_ns=lambda f: max(0.25, 6.5622 - 3.4084 * math.log10(f)),
        scale_azimuth=1.289,
        scale_zenith=1.178,
        later=(-7.4, 0.2),
    ),
    "UMi": Fading(
        lowest_ghz=2.0,
        delay_spread=lambda f: (
            -0.22 * math.log10(1 + f) - 6.87,
            0.19 * math.log10(1 + f) + 0.22,
        ),
        azimuth_spread=lambda f: (
            -0.24 * math.log10(1 + f) + 1.54,
            0.10 * math.log10(1 + f) + 0.33,
        ),
        zenith_deviation=0.35,
        shadow_db=7.82,
        correlation=(-0.7, 0.0, 0.0, 0.0, -0.5, 0.5),
        stretch=2.1,
        clusters=19,
        cluster_azimuth_deg=10.0,
        cluster_delay_ns=lambda f: 11.0,
        scale_azimuth=1.273,
        scale_zenith=1.184,
        later=(-7.5, 0.5),
    ),
}
"""Parameters of the environments by name.

Source: TR 38.901 V19, Tables 7.4.1-1, 7.5-2, 7.5-4, 7.5-6 (notes: UMa below 6 GHz as at 6, UMi
below 2 as at 2), 7.5-7, 7.5-8 and 7.6.9-1.
"""


class Link(NamedTuple):
    """A link from a base station: horizontal distance, both heights (m) and frequency (GHz)."""

    flat_m: float
    station_m: float
    height_m: float
    ghz: float

    @property
    def range_m(self) -> float:
        """Distance in space (m)."""
        return math.hypot(self.flat_m, self.station_m - self.height_m)


class Large(NamedTuple):
    """Large-scale parameters of a link.

    delay_s: delay spread; azimuth_deg, zenith_deg: spreads of the angles; shadow_db: shadowing.
    """

    delay_s: float
    azimuth_deg: float
    zenith_deg: float
    shadow_db: float


class Rays(NamedTuple):
    """Rays (K,) of a link.

    delay_s: after the first; azimuth_deg: from the link's; zenith_deg: zenith angle; power: share.
    """

    delay_s: np.ndarray
    azimuth_deg: np.ndarray
    zenith_deg: np.ndarray
    power: np.ndarray


def path_loss_db(environment: str, link: Link) -> float:
    """Return the path loss (dB) without line of sight, at least that with it.

    Source: Table 7.4.1-1.
    """
    lg = math.log10(link.range_m)
    f = 20 * math.log10(link.ghz)
    # The surface's effective height is 1 m, as for points below 13 m.
    bend = 4 * (link.station_m - 1) * max(link.height_m - 1, 0.0) * link.ghz * 1e9 / SPEED_OF_LIGHT
    square = math.log10(max(bend**2 + (link.station_m - link.height_m) ** 2, 1.0))
    near = link.flat_m <= bend
    if environment == "UMi":
        slope = 21 * lg if near else 40 * lg - 9.5 * square
        seen = 32.4 + slope + f
        return max(seen, 35.3 * lg + 22.4 + 1.065 * f - 0.3 * (link.height_m - 1.5))
    slope = 22 * lg if near else 40 * lg - 9 * square
    seen = 28.0 + slope + f
    return max(seen, 13.54 + 39.08 * lg + f - 0.6 * (link.height_m - 1.5))


def zenith_spread(environment: str, link: Link) -> tuple[float, float]:
    """Return the mean of lg(ZSD / 1 degree) and the zenith angles' offset (degrees).

    Source: Tables 7.5-7 and 7.5-8.
    """
    flat = link.flat_m
    high = link.height_m
    if environment == "UMi":
        mean = max(-0.5, -3.1 * flat / 1000 + 0.01 * max(high - link.station_m, 0.0) + 0.2)
        offset = -(10 ** (-1.5 * math.log10(max(10.0, flat)) + 3.3))
        return mean, offset
    lg = math.log10(max(link.ghz, ENVIRONMENTS["UMa"].lowest_ghz))
    slope = (0.208 * lg - 0.782) * math.log10(max(25.0, flat))
    power = slope - 0.13 * lg + 2.03 - 0.07 * (high - 1.5)
    mean = max(-0.5, -2.1 * flat / 1000 - 0.01 * (high - 1.5) + 0.9)
    offset = 7.66 * lg - 5.96 - 10**power
    return mean, offset


def large_scale(environment: str, link: Link, rng: np.random.Generator) -> Large:
    """Return a link's spreads and shadowing, correlated as Table 7.5-6 says.

    Positive shadowing means more power.
    """
    table = ENVIRONMENTS[environment]
    ghz = max(link.ghz, table.lowest_ghz)
    # Rows and columns: shadowing, delay spread, azimuth spread, zenith spread.
    matrix = np.eye(4)
    pairs = [(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)]
    for (row, column), value in zip(pairs, table.correlation, strict=True):
        matrix[row, column] = matrix[column, row] = value
    shadow, delay, azimuth, zenith = portable.applied(upper_root(matrix).T, rng.standard_normal(4))
    delay_mean, delay_dev = table.delay_spread(ghz)
    azimuth_mean, azimuth_dev = table.azimuth_spread(ghz)
    zenith_mean, _ = zenith_spread(environment, link)
    return Large(
        delay_s=10 ** (delay_mean + delay_dev * delay),
        azimuth_deg=min(10 ** (azimuth_mean + azimuth_dev * azimuth), WIDEST_AZIMUTH_DEG),
        zenith_deg=min(10 ** (zenith_mean + table.zenith_deviation * zenith), WIDEST_ZENITH_DEG),
        shadow_db=table.shadow_db * shadow,
    )


def rays(
    environment: str,
    link: Link,
    large: Large,
    rng: np.random.Generator,
    clusters: int | None = None,
) -> Rays:
    """Return a link's rays. Their powers sum to one before the faintest clusters are left out.

    clusters: as many clusters of one ray each instead of the table's of 20 rays. Source: clause
    7.5, steps 5 to 8, Eqs. 7.5-1, 7.5-5, 7.5-9, 7.5-11, 7.5-13, 7.5-14, 7.5-19, 7.5-20 and 7.5-26.
    """
    table = ENVIRONMENTS[environment]
    count = clusters or table.clusters
    delay = -table.stretch * large.delay_s * portable.log(1.0 - rng.random(count))
    delay = np.sort(delay - delay.min())
    power = portable.exp(-delay * (table.stretch - 1) / (table.stretch * large.delay_s))
    power *= portable.from_decibels(-3.0 * rng.standard_normal(count))
    power /= power.sum()
    depth = -portable.log(power / power.max())
    mean_zenith, offset = zenith_spread(environment, link)
    sign = np.where(rng.random((2, count)) < 0.5, -1.0, 1.0)
    spread = np.array([large.azimuth_deg, large.zenith_deg])[:, None]
    jitter = spread / 7 * rng.standard_normal((2, count))
    azimuth = sign[0] * 2 * (large.azimuth_deg / 1.4) * np.sqrt(depth) / table.scale_azimuth
    azimuth = azimuth + jitter[0]
    straight = math.degrees(math.acos((link.height_m - link.station_m) / link.range_m))
    zenith = sign[1] * large.zenith_deg * depth / table.scale_zenith + jitter[1] + straight + offset
    kept = power > power.max() * 10 ** (-FAINTEST_DB / 10)
    delay = delay[kept]
    azimuth = azimuth[kept]
    zenith = zenith[kept]
    power = power[kept]
    if clusters:
        return Rays(delay, azimuth, zenith, power)
    return _split(table, link, mean_zenith, Rays(delay, azimuth, zenith, power), rng)


def _split(
    table: Fading, link: Link, mean_zenith: float, clusters: Rays, rng: np.random.Generator
) -> Rays:
    """The rays of clusters, coupled at random in azimuth and zenith.

    The two strongest clusters have three sub-clusters.
    """
    count = len(OFFSETS)
    delay = np.repeat(clusters.delay_s[:, None], count, axis=1)
    azimuth = clusters.azimuth_deg[:, None] + table.cluster_azimuth_deg * OFFSETS
    later = 1.28e-9 * table.cluster_delay_ns(max(link.ghz, table.lowest_ghz))
    zenith = np.empty_like(azimuth)
    strongest = np.argsort(-clusters.power)[:2]
    for number in range(len(delay)):
        groups = SUB_CLUSTERS if number in strongest else (np.arange(count),)
        coupled = OFFSETS.copy()
        for step, group in enumerate(groups):
            coupled[group] = OFFSETS[group][rng.permutation(len(group))]
            delay[number, group] += step * later
        zenith[number] = clusters.zenith_deg[number] + 0.375 * 10**mean_zenith * coupled
    power = np.repeat(clusters.power[:, None] / count, count, axis=1)
    return Rays(delay.ravel(), azimuth.ravel(), zenith.ravel(), power.ravel())


def later_s(environment: str, rng: np.random.Generator) -> float:
    """Return the delay (s) of the first ray beyond that of the distance.

    Source: clause 7.6.9, Table 7.6.9-1.
    """
    mean, deviation = ENVIRONMENTS[environment].later
    return 10 ** (mean + deviation * float(rng.standard_normal()))
