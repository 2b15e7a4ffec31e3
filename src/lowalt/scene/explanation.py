"""Whether a scene's receiver finds the targets of a few samples, and what each effect changes.

An effect is priced by leaving it out of the scene, or by adding it with its defaults where the
scene does not name it. `commands.explain` prints it all. It passes in a function that says what a
change does to images and to the answers of a trained network, since a scene may not import those
packages.
"""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import numpy as np
import yaml

from lowalt.config.blocks import motion_block
from lowalt.config.network import Network, Station, masts_m
from lowalt.files.errors import InputError
from lowalt.machine.progress import reported
from lowalt.motion.drawing import region_polygon
from lowalt.motion.track_files import path_of
from lowalt.motion.tracks import model_rows
from lowalt.scene.chain import SceneSample, received_signal
from lowalt.scene.checks import check
from lowalt.scene.effects import PLACES, NamedEffect, called, module_of, only
from lowalt.scene.levels import Level, levels, table
from lowalt.scene.observe import Scene, observe
from lowalt.scene.truth import geometric
from lowalt.targets import occluders
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import records_of

CLOSE_CELLS = 1
"""A chosen range cell is right if it lies at most this many cells from the target's."""
VISIBLE = 8
"""A pixel, 0 to 255, counts as changed if it changes by more than this."""
FOUND = 0.9
"""A target counts as found if the range cell is right in at least this share of the symbols."""
BETTER = 0.05
"""Another detection is named if its share of right cells is larger by more than this."""
MOST_RATIO = 10
"""A change that is larger than this multiple of the signal is written in dB."""


class ExplainedSample(NamedTuple):
    """One motion model on which the effects of a scene are measured."""

    cloud: Cloud
    row: dict
    occluders: dict | None


class Finding(NamedTuple):
    """One sample at one station.

    radial_mps: mean rate of the target's range over the look (m/s); right: share of symbols whose
    chosen cell is within one of the target's; over_db: power of the target in its cell over the
    mean power of the loudest cell of everything else, behind the filters (dB, inf without anything
    else); otherwise: the share `right` with other detections (`_other_detections`).
    """

    category: str
    subtype: str
    model: int
    station: str
    range_m: float
    radial_mps: float
    right: float
    over_db: float
    otherwise: dict[str, float]
    levels: list[Level]


class Change(NamedTuple):
    """What leaving an effect out, or adding it, changes.

    signal: root mean square of the signal's change over the signal's, the mean over samples and
    stations; by_class: the same of each class; cells: share of symbols with another range cell,
    modulo the smaller number of cells where the effect changes that number; more: share of the
    pixels, or of a network's answers, that differ; ms: processor time of the effect per sample and
    station, a median; spread_ms: standard deviation of that time over samples and stations; also: a
    further change without which the scene would be refused; refused: why the effect was not tried;
    part: the part of the effect that was left out, "" for the whole.
    """

    effect: str
    place: str
    named: bool
    signal: float = math.nan
    cells: float = math.nan
    more: dict[str, float] = {}  # noqa: RUF012
    ms: float = math.nan
    spread_ms: float = math.nan
    also: str = ""
    refused: str = ""
    part: str = ""
    by_class: dict[str, float] = {}  # noqa: RUF012


