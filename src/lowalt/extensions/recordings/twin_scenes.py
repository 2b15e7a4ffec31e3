"""Scenes of a twin: targets in front of the radar and their courses, drawn from the ranges of a
configuration.

A value of a scene is a number, [low, high] for a uniform draw, or [a, b, c, ...] for one whose
stretches a to b, b to c and so on are equally probable. Keys of a scene (`scene` in
brought.schema.yaml):
    subtypes       names of targets, one drawn per sample
    course         hover | pass | to_and_fro, and the course's own keys:
                   hover: distance_m, height_m, sway_m, sway_hz, rock_deg
                   pass: lateral_m, height_m, speed_mps, ahead_m (place along the road at the first
                   symbol); acceleration_mps2 and curve_per_m (one over the radius of a bend), both
                   or neither
                   to_and_fro: near_m, far_m, height_m, speed_mps, turn_s
    rate_hz        of rotors or wings (optional: the target's own); wheels roll with the speed
    spread, wander of the rotors' rates, as the effect `rotor_spread` has them (both optional)
    strength_db    kind of part -> dB on its cross section; foil: dB of foil on a blade
    texture_db     spread of the points' cross sections; tip: exponent of a blade's growth to its
    tip (both optional) beam           width_deg and floor_db of the antenna, which looks along +y
    (optional: all directions) foils          patterns of foil, one drawn per sample (optional)
    flap           changes of the wing beat, degrees (optional)
    size           length, width and height as multiples of the subtype's (optional)
    second         share of samples with a second target, its level_db, and its scene (optional; the
    same scene) rate_error     of the receiver's clock (optional)
    receiver       settings of `twin_receiver.Receiver` that differ from those of the radar
    (optional)
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

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


def value(setting: float | list[float], rng: np.random.Generator) -> float:
    """Return a setting's value: the number, or a draw from the stretches between the numbers of a
    list, which are equally probable; uniform within each.

    Raises: InputError for anything else.
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


def clouds_of(records: dict[str, dict], names: list[str], seed: int) -> dict[str, Cloud]:
    """Return the built-in clouds of the subtypes `names`; records: the merged record of each
    subtype.

    Raises: InputError naming a subtype without a built-in record.
    """
    for name in names:
        if name not in records or records[name]["source"] not in ("builtin", "gait"):
            raise InputError(
                f"scene: subtype {name!r}, expected one with a built-in record of {sorted(records)}"
            )
    return {name: make(records[name], None, seed) for name in names}


def _course(
    scene: dict, cloud: Cloud, times_s: np.ndarray, rng: np.random.Generator
) -> tuple[Course, float]:
    """The course at the times, and the target's speed (m/s)."""

    def drawn(key: str) -> float:
        """The value of one of the course's keys."""
        return value(scene[key], rng)

    kind = scene["course"]
    heading = rng.uniform(0, 2 * np.pi)
    if kind == "hover":
        place = np.array([0.0, drawn("distance_m"), drawn("height_m")])
        rock = math.radians(drawn("rock_deg"))
        return hover(times_s, place, heading, drawn("sway_m"), drawn("sway_hz"), rock, rng), 0.0
    if kind == "pass":
        place = np.array([drawn("lateral_m"), drawn("ahead_m"), drawn("height_m")])
        speed = drawn("speed_mps")
        if "acceleration_mps2" in scene:
            return _driven(
                place, speed, drawn("acceleration_mps2"), drawn("curve_per_m"), cloud, times_s
            )
        return straight(times_s, place, abs(speed), 0.0 if speed > 0 else math.pi), abs(speed)
    if kind == "to_and_fro":
        walk = [drawn(name) for name in ("near_m", "far_m", "speed_mps", "turn_s")]
        return to_and_fro(
            times_s, *walk, cloud.record["track_speed_mps"], 0.0, drawn("height_m")
        ), walk[2]
    raise InputError(f"scene: course is {kind!r}, expected hover, pass or to_and_fro")


