"""The calibration point cloud (CPC): the one file that passes from targets to motion.

The module says what it must hold.

A cloud is a NumPy archive (.npz): it keeps float64 exactly, holds several arrays of different shape
in one file, and NumPy, MATLAB (scipy.io) and Julia open it without our code. Frame: metres,
body-centred, front +y, up +z. Every point belongs to one part; every part except the body moves.

    points      (L, 3)  float64  m
    normals     (L, 3)  float64  outward unit vectors, NaN where the source has none
    rcs_m2      (L,)    float64  radar cross section of each point
    part        (L,)    int64    index of the point's part
    kinds       (P,)    str      body | rotor | wing | wheel | node
    names       (P,)    str      one name a part, unique in the cloud
    parents     (P,)    int64    the part that this part's hinge moves with (an outer wing: its
                                 inner wing), -1 for none
    hinges      (P, 3)  float64  m, a point on the part's axis (NaN for body and node)
    axes        (P, 3)  float64  unit vector of the axis; its sign is a rotor's sense (NaN for body
                                 and node)
    track       (F, L, 3) float64  m, a cyclic recording of all points (F = 0 unless the parts are
                                 nodes)
    record      str     JSON: subtype, category, source, checksum, track_rate_hz, rate_factors,
                        sizes, ...
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

import numpy as np

from lowalt.config import classes
from lowalt.files.archives import write_arrays
from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError, reading
from lowalt.files.json_objects import json_object

KINDS = ("body", "rotor", "wing", "wheel", "node")
MOST_TURNING_PARTS = 16
"""Most rotors or wheels of a cloud, each with a phase of its own.

EH216-S, flown as coaxial pairs, has 16 rotors.
"""

LARGEST_RATE_FACTOR = 100
LARGEST_M = 1e3
LARGEST_RCS_M2 = 1e9
"""Bounds of coordinates and cross sections.

They are far more than any target has, and far less than what overflows.
"""


@dataclass(frozen=True)
class Cloud:
    """A calibration point cloud; shapes and units in the module's docstring."""

    points: np.ndarray
    part: np.ndarray
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    parents: np.ndarray
    hinges: np.ndarray
    axes: np.ndarray
    normals: np.ndarray
    rcs_m2: np.ndarray
    record: dict
    track: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3)))

    @property
    def subtype(self) -> str:
        """The subtype's published name."""
        return self.record["subtype"]

    @property
    def category(self) -> str:
        """The target's class, a word of the table of targets."""
        return self.record["category"]

    @property
    def like(self) -> str:
        """The published class that the target is built, moves and reflects like."""
        return classes.like(self.record)

    @property
    def rate_factors(self) -> np.ndarray:
        """Rate of each part (P,) divided by the rate of its motion model.

        It is 1 unless the record states it.
        """
        factors = self.record.get("rate_factors", {})
        return np.array([float(factors.get(name, 1.0)) for name in self.names])

    def parts_of(self, kind: str) -> list[int]:
        """Indices of the parts of one kind, in the cloud's order."""
        return [index for index, name in enumerate(self.kinds) if name == kind]


def check(cloud: Cloud, where: str) -> Cloud:
    """Return the cloud if it keeps the contract.

    Raises: InputError naming `where`, the array and what was expected.
    """
    with reading(where, "cloud"):
        for good, fault in chain(_arrays(cloud), _parts(cloud), _facts(cloud)):
            if not good:
                raise InputError(fault)
    return cloud


def _near(positions: np.ndarray) -> bool:
    """Return whether all coordinates are numbers within LARGEST_M."""
    return bool((abs(positions) <= LARGEST_M).all())


def _arrays(cloud: Cloud) -> Iterator[tuple[bool, str]]:
    """Return whether each array has its shape and numbers in range.

    The text of each pair states the fault.
    """
    count = len(cloud.points)
    parts = len(cloud.kinds)
    yield count > 0, "points is empty, expected at least one point"
    shapes = {
        "points": (count, 3),
        "normals": (count, 3),
        "rcs_m2": (count,),
        "part": (count,),
        "parents": (parts,),
        "hinges": (parts, 3),
        "axes": (parts, 3),
    }
    for name, shape in shapes.items():
        array = getattr(cloud, name)
        numbers = "iuf"
        if name in ("part", "parents"):
            numbers = "iu"
        yield np.shape(array) == shape, f"{name} has shape {np.shape(array)}, expected {shape}"
        yield (
            array.dtype.kind in numbers,
            f"{name} has values of type {array.dtype}, expected numbers",
        )
    yield _near(cloud.points), f"points has a coordinate that is no number within {LARGEST_M:g} m"
    good_rcs = (cloud.rcs_m2 >= 0) & (cloud.rcs_m2 <= LARGEST_RCS_M2)
    yield (
        bool(good_rcs.all()),
        f"rcs_m2 has a value that is no number from 0 to {LARGEST_RCS_M2:g} m2",
    )
    lengths = np.linalg.norm(cloud.normals, axis=1)
    good_normals = np.isnan(lengths) | (abs(lengths - 1) < 1e-9)
    yield bool(good_normals.all()), "normals has a vector of length other than 1 or NaN"