def samples(
    config: dict, inputs: Path | None, asked: list[tuple[str, int]]
) -> list[ExplainedSample]:
    """Return the motion models `asked` for, by subtype and number.

    Where none is asked for, it is the first model of each category's first subtype.

    Clouds and motion are made as the workflow makes them, so a sample is the one the data set
    holds.
    Raises: InputError for a subtype the scene does not have.
    """
    records = records_of(config["targets"], inputs)
    select = config["targets"]["select"]
    records = {name: record for name, record in records.items() if not select or name in select}
    unknown = [name for name, _ in asked if name not in records]
    if unknown:
        raise InputError(
            f"--sample: {unknown}, expected subtypes of the scene such as {next(iter(records))!r}"
        )
    firsts: dict[str, tuple[str, int]] = {}
    for name, record in records.items():
        firsts.setdefault(record["published"]["category"], (name, 0))
    masts = np.array(masts_m(config["network"]), dtype=float)
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    motion = motion_block(config)
    result = []
    path = path_of(motion, corners, masts)
    for name, model in asked or firsts.values():
        record = records[name]
        cloud = make(record, inputs, config["seed"])
        track, look = divmod(model, motion.get("looks", 1))
        published = record["published"]
        rows = model_rows(config["seed"], cloud, published, masts, corners, motion, track, path)
        row = rows[look] | {"group": published["unseen_protocol"], "model": model}
        try:
            surfaces = occluders.make(record, inputs, config["seed"]) | {"subtype": name}
        except InputError:
            # A target without surfaces is refused where the scene, or a trial, hides points behind
            # them.
            surfaces = None
        result.append(ExplainedSample(cloud, row, surfaces))
    return result


