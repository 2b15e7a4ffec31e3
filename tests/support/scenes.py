"""A small network, a target of a body and a rotor, and scenes of effects: inputs of the tests of
`lowalt.scene`.
"""

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo import Rigid
from lowalt.motion.table import NUMBERS
from lowalt.scene.chain import SceneSample
from lowalt.scene.effects import called
from lowalt.scene.observe import Scene, observe
from lowalt.scene.view import Beams, Perturbations, View, located
from lowalt.targets.cloud import Cloud

A = Station("A", (0.0, 0.0, 10.0), 0.3, 4.9e9)
B = Station("B", (120.0, 10.0, 12.0), 2.6, 4.9e9 + 41 * 120e3)


def network(**changes) -> Network:
    """A small network of one station at 10 m height."""
    values = {
        "carrier_hz": 4.9e9,
        "subcarrier_spacing_hz": 120e3,
        "subcarriers": 32,
        "guard_subcarriers": 10,
        "symbol_interval_s": 2.5e-3,
        "symbols": 24,
        "transmit": (4, 2),
        "receive": (4, 2),
        "power": 1.0,
        "stations": (A,),
    }
    return Network(**values | changes)


def link(sends: Station = A, hears: Station = B) -> Station:
    """The link from one station to another."""
    name = f"{sends.name}-{hears.name}"
    return Station(name, hears.position_m, hears.normal_rad, sends.frequency_hz, sends, hears)


def linked(**changes) -> Network:
    """A network of two stations and both links between them."""
    return network(**{"stations": (A, link(), B, link(B, A))} | changes)


def target(
    rng: np.random.Generator, points: int = 9, size_m: float = 0.5, **changes: float
) -> tuple[Cloud, dict]:
    """A cloud of a body and a rotor with random points, and its row of the motion table."""
    cloud = Cloud(
        points=rng.uniform(-size_m, size_m, (points, 3)),
        part=np.sort(np.arange(points) % 2),
        kinds=("body", "rotor"),
        names=("body", "rotor 0"),
        parents=np.array([-1, -1]),
        hinges=np.array([[np.nan] * 3, [0.1, 0.0, 0.0]]),
        axes=np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]),
        normals=np.full((points, 3), np.nan),
        rcs_m2=rng.uniform(0.1, 2.0, points),
        record={"subtype": "Thing", "category": "UAV", "source": "test", "checksum": ""},
    )
    row = dict.fromkeys(NUMBERS, np.nan) | {
        "subtype": "Thing",
        "category": "UAV",
        "group": "seen",
        "model": 3,
        "x_m": 60.0,
        "y_m": 25.0,
        "z_m": 30.0,
        "vx_mps": 5.0,
        "vy_mps": -3.0,
        "vz_mps": 1.0,
        "yaw_rad": 0.7,
        "pitch_rad": 0.1,
        "roll_rad": -0.1,
        "rate_hz": 60.0,
        "phase_0_rad": 0.4,
    }
    return cloud, row | changes


def scene(effects: dict, radio: Network | None = None) -> Scene:
    """The scene of these effects."""
    return Scene(radio or network(), 5, None, tuple(called(effects)))


def sample_of(
    effects: dict, radio: Network | None = None, rng: int = 1, points: int = 9, **changes: float
) -> SceneSample:
    """The small target as the first station of a scene of these effects sees it."""
    asked = scene(effects, radio)
    cloud, row = target(np.random.default_rng(rng), points, **changes)
    return SceneSample(asked, observe(asked, asked.network.stations[0], cloud, row))


def view_of(
    radio: Network, places: np.ndarray, rcs_m2: np.ndarray, aim_m, station: Station | None = None
) -> View:
    """A view of points at places (N, L, 3) m, under beams at aim_m (3,), or (K, 3) from symbol 0,
    1, ... on.
    """
    times_s = radio.symbol_interval_s * np.arange(len(places))
    aims = np.atleast_2d(np.asarray(aim_m, float))
    count = len(rcs_m2)
    nothing = np.full((1, 3), np.nan)
    cloud = Cloud(
        points=np.zeros((count, 3)),
        part=np.zeros(count, int),
        kinds=("body",),
        names=("body",),
        parents=np.array([-1]),
        hinges=nothing,
        axes=nothing,
        normals=np.full((count, 3), np.nan),
        rcs_m2=np.asarray(rcs_m2, float),
        record={"subtype": "Thing", "category": "UAV", "source": "test", "checksum": ""},
    )
    beams = Beams(radio.symbol_interval_s * np.arange(len(aims)), aims)
    names = {end.name for end in radio.stations} | {"A", "B"}
    still = Rigid(
        np.eye(3) + np.zeros((len(places), 1, 1, 1)),
        np.zeros((len(places), 1, 3)),
        cloud.points,
        cloud.part,
    )
    return View(
        radio,
        station or radio.stations[0],
        cloud,
        {},
        times_s,
        still,
        places,
        Perturbations(times_s, ()),
        aims[0],
        dict.fromkeys(names, beams),
    )


def seen_by(
    radio: Network,
    station: Station,
    cloud: Cloud,
    row: dict,
    times_s: np.ndarray | None = None,
    **facts,
) -> View:
    """The view of a target in motion, whose origin at the first symbol the beams point at."""
    times_s, moved = radio.times_s if times_s is None else times_s, Perturbations(radio.times_s, ())
    origin_m = np.array([row["x_m"], row["y_m"], row["z_m"]])
    return View(
        radio,
        station,
        cloud,
        row,
        times_s,
        *located(cloud, row, times_s, moved),
        moved,
        origin_m,
        **facts,
    )


def drifting(
    rng: np.random.Generator, middle_m, symbols: int = 5, points: int = 11, size_m: float = 0.7
) -> np.ndarray:
    """Places (N, L, 3) m of points about a middle that drifts."""
    drift = np.linspace(0.0, 1.0, symbols)[:, None, None] * [0.3, -0.2, 0.1]
    return np.asarray(middle_m, float) + rng.uniform(-size_m, size_m, (1, points, 3)) + drift
