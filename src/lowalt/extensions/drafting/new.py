"""The draft of a record from a file and what the user states about it.

A draft passes every check that `make` has.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from lowalt.extensions.drafting.draft import chosen, drafted, refuse_miscount
from lowalt.extensions.drafting.guesses import UNUSUAL, USUAL_M, guessed_unit
from lowalt.extensions.drafting.inspection import Inspection, inspect_mesh
from lowalt.extensions.drafting.robot_files import is_description, read_robot
from lowalt.extensions.drafting.robots import (
    WHICH,
    category_of,
    drafted_robot,
    front_of_robot,
    parts_of,
    write_parts,
)
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.targets.make import make
from lowalt.targets.mesh_files import UNITS_M, metres
from lowalt.targets.mesh_record import MOVING_KIND
from lowalt.targets.records import merge, with_row

SEED = 20260701


@dataclass(frozen=True)
class Asked:
    """What a user states: the file, the folder of inputs, the table of targets, and known facts.

    `count` rotors or wheels; `moving` words such as 5+6 that number the pieces that move; `glb` the
    name of the file into which the parts of a description are written; `picture` where a picture
    with numbers goes.
    """

    file: Path
    inputs: Path
    table: dict[str, dict]
    subtype: str | None = None
    category: str | None = None
    unit: str | float | None = None
    size_m: float | None = None
    up: str | None = None
    front: str | None = None
    count: int | None = None
    moving: list[str] | None = None
    glb: str = "parts.glb"
    picture: Path = Path("pieces.png")

    @property
    def name(self) -> str:
        """The name of the target: by default of its file, or of the folder of a `model.sdf`."""
        if self.subtype:
            return self.subtype
        if self.file.stem == "model":
            return self.file.resolve().parent.name
        return self.file.stem

    @property
    def row(self) -> dict:
        """The published row of the target, empty for a target with a row of its own."""
        return self.table.get(self.name, {})


@dataclass(frozen=True)
class Draft:
    """The `text` of a record file, and the bytes of the GLB with the parts of a description."""

    text: str
    glb: bytes | None = None


def _refuse(asked: Asked) -> None:
    """Refuse a pedestrian, an unpublished name without a category, and a size that is none."""
    if asked.row.get("category") == "Pedestrian":
        raise InputError(
            f"--subtype is {asked.name!r}, a pedestrian, expected a UAV, a bird or a vehicle"
        )
    if asked.size_m is not None and not 0 < asked.size_m < 1e6:
        raise InputError(f"--size is {asked.size_m}, expected metres")
    if not (asked.row or asked.category or is_description(asked.file)):
        if asked.subtype:
            raise InputError(
                f"--subtype is {asked.subtype!r}, expected one of {list(asked.table)}, or "
                "--category for a row of its own"
            )
        raise InputError(
            f"{asked.file}: its category cannot be seen: {WHICH}; or --subtype with a published "
            "target"
        )


def draft(asked: Asked, show: Callable[[Inspection], None]) -> Draft:
    """Return the draft of a record for a mesh file or a robot's description.

    show: draws the pieces of a mesh with numbers into asked.picture, before a wrong number of
    moving parts is refused.
    Raises: InputError naming the file and the option to give: whatever cannot be seen, and whatever
    `make` refuses.
    """
    _refuse(asked)
    path = existing(asked.file, "mesh or description").resolve()
    inputs = asked.inputs.resolve()
    if not path.is_relative_to(inputs):
        raise InputError(
            f"{asked.file}: not inside the folder of inputs {asked.inputs}, expected --inputs with "
            "it"
        )
    if not is_description(asked.file):
        category = str(asked.row.get("category") or asked.category)
        text = _of_mesh(asked, asked.file, path.relative_to(inputs).as_posix(), category, show)
        _check(asked, text, asked.inputs)
        return Draft(text)
    with TemporaryDirectory() as folder:
        text = _of_robot(asked, Path(folder) / asked.glb, show)
        _check(asked, text, Path(folder))
        return Draft(text, (Path(folder) / asked.glb).read_bytes())


def _of_robot(asked: Asked, glb: Path, show: Callable[[Inspection], None]) -> str:
    """The record of a robot's description, whose parts are written into the file `glb`."""
    robot = read_robot(asked.file, asked.inputs)
    axes = (asked.up, asked.front)
    try:
        category = asked.row.get("category") or asked.category or category_of(robot)
        kind = MOVING_KIND[category]
        ahead = None
        if category == "Bird":
            front = front_of_robot(robot, {}, category, axes).axis
            ahead = np.eye(3)["xyz".index(front[-1])]
        joints, triangles = parts_of(robot, kind, ahead)
        if joints:
            write_parts(glb, triangles)
            count = asked.count
            if count is None:
                count = asked.row.get("n_rotors_or_wings", len(joints))
            if kind != "wing" and count != len(joints):
                raise InputError(
                    f"{len(joints)} {kind}s turn, expected {count} for {asked.name}: leave "
                    "--subtype and the number out for a row of its own, or choose a target with "
                    "as many"
                )
            names = (asked.name, asked.file.name, glb.name)
            return drafted_robot(robot, (joints, triangles), category, asked.table, names, axes)
    except InputError as error:
        raise InputError(f"{asked.file}: {error}") from None
    # The names of links tell rotors that no joint turns; their pieces are looked at like those of a
    # mesh.
    of_links = {}
    for link, surfaces in robot.surfaces.items():
        if surfaces:
            of_links[link] = np.concatenate(surfaces)
    write_parts(glb, of_links)
    return _of_mesh(replace(asked, unit="m", up=asked.up or "z"), glb, glb.name, category, show)