def scene_of(config: dict) -> Scene:
    """Return the checked scene of a whole configuration.

    Where its effects add noise, it is that at the middle SNR.

    Raises: InputError where effects contradict each other.
    """
    check(config)
    network = Network.from_settings(config["network"])
    effects = tuple(called(config["effects"]))
    snrs = sorted(float(snr) for snr in config["noise"]["snr_db"])
    middle = snrs[(len(snrs) - 1) // 2]
    scene = Scene(network, config["seed"], config["echo"]["tolerance"], effects)
    return scene.at_snr(middle)


def finding(
    scene: Scene,
    station: Station,
    explained: ExplainedSample,
    clouds: dict[str, Cloud],
    listed: bool = False,
) -> Finding:
    """Return whether a sample's target is found at a station, and how loud it is against all else.

    listed: whether levels are wanted, which take as long as a sample.
    """
    cloud, row, surfaces = explained
    sample = SceneSample(scene, observe(scene, station, cloud, row, surfaces), clouds)
    target_cell = sample.observed_cell(sample.view)
    empty = sample.without_target()
    received = sample.filtered(sample.detection)
    background = empty.filtered(sample.detection)
    at_target = (received - background)[np.arange(len(target_cell)), target_cell]
    loudest = float((abs(background) ** 2).mean(axis=0).max())
    over_db = np.inf
    if loudest > 0:
        with np.errstate(divide="ignore"):
            over_db = 10 * np.log10(np.mean(abs(at_target) ** 2) / loudest)
    otherwise = {}
    for label, detection in _other_detections(sample.detection).items():
        otherwise[label] = _right(sample, detection, target_cell)
    view = sample.view
    lines = []
    if listed:
        lines = levels(view, scene.effects, sample.power)
    return Finding(
        category=row["category"],
        subtype=row["subtype"],
        model=row["model"],
        station=station.name,
        range_m=float(np.linalg.norm(view.aim_m - np.asarray(station.position_m))),
        radial_mps=float(geometric(view)[:, 1].mean()),
        right=_right(sample, sample.detection, target_cell),
        over_db=float(over_db),
        otherwise=otherwise,
        levels=lines,
    )


def _other_detections(detection: list[NamedEffect]) -> dict[str, list[NamedEffect]]:
    """Return other detections than a scene's, by label.

    They are the kinds of its effects (KINDS), without and with each effect of the place that it
    does not name and that is worth a trial (TRIED).
    """
    kinds = {}
    for number, effect in enumerate(detection):
        for kind, settings in getattr(effect.module, "KINDS", {}).items():
            changed = effect._replace(settings=effect.settings | settings)
            label = f"{effect.name} {kind}"
            kinds[label] = [*detection[:number], changed, *detection[number + 1 :]]
    named = {effect.name for effect in detection}
    unnamed = [name for name, place in PLACES.items() if place == "detection" and name not in named]
    tried = [name for name in unnamed if hasattr(module_of(name), "TRIED")]
    if not kinds:
        result = {"the same": detection}
        for name in tried:
            result[name] = detection + called({name: {}})
        return result
    result = {}
    for label, effects in kinds.items():
        result[label] = effects
        for name in tried:
            result[f"{label} and {name}"] = effects + called({name: {}})
    return result


def _right(sample: SceneSample, detection: Sequence[NamedEffect], target_cell: np.ndarray) -> float:
    """Share of symbols whose chosen cell is close to the target's.

    Cells wrap around as ranges do.
    """
    acting = [effect for effect in detection if not effect.idle]
    cells = sample.filtered(acting)
    off = abs(sample.chosen(acting, cells) - target_cell)
    off = np.minimum(off, cells.shape[1] - off)
    return float(np.mean(off <= CLOSE_CELLS))


def changes(
    config: dict,
    chosen: list[ExplainedSample],
    station_names: Sequence[str],
    shown: Callable[[np.ndarray], dict[str, np.ndarray]],
) -> list[Change]:
    """Return what each effect changes at some stations.

    The effects that the scene names come first.

    shown: turns the signals (K, stations, N) of all samples into what is compared, by name: pixels
    of images, answers of a network.
    """
    places = {effect.name: effect.place for effect in scene_of(config).effects}
    named = list(places)
    # The first call of a kernel compiles it, so the scene itself is computed twice. So is a single
    # sample with each effect, whose time is no median of several.
    passes = 2 if len(chosen) * len(station_names) == 1 else 1
    signals, cells, times_ms = _received(config, station_names, chosen, 2)
    count = _cell_count(scene_of(config))
    classes = np.array([explained.row["category"] for explained in chosen])
    before = shown(signals)
    result = []
    tried = _tried(config, named)
    for name, part in reported(tried, len(tried), "effects"):
        place = places.get(name) or PLACES[name]
        inside = name in named
        also = ""
        try:
            if part:
                changed = _without_part(config, name, part)
            else:
                changed, also = _changed(config, name)
            new_signals, new_cells, new_times_ms = _received(changed, station_names, chosen, passes)
        except InputError as error:
            result.append(Change(name, place, inside, refused=str(error)))
            continue
        moved = np.linalg.norm(new_signals - signals, axis=2) / np.linalg.norm(signals, axis=2)
        cost_ms = new_times_ms - times_ms
        if inside:
            cost_ms = -cost_ms
        fewest = min(count, _cell_count(scene_of(changed)))
        other_cell = _folded(cells, fewest) != _folded(new_cells, fewest)
        by_class = {str(kind): float(moved[classes == kind].mean()) for kind in np.unique(classes)}
        after = shown(new_signals)
        result.append(
            Change(
                name,
                place,
                inside,
                signal=float(np.mean(moved)),
                cells=float(np.mean(other_cell)),
                more={kind: _differing(before[kind], after[kind]) for kind in before},
                ms=float(np.median(cost_ms)),
                spread_ms=float(np.std(cost_ms)),
                also=also,
                part=part,
                by_class=by_class,
            )
        )
    return result


def _tried(config: dict, named: list[str]) -> list[tuple[str, str]]:
    """What is changed in turn: an effect, and its component that is left out, "" for the whole."""
    result = [(name, "") for name in named]
    for name in named:
        result += [(name, part) for part in getattr(module_of(name), "PARTS", {})]
    result += [(name, "") for name in PLACES if name not in config["effects"]]
    return result


def _cell_count(scene: Scene) -> int:
    """The number of range cells of a scene's receiver.

    Combs of pilots have fewer than subcarriers.
    """
    subcarriers = scene.network.subcarriers
    range_cells = only(scene.effects, "range_cells")
    if range_cells is None:
        return subcarriers
    return range_cells(np.zeros((1, subcarriers), np.complex128)).shape[1]


def _folded(cells: np.ndarray, count: int) -> np.ndarray:
    """Range cells as a receiver with `count` cells numbers them; -1, no symbol, stays."""
    return np.where(cells < 0, cells, cells % count)


def _without_part(config: dict, name: str, part: str) -> dict:
    """The configuration without a part of an effect that it names."""
    settings = (config["effects"][name] or {}) | module_of(name).PARTS[part]
    return config | {"effects": config["effects"] | {name: settings}}


def _differing(before: np.ndarray, after: np.ndarray) -> float:
    """Share of entries that differ: numbers by more than VISIBLE, texts at all."""
    differs = before != after
    if before.dtype.kind == "i":
        differs = abs(before - after) > VISIBLE
    return float(np.mean(differs))


def _changed(config: dict, name: str) -> tuple[dict, str]:
    """Return the configuration with an effect taken out or added, and what else had to change.

    An effect that the configuration names is taken out, any other is added.

    Raises: InputError where no single further change makes the scene fit.
    """
    effects = config["effects"]
    if name in effects:
        others = {key: value for key, value in effects.items() if key != name}
        choices = [(config | {"effects": others}, "")]
        for other in others:
            fewer = {key: value for key, value in others.items() if key != other}
            choices.append((config | {"effects": fewer}, f"and without {other}"))
    else:
        added = config | {"effects": effects | {name: {}}}
        choices = [
            (added, ""),
            (added | {"noise": config["noise"] | {"snr_db": [np.inf]}}, "at no set SNR"),
        ]
    faults = []
    for changed, also in choices:
        try:
            check(changed)
            return changed, also
        except InputError as error:
            faults.append(error)
    raise faults[0]


def _received(
    config: dict, station_names: Sequence[str], chosen: list[ExplainedSample], passes: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return signals and cells (K, stations, N) of the chosen samples, and their times.

    The times (K, stations) ms are the processor's in the last pass.
    """
    scene = scene_of(config)
    clouds = {explained.cloud.subtype: explained.cloud for explained in chosen}
    for _ in range(passes):
        received = []
        times_s = [time.process_time()]
        for explained in chosen:
            for name in station_names:
                station = scene.network.station(name)
                received.append(received_signal(scene, station, *explained, clouds))
                times_s.append(time.process_time())
    shape = (len(chosen), len(station_names))
    signals = np.array([result.signal for result in received]).reshape(*shape, -1)
    cells = np.array([result.cell for result in received]).reshape(*shape, -1)
    return signals, cells, 1e3 * np.diff(times_s).reshape(shape)


def verdict(findings: Sequence[Finding]) -> list[str]:
    """Return sentences that say whether the receiver finds its targets.

    They also say what would find more of them.
    """
    of_class: dict[str, list[Finding]] = {}
    for finding in findings:
        of_class.setdefault(finding.category, []).append(finding)
    share = fmean([finding.right for finding in findings])
    shares = []
    over = []
    compared = False
    for name, mine in of_class.items():
        shares.append(f"{name} {fmean([finding.right for finding in mine]):.0%}")
        over_db = fmean([finding.over_db for finding in mine])
        side = "above" if over_db >= 0 else "below"
        over.append(f"{name} {abs(over_db):.1f} dB {side}")
        compared |= math.isfinite(over_db)
    lines = [
        f"The target's range cell, or one next to it, is chosen in {share:.0%} of the symbols: "
        f"{', '.join(shares)}."
    ]
    if compared:
        lines.append(
            "Behind the filters the target is, against the loudest cell of all else: "
            f"{', '.join(over)} it."
        )
    better = {}
    for name in findings[0].otherwise:
        better[name] = fmean([finding.otherwise[name] for finding in findings])
    best = max(better, key=better.__getitem__)
    if share < FOUND and better[best] > share + BETTER:
        lines.append(f"With {best} it would be {better[best]:.0%}.")
    return lines


def effects_table(changes: Sequence[Change], sources: bool) -> list[str]:
    """Return one line per effect: by how much it changes signals, range cells and images.

    The line also states the effect's time.
    """
    more = list(dict.fromkeys(key for change in changes for key in change.more))
    columns = "".join(f"{key:>9}" for key in more)
    lines = [f"{'effect':<20} {'':<7} {'signal':>16} {'cells':>7} {columns}{'ms':>9}"]
    for change in changes:
        head = f"{change.effect:<20} {'named' if change.named else 'added':<7} "
        if change.refused:
            lines.append(f"{head}not tried: {change.refused}")
            continue
        shares = "".join(f"{change.more.get(key, math.nan):>9.1%}" for key in more)
        cost = cost_text(change.ms, change.spread_ms)
        cells = f"{_signal_text(change):>16} {change.cells:>7.1%} {shares}{cost:>9}"
        remark = change.also
        if change.part:
            remark += f"its {change.part} left out"
        lines.append(f"{head}{cells}  {remark}".rstrip())
    lines.append(
        "named: without it; added: with it and its defaults. Shares of the signal's rms, of "
        "symbols, of pixels; x: the change over the signal, from the least to the most changed "
        "class, where it exceeds the signal in one; dB: how much the effect weakens (-) or "
        "strengthens (+) the signal, over the classes, where one changes more than tenfold; <: a "
        "time that the measurement cannot tell from zero."
    )
    if sources:
        lines += [
            f"{change.effect}: {module_of(change.effect).SOURCE}"
            for change in changes
            if not change.part
        ]
    return lines


def _signal_text(change: Change) -> str:
    """The change of the signal as a share of it, else the range of its ratio over the classes.

    It is a share up to 100 % in every class, a ratio with an x up to tenfold, and beyond that,
    where an effect hides or drowns nearly all of a signal, in dB.
    """
    ratios = sorted(change.by_class.values()) or [change.signal]
    largest = ratios[-1]
    if largest <= 1:
        return f"{change.signal:.1%}"
    if largest <= MOST_RATIO:
        texts = [f"x{ratio:.2g}" for ratio in ratios]
        unit = ""
    else:
        levels_db = []
        for ratio in ratios:
            level_db = -math.inf
            if ratio > 0:
                level_db = 20 * math.log10(ratio)
                if change.named:
                    level_db = -level_db
            levels_db.append(level_db)
        texts = [f"{level_db:+.0f}" for level_db in sorted(levels_db)]
        unit = " dB"
    least = texts[0]
    most = texts[-1]
    if least == most:
        return f"{least}{unit}"
    return f"{least} to {most}{unit}"


def cost_text(ms: float, spread_ms: float) -> str:
    """Return a cost in ms.

    If it is negative or below its spread, it is the larger of both magnitudes behind a `<`.
    """
    if ms > spread_ms:
        return f"{ms:.1f}"
    return f"<{max(spread_ms, -ms):.1f}"


def suggested(overlay: dict, changes: Sequence[Change], least: float) -> str:
    """Return a scene as YAML with those of its effects that change a signal by more than `least`.

    least: a share of the signal's root mean square; overlay: the scene's own blocks.
    """
    others = {key: value for key, value in overlay.items() if key != "effects"}
    lines = []
    if others:
        lines.append(yaml.safe_dump(others, sort_keys=False).rstrip())
    whole = [change for change in changes if change.named and not change.part]
    kept = [change for change in whole if not change.signal <= least]
    lines.append(
        f"# Effects that change a signal by more than {least:g} of its root mean square, and by "
        "how much."
    )
    lines.append("effects:" if kept else "effects: {}")
    for change in kept:
        settings = overlay["effects"][change.effect] or {}
        block = yaml.safe_dump(settings, default_flow_style=True, width=1000)
        lines.append(f"  {change.effect}: {block.strip()}  # {change.signal:.2g}")
    return "\n".join(lines) + "\n"


def level_lines(finding: Finding) -> list[str]:
    """Return the levels of one sample at one station as a link budget lists them."""
    head = (
        f"{finding.subtype}, model {finding.model}, station {finding.station}, range "
        f"{finding.range_m:.0f} m"
    )
    return [head, *(f"  {line}" for line in table(finding.levels))]
