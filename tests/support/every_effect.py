"""Scenes with any of all effects, made of numbers in [0, 1], for draws at random and for an optimiser."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import Network, Station
from lowalt.effects.catalogue import BY_NEED, ORDER, PLACES, called, providing
from lowalt.effects.channel.direct_path import MONOSTATIC
from lowalt.effects.channel.walls import DEFAULTS as WALLS
from lowalt.effects.checks import CheckedScene
from lowalt.effects.interface import Checks, Quantises
from lowalt.effects.received import Scene, received_signal
from lowalt.motion.table import NUMBERS
from lowalt.targets import occluders
from lowalt.targets.cloud import Cloud
from lowalt.targets.surfaces import box

NAMES = tuple(entry.partition("/")[2] for entry in ORDER)
"""Every effect, in the chain's order."""
SUDDEN = {"adc": 0.1, "detector": 0.1}
"""Share of scenes with an effect behind which nothing is left out; the others are in 35 % of the scenes, physics by
need in 65 %."""
LINKS = ("direct_path", "link_offset")
GEOMETRY = 14
NUMBERS_OF_A_SCENE = GEOMETRY + 2 * len(NAMES)
"""How many numbers make a scene: range and so on, then for each effect whether it is named, and how strong."""


class Case(NamedTuple):
    """One scene: its network, the station that hears, the target with its row and surfaces, effects and tolerance."""

    network: Network
    station: Station
    cloud: Cloud
    row: dict
    surfaces: dict | None
    effects: dict
    tolerance: float

    def scene(self, tolerance: float | None) -> Scene:
        """The scene with another tolerance."""
        return Scene(self.network, 5, tolerance, tuple(called(self.effects)))

    def received(self, tolerance: float | None):
        """The signal with what this tolerance leaves out."""
        return received_signal(
            self.scene(tolerance), self.station, self.cloud, self.row, self.surfaces, {self.cloud.subtype: self.cloud}
        )


def strengths(u: dict[str, float]) -> dict[str, dict]:
    """Settings of every effect from one number in [0, 1] each; none of physics by need."""
    pick = {name: partial(_one_of, value) for name, value in u.items()}
    ground, clocks = u["ground_reflection"], {"sigma_ppm": 10 ** (-6 + 4 * u["link_offset"]), "sigma_s": 1e-8}
    return {
        "rotor_spread": {"spread": 0.01 + 0.2 * u["rotor_spread"], "wander": 0.1 * u["rotor_spread"]},
        "gusts": {"wind_mps": 0.5 + 20.0 * u["gusts"]},
        "slow_time": {
            "downlink": 1.0 - 0.5 * u["slow_time"], "missing": 0.1 * u["slow_time"], "jitter_s": 5e-4 * u["slow_time"],
            "regrid": pick["slow_time"]("linear", "hold", "zero", "nudft"),
        },
        "data_symbols": {"order": pick["data_symbols"](16, 64, 256)},
        "power_amplifier": {"backoff_db": 15.0 - 12.0 * u["power_amplifier"], "smoothness": 2.0},
        "comb_pilots": {"spacing": pick["comb_pilots"](2, 4)},
        "pointing_error": {
            "sigma_deg": 0.1 + 3.0 * u["pointing_error"], "update_s": pick["pointing_error"](None, 0.01, 5e-3),
        },
        "element_pattern": {"downtilt_deg": 12.0 * u["element_pattern"]},
        "mean_cross_section": {"blades_db": -20.0 + 20.0 * u["mean_cross_section"]},
        "fluctuation": {"spread_db": 0.5 + 5.0 * u["fluctuation"]},
        "cross_sections": {
            "power": 0.5 + 3.0 * u["cross_sections"], "blades": pick["cross_sections"]("diffuse", "facet"),
        },
        "occlusion": {"strength": 0.1 + 0.9 * u["occlusion"], "blades": pick["occlusion"]("bent", "opaque")},
        "line_of_sight": {"environment": pick["line_of_sight"]("UMa", "UMi", "RMa"), "blocked_db": 25.0},
        "ground_reflection": {
            "permittivity": 2.0 + 60.0 * ground, "conductivity_s_m": 10 ** (4.0 * ground - 3.0),
            "roughness_m": pick["ground_reflection"](0.0, 0.02),
            "polarisation": pick["ground_reflection"]("vertical", "horizontal"),
        },
        "walls": {"facades": [[*WALLS["facades"][0][:3], 500.0, 200.0]], "permittivity": 2.0 + 8.0 * u["walls"]},
        "reflected_aspect": {},
        "companions": {"count": pick["companions"]([1, 1], [2, 2]), "spread_m": 10.0 + 20.0 * u["companions"]},
        "direct_path": {"loss_db": 60.0 - 60.0 * u["direct_path"]},
        "interference": {"leakage_db": 60.0 * u["interference"], "loss_db": 20.0, **clocks},
        "clutter": {"clutter_to_signal_db": 60.0 * u["clutter"] - 30.0, "wind_mps": pick["clutter"](0.0, 5.0)},
        "background_channel": {
            "environment": pick["background_channel"]("RMa", "UMa", "UMi"),
            "weak_clusters": u["background_channel"] > 0.8,
        },
        "receiver_noise": {"noise_figure_db": 10.0 * u["receiver_noise"]},
        "cell_noise": {"snr_db": 40.0 - 50.0 * u["cell_noise"]},
        "link_offset": clocks,
        "timing_offset": {"sigma_s": 1e-7 * u["timing_offset"] + 1e-10},
        "clock_offset": {"sigma_ppm": 10 ** (4 * u["clock_offset"] - 3)},
        "carrier_offset": {"sigma_ppm": 10 ** (4 * u["carrier_offset"] - 5)},
        "phase_noise": {"level_db": 30.0 * u["phase_noise"] - 20.0, "shared": pick["phase_noise"](True, False)},
        "transmit_leakage": {"isolation_db": 130.0 - 70.0 * u["transmit_leakage"]},
        "iq_imbalance": {"gain_db": 3.0 * u["iq_imbalance"], "phase_deg": 1.0 + 9.0 * u["iq_imbalance"]},
        "adc": {"bits": pick["adc"](14, 12, 10, 8)},
        "canceller": {
            "kind": pick["canceller"]("mean", "exponential", "pulse"), "order": 2,
            "memory": 0.1 + 0.89 * u["canceller"],
        },
        "detector": {
            "cfar": pick["detector"]("none", "ca", "os"), "training": 1, "guard": 0, "false_alarm": 0.1,
            "gate_cells": 1,
        },
        "cell_error": {"probability": 0.5 * u["cell_error"] + 0.01, "spread_cells": 2},
    }  # fmt: skip