def _driven(
    place_m: np.ndarray,
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
    course = drive(times_s, place_m, abs(speed_mps), yaw, acceleration_mps2, curve_per_m, own_mps)
    if cloud.like in AIRBORNE:
        course = course._replace(clock_s=times_s)
    return course, own_mps


def _rate(scene: dict, cloud: Cloud, speed: float, rng: np.random.Generator) -> float:
    """The rate (Hz) of rotors, wings or wheels; wheels roll at the speed (m/s).

    Rotors and wings take the rates of the table of targets where the scene says none.
    """
    if cloud.like == "Vehicle":
        return speed / (math.pi * cloud.record["wheel_diameter_m"])
    if "rate_hz" in scene or cloud.like not in AIRBORNE:
        return value(scene.get("rate_hz", 0.0), rng)
    return value(
        [cloud.record["published"][key] or 0.0 for key in ("freq_lo_hz", "freq_hi_hz")], rng
    )


def heard(
    twin: Twin, scene: dict, clouds: dict[str, Cloud], rng: np.random.Generator, seconds: float
) -> tuple[np.ndarray, str]:
    """Return the complex echo (N,) of one drawn scene at the receiver's rate, margins included, and
    the subtype's name.

    seconds: length without the margins. A second target, where the scene has one, drives at its own
    place and speed.
    Raises: InputError for a scene with a wrong key or value.
    """
    if "others" in scene:
        kind = scene["others"][int(rng.integers(len(scene["others"])))]
        count = math.ceil((seconds + 2 * MARGIN * twin.symbol_interval_s) * twin.rate_hz)
        return other_echo(kind, twin, count, rng), kind
    signal, name = _of_one_target(twin, scene, clouds, rng, seconds)
    if "second" in scene and rng.uniform() < scene["second"]["share"]:
        second, _ = _of_one_target(twin, scene["second"].get("scene", scene), clouds, rng, seconds)
        level = 10 ** (value(scene["second"]["level_db"], rng) / 20)
        signal = signal + level * rms(signal) / max(rms(second), 1e-300) * second
    return signal, name


def _of_one_target(
    twin: Twin, scene: dict, clouds: dict[str, Cloud], rng: np.random.Generator, seconds: float
) -> tuple[np.ndarray, str]:
    """The echo of one drawn target, and its subtype's name."""
    try:
        name = scene["subtypes"][int(rng.integers(len(scene["subtypes"])))]
        cloud = clouds[name]
        if "flap" in scene:
            flap = {key: value(setting, rng) for key, setting in scene["flap"].items()}
            cloud = replace(cloud, record=cloud.record | {"flap": cloud.record["flap"] | flap})
        if "size" in scene:
            cloud = sized(
                cloud, [value(scene["size"][axis], rng) for axis in ("width", "length", "height")]
            )
        strength = {
            kind: value(setting, rng) for kind, setting in scene.get("strength_db", {}).items()
        }
        foils = scene.get("foils")
        cloud = strengthened(cloud, strength, foils[int(rng.integers(len(foils)))] if foils else "")
        cloud = textured(
            cloud, *(value(scene.get(key, 0.0), rng) for key in ("texture_db", "tip")), rng
        )
        margin = 2 * MARGIN * twin.symbol_interval_s
        times = np.arange(math.ceil((seconds + margin) * twin.rate_hz)) / twin.rate_hz
        if "rate_error" in scene:
            times *= 1 + value(scene["rate_error"], rng)
        times += value(scene.get("start_s", 0.0), rng)
        course, speed = _course(scene, cloud, times, rng)
        row = still_row(cloud, _rate(scene, cloud, speed, rng), rng)
        if "node" in cloud.kinds:
            row["start_s"] = float(rng.uniform(0, len(cloud.track) / cloud.record["track_rate_hz"]))
        wander = [value(scene.get(key, 0.0), rng) for key in ("spread", "wander")]
        signal = echo(twin, cloud, row, course, times, *wander, rng)
        if "beam" in scene:
            signal *= beam_gain(
                course.place_m,
                *(value(scene["beam"][key], rng) for key in ("width_deg", "floor_db")),
            )
    except KeyError as error:
        raise InputError(
            f"scene {scene.get('course')!r} of {scene.get('subtypes')}: {error} is missing"
        ) from None
    return signal, name


def samples(
    twin: Twin, receiver: dict, signal: np.ndarray, rng: np.random.Generator, target: bool = True
) -> np.ndarray:
    """Return the samples (N,) that the receiver records of an echo (N,); its settings are drawn
    from their ranges.

    target: False for the same receiver and noise without the echo.
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
    """A coherent interval (symbols,) of an echo at a receiver, the same without the echo where
    targets move, and whether the target stands above the noise."""

    interval: np.ndarray
    quiet: np.ndarray
    found: bool


def _drawn(twin: Twin, receiver: dict, signal: np.ndarray, keys: tuple) -> Drawn:
    """The interval of an echo at a receiver. Where targets move, so that they are not heard all the
    time, the receiver is drawn again while no target is present."""
    seconds = twin.symbols * twin.symbol_interval_s
    for redraw in range(REDRAWS):
        both = []
        for target in (True, False) if twin.slowest_mps else (True,):
            values = samples(twin, receiver, signal, stream(*keys, redraw), target)
            both.append(
                coherent_intervals(stretch(values, twin, seconds), twin.symbols, slow=twin.slow)
            )
        found = not twin.slowest_mps or bool(present(both[0], twin, both[-1]).all())
        if found:
            break
    return Drawn(both[0][0], both[-1][0], found)


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
    """Return simulated coherent intervals (count, receivers, symbols) and their subtypes' names
    (count); quiet: the same without the targets, where targets move.

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
                result[number, receiver] = (
                    drawn.quiet if quiet or name == NOTHING else drawn.interval
                )
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


def _placed(scene: dict, said: dict) -> dict:
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
            scenes = [_placed(scene, said) for scene in usual["scenes"][label]]
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
    """All twins of some radars: name -> twin, and category -> scenes, receivers filled in; records:
    of all targets.
    """

    seed: int
    twins: dict[str, Twin]
    scenes: dict[str, dict[str, list[dict]]]
    records: dict[str, dict]

    @classmethod
    def of(cls, radars: dict[str, tuple[Record, Twin, list[float]]]) -> "Library":
        """Return the library of radars by name, each with its record, its twin and its range of SNR
        (dB).

        Raises: InputError where the record of an own target is wrong.
        """
        usual = load_yaml(shipped(SCENES), "usual scenes")
        own = dict.fromkeys(
            name for about, *_ in radars.values() for name in (about.twin or {}).get("targets", [])
        )
        table = usual["targets"]["table"]
        records = usual["targets"]["records"]
        known = load_records(shipped(table), [*map(shipped, records), *own])
        scenes = {
            name: scenes_of(about, snr_db, usual) for name, (about, _, snr_db) in radars.items()
        }
        return cls(
            int(usual["seed"]), {name: twin for name, (_, twin, _) in radars.items()}, scenes, known
        )

    @classmethod
    def read(cls, folder: str | Path = RADARS, over: dict | None = None) -> "Library":
        """Return the library of the records of radars in a folder, by rising carrier.

        over: as `twin.records`. Raises: InputError as `twin.records` and `of`, and for a record
        without snr_db.
        """
        radars = {}
        for name, about in records(folder, over).items():
            if "snr_db" not in (about.twin or {}):
                raise InputError(
                    f"{about.file}: the record says nothing of twin.snr_db, expected a range in dB"
                )
            radars[name] = about, twin_of(about, float(about.rate_hz or 0)), about.twin["snr_db"]
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
        """Return simulated intervals (count, receivers, symbols) of a category, and the names of
        their subtypes.

        The category's scenes share the `count` intervals evenly. `purpose` keys the random streams:
        equal purposes give equal scenes. quiet: the same intervals without their targets, as
        `intervals`.
        """
        scenes = self.scenes[twin][category]
        seconds = [
            scene["second"]["scene"] for scene in scenes if "scene" in scene.get("second", {})
        ]
        subtypes_of_all = dict.fromkeys(
            name for scene in [*scenes, *seconds] for name in scene.get("subtypes", ())
        )
        clouds = clouds_of(self.records, list(subtypes_of_all), self.seed)
        parts = []
        names = []
        for number, scene in enumerate(scenes):
            share = len(range(number, count, len(scenes)))
            keys = (purpose, twin, category, number)
            signals, subtypes = intervals(
                self.twins[twin], scene, clouds, self.seed, keys, share, receivers, quiet
            )
            parts.append(signals)
            names += subtypes
        return np.concatenate(parts), names
