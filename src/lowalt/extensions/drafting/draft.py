"""A record drafted from the inspection of a mesh; every guess is marked for the user to confirm.

The draft is a YAML text with one record; it passes the checks of `mesh_record`, so a cloud can be
made of it at once.
"""

from collections.abc import Sequence

import numpy as np
import yaml
from scipy.spatial import cKDTree

from lowalt.config.classes import AIRBORNE
from lowalt.extensions.drafting.guesses import TURNING, Group, alike, turning_axis
from lowalt.extensions.drafting.inspection import Inspection
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.mesh_record import ALL_AXES, MOVING_KIND, body_axes

MARGIN = 0.02
"""A region extends beyond its components by this share of their largest extent."""

WINGS_ALIKE = 0.05
"""Largest mean distance of a bird's wings from their mirror image, in parts of its size."""

CONFIRM = "  # GUESSED, please confirm"


def record_text(
    about: list[str], subtype: str, row: list[str], settings: dict[str, str], parts: list[str]
) -> str:
    """Return a record file's text for a mesh.

    It has what the record is about, then the subtype with a row of its own, settings and parts,
    each line of `row` and `parts` as it stands in the file.
    """
    name = yaml.safe_dump(subtype).splitlines()[0]
    lines = [f"# {line}" for line in about]
    lines += [f"{name}:", "  source: mesh", *row]
    lines += [f"  {key}: {value}" for key, value in settings.items()]
    lines += ["  parts:", *parts]
    return "\n".join(lines) + "\n"


DIGITS = 5
"""Lengths in a draft have this many digits of the target's size, wherever the origin lies."""


def _number(value: float, size: float) -> str:
    """A length (m) as text, exact enough for a target of a size (m).

    Georeferenced coordinates keep all their digits.
    """
    decimals = max(0, DIGITS - 1 - int(np.floor(np.log10(size))))
    return f"{round(float(value), decimals) + 0.0:.15g}"


def numbers(values: np.ndarray, size: float) -> str:
    """Return lengths (m) as a YAML list, exact enough for a target of a size (m)."""
    return "[" + ", ".join(_number(value, size) for value in values) + "]"


def _position(group: Group, inspection: Inspection) -> str:
    """Return the position of a group on the target in words: front or rear, left or right."""
    centre = group.centre - (inspection.low + inspection.high) / 2
    right, front, _ = body_axes(inspection.front, inspection.up)
    along = "front" if centre @ front >= 0 else "rear"
    across = "right" if centre @ right >= 0 else "left"
    return f"{along} {across}"


def _diagonal(hubs: np.ndarray) -> float:
    """The largest distance (m) between two of the hubs (R, 2), 0 without any."""
    if not len(hubs):
        return 0.0
    return float(np.linalg.norm(hubs[:, None] - hubs[None], axis=2).max())


def size_word(category: str, extent: np.ndarray, hubs: np.ndarray) -> str:
    """Return what the size of a target measures, as a word of the record's `size_is`.

    Of a plane it is the span.
    """
    if category == "Vehicle":
        return ALL_AXES
    if category == "Bird":
        return "length"
    if 2 * _diagonal(hubs) > extent.max():
        return "motor diagonal"
    return "largest extent"


def row_lines(
    category: str,
    extent: np.ndarray,
    hubs: np.ndarray,
    wheel_m: float | None,
    table: dict[str, dict],
) -> list[str]:
    """Return the lines of a row for a target that the table lacks.

    Its size is the file's; its rates and speeds are those of the target of its category that is
    nearest in size.

    extent: (3,) m along right, front and up; hubs: (R, 2) m, the rotors' in plan, or its wheels'
    positions; wheel_m: diameter of a wheel.
    """
    width, length, height = extent
    key = "size_m"
    if category == "Vehicle":
        key = "len_m"
        sizes = {"wid_m": width, "len_m": length, "hgt_m": height, "wheel_diam_m": wheel_m}
    elif category == "Bird":
        sizes = {key: length}
    elif size_word(category, extent, hubs) == "largest extent":
        sizes = {key: extent.max()}
    else:
        sizes = {key: _diagonal(hubs)}
    rows = [row for row in table.values() if row["category"] == category]
    near = min(rows, key=lambda row: abs(np.log(row[key] / sizes[key])))
    cells: dict[str, object] = {"category": category}
    for name, value in sizes.items():
        if value:
            cells[name] = float(f"{value:.4g}")
    count = 2 if category == "Bird" else len(hubs)
    if count:
        cells["n_rotors_or_wings"] = count
    speeds: tuple[str, ...]
    if category in AIRBORNE:
        speeds = ("vx_abs_max", "vy_abs_max", "vz_abs_max")
    else:
        speeds = ("speed_lo", "speed_hi")
    for name in ("wheel_diam_m", "freq_lo_hz", "freq_hi_hz", *speeds):
        if near[name] is not None and name not in cells:
            cells[name] = near[name]
    listed = ", ".join(f"{name}: {value}" for name, value in cells.items())
    taken = f"sizes are the file's, rates and speeds those of {near['name']}"
    return [f"  row: {{{listed}}}{CONFIRM}: {taken}"]


