"""Scenes of a twin: targets in front of the radar and their courses, drawn from ranges.

`TwinScene` lists the keys of a scene (`scene` in brought.schema.yaml). A value of a scene is a
number, [low, high] for a uniform draw, or [a, b, c, ...] for one whose stretches a to b, b to c and
so on are equally probable.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lowalt.config.classes import AIRBORNE, CATEGORIES
from lowalt.extensions.recordings.channel import coherent_intervals, symbol_rate
from lowalt.extensions.recordings.presence import present
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import NO_CLASS, RADARS, Twin, records, twin_of
from lowalt.extensions.recordings.twin_courses import Course, drive, hover, straight, to_and_fro
from lowalt.extensions.recordings.twin_echo import (
    beam_gain,
    echo,
    sized,
    still_row,
    strengthened,
    textured,
)
from lowalt.extensions.recordings.twin_others import KINDS, NOTHING, other_echo
from lowalt.extensions.recordings.twin_receiver import Receiver, received
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.progress import reported
from lowalt.numerics.portable import rms
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import load_records

MARGIN = 40
"""Symbols simulated before and after a stretch; they take the transients of the filters and of the
analytic signal.
"""
Setting = float | list[float]
"""A number, or the ends of the stretches that a draw is taken from."""


def value(setting: Setting, rng: np.random.Generator) -> float:
    """Return the number that a setting states or, for a list, a draw from its stretches.

    The stretches between the numbers of a list are equally probable; the draw is uniform within
    each. Raises: InputError for anything else.
    """
    if (
        isinstance(setting, list)
        and len(setting) >= 2
        and all(isinstance(end, (int, float)) for end in setting)
    ):
        first = int(rng.integers(len(setting) - 1)) if len(setting) > 2 else 0
        return float(rng.uniform(setting[first], setting[first + 1]))
    if isinstance(setting, bool) or not isinstance(setting, (int, float)):
        raise InputError(f"scene: value is {setting!r}, expected a number or [low, high]")
    return float(setting)


@dataclass(frozen=True)
class TwinScene:
    """The keys of a scene, with their units; None for a key that the scene does not state.

    A course takes the keys of its own section below; everything else is for any course.
    """

    subtypes: list[str] | None = None  # names of targets, one drawn per sample
    others: list[str] | None = None  # kinds of what belongs to no class, in place of targets
    course: str | None = None  # hover, pass or to_and_fro
    height_m: Setting | None = None  # over the radar, on every course

    # hover
    distance_m: Setting | None = None
    sway_m: Setting | None = None  # rms on each axis
    sway_hz: Setting | None = None  # fastest sway
    rock_deg: Setting | None = None  # rms of pitch and roll

    # pass; also speed_mps. acceleration_mps2 and curve_per_m stand both or neither.
    lateral_m: Setting | None = None
    ahead_m: Setting | None = None  # position along the road at the first symbol
    acceleration_mps2: Setting | None = None
    curve_per_m: Setting | None = None  # one over the radius of a bend

    # to_and_fro; also speed_mps
    near_m: Setting | None = None
    far_m: Setting | None = None
    turn_s: Setting | None = None

    speed_mps: Setting | None = None
    start_s: Setting = 0.0  # time of the first symbol on the course
    rate_hz: Setting | None = None  # of rotors or wings, by default the target's own
    spread: Setting = 0.0  # of the rotors' rates, as the effect `rotor_spread` has it
    wander: Setting = 0.0  # of the rotors' rates, as the effect `rotor_spread` has it
    strength_db: dict[str, Setting] | None = None  # kind of part, or foil -> dB
    texture_db: Setting = 0.0  # spread of the points' cross sections
    tip: Setting = 0.0  # exponent of a blade's growth to its tip
    foils: list[str] | None = None  # patterns of foil on blades, one drawn per sample
    flap: dict[str, Setting] | None = None  # changes of the wing beat, degrees
    size: dict[str, Setting] | None = None  # length, width, height as multiples of the subtype's
    beam: dict[str, Setting] | None = None  # width_deg and floor_db, along +y; None: everywhere
    second: dict | None = None  # a second target: share of samples, level_db, its own scene
    rate_error: Setting | None = None  # of the receiver's clock, relative
    receiver: dict[str, Setting] | None = None  # settings of `twin_receiver.Receiver`

    def stated(self, key: str) -> Any:
        """Return the setting of a key. Raises: KeyError where the scene does not state it."""
        setting = getattr(self, key)
        if setting is None:
            raise KeyError(key)
        return setting

    def drawn(self, key: str, rng: np.random.Generator) -> float:
        """Return a value of a key. Raises: KeyError and InputError as `stated` and `value`."""
        return value(self.stated(key), rng)


def clouds_of(records: dict[str, dict], names: list[str], seed: int) -> dict[str, Cloud]:
    """Return the built-in clouds of the subtypes `names`.

    records: the merged record of each subtype.
    Raises: InputError naming a subtype without a built-in record.
    """
    for name in names:
        if name not in records or records[name]["source"] not in ("builtin", "gait"):
            raise InputError(
                f"scene: subtype {name!r}, expected one with a built-in record of {sorted(records)}"
            )
    return {name: make(records[name], None, seed) for name in names}


def _course(
    scene: TwinScene, cloud: Cloud, times_s: np.ndarray, rng: np.random.Generator
) -> tuple[Course, float]:
    """The course at the times, and the target's speed (m/s)."""
    kind = scene.stated("course")
    heading = rng.uniform(0, 2 * np.pi)
    if kind == "hover":
        centre = np.array([0.0, scene.drawn("distance_m", rng), scene.drawn("height_m", rng)])
        rock = math.radians(scene.drawn("rock_deg", rng))
        sway_m = scene.drawn("sway_m", rng)
        sway_hz = scene.drawn("sway_hz", rng)
        return hover(times_s, centre, heading, sway_m, sway_hz, rock, rng), 0.0
    if kind == "pass":
        lateral = scene.drawn("lateral_m", rng)
        start = np.array([lateral, scene.drawn("ahead_m", rng), scene.drawn("height_m", rng)])
        speed = scene.drawn("speed_mps", rng)
        if scene.acceleration_mps2 is not None:
            acceleration = scene.drawn("acceleration_mps2", rng)
            curve = scene.drawn("curve_per_m", rng)
            return _driven(start, speed, acceleration, curve, cloud, times_s)
        yaw = 0.0 if speed > 0 else math.pi
        return straight(times_s, start, abs(speed), yaw), abs(speed)
    if kind == "to_and_fro":
        near = scene.drawn("near_m", rng)
        far = scene.drawn("far_m", rng)
        speed = scene.drawn("speed_mps", rng)
        turn = scene.drawn("turn_s", rng)
        gait_mps = cloud.record["track_speed_mps"]
        height = scene.drawn("height_m", rng)
        return to_and_fro(times_s, near, far, speed, turn, gait_mps, 0.0, height), speed
    raise InputError(f"scene: course is {kind!r}, expected hover, pass or to_and_fro")


