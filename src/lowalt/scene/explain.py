"""What a scene does to the signals of a few samples: whether the target's cell is found, and what each effect changes.

An effect is priced by leaving it out of the scene, or by adding it with its defaults where the scene does not name it.
`commands.explain` prints the facts; what they mean for images and for a trained network is asked of a function, since
those rooms come later.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station, masts_m
from lowalt.config.plan import motion_block
from lowalt.files.errors import InputError
from lowalt.motion.sample import region_polygon
from lowalt.motion.track_files import path_of
from lowalt.motion.tracks import model_rows
from lowalt.scene.catalogue import PLACES, NamedEffect, called
from lowalt.scene.chain import SceneSample, received_signal
from lowalt.scene.checks import check
from lowalt.scene.levels import Level, levels
from lowalt.scene.observe import Scene
from lowalt.targets import occluders
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import records_of

CANCELLERS = (
    ("none", {"kind": "none"}), ("mean", {"kind": "mean"}), ("pulse, order 1", {"kind": "pulse", "order": 1}),
    ("pulse, order 2", {"kind": "pulse", "order": 2}), ("clutter", {"kind": "clutter"}),
)  # fmt: skip
"""Cancellers that a verdict compares."""
WORD = 1
"""Range cells by which a chosen cell may be beside the target's and still hold it."""


class ExplainedSample(NamedTuple):
    """One motion model to explain the scene by."""

    cloud: Cloud
    row: dict
    occluders: dict | None


class Finding(NamedTuple):
    """One sample at one station.

    right: share of symbols whose chosen cell is within one of the target's; over_db: the target in its cell over the
    mean power of the loudest cell of all else, behind the filters (dB, inf without anything else); otherwise: share
    right with other detection: each of CANCELLERS where the scene has one, with and without a detector.
    """

    category: str
    subtype: str
    model: int
    station: str
    range_m: float
    right: float
    over_db: float
    otherwise: dict[str, float]
    levels: list[Level]


class Change(NamedTuple):
    """What leaving an effect out, or adding it, changes.

    signal: root mean square of the signal's change over the signal's; cells: share of symbols with another range cell;
    more: what the caller's function says of the signals (images, answers); ms: processor time that the effect takes a
    sample and station; also: what else had to change for the scene to fit; refused: why the effect was not tried.
    """

    effect: str
    place: str
    named: bool
    signal: float
    cells: float
    more: dict[str, float]
    ms: float
    also: str = ""
    refused: str = ""


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
        firsts: dict[str, tuple[str, int]] = {}
        for name, record in records.items():
            firsts.setdefault(record["published"]["category"], (name, 0))
        named = list(firsts.values())
    masts = np.array(masts_m(config["network"]), dtype=float)
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    motion, result = motion_block(config), []
    path = path_of(motion, corners, masts)
    for name, model in named:
        record = records[name]
        cloud = make(record, inputs, config["seed"])
        track, look = divmod(model, motion.get("looks", 1))
        row = model_rows(config["seed"], cloud, record["published"], masts, corners, motion, track, path)[look]
        try:
            surfaces = occluders.make(record, inputs, config["seed"]) | {"subtype": name}
        except InputError:
            # A target without surfaces is refused where the scene, or a trial, hides points behind them.
            surfaces = None
        row = {**row, "group": record["published"]["unseen_protocol"], "model": model}
        result.append(ExplainedSample(cloud, row, surfaces))
    return result


