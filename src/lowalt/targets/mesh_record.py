"""The keys and values of a mesh record, checked before any file is opened.

All places are along the axes of the mesh file, before scaling, in metres, or with `lengths: file` in the record's
unit; a checked record has metres. The order of keys and parts changes nothing. `records.schema.yaml` lists the keys
with their meaning.
"""

import numpy as np

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.targets import bird, uav, vehicle
from lowalt.targets.cloud import MOST_TURNING_PARTS
from lowalt.targets.input_files import check_file_name, record_files
from lowalt.targets.mesh_files import UNITS_M

SIZES = ("motor diagonal", "length", "width", "height", "largest extent")
ALL_AXES = "length, width and height"
DEFAULTS = {"scale": "published", "scale_limit": 2.5, "drop": []}
MOVING_SHARE = {"UAV": uav.MOVING_SHARE, "Bird": bird.MOVING_SHARE, "Vehicle": vehicle.MOVING_SHARE}
MOVING_KIND = {"UAV": "rotor", "Bird": "wing", "Vehicle": "wheel"}


def body_axes(front: str, up: str) -> np.ndarray:
    """Return the unit vectors (3, 3) right, front and up, of the names of two axes such as "-y"."""
    vectors = [np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1) for axis in (front, up)]
    return np.stack([np.cross(*vectors), *vectors])


def ordered_parts(parts: dict[str, dict]) -> dict[str, dict]:
    """Return a record's parts in the one order that all stages use: the body, then the others by name, each part after
    its parent.

    A record loses the order of its keys on its way through the workflow's settings, so the order as written must not
    matter. `parts` are those of a record that `check_record` has passed.
    """
    body = [name for name, part in parts.items() if part["kind"] == "body"]
    result, waiting = dict.fromkeys(body), sorted(set(parts) - set(body))
    while waiting:
        ready = next(name for name in waiting if parts[name].get("parent") not in waiting)
        waiting.remove(ready)
        result[ready] = None
    return {name: parts[name] for name in result}


def _ancestors(name: str, parts: dict[str, dict]) -> list[str]:
    """The parent of a part, the parent's parent and so on; it ends at a name that occurs twice."""
    found = [name]
    while (parent := parts.get(found[-1], {}).get("parent")) is not None:
        found.append(parent)
        if found.count(parent) > 1:
            break
    return found[1:]


def _part_fault(name: str, part: dict, parts: dict[str, dict], category: str) -> str | None:
    """Return the fault of a part whose form is right, or None."""
    kind = part["kind"]
    if kind == "body":
        return None if "meshes" in part and len(part) == 2 else "a body has a kind and meshes, nothing else"
    if kind != MOVING_KIND[category]:
        return f"kind is {kind}, expected {MOVING_KIND[category]} for a {category}"
    if "wheel" in part and (kind != "wheel" or part.get("hinge", "found") == "found"):
        return "a made wheel needs kind wheel and a hinge in metres"
    if kind == "wing" and (part.get("hinge", "found") == "found" or part.get("axis") == "found"):
        return "a wing needs a hinge in metres, and its axis is given or the front line"
    if "sense" in part and kind != "rotor":
        return "sense is for rotors"
    if "parent" in part:
        moving = sorted(other for other, found in parts.items() if found["kind"] != "body" and other != name)
        if part["parent"] not in moving:
            return f"parent is {part['parent']!r}, expected one of {moving}"
        if name in _ancestors(name, parts):
            return f"parent is {part['parent']!r}, which hangs on {name!r} itself, expected no circle"
    if isinstance(part.get("axis"), list) and not any(part["axis"]):
        return "axis is zero, expected a direction"
    return None


def in_metres(record: dict) -> dict:
    """Return a record whose hinges, regions and moves are in metres, whatever its key `lengths` says they are in."""
    if record.get("lengths", "m") == "m":
        return record
    unit = record["unit"]
    factor = UNITS_M[unit] if isinstance(unit, str) else unit

    def scaled(value: object) -> object:
        """Return lengths times the factor in nested lists and mappings; names and flags stay."""
        if isinstance(value, dict):
            return {key: item if key in ("axis", "whole") else scaled(item) for key, item in value.items()}
        if isinstance(value, list):
            return [scaled(item) for item in value]
        return factor * value if isinstance(value, (int, float)) else value

    def part_in_metres(part: dict) -> dict:
        """Return a part whose hinge, region and moves are in metres."""
        places = {key: scaled(part[key]) for key in ("region", "hinge") if key in part}
        meshes = [mesh | {"move": scaled(mesh["move"])} if "move" in mesh else mesh for mesh in part.get("meshes", [])]
        return part | places | ({"meshes": meshes} if meshes else {})

    parts = {name: part_in_metres(part) for name, part in record["parts"].items()}
    return record | {"parts": parts, "drop": scaled(record.get("drop", [])), "lengths": "m"}


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record of a mesh, checked, with its defaults.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    if category not in MOVING_SHARE:
        raise InputError(f"{where}: source is 'mesh' for a {category}, expected mocap or gait")
    if merged["up"][-1] == merged["front"][-1]:
        raise InputError(f"{where}: up {merged['up']} and front {merged['front']}, expected two different axes")
    bodies = [name for name, part in merged["parts"].items() if part["kind"] == "body"]
    if len(bodies) != 1:
        raise InputError(f"{where}: parts: {len(bodies)} of kind body {bodies}, expected exactly one body")
    turning = sum(part["kind"] in ("rotor", "wheel") for part in merged["parts"].values())
    if turning > MOST_TURNING_PARTS:
        raise InputError(f"{where}: parts: {turning} rotors or wheels, expected at most {MOST_TURNING_PARTS}")
    for name, part in merged["parts"].items():
        fault = _part_fault(name, part, merged["parts"], category)
        if fault:
            raise InputError(f"{where}: parts.{name}: {fault}")
    sizes = (ALL_AXES,) if category == "Vehicle" else SIZES
    size = merged.get("size_is", ALL_AXES if category == "Vehicle" else None)
    if size not in sizes:
        raise InputError(f"{where}: size_is is {size!r}, expected one of {sizes} for a {category}")
    result = DEFAULTS | {"moving_share": MOVING_SHARE[category]} | merged | {"size_is": size}
    result["parts"] = ordered_parts(merged["parts"])
    result = in_metres(result)
    if category == "Vehicle":
        result.setdefault("wheel_size", "published")
    for name in record_files(result):
        check_file_name(name, f"{where}: file")
    return result
