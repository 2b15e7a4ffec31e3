"""A record drafted from the inspection of a mesh; every guess is marked for the user to confirm.

The draft is a YAML text with one record; it passes the checks of `mesh_record`, so a cloud can be made of it at once.
"""

import numpy as np

from lowalt.common.classes import like
from lowalt.targets.guesses import Component
from lowalt.targets.inspection import Inspection
from lowalt.targets.mesh_record import ALL_AXES, MOVING_KIND

MARGIN = 0.02
"""A region reaches this share of its largest extent beyond the components that it shall take."""

TOUCH = 0.1
"""Boxes nearer than twice this share of the larger one's length belong together: the hub lies between two blades."""

CONFIRM = "  # GUESSED, please confirm"


def clusters(parts: list[Component]) -> list[list[Component]]:
    """Return components whose boxes touch as one group each, such as the two blades of one propeller.

    Boxes touch that are nearer than 2 TOUCH of the larger one's largest extent.
    """
    groups: list[list[Component]] = []
    for part in parts:
        near = [group for group in groups if any(_touch(part, other) for other in group)]
        groups = [group for group in groups if group not in near] + [[part, *(one for group in near for one in group)]]
    return groups


def _touch(one: Component, other: Component) -> bool:
    """Whether the boxes of two components, widened by TOUCH of the larger extent, overlap."""
    slack = TOUCH * max(one.extent.max(), other.extent.max())
    return bool((one.low - slack <= other.high + slack).all() and (other.low - slack <= one.high + slack).all())


def _numbers(values: np.ndarray) -> str:
    """Numbers as a YAML list with five digits."""
    return "[" + ", ".join(f"{value:.5g}" for value in values) + "]"


def _region(group: list[Component]) -> str:
    """YAML text of a box around components, wider by MARGIN."""
    low = np.min([part.low for part in group], axis=0)
    high = np.max([part.high for part in group], axis=0)
    slack = MARGIN * float((high - low).max())
    return f"{{box: [{_numbers(low - slack)}, {_numbers(high + slack)}], whole: true}}"


def _place(group: list[Component], found: Inspection) -> str:
    """Return the place of a group on the target in words: front or rear, left or right."""
    up, front = "xyz".index(found.up), "xyz".index(found.front)
    middle = (found.low + found.high) / 2
    centre = np.mean([part.centre for part in group], axis=0) - middle
    right = np.cross(np.eye(3)[front], np.eye(3)[up])
    return f"{'front' if centre[front] >= 0 else 'rear'} {'right' if centre @ right >= 0 else 'left'}"


def _wings(found: Inspection) -> list[str]:
    """Return the lines of two wings without elbows; each begins at `shoulder_m` and is hinged at its root's middle."""
    front, up = "xyz".index(found.front), "xyz".index(found.up)
    right = 3 - front - up
    sign = np.sign(np.cross(np.eye(3)[front], np.eye(3)[up])[right])
    middle, lines = (found.low + found.high)[right] / 2, []
    for name, side in (("left wing", -sign), ("right wing", sign)):
        out = side * (found.points[:, right] - middle)
        root = found.points[(out > found.shoulder_m) & (out < 1.3 * found.shoulder_m)]
        hinge = np.median(root, axis=0) if len(root) else (found.low + found.high) / 2
        hinge[right] = middle + side * found.shoulder_m
        corners = [["null"] * 3, ["null"] * 3]
        corners[0 if side > 0 else 1][right] = f"{hinge[right]:.5g}"
        # Tail feathers may spread as wide as the wing's root, behind it.
        along = found.points[out > 0.4 * out.max(), front]
        slack = 0.25 * np.ptp(along)
        corners[0][front], corners[1][front] = f"{along.min() - slack:.5g}", f"{along.max() + slack:.5g}"
        box = ", ".join("[" + ", ".join(corner) + "]" for corner in corners)
        lines.append(f"    {name}: {{kind: wing, region: {{box: [{box}]}}, hinge: {_numbers(hinge)}}}{CONFIRM}")
    return lines


def drafted(found: Inspection, subtype: str, row: dict, file: str) -> str:
    """Return a record file's text for a subtype of the published table (`row`), from an inspected mesh.

    `file` is the mesh's path inside the folder of inputs. Lines that end in CONFIRM hold guesses. Moving parts are the
    components that may be rotors or wheels; boxes take them out of the body. A bird's wings are the surface farther
    out than `shoulder_m`.
    """
    category = like(row)
    kind = MOVING_KIND[category]
    groups = clusters([part for part in found.components if part.guess == kind])
    unit = "" if found.unit_from != "guessed from the size" else CONFIRM
    size_is = {"UAV": "motor diagonal" if len(groups) >= 2 else "largest extent", "Vehicle": ALL_AXES}
    lines = [
        f"# Drafted from {file}. Lengths are in metres along the file's axes.",
        "# Confirm each line that is marked, then remove the mark.",
        f"{subtype}:",
        "  source: mesh",
        f"  unit: {found.unit}{unit}",
        f"  up: {found.up}{CONFIRM}: {found.up} or -{found.up}",
        f"  front: {found.front}{CONFIRM}: {found.front} or -{found.front}",
        f"  size_is: {size_is.get(category, 'length')}",
        "  licence: unknown  # the licence of the mesh",
        "  parts:",
        f"    body: {{kind: body, meshes: [{{file: {file!r}}}]}}",
    ]
    if category == "Bird":
        lines += _wings(found)
    elif not groups:
        lines.append(
            f"    # No {kind} was found. Add each as a part of kind {kind}: see design/targets.md for its keys."
        )
    names: dict[str, int] = {}
    for group in sorted(groups, key=lambda group: group[0].centre.tolist()):
        place = f"{_place(group, found)} {kind}"
        names[place] = names.get(place, 0) + 1
        name = place if names[place] == 1 else f"{place} {names[place]}"
        lines.append(f"    {name}: {{kind: {kind}, region: {_region(group)}}}{CONFIRM}")
    return "\n".join(lines) + "\n"