def _of_mesh(
    asked: Asked, path: Path, file: str, category: str, show: Callable[[Inspection], None]
) -> str:
    """The record of a mesh file at `path`, which the record names `file`."""
    count = asked.count
    if count is None:
        count = asked.row.get("n_rotors_or_wings")
    row = asked.row | {"n_rotors_or_wings": count}
    axes = (asked.up, asked.front)
    usual = "x" if is_description(asked.file) else None
    seen = inspect_mesh(path, category, asked.unit, row, asked.size_m, axes, usual)
    # Messages name the user's description, not the file that its parts lie in for now.
    seen = replace(seen, path=asked.file)
    if not seen.sides_seen:
        raise InputError(
            f"{asked.file}: left and right of the bird cannot be seen, expected --up and --front"
        )
    if seen.cut:
        raise InputError(
            f"{asked.file}: one half of a target, cut off along {seen.cut}: join it with its "
            f"mirror image first, or give --front {seen.cut} where a whole one ends flat there"
        )
    if not asked.row:
        _refuse_size(asked, seen)
    groups = seen.groups
    if asked.moving:
        groups = chosen(seen, asked.moving)
        if count is None:
            count = len(groups)
    try:
        refuse_miscount(seen, groups, count, str(asked.picture))
    except InputError:
        show(seen)
        raise
    stated = [axis for axis in ("up", "front") if getattr(asked, axis)]
    return drafted(seen, asked.name, file, asked.table, groups, stated)


def _refuse_size(asked: Asked, seen: Inspection) -> None:
    """Refuse a mesh of unusual size for its category.

    Raises: InputError naming the options and the unit that fits.

    A size from the user may be UNUSUAL, and one from the file may be twice as large as usual: a
    real helicopter is.
    """
    extent = seen.high - seen.low
    size = float(extent.max())
    low, high = USUAL_M[seen.category]
    least = low
    most = high
    if asked.unit is not None or asked.size_m is not None:
        least = low / UNUSUAL
        most = high * UNUSUAL
    if seen.unit_from.startswith("stated"):
        most = high * 2.0
    if least <= size <= most:
        return
    unit = guessed_unit(extent / metres(seen.unit), seen.category)
    fitting = size / metres(seen.unit) * UNITS_M[unit]
    remedy = "give --unit or --size"
    if low <= fitting <= high:
        remedy += f", such as --unit {unit}, with which it measures {fitting:.4g} m"
    raise InputError(
        f"{asked.file}: measures {size:.4g} m in the unit {seen.unit!r} ({seen.unit_from}), "
        f"expected {low} to {high} m for a {seen.category}: {remedy}"
    )


def _check(asked: Asked, text: str, folder: Path) -> None:
    """Make the cloud of a drafted record, whose files are in the folder.

    Raises: InputError as `make` does.
    """
    record = yaml.safe_load(text)[asked.name]
    cells = record.pop("row", None)
    try:
        row = asked.row
        if cells:
            row = with_row(None, asked.name, cells, "draft")
        make(merge(row, record, f"draft: {asked.name}"), folder, SEED)
    except InputError as error:
        reason = re.sub(f"^{re.escape(str(folder))}/|^{re.escape(asked.name)}: ", "", str(error))
        raise InputError(f"{asked.file}: no cloud can be made of it: {reason}") from None