def _one_of(at: float, *given):
    """One of the values given, the first for small numbers."""
    return given[min(int(at * len(given)), len(given) - 1)]


def fitting(named: dict[str, dict], network: Network) -> dict[str, dict]:
    """The effects without those that contradict the others, as their own checks say."""
    if "cross_sections" in named and "fluctuation" in named:
        named["fluctuation"] |= {"pattern": False}
    while True:
        effects = called(named)
        scene = CheckedScene(network, {one.name: one.settings for one in effects}, (np.inf,))
        for effect in providing(effects, Checks):
            try:
                effect.module.check(effect.settings, scene)
            except InputError:
                named.pop(effect.name)
                break
        else:
            return named


def networks(u: np.ndarray, linked: bool) -> Network:
    """A network with a station 25 m up and a second one on the same sub-band, with a link to it on request."""
    carrier = 10 ** (9.0 + 0.8 * u[0])
    shape = (1 + int(7.99 * u[1]), 1 + int(3.99 * u[2]))
    a, b = Station("A", (0.0, 0.0, 25.0), 0.3, carrier), Station("B", (300.0, 40.0, 20.0), 2.5, carrier)
    link = Station("A-B", b.position_m, b.normal_rad, a.frequency_hz, a, b)
    return Network(carrier, 120e3, 32, 10, 2.5e-3, 12, shape, shape, 1.0, (a, link, b) if linked else (a, b))