def _wings(inspection: Inspection) -> list[str]:
    """Return the lines of two wings without elbows.

    Each begins at `shoulder_m`; its hinge is the middle of its root.
    Raises: InputError where the two sides do not mirror one another.
    """
    size = float((inspection.high - inspection.low).max())
    front = "xyz".index(inspection.front[-1])
    up = "xyz".index(inspection.up[-1])
    right = 3 - front - up
    sign = body_axes(inspection.front, inspection.up)[0, right]
    middle = (inspection.low + inspection.high)[right] / 2
    lines = []
    mirrored_points = inspection.points.copy()
    mirrored_points[:, right] = 2 * middle - mirrored_points[:, right]
    outer = np.abs(inspection.points[:, right] - middle) > inspection.shoulder_m
    off, _ = cKDTree(mirrored_points).query(inspection.points[outer])
    if not outer.any() or np.mean(off) > WINGS_ALIKE * size:
        raise InputError(
            f"{inspection.path}: its sides along {'xyz'[right]} do not mirror one another, "
            "expected two wings: is one missing, or is --up or --front another axis?"
        )
    for name, side in (("left wing", -sign), ("right wing", sign)):
        out = side * (inspection.points[:, right] - middle)
        at_root = (out > inspection.shoulder_m) & (out < 1.3 * inspection.shoulder_m)
        root = inspection.points[at_root]
        hinge = (inspection.low + inspection.high) / 2
        if len(root):
            hinge = np.median(root, axis=0)
        hinge[right] = middle + side * inspection.shoulder_m
        corners = [["null"] * 3, ["null"] * 3]
        inner = 0 if side > 0 else 1
        corners[inner][right] = _number(hinge[right], size)
        # Tail feathers may spread as wide as the wing's root, behind it.
        along = inspection.points[out > 0.4 * out.max(), front]
        slack = 0.25 * np.ptp(along)
        corners[0][front] = _number(along.min() - slack, size)
        corners[1][front] = _number(along.max() + slack, size)
        box = ", ".join("[" + ", ".join(corner) + "]" for corner in corners)
        region = f"region: {{box: [{box}]}}"
        lines.append(
            f"    {name}: {{kind: wing, {region}, hinge: {numbers(hinge, size)}}}{CONFIRM}"
        )
    return lines


def alternating(hubs: np.ndarray) -> list[str]:
    """Return senses ccw and cw in turn for rotors around their middle.

    hubs: (R, 2) in plan.
    """
    if not len(hubs):
        return []
    order = np.argsort(np.arctan2(*(hubs - portable.mean(hubs, 0)).T), kind="stable")
    turns = np.argsort(order, kind="stable")
    return [("ccw", "cw")[turn % 2] for turn in turns.tolist()]


def mirrored(groups: list[Group]) -> bool:
    """Return whether groups are three or more copies whose centres mirror one another.

    None may lie near their middle. Such are the propellers of a multirotor, the wheels of a car.
    """
    if len(groups) < 3 or any(not alike(groups[0], group) for group in groups):
        return False
    centres = np.array([group.centre for group in groups])
    away = centres - (centres.min(axis=0) + centres.max(axis=0)) / 2
    reach = np.linalg.norm(away, axis=1)
    if reach.min() <= 0.3 * reach.max():
        return False
    # Centres mirror one another along an axis in which they are spread, not along the one in which
    # they are level.
    for axis in np.flatnonzero(np.ptp(centres, axis=0) > 0.3 * reach.max()):
        image = away * np.where(np.arange(3) == axis, -1, 1)
        off = np.linalg.norm(away[:, None] - image[None], axis=2).min(axis=1).max()
        if off < 0.05 * reach.max():
            return True
    return False