def _driven(
    start_m: np.ndarray,
    speed_mps: float,
    acceleration_mps2: float,
    curve_per_m: float,
    cloud: Cloud,
    times_s: np.ndarray,
) -> tuple[Course, float]:
    """The course of `drive`, and the speed (m/s) at which its clock runs as fast as time.

    Wheels and limbs follow the way; rotors and wings do not.
    """
    own_mps = 1.0
    if "node" in cloud.kinds:
        own_mps = cloud.record["track_speed_mps"]
    yaw = 0.0 if speed_mps > 0 else math.pi
    course = drive(times_s, start_m, abs(speed_mps), yaw, acceleration_mps2, curve_per_m, own_mps)
    if cloud.like in AIRBORNE:
        course = course._replace(clock_s=times_s)
    return course, own_mps


def _rate(scene: TwinScene, cloud: Cloud, speed: float, rng: np.random.Generator) -> float:
    """The rate (Hz) of rotors, wings or wheels; wheels roll at the speed (m/s).

    Rotors and wings take the rates of the table of targets where the scene says none.
    """
    if cloud.like == "Vehicle":
        return speed / (math.pi * cloud.record["wheel_diameter_m"])
    if scene.rate_hz is not None:
        return value(scene.rate_hz, rng)
    if cloud.like not in AIRBORNE:
        return 0.0
    published = cloud.record["published"]
    return value([published["freq_lo_hz"] or 0.0, published["freq_hi_hz"] or 0.0], rng)