def targets(rng: np.random.Generator, size_m: float, recorded: bool) -> tuple[Cloud, dict | None]:
    """A few points on a box with a rotor, with normals and surfaces, or the nodes of a recording of three frames."""
    count = int(rng.choice([3, 5, 9]))
    points, normals = rng.uniform(-size_m, size_m, (count, 3)), rng.normal(size=(count, 3))
    record = {"subtype": "Thing", "category": "UAV", "source": "test", "checksum": ""}
    flying = dict.fromkeys(("vx_abs_max", "vy_abs_max", "vz_abs_max"), 5.0)
    record["published"] = {**flying, "freq_lo_hz": 20.0, "freq_hi_hz": 80.0, "size_m": 2 * size_m}
    cloud = Cloud(
        points=points, part=np.arange(count) % 2, kinds=("body", "rotor"), names=("body", "rotor 0"),
        parents=np.array([-1, -1]), hinges=np.array([[np.nan] * 3, [0.1 * size_m, 0.0, 0.0]]),
        axes=np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]), rcs_m2=rng.uniform(0.1, 2.0, count), record=record,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
    )  # fmt: skip
    if not recorded:
        blade = box((2 * size_m, 0.1 * size_m, 0.02 * size_m), (0, 0, size_m))
        sides = [box((size_m, size_m, 0.5 * size_m), (0, 0, 0)), blade]
        return cloud, occluders.from_surfaces(sides, np.full(count, 1e-9), np.full(2, True)) | {"subtype": "Thing"}
    empty, names = np.full((count, 3), np.nan), tuple(f"node {index}" for index in range(count))
    track = points + 10 ** rng.uniform(-4, -1) * rng.normal(size=(3, count, 3))
    cloud = replace(
        cloud, part=np.arange(count), kinds=("node",) * count, names=names, parents=np.full(count, -1), hinges=empty,
        axes=empty, normals=empty, track=track, record=record | {"track_rate_hz": 10 ** rng.uniform(0, 4)},
    )  # fmt: skip
    return cloud, None


def case(numbers: np.ndarray) -> Case:
    """The scene of `NUMBERS_OF_A_SCENE` numbers in [0, 1]."""
    u = np.clip(np.asarray(numbers, float), 0.0, 1.0)
    place, switch, strong = u[:GEOMETRY], u[GEOMETRY : GEOMETRY + len(NAMES)], u[GEOMETRY + len(NAMES) :]
    linked, recorded = place[3] > 0.9, place[4] > 0.85
    network, rng = networks(place[:3], linked), np.random.default_rng(int(1e6 * place[5]))
    cloud, surfaces = targets(rng, 10 ** (3.3 * place[6] - 3.0), recorded)
    range_m, angle = 10 ** (1.2 + 2.3 * place[7]), 2.8 * (place[8] - 0.5)
    row = dict.fromkeys(NUMBERS, 0.0) | {
        "subtype": "Thing", "category": "UAV", "group": "seen", "model": 3, "x_m": range_m * np.cos(angle),
        "y_m": range_m * np.sin(angle), "z_m": 4.0 + range_m * place[9], "vx_mps": 10 ** (3.5 * place[10] - 2.0),
        "vy_mps": 3.0 * place[11], "yaw_rad": 6.0 * place[11], "rate_hz": 10 ** (3.3 * place[12] - 1.0),
        "playback": 1.0, "start_s": place[10],
    }  # fmt: skip
    given = strengths(dict(zip(NAMES, strong, strict=True))) | {name: {} for name in BY_NEED}
    absent = set(MONOSTATIC) if linked else set(LINKS)
    absent |= {"occlusion", "companions", "gusts", "rotor_spread"} if recorded else set()
    share = {name: SUDDEN.get(name, 0.65 if name in BY_NEED else 0.35) for name in NAMES}
    drawn = {name for name, one in zip(NAMES, switch, strict=True) if one < share[name]}
    named = {name: given[name] for name in NAMES if name in drawn - absent}
    if linked:
        named = {"direct_path": given["direct_path"], **named}
    effects = fitting(named, network)
    station = network.station("A-B") if linked else network.stations[0]
    return Case(network, station, cloud, row, surfaces, effects, 10 ** (-4.0 + 3.5 * place[13]))


def change(one: Case) -> float:
    """Change of the signal by what is left out, over the tolerance: at most 1 where every bound holds.

    Behind a converter the promise is on the mean square.
    """
    received, truth = one.received(one.tolerance), one.received(None)
    error, largest = abs(received.signal - truth.signal), float(abs(truth.signal).max())
    stepped = bool(providing(one.scene(None).effects, Quantises))
    worst = np.sqrt(np.mean(error**2)) if stepped else error.max()
    return float(worst / largest / one.tolerance) if largest > 0 else float(worst > 0)


def unknown() -> set[str]:
    """Effects of the catalogue that no scene here can name."""
    return set(PLACES) - set(strengths(dict.fromkeys(NAMES, 0.5))) - set(BY_NEED)