def refuse_miscount(
    inspection: Inspection, groups: list[Group], count: int | None, picture: str
) -> None:
    """Refuse a target whose number of rotors or wheels is wrong.

    Where the number is not known, names must tell it, or the parts must mirror one another.

    Raises: InputError naming what was found, the numbered picture and the option to write.
    """
    kind = MOVING_KIND[inspection.category]
    if kind == "wing":
        return
    if count is None:
        # Groups of different sizes may be blades taken for rotors.
        named = len({len(group) for group in groups}) == 1
        for group in groups:
            named &= all(TURNING[kind].search(blade.piece) for blade in group)
        right = named or mirrored(groups)
        expected = f"at least one, or --{kind}s 0"
        if groups:
            expected = f"--{kind}s {len(groups)} where that is all"
    else:
        right = len(groups) == count
        expected = str(count)
    if not right:
        raise InputError(
            f"{inspection.path}: {len(groups)} {kind}s found, expected {expected}; otherwise name "
            f"each {kind}'s pieces as numbered in {picture}, such as --moving 3 5+6 7 9. "
            f"A {kind} that has no number is joined to the body: separate it first"
        )


def chosen(inspection: Inspection, words: list[str]) -> list[Group]:
    """Return the groups of components that words such as 5+6 number, from 1 as an inspection does.

    Raises: InputError naming the word that is no such number.
    """
    most = len(inspection.components)
    groups = []
    for word in words:
        written = word.split("+")
        if not all(number.isdecimal() and 1 <= int(number) <= most for number in written):
            raise InputError(f"--moving is {word!r}, expected numbers from 1 to {most} joined by +")
        groups.append(Group(inspection.components[int(number) - 1] for number in written))
    return groups


def drafted(
    inspection: Inspection,
    subtype: str,
    file: str,
    table: dict[str, dict],
    groups: list[Group],
    stated_axes: Sequence[str] = (),
) -> str:
    """Return a record file's text for a subtype, from an inspected mesh.

    `file` is the mesh's path inside the folder of inputs, `table` of targets; a subtype that it
    lacks gets a row of its own. `groups` are the components that move, `stated_axes` those of "up"
    and "front" that the user stated. Lines that end in CONFIRM hold guesses. Boxes take moving
    parts out of the body; a bird's wings are the surface farther out than `shoulder_m`.
    Raises: InputError where the two sides of a bird do not mirror one another.
    """
    category = inspection.category
    kind = MOVING_KIND[category]
    groups = sorted(groups, key=lambda group: group[0].centre.tolist())
    frame = body_axes(inspection.front, inspection.up)
    hubs = np.array([frame[:2] @ group.centre for group in groups]).reshape(-1, 2)
    extent = np.abs(frame @ (inspection.high - inspection.low))
    wheel_m = max((float(group.extent.max()) for group in groups), default=None)
    row = []
    if subtype not in table:
        row = row_lines(category, extent, hubs, wheel_m, table)
    size = float((inspection.high - inspection.low).max())
    if "up" in stated_axes:
        up_mark = ""
    elif inspection.up_from.startswith("as "):
        up_mark = f"  # {inspection.up_from}"
    else:
        up_mark = f"{CONFIRM}: {inspection.up[-1]} or -{inspection.up[-1]}"
    parts = [f"    body: {{kind: body, meshes: [{{file: {file!r}}}]}}"]
    if category == "Bird":
        parts += _wings(inspection)
    names: dict[str, int] = {}
    for group, sense in zip(groups, alternating(hubs), strict=True):
        name = f"{_position(group, inspection)} {kind}"
        names[name] = names.get(name, 0) + 1
        if names[name] > 1:
            name = f"{name} {names[name]}"
        slack = MARGIN * float(group.extent.max())
        box = f"[{numbers(group.low - slack, size)}, {numbers(group.high + slack, size)}]"
        turn = f", sense: {sense}" if kind == "rotor" else ""
        up = "xyz".index(inspection.up[-1])
        axis = turning_axis(group, up, inspection.low, inspection.high)
        if kind == "rotor" and axis != int(group.extent.argmin()):
            turn = f", axis: {np.eye(3)[axis].astype(int).tolist()}{turn}"
        parts.append(
            f"    {name}: {{kind: {kind}, region: {{box: {box}, whole: true}}{turn}}}{CONFIRM}"
        )
    about = [
        f"Drafted from {file}. Lengths are in metres along the file's axes.",
        "Confirm each line that is marked, then remove the mark.",
    ]
    unit_mark = CONFIRM if inspection.unit_from.startswith("guessed") else ""
    settings = {
        "unit": f"{inspection.unit}{unit_mark}",
        "up": f"{inspection.up}{up_mark}",
        "front": f"{inspection.front}{inspection.front_from.comment}",
        "size_is": size_word(category, extent, hubs),
        "licence": "unknown  # the licence of the mesh",
    }
    if row and category == "Vehicle":
        settings["wheel_size"] = "mesh"
    return record_text(about, subtype, row, settings, parts)
