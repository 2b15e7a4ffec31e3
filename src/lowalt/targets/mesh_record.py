"""The keys and values of a mesh record, checked before any file is opened.

All positions are along the axes of the mesh file, before scaling, in metres. The order of keys and
parts changes nothing. `records.schema.yaml` lists the keys with their meaning.
"""

import numpy as np

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.targets import bird, uav, vehicle
from lowalt.targets.cloud import MOST_TURNING_PARTS

SIZES = ("motor diagonal", "length", "width", "height", "largest extent")
ALL_AXES = "length, width and height"
DEFAULTS = {"scale": "published", "scale_limit": 2.5, "drop": []}
MOVING_SHARE = {"UAV": uav.MOVING_SHARE, "Bird": bird.MOVING_SHARE, "Vehicle": vehicle.MOVING_SHARE}
MOVING_KIND = {"UAV": "rotor", "Bird": "wing", "Vehicle": "wheel"}


def body_axes(front: str, up: str) -> np.ndarray:
    """Return the unit vectors (3, 3) right, front and up, of the names of two axes such as "-y"."""
    vectors = []
    for axis in (front, up):
        vector = np.eye(3)["xyz".index(axis[-1])]
        if axis[0] == "-":
            vector = vector * -1
        vectors.append(vector)
    return np.stack([np.cross(*vectors), *vectors])


def ordered_parts(parts: dict[str, dict]) -> dict[str, dict]:
    """Return a record's parts in the one order that all stages use.

    The body comes first, then the others by name, each part after its parent.

    A record loses the order of its keys on its way through the workflow's settings, so the order as
    written must not matter. `parts` are those of a record that `check_record` has passed.
    """
    body = [name for name, part in parts.items() if part["kind"] == "body"]
    result = dict.fromkeys(body)
    waiting = sorted(set(parts) - set(body))
    while waiting:
        ready = next(name for name in waiting if parts[name].get("parent") not in waiting)
        waiting.remove(ready)
        result[ready] = None
    return {name: parts[name] for name in result}


def _part_fault(name: str, part: dict, parts: dict[str, dict], category: str) -> str | None:
    """Return the fault of a part whose form is right, or None."""
    kind = part["kind"]
    if kind == "body":
        if set(part) == {"kind", "meshes"}:
            return None
        return "a body has a kind and meshes, nothing else"
    if kind != MOVING_KIND[category]:
        return f"kind is {kind}, expected {MOVING_KIND[category]} for a {category}"
    if "wheel" in part and (kind != "wheel" or part.get("hinge", "found") == "found"):
        return "a made wheel needs kind wheel and a hinge in metres"
    if kind == "wing" and (part.get("hinge", "found") == "found" or part.get("axis") == "found"):
        return "a wing needs a hinge in metres, and its axis is given or the front line"
    if "sense" in part and kind != "rotor":
        return "sense is for rotors"
    if "parent" in part:
        moving = sorted(
            other for other in parts if parts[other]["kind"] != "body" and other != name
        )
        if part["parent"] not in moving:
            return f"parent is {part['parent']!r}, expected one of {moving}"
        above = []
        parent = part["parent"]
        while parent is not None and parent not in above:
            above.append(parent)
            parent = parts.get(parent, {}).get("parent")
        if name in above:
            return (
                f"parent is {part['parent']!r}, which hangs on {name!r} itself, expected no circle"
            )
    if isinstance(part.get("axis"), list) and not any(part["axis"]):
        return "axis is zero, expected a direction"
    return None


def check_record(merged: dict, where: str) -> dict:
    """Return the merged record of a mesh, checked, with its defaults.

    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    if category not in MOVING_SHARE:
        raise InputError(f"{where}: source is 'mesh' for a {category}, expected mocap or gait")
    if merged["up"][-1] == merged["front"][-1]:
        raise InputError(
            f"{where}: up {merged['up']} and front {merged['front']}, expected two different axes"
        )
    bodies = [name for name, part in merged["parts"].items() if part["kind"] == "body"]
    if len(bodies) != 1:
        raise InputError(
            f"{where}: parts: {len(bodies)} of kind body {bodies}, expected exactly one body"
        )
    turning = sum(part["kind"] in ("rotor", "wheel") for part in merged["parts"].values())
    if turning > MOST_TURNING_PARTS:
        raise InputError(
            f"{where}: parts: {turning} rotors or wheels, expected at most {MOST_TURNING_PARTS}"
        )
    for name, part in merged["parts"].items():
        if fault := _part_fault(name, part, merged["parts"], category):
            raise InputError(f"{where}: parts.{name}: {fault}")
    defaults = DEFAULTS | {"moving_share": MOVING_SHARE[category]}
    sizes: tuple[str, ...] = SIZES
    if category == "Vehicle":
        defaults |= {"size_is": ALL_AXES, "wheel_size": "published"}
        sizes = (ALL_AXES,)
    result = defaults | merged
    result["parts"] = ordered_parts(merged["parts"])
    size = result.get("size_is")
    if size not in sizes:
        raise InputError(f"{where}: size_is is {size!r}, expected one of {sizes} for a {category}")
    return result
