"""A small scene of the echo with one of everything, its points' places by plain sums, and the truth about them.

The truth is in the longest floating-point numbers of the machine, straight from the formulas of the paper.
"""

from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.config.network import Network, Station
from lowalt.echo import Rigid, api
from lowalt.echo.fast.layout import layout

LONG = np.longdouble
TAU = 8 * np.arctan(LONG(1))
NETWORK = Network(4.9e9, 120e3, 64, 10, 2.5e-3, 3, (3, 2), (2, 5), 1.7, (Station("A", (4.0, -7.0, 25.0), 0.7, 5.2e9),))
"""No two sides of the arrays alike, so that none can stand for another."""


def pieces(sizes=(5, 3, 20), symbols=3, away=(90.0, 120.0, 40.0), size=0.6, seed=1) -> Rigid:
    """Points on turning parts of these sizes; the second part's matrix is zero, as a node's is."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(symbols * len(sizes), random_state=seed).as_matrix()
    rotation = rotation.reshape(symbols, len(sizes), 3, 3)
    rotation[:, 1:2] = 0.0
    translation = (
        np.asarray(away) + rng.normal(0, size, (symbols, len(sizes), 3)) + 2.0 * np.arange(symbols)[:, None, None]
    )
    return Rigid(rotation, translation, rng.normal(0, size, (sum(sizes), 3)), np.repeat(np.arange(len(sizes)), sizes))


def places(motion) -> np.ndarray:
    """Places (N, L, 3) of all points (m)."""
    if isinstance(motion, np.ndarray):
        return LONG(1) * motion
    turned = np.einsum("nlij,lj->nli", LONG(1) * motion.rotation[:, motion.part], motion.points)
    return turned + motion.translation[:, motion.part]


def prepared(motion, rcs_m2=1.0, net: Network = NETWORK):
    """What the kernels get of a scene, under the names of their arguments."""
    where = motion.translation[0, 0] if isinstance(motion, Rigid) else motion[0, 0]
    aim = where + np.array([1.0, 2.0, -1.5])
    scene, radio, refs, aims, _ = api.prepared(net, net.stations[0], motion, rcs_m2, aim, None, "")
    peak = radio.scale * radio.transmit_h * radio.transmit_v * radio.receive_h * radio.receive_v
    return SimpleNamespace(net=net, scene=scene, radio=radio, refs=refs, aims=aims, lay=layout(scene, peak), peak=peak)


def dirichlet(x, count):
    """sin(pi count x) / sin(pi x) as the sum of a symmetric comb's waves."""
    orders = 2 * np.arange(count) - (count - 1)
    return np.cos(TAU / 2 * np.multiply.outer(x, orders)).sum(axis=-1)


def seen(there: SimpleNamespace, motion) -> SimpleNamespace:
    """How the station sees all points, (N, L) each: ranges (m), how much farther than the reference, direction cosines
    and their reference's, turns of phase of each point, gains over their peak, and amplitudes over the sum of all."""
    net, station = there.net, there.net.stations[0]
    apart = places(motion) - np.array(station.position_m, LONG)
    first = LONG(1) * (motion.translation if isinstance(motion, Rigid) else motion)[:, :1]
    range_m = np.sqrt((apart**2).sum(-1))
    reference_m = np.sqrt(((first - np.array(station.position_m, LONG)) ** 2).sum(-1))
    sine, cosine = np.sin(LONG(station.normal_rad)), np.cos(LONG(station.normal_rad))
    across, up = (cosine * apart[..., 1] - sine * apart[..., 0]) / range_m, apart[..., 2] / range_m
    kappa = LONG(station.frequency_hz) / net.carrier_hz
    light = LONG(299_792_458)
    psi, omega = across - there.aims[0], up - there.aims[1]
    middle = station.frequency_hz + (net.subcarriers - 1) * LONG(net.subcarrier_spacing_hz) / 2
    turn = kappa / 4 * ((sum(pair[0] for pair in (net.transmit, net.receive)) - 2) * psi
                        + (sum(pair[1] for pair in (net.transmit, net.receive)) - 2) * omega)  # fmt: skip
    gains = [
        dirichlet(kappa / 2 * seen_at, net.transmit[side]) * dirichlet(kappa / 2 * seen_at, net.receive[side])
        / (net.transmit[side] * net.receive[side]) for side, seen_at in enumerate((psi, omega))
    ]  # fmt: skip
    return SimpleNamespace(
        range_m=range_m, more_m=range_m - reference_m, across=across, up=up, reference_m=reference_m,
        turn=turn - 2 * middle / light * range_m, gain_h=gains[0], gain_v=gains[1],
        cells=2 * net.subcarriers / light * LONG(net.subcarrier_spacing_hz) * range_m,
    )  # fmt: skip
