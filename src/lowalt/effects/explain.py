"""The explanation that `lowalt explain SCENE` prints: effects, sources, decisions with their bounds, and costs.

The costs are measured when the command runs, on one motion model of each category of the scene, at its first station.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.config import load
from lowalt.common.errors import InputError
from lowalt.common.hardware import describe
from lowalt.common.network import SPEED_OF_LIGHT, Network, masts_m
from lowalt.common.streams import stream
from lowalt.common.timing import median_s
from lowalt.echo import echo_signal, method_text
from lowalt.effects.catalogue import BY_NEED, PLACES, NamedEffect, called
from lowalt.effects.channel import cyclic_prefix
from lowalt.effects.checks import check
from lowalt.effects.levels import levels, table
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


def sample_lines(scene: Scene, sample: ExplainedSample, station_name: str) -> list[str]:
    """Return lines that name the effects computed for one sample at one station, with their bounds."""
    station = scene.network.station(station_name)
    cloud = with_cross_sections(scene, sample.cloud)
    view = observe(scene, station, cloud, sample.row, sample.occluders)
    if station.transmitter is not None:
        return link_lines(scene, view, sample)
    own = echo_signal(scene.network, station, view.motion, cloud.rcs_m2, view.aim_m, scene.tolerance)
    received = received_signal(scene, station, sample.cloud, sample.row, sample.occluders)
    range_m = np.linalg.norm(view.aim_m - np.asarray(station.position_m))
    lines = [f"{sample.row['subtype']}, model {sample.row['model']}, station {station_name}, range {range_m:.0f} m"]
    lines += [f"  {line}" for line in method_text(own).splitlines()]
    lines.append(f"  {prefix_line(scene, float(range_m))}")
    for decision in received.decisions:
        verb = "computed" if decision.computed else "left out"
        bound = "" if np.isinf(decision.bound) else f", bound {decision.bound:.2g} of the largest value"
        lines.append(f"  {decision.name}: {verb}{bound} ({decision.reason})")
    named = {effect.name: effect for effect in scene.effects}
    lines += [f"  {line}" for line in ("levels of one subcarrier:", *table(levels(view, named, received.power)))]
    moved = np.sqrt(np.mean(abs(received.signal - own.signal) ** 2) / received.power) if received.power > 0 else np.nan
    other = np.mean(received.cell != own.cell)
    lines.append(
        f"  against the target's echo alone: rms change {moved:.2g}, other range cell in {other:.1%} of symbols"
    )
    return lines


def link_lines(scene: Scene, view: View, sample: ExplainedSample) -> list[str]:
    """Return lines on one sample of a link between two stations: geometry, Doppler factor, level of the echo."""
    station = view.station
    ends = [np.asarray(one.position_m) - view.aim_m for one in (station.transmitter, station)]
    out, back = (float(np.linalg.norm(one)) for one in ends)
    angle = math.acos(float(np.clip(ends[0] @ ends[1] / (out * back), -1.0, 1.0)))
    power = received_signal(scene, station, sample.cloud, sample.row, sample.occluders).power
    named = {effect.name: effect for effect in scene.effects}
    return [
        f"{sample.row['subtype']}, model {sample.row['model']}, link {station.name}: {out:.0f} m and {back:.0f} m",
        f"  bistatic angle {math.degrees(angle):.0f} degrees: Doppler is {math.cos(angle / 2):.2f} of 2 v / lambda "
        "along the bisector; all physics named is computed",
        f"  {prefix_line(scene, 0.5 * (out + back))}",
        *(f"  {line}" for line in ("levels of one subcarrier:", *table(levels(view, named, power)))),
    ]


def prefix_line(scene: Scene, range_m: float) -> str:
    """Return a line that says whether the cyclic prefix covers an echo from `range_m`, and its loss otherwise."""
    settings = {effect.name: effect.settings for effect in scene.effects}.get("cyclic_prefix")
    network = scene.network
    prefix = cyclic_prefix.length_s(settings or cyclic_prefix.DEFAULTS, network)
    covered = f"cyclic prefix {1e6 * prefix:.3g} us, covers {0.5 * prefix * SPEED_OF_LIGHT:.0f} m"
    lost = float(cyclic_prefix.lost(2 * range_m / SPEED_OF_LIGHT, prefix, network))
    if lost == 0:
        return f"{covered}: this echo is within it"
    kept, spread = 1 - lost, max(1 - (1 - lost) ** 2, 1e-30)
    level = f"{20 * np.log10(kept):.1f} dB" if kept > 0 else "gone"
    modelled = "computed" if settings is not None else "not modelled, name effects.cyclic_prefix"
    return (
        f"{covered}: this echo loses {lost:.0%} of its window, {level}; interference {10 * np.log10(spread):.0f} dB a "
        f"subcarrier, {10 * np.log10(spread / network.subcarriers):.0f} dB a range cell ({modelled})"
    )


def explain_scene(
    paths: list[Path],
    schema: Path,
    inputs: Path | None,
    named: list[tuple[str, int]],
    station: str | None,
    measure: bool,
) -> str:
    """Return the explanation of the scene of a base configuration and its overlays `paths`.

    named: samples (subtype, model number), by default one a category; station: by default the first; measure: whether
    costs are measured. Raises: InputError where the configuration, a sample or a station is wrong.
    """
    return explained(load(paths, schema), inputs, named, station, measure)


def explained(
    config: dict, inputs: Path | None, named: list[tuple[str, int]], station: str | None, measure: bool
) -> str:
    """Return the explanation of the scene of a whole configuration; arguments and errors as `explain_scene`."""
    checked = check(config)
    effects = tuple(called(config["effects"]))
    scene = Scene(Network.from_settings(config["network"]), config["seed"], config["echo"]["tolerance"], effects)
    station = station or scene.network.stations[0].name
    scene.network.station(station)
    tolerance = "exact" if scene.tolerance is None else f"{scene.tolerance:g} of a sample's largest value"
    lines = [
        f"scene {config['run']}: stations {', '.join(s.name for s in scene.network.stations)}, tolerance {tolerance}, "
        f"SNRs {', '.join(f'{float(snr):g}' for snr in config['noise']['snr_db'])} dB",
        "always (Eq. 7): beam pattern over the target, spread over range cells, 1/r^2 over the target, exact range; "
        "how, by sample, below",
    ]
    chosen = samples(config, inputs, named)
    price = costs(scene, chosen, station) if measure else {}
    for effect in effects:
        cost = f" | +{price[effect.name]:.2f} ms" if measure else ""
        kind = "by need" if effect.name in BY_NEED else effect.place
        values = ", ".join(f"{key} {value}" for key, value in effect.settings.items())
        lines += [f"{effect.name} ({kind}): {values or 'no parameters'}{cost}", f"  {effect.module.SOURCE}"]
    idle = [name for name in config["effects"] if name not in checked.effects]
    if idle:
        lines.append(f"named, but the identity with these parameters, so left out: {', '.join(idle)}")
    absent = [name for name in PLACES if name not in config["effects"]]
    lines.append(f"not named, so not imported and nothing drawn: {', '.join(absent) or 'none'}")
    if measure:
        lines.append(
            f"time a sample and station: base {price['base']:.2f} ms, with all effects {price['together']:.2f} ms "
            f"(medians of {REPEATS}, mean over {len(chosen)} samples; {describe()})"
        )
    for sample in chosen:
        lines += ["", *sample_lines(scene, sample, station)]
    return "\n".join(lines)