def scene_of(config: dict) -> Scene:
    """Return the checked scene of a whole configuration, with noise at its middle SNR where the effects add that.

    Raises: InputError where effects contradict each other.
    """
    check(config)
    scene = Scene(
        Network.from_settings(config["network"]), config["seed"], config["echo"]["tolerance"],
        tuple(called(config["effects"])),
    )  # fmt: skip
    snrs = sorted(float(snr) for snr in config["noise"]["snr_db"])
    return scene.at_snr(snrs[(len(snrs) - 1) // 2])


def finding(scene: Scene, station: Station, explained: ExplainedSample, clouds: dict[str, Cloud]) -> Finding:
    """Return whether a sample's target is found at a station, and how loud it is against all else."""
    sample = SceneSample(scene, station, *explained, clouds)
    own, empty = sample.own_cell(), sample.without_target()
    behind, rest = sample.filtered(sample.detection), empty.filtered(sample.detection)
    at_target = (behind - rest)[np.arange(len(own)), own]
    loudest = float((abs(rest) ** 2).mean(axis=0).max())
    with np.errstate(divide="ignore"):
        over_db = 10 * np.log10(np.mean(abs(at_target) ** 2) / loudest) if loudest > 0 else np.inf
    names = {effect.name for effect in sample.detection}
    otherwise = {}
    for name, changed in CANCELLERS if "canceller" in names else (("", {}),):
        detection = [_with(effect, changed) for effect in sample.detection]
        for more in ("",) if "detector" in names else ("", "detector"):
            added = detection + (called({more: {}}) if more else [])
            said = " and ".join(filter(None, (name and f"canceller {name}", more))) or "the same"
            otherwise[said] = _right(sample, added, own)
    named = {effect.name: effect for effect in scene.effects}
    range_m = float(np.linalg.norm(sample.view.aim_m - np.asarray(station.position_m)))
    row = explained.row
    return Finding(
        row["category"], row["subtype"], row["model"], station.name, range_m, _right(sample, sample.detection, own),
        float(over_db), otherwise, levels(sample.view, named, sample.power),
    )  # fmt: skip


def _with(effect: NamedEffect, changed: dict) -> NamedEffect:
    """A canceller with other settings; any other effect as it is."""
    return effect._replace(settings=effect.settings | changed) if effect.name == "canceller" else effect


def _right(sample: SceneSample, detection: Sequence[NamedEffect], own: np.ndarray) -> float:
    """Share of symbols whose chosen cell is within WORD of the target's, cells wrapping around as ranges do."""
    kept = [effect for effect in detection if not effect.module.idle(effect.settings)]
    cells = sample.filtered(kept)
    off = abs(sample.chosen(kept, cells) - own)
    return float(np.mean(np.minimum(off, cells.shape[1] - off) <= WORD))


def changes(
    config: dict, chosen: list[ExplainedSample], station_names: Sequence[str],
    compare: Callable[[np.ndarray, np.ndarray], dict[str, float]],
) -> list[Change]:  # fmt: skip
    """Return what each effect of the catalogue changes at some stations, those that the scene names first.

    compare: says of the signals (K, stations, N) of all samples, as the scene has them and changed, what else differs.
    """
    scene = scene_of(config)
    stations = [scene.network.station(name) for name in station_names]
    clouds = {explained.cloud.subtype: explained.cloud for explained in chosen}
    before, ms = _timed(scene, stations, chosen, clouds)
    names = [effect.name for effect in scene.effects]
    result = []
    for name in [*names, *(name for name in PLACES if name not in config["effects"])]:
        named = name in names
        try:
            changed, also = _changed(config, name)
            after, taken = _timed(scene_of(changed), stations, chosen, clouds)
        except InputError as error:
            result.append(Change(name, PLACES[name], named, np.nan, np.nan, {}, np.nan, refused=str(error)))
            continue
        moved = np.linalg.norm(after[0] - before[0], axis=2) / np.linalg.norm(before[0], axis=2)
        cells, more = float(np.mean(before[1] != after[1])), compare(before[0], after[0])
        cost = ms - taken if named else taken - ms
        result.append(Change(name, PLACES[name], named, float(np.mean(moved)), cells, more, cost, also))
    return result


def _changed(config: dict, name: str) -> tuple[dict, str]:
    """The configuration without an effect that it names, or with one more, and what else had to change with it.

    Raises: InputError where no single further change makes the scene fit.
    """
    effects = config["effects"]
    if name in effects:
        rest = {key: value for key, value in effects.items() if key != name}
        choices = [(config | {"effects": rest}, "")]
        for other in rest:
            fewer = {key: value for key, value in rest.items() if key != other}
            choices.append((config | {"effects": fewer}, f"and without {other}"))
    else:
        added = config | {"effects": effects | {name: {}}}
        choices = [(added, ""), (added | {"noise": config["noise"] | {"snr_db": [np.inf]}}, "at no set SNR")]
    faults = []
    for changed, also in choices:
        try:
            check(changed)
            return changed, also
        except InputError as error:
            faults.append(error)
    raise faults[0]


def _timed(
    scene: Scene, stations: Sequence[Station], chosen: list[ExplainedSample], clouds: dict[str, Cloud]
) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """Signals and cells (K, stations, N) of the chosen samples, and one's mean processor time (ms)."""
    # The first call compiles and fills tables.
    received_signal(scene, stations[0], *chosen[0], clouds)
    start = time.process_time()
    received = [[received_signal(scene, end, *explained, clouds) for end in stations] for explained in chosen]
    ms = 1e3 * (time.process_time() - start) / (len(chosen) * len(stations))
    signals = np.array([[each.signal for each in row] for row in received])
    return (signals, np.array([[each.cell for each in row] for row in received])), ms