def heard(
    twin: Twin, settings: dict, clouds: dict[str, Cloud], rng: np.random.Generator, seconds: float
) -> tuple[np.ndarray, str]:
    """Return the complex echo (N,) of one drawn scene at the receiver, and the subtype's name.

    settings: keys of `TwinScene`; seconds: length without the margins, which the echo includes. A
    second target, where the scene has one, has a position and speed of its own.
    Raises: InputError for a scene with a wrong key or value.
    """
    scene = TwinScene(**settings)
    if scene.others is not None:
        kind = scene.others[int(rng.integers(len(scene.others)))]
        count = math.ceil((seconds + 2 * MARGIN * twin.symbol_interval_s) * twin.rate_hz)
        return other_echo(kind, twin, count, rng), kind
    signal, name = _of_one_target(twin, scene, clouds, rng, seconds)
    if scene.second is not None and rng.uniform() < scene.second["share"]:
        other = TwinScene(**scene.second.get("scene", settings))
        second, _ = _of_one_target(twin, other, clouds, rng, seconds)
        level = 10 ** (value(scene.second["level_db"], rng) / 20)
        signal = signal + level * rms(signal) / max(rms(second), 1e-300) * second
    return signal, name


def _cloud(scene: TwinScene, clouds: dict[str, Cloud], rng: np.random.Generator) -> Cloud:
    """The cloud of a drawn subtype with the flapping, size and strengths that the scene sets."""
    subtypes = scene.stated("subtypes")
    cloud = clouds[subtypes[int(rng.integers(len(subtypes)))]]
    if scene.flap is not None:
        flap = {key: value(setting, rng) for key, setting in scene.flap.items()}
        cloud = replace(cloud, record=cloud.record | {"flap": cloud.record["flap"] | flap})
    if scene.size is not None:
        factors = [value(scene.size[axis], rng) for axis in ("width", "length", "height")]
        cloud = sized(cloud, factors)
    strengths = scene.strength_db or {}
    strength = {kind: value(setting, rng) for kind, setting in strengths.items()}
    foil = ""
    if scene.foils:
        foil = scene.foils[int(rng.integers(len(scene.foils)))]
    cloud = strengthened(cloud, strength, foil)
    texture_db = value(scene.texture_db, rng)
    tip = value(scene.tip, rng)
    return textured(cloud, texture_db, tip, rng)


def _of_one_target(
    twin: Twin, scene: TwinScene, clouds: dict[str, Cloud], rng: np.random.Generator, seconds: float
) -> tuple[np.ndarray, str]:
    """As `_drawn_echo`. Raises: InputError for a key that the scene lacks or that does not fit."""
    try:
        return _drawn_echo(twin, scene, clouds, rng, seconds)
    except KeyError as error:
        # The record of a target lacks what a key of another kind of target changes, such as flap.
        raise InputError(
            f"scene {scene.course!r} of {scene.subtypes}: {error} is missing"
        ) from None


def _drawn_echo(
    twin: Twin, scene: TwinScene, clouds: dict[str, Cloud], rng: np.random.Generator, seconds: float
) -> tuple[np.ndarray, str]:
    """The echo of one drawn target, and its subtype's name."""
    cloud = _cloud(scene, clouds, rng)
    margin = 2 * MARGIN * twin.symbol_interval_s
    times = np.arange(math.ceil((seconds + margin) * twin.rate_hz)) / twin.rate_hz
    if scene.rate_error is not None:
        times *= 1 + value(scene.rate_error, rng)
    times += value(scene.start_s, rng)
    course, speed = _course(scene, cloud, times, rng)
    row = still_row(cloud, _rate(scene, cloud, speed, rng), rng)
    if "node" in cloud.kinds:
        row["start_s"] = float(rng.uniform(0, len(cloud.track) / cloud.record["track_rate_hz"]))
    spread = value(scene.spread, rng)
    wander = value(scene.wander, rng)
    signal = echo(twin, cloud, row, course, times, spread, wander, rng)
    if scene.beam is not None:
        width_deg = value(scene.beam["width_deg"], rng)
        floor_db = value(scene.beam["floor_db"], rng)
        signal *= beam_gain(course.place_m, width_deg, floor_db)
    return signal, cloud.subtype


def samples(
    twin: Twin, receiver: dict, signal: np.ndarray, rng: np.random.Generator, target: bool = True
) -> np.ndarray:
    """Return the samples (N,) that a receiver records of an echo (N,).

    receiver: its settings, which are drawn from their ranges; target: False for the same receiver
    and noise without the echo.
    """
    settings = Receiver.from_settings({key: value(item, rng) for key, item in receiver.items()})
    return received(signal, twin.rate_hz, settings, twin.channel == "real", rng, target)


