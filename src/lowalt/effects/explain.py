"""The facts that `lowalt explain SCENE` prints: effects, sources, decisions with their bounds, and costs.

`lowalt.effects.explain_text` writes them as text and as data for a program.

The costs are measured when the command runs, on one motion model of each category of the scene, at its first station.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, masts_m
from lowalt.common.streams import stream
from lowalt.common.timing import median_s
from lowalt.echo import EchoResult, echo_signal
from lowalt.effects.catalogue import PLACES, NamedEffect, called
from lowalt.effects.channel import cyclic_prefix
from lowalt.effects.checks import check
from lowalt.effects.levels import Level, levels
from lowalt.effects.need import Decision
from lowalt.effects.received import Scene, observe, received_signal, with_cross_sections
from lowalt.effects.view import View
from lowalt.motion.sample import draw, region_polygon
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import records_of

REPEATS = 3


class ExplainedSample(NamedTuple):
    """One motion model to explain the scene by."""

    cloud: Cloud
    row: dict
    occluders: dict | None


class Prefix(NamedTuple):
    """What the cyclic prefix covers: its length (s), the range (m) up to which an echo lies within it, the share of its
    window that this echo loses, whether the scene computes that loss, and the number of subcarriers."""

    length_s: float
    covers_m: float
    lost: float
    computed: bool
    subcarriers: int


class OwnEcho(NamedTuple):
    """A sample at a station that sends and receives: the target's echo alone, and the decisions on physics by need.

    rms_change: rms change of the signal by all effects over the echo's rms; other_cells: share of symbols in which
    another range cell is chosen.
    """

    echo: EchoResult
    decisions: list[Decision]
    rms_change: float
    other_cells: float


class LinkGeometry(NamedTuple):
    """A sample on a link: metres from the transmitter to the target and on to the receiver, and the angle (rad) between
    both ways."""

    out_m: float
    back_m: float
    bistatic_rad: float


class SampleFacts(NamedTuple):
    """The facts on one sample at one station; `seen` tells a station that sends itself from a link."""

    subtype: str
    model: int
    station: str
    range_m: float
    prefix: Prefix
    levels: list[Level]
    seen: OwnEcho | LinkGeometry


class SceneFacts(NamedTuple):
    """The facts on a scene.

    idle: named effects that change nothing with their parameters; absent: effects that are not named; ms: as `costs`
    returns it, empty where nothing was measured.
    """

    run: str
    stations: list[str]
    tolerance: float | None
    snr_db: list[float]
    effects: tuple[NamedEffect, ...]
    idle: list[str]
    absent: list[str]
    ms: dict[str, float]
    samples: list[SampleFacts]


def samples(config: dict, inputs: Path | None, named: list[tuple[str, int]]) -> list[ExplainedSample]:
    """Return the motion models `named` (subtype, number), or the first model of each category's first subtype.

    Clouds and motion are made as the workflow makes them, so a sample is the one the data set holds.
    Raises: InputError for a subtype the scene does not have.
    """
    records = records_of(config["targets"], inputs)
    select = config["targets"]["select"]
    records = {name: record for name, record in records.items() if not select or name in select}
    unknown = [name for name, _ in named if name not in records]
    if unknown:
        raise InputError(f"--sample: {unknown}, expected subtypes of the scene such as {next(iter(records))!r}")
    if not named:
        firsts = {}
        for name, record in records.items():
            firsts.setdefault(record["published"]["category"], (name, 0))
        named = list(firsts.values())
    masts = np.array(masts_m(config["network"]), dtype=float)
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    result = []
    for name, model in named:
        record = records[name]
        cloud = make(record, inputs, config["seed"])
        rng = stream(config["seed"], "motion", name, model)
        row = draw(rng, cloud, record["published"], masts, corners, config["motion"])
        occluders = None
        if "occlusion" in config["effects"]:
            from lowalt.targets import occluders as surfaces

            occluders = surfaces.make(record, inputs, config["seed"]) | {"subtype": name}
        result.append(
            ExplainedSample(cloud, {**row, "group": record["published"]["unseen_protocol"], "model": model}, occluders)
        )
    return result


def costs(scene: Scene, chosen: list[ExplainedSample], station_name: str) -> dict[str, float]:
    """Return milliseconds a sample and station: "base", each effect added alone to the base, and "together"."""
    station = scene.network.station(station_name)

    def mean(effects: tuple[NamedEffect, ...]) -> float:
        """Mean milliseconds of the chosen samples with these effects."""
        part = Scene(scene.network, scene.seed, scene.tolerance, effects)
        times = [
            1e3 * median_s(lambda s=s: received_signal(part, station, s.cloud, s.row, s.occluders), REPEATS)
            for s in chosen
        ]
        return sum(times) / len(times)

    result = {"base": mean(())}
    result |= {effect.name: mean((effect,)) - result["base"] for effect in scene.effects}
    return result | {"together": mean(scene.effects)}


def sample_facts(scene: Scene, sample: ExplainedSample, station_name: str) -> SampleFacts:
    """Return the facts on one sample at one station: which effects are computed with their bounds, and levels."""
    station = scene.network.station(station_name)
    cloud = with_cross_sections(scene, sample.cloud)
    view = observe(scene, station, cloud, sample.row, sample.occluders)
    received = received_signal(scene, station, sample.cloud, sample.row, sample.occluders)
    if station.transmitter is None:
        own = echo_signal(scene.network, station, view.motion, cloud.rcs_m2, view.aim_m, scene.tolerance)
        power = received.power
        moved = np.sqrt(np.mean(abs(received.signal - own.signal) ** 2) / power) if power > 0 else np.nan
        other = np.mean(received.cell != own.cell)
        range_m = float(np.linalg.norm(view.aim_m - np.asarray(station.position_m)))
        seen = OwnEcho(own, received.decisions, float(moved), float(other))
    else:
        seen = link_geometry(view)
        range_m = 0.5 * (seen.out_m + seen.back_m)
    named = {effect.name: effect for effect in scene.effects}
    return SampleFacts(
        sample.row["subtype"], sample.row["model"], station_name, range_m, prefix(scene, range_m),
        levels(view, named, received.power), seen,
    )  # fmt: skip


def link_geometry(view: View) -> LinkGeometry:
    """Return the distances and the bistatic angle of a target that a link between two stations observes."""
    station = view.station
    ends = [np.asarray(one.position_m) - view.origin_m for one in (station.transmitter, station)]
    out, back = (float(np.linalg.norm(one)) for one in ends)
    return LinkGeometry(out, back, math.acos(float(np.clip(ends[0] @ ends[1] / (out * back), -1.0, 1.0))))


def prefix(scene: Scene, range_m: float) -> Prefix:
    """Return what the cyclic prefix covers of an echo from `range_m`."""
    settings = {effect.name: effect.settings for effect in scene.effects}.get("cyclic_prefix")
    length = cyclic_prefix.length_s(settings or cyclic_prefix.DEFAULTS, scene.network)
    lost = float(cyclic_prefix.lost(2 * range_m / SPEED_OF_LIGHT, length, scene.network))
    return Prefix(length, 0.5 * length * SPEED_OF_LIGHT, lost, settings is not None, scene.network.subcarriers)


def scene_facts(
    config: dict, inputs: Path | None, named: list[tuple[str, int]], station: str | None, measure: bool
) -> SceneFacts:
    """Return the facts on the scene of a whole configuration.

    named: samples (subtype, model number), by default one a category; station: by default the first; measure: whether
    costs are measured. Raises: InputError where the configuration, a sample or a station is wrong.
    """
    checked = check(config)
    effects = tuple(called(config["effects"]))
    scene = Scene(Network.from_settings(config["network"]), config["seed"], config["echo"]["tolerance"], effects)
    names = [station.name for station in scene.network.stations]
    station = station or names[0]
    scene.network.station(station)
    chosen = samples(config, inputs, named)
    return SceneFacts(
        config["run"], names, scene.tolerance, [float(snr) for snr in config["noise"]["snr_db"]], effects,
        [name for name in config["effects"] if name not in checked.effects],
        [name for name in PLACES if name not in config["effects"]],
        costs(scene, chosen, station) if measure else {},
        [sample_facts(scene, sample, station) for sample in chosen],
    )  # fmt: skip