def _parts(cloud: Cloud) -> Iterator[tuple[bool, str]]:
    """Return whether name, kind, parent, hinge and axis of each part are right.

    The text of each pair states the fault.
    """
    count = len(cloud.kinds)
    unique = len(set(cloud.names)) == count == len(cloud.names)
    yield unique, f"names {cloud.names}, expected {count} unique names"
    yield set(cloud.kinds) <= set(KINDS), f"kinds {sorted(set(cloud.kinds))}, expected only {KINDS}"
    yield (
        cloud.part.min() >= 0 and cloud.part.max() < count,
        f"part names a part outside 0..{count - 1}",
    )
    parts = zip(cloud.kinds, cloud.names, cloud.parents, strict=True)
    for index, (kind, name, parent) in enumerate(parts):
        yield -1 <= parent < index, f"parents[{index}] is {parent}, expected an earlier part or -1"
        if kind in ("rotor", "wing", "wheel"):
            length = np.linalg.norm(cloud.axes[index])
            yield (
                bool(abs(length - 1) < 1e-12),
                f"axes[{index}] ({name}) has length {length}, expected 1",
            )
            yield (
                _near(cloud.hinges[index]),
                f"hinges[{index}] ({name}) is no place within {LARGEST_M:g} m",
            )


def _facts(cloud: Cloud) -> Iterator[tuple[bool, str]]:
    """Return whether the record has all required keys and a track fits its nodes.

    The text of each pair states the fault.
    """
    missing = {"subtype", "category", "source", "checksum"} - set(cloud.record)
    yield not missing, f"record lacks {sorted(missing)}"
    classes.refuse_subtype(cloud.record["subtype"], "record")
    classes.like(cloud.record)
    factors = cloud.record.get("rate_factors", {})
    yield (
        isinstance(factors, dict),
        f"rate_factors: {factors!r}, expected numbers by the parts' names",
    )
    turning_parts = sorted([*cloud.parts_of("rotor"), *cloud.parts_of("wheel")])
    turning = [cloud.names[part] for part in turning_parts]
    strange = sorted(set(factors) - set(turning))
    yield not strange, f"rate_factors: {strange} are no parts that turn, expected some of {turning}"
    good = all(
        isinstance(value, (int, float)) and 0 <= value <= LARGEST_RATE_FACTOR
        for value in factors.values()
    )
    yield good, f"rate_factors: {factors}, expected numbers from 0 to {LARGEST_RATE_FACTOR}"
    if "node" in cloud.kinds:
        count = len(cloud.points)
        shape = cloud.track.shape
        fits = len(shape) == 3 and shape[1:] == (count, 3) and shape[0] >= 2
        yield fits, f"track has shape {shape}, expected (frames >= 2, {count}, 3)"
        yield _near(cloud.track), f"track has a coordinate that is no number within {LARGEST_M:g} m"
        yield (
            cloud.record.get("track_rate_hz", 0) > 0,
            "record.track_rate_hz is missing, expected a positive rate",
        )
        yield (
            list(cloud.part) == list(range(count)),
            "part of a node cloud must be 0..L-1, one part a node",
        )


def extent(cloud: Cloud) -> float:
    """Return the longest side (m) of the box around a cloud's points in all frames."""
    positions = cloud.points
    if len(cloud.track):
        positions = cloud.track.reshape(-1, 3)
    return float((positions.max(axis=0) - positions.min(axis=0)).max())


def scaled(cloud: Cloud, factor: float) -> Cloud:
    """Return a cloud `factor` times as large; cross sections and turning rates stay."""
    return replace(
        cloud,
        points=factor * cloud.points,
        hinges=factor * cloud.hinges,
        track=factor * cloud.track,
    )


def cloud_of(clouds: Mapping[str, Cloud], row: dict) -> Cloud:
    """Return the cloud of a motion table's row among `clouds`, by subtype.

    It has the row's own size where the row states one.

    Raises: InputError naming the sample where there is none.
    """
    if row["subtype"] not in clouds:
        raise InputError(
            f"{row['subtype']}, model {row['model']}: no cloud of this subtype among "
            f"{sorted(clouds)}"
        )
    cloud = clouds[row["subtype"]]
    if "scale" in row:
        return scaled(cloud, row["scale"])
    return cloud


def write(path: str | Path, cloud: Cloud) -> None:
    """Write a checked cloud; equal clouds give equal bytes.

    Raises: InputError where the cloud breaks the contract.
    """
    check(cloud, str(path))
    arrays = {
        "points": cloud.points,
        "normals": cloud.normals,
        "rcs_m2": cloud.rcs_m2,
        "part": cloud.part.astype(np.int64),
        "kinds": np.array(cloud.kinds),
        "names": np.array(cloud.names),
        "parents": cloud.parents.astype(np.int64),
        "hinges": cloud.hinges,
        "axes": cloud.axes,
        "track": cloud.track,
        "record": np.array(json.dumps(cloud.record, sort_keys=True)),
    }
    with replacing(path) as temporary:
        write_arrays(temporary, arrays)


def read_clouds(paths: Iterable[str | Path]) -> dict[str, Cloud]:
    """Return the clouds of files by their subtypes. Raises: as `read`."""
    return {cloud.subtype: cloud for cloud in map(read, paths)}


def read(path: str | Path) -> Cloud:
    """Read and check a cloud file.

    Raises: InputError naming the file and what is wrong with it.
    """
    checked_archive(path, "cloud")
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        record = json_object(str(arrays.pop("record")), path, "a cloud")
        kinds = tuple(map(str, arrays.pop("kinds")))
        names = tuple(map(str, arrays.pop("names")))
        cloud = Cloud(kinds=kinds, names=names, record=record, **arrays)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a cloud file ({error})") from error
    return check(cloud, str(path))