def stretch(values: np.ndarray, twin: Twin, seconds: float) -> np.ndarray:
    """Return simulated samples at the symbol rate, with the margins cut off."""
    signal = symbol_rate(values, twin.rate_hz, twin.symbol_interval_s, twin.sampling)
    return signal[MARGIN : MARGIN + math.floor(seconds / twin.symbol_interval_s + 1e-6)]


REDRAWS = 8
"""Largest number of receivers drawn for one echo, and of echoes drawn for a window, until its
target is above the noise. The last one is kept anyway."""


class Drawn(NamedTuple):
    """A coherent interval (symbols,) of an echo at a receiver.

    quiet: the same without the echo, where targets move; found: whether the target stands above
    the noise.
    """

    interval: np.ndarray
    quiet: np.ndarray
    found: bool


def _drawn(twin: Twin, receiver: dict, signal: np.ndarray, keys: tuple) -> Drawn:
    """The interval of an echo at a receiver.

    A moving target is not heard all the time: the receiver is drawn again while none is present.
    """
    seconds = twin.symbols * twin.symbol_interval_s

    def interval(redraw: int, target: bool) -> np.ndarray:
        """The interval (1, symbols) at one drawn receiver."""
        values = samples(twin, receiver, signal, stream(*keys, redraw), target)
        return coherent_intervals(stretch(values, twin, seconds), twin.symbols, slow=twin.slow)

    for redraw in range(REDRAWS):
        heard_interval = interval(redraw, target=True)
        if not twin.slowest_mps:
            return Drawn(heard_interval[0], heard_interval[0], found=True)
        quiet = interval(redraw, target=False)
        found = bool(present(heard_interval, twin, quiet).all())
        if found:
            break
    return Drawn(heard_interval[0], quiet[0], found)


def intervals(
    twin: Twin,
    scene: dict,
    clouds: dict[str, Cloud],
    seed: int,
    keys: tuple,
    count: int,
    receivers: int = 1,
    quiet: bool = False,
) -> tuple[np.ndarray, list[str]]:
    """Return simulated coherent intervals (count, receivers, symbols) and their subtypes' names.

    scene: keys of `TwinScene`; quiet: the same without the targets, where targets move.
    Each of `count` scenes is drawn once. Its echo goes to `receivers` receivers, each drawn from
    the scene's ranges. As with recordings, a window counts if its target stands above the noise
    (`presence.present`); a hovering target counts at any SNR. A scene whose target no receiver
    hears, such as a car that stands, is drawn again.
    """
    seconds = twin.symbols * twin.symbol_interval_s
    result = np.empty((count, receivers, twin.symbols), np.complex128)
    names = []
    for number in reported(range(count), count, "scenes"):
        for again in range(REDRAWS):
            which = (number, again) if again else (number,)
            signal, name = heard(twin, scene, clouds, stream(seed, "twin", *keys, *which), seconds)
            heard_by_all = True
            for receiver in range(receivers):
                receiver_keys = (seed, "twin-receiver", *keys, *which, receiver)
                drawn = _drawn(twin, scene["receiver"], signal, receiver_keys)
                without_target = quiet or name == NOTHING
                result[number, receiver] = drawn.quiet if without_target else drawn.interval
                heard_by_all = heard_by_all and drawn.found
                if not drawn.found and again + 1 < REDRAWS and twin.slowest_mps:
                    break
            if heard_by_all:
                break
        names.append(name)
    return result, names


SCENES = "config/measured/scenes.yaml"
"""The usual scenes and receiver, for whatever the record of a radar does not state."""
ROOM_M = 2.5
"""Least distance between the ends of a walk."""


def _at_distances(scene: dict, said: dict) -> dict:
    """A usual scene with the distances, heights and beam of a record's block `twin`."""
    near, far = said["distance_m"]
    scene = {**scene, "height_m": said["height_m"]}
    scene["beam"] = {"width_deg": said["beam_deg"], "floor_db": -20.0}
    if scene["course"] == "hover":
        scene["distance_m"] = [near, far]
    elif scene["course"] == "pass":
        scene |= {"lateral_m": [near, max(near, far / 3)], "ahead_m": [-far / 4, far]}
    else:
        last = near + 0.2 * (far - near)
        scene |= {
            "near_m": [near, last],
            "far_m": [max(last + ROOM_M, 0.6 * far), max(last + ROOM_M, far)],
        }
    return scene


def scenes_of(record: Record, snr_db: list[float], usual: dict) -> dict[str, list[dict]]:
    """Return the scenes of each class of a record, their receivers filled in.

    snr_db: range of SNR (dB); usual: the content of `SCENES`, for whatever the record's block
    `twin` does not say.
    """
    said = record.twin or {}
    receiver = usual["receiver"] | said.get("receiver", {}) | {"snr_db": snr_db}
    # Values are drawn in this order, whatever the order of the files is.
    receiver = {key: receiver[key] for key in Receiver.__dataclass_fields__ if key in receiver}
    result = {}
    for label in said.get("classes", CATEGORIES):
        if label == NO_CLASS:
            result[label] = [{"others": list(KINDS), "receiver": receiver}]
            continue
        scenes = said.get("scenes", {}).get(label)
        if scenes is None:
            scenes = [_at_distances(scene, said) for scene in usual["scenes"][label]]
        elif scenes == "usual":
            scenes = usual["scenes"][label]
        if names := said.get("subtypes", {}).get(label):
            scenes = [{**scene, "subtypes": names} for scene in scenes]
        result[label] = [
            {**scene, "receiver": receiver | scene.get("receiver", {})} for scene in scenes
        ]
    return result


@dataclass(frozen=True)
class Library:
    """All twins of some radars, their scenes and the records of all targets.

    twins: name -> twin; scenes: name -> category -> scenes with the keys of `TwinScene`, receivers
    filled in; records: subtype -> record.
    """

    seed: int
    twins: dict[str, Twin]
    scenes: dict[str, dict[str, list[dict]]]
    records: dict[str, dict]

    @classmethod
    def of(cls, radars: dict[str, tuple[Record, Twin, list[float]]]) -> "Library":
        """Return the library of radars by name: their record, twin and range of SNR (dB).

        Raises: InputError where the record of an own target is wrong.
        """
        usual = load_yaml(shipped(SCENES), "usual scenes")
        twins = {}
        scenes = {}
        own_targets: dict[str | Path, None] = {}
        for name, (about, twin, snr_db) in radars.items():
            twins[name] = twin
            scenes[name] = scenes_of(about, snr_db, usual)
            own_targets |= dict.fromkeys((about.twin or {}).get("targets", []))
        table = shipped(usual["targets"]["table"])
        files: list[str | Path] = [*map(shipped, usual["targets"]["records"]), *own_targets]
        return cls(int(usual["seed"]), twins, scenes, load_records(table, files))

    @classmethod
    def read(cls, folder: str | Path = RADARS, over: dict | None = None) -> "Library":
        """Return the library of the records of radars in a folder, by rising carrier.

        over: as `twin.records`. Raises: InputError as `twin.records` and `of`, and for a record
        without snr_db.
        """
        radars = {}
        for name, about in records(folder, over).items():
            said = about.twin or {}
            if "snr_db" not in said:
                raise InputError(
                    f"{about.file}: the record says nothing of twin.snr_db, expected a range in dB"
                )
            radars[name] = about, twin_of(about, float(about.rate_hz or 0)), said["snr_db"]
        return cls.of(radars)

    def simulated(
        self,
        twin: str,
        category: str,
        count: int,
        purpose: str,
        receivers: int = 1,
        quiet: bool = False,
    ) -> tuple[np.ndarray, list[str]]:
        """Return simulated intervals (count, receivers, symbols) of a category and their subtypes.

        The category's scenes share the `count` intervals evenly. `purpose` keys the random streams:
        equal purposes give equal scenes. quiet: the same intervals without their targets, as
        `intervals`.
        """
        scenes = self.scenes[twin][category]
        subtypes_of_all: dict[str, None] = {}
        for scene in scenes:
            second = scene.get("second", {}).get("scene", {})
            subtypes_of_all |= dict.fromkeys(scene.get("subtypes", ()))
            subtypes_of_all |= dict.fromkeys(second.get("subtypes", ()))
        clouds = clouds_of(self.records, list(subtypes_of_all), self.seed)
        of_scenes = []
        names = []
        for number, scene in enumerate(scenes):
            share = len(range(number, count, len(scenes)))
            keys = (purpose, twin, category, number)
            signals, subtypes = intervals(
                self.twins[twin], scene, clouds, self.seed, keys, share, receivers, quiet
            )
            of_scenes.append(signals)
            names += subtypes
        return np.concatenate(of_scenes), names
