"""The keys and values of a mesh record, checked before any file is opened.

All places are in metres along the axes of the mesh file (after `unit`, before scaling). The order of keys and parts
means nothing. Keys:

unit         of the file's numbers: m, cm, mm, in, ft, or the metres that 1.0 in the file stands for (any positive
             number); a mesh may have its own. It overrides a unit that the file states, with a warning
up, front    the file's axis that points up and to the front: x, -x, y, -y, z or -z
size_is      what the published size measures: motor diagonal, length (along the front), width, height or
             largest extent; for vehicles the table has all three
scale        published (UAV and bird by `size_is`; a vehicle axis by axis, wheels staying round), uniform (a vehicle
             by its length alone) or none
scale_limit  largest factor either way between mesh and published size; a wrong unit is caught by it (2.5)
wheel_size   published (wheels get the table's diameter) or mesh (they are scaled like the car)
moving_share share of the points on moving parts; flap: as for built-in birds
parts        by name, one of them of kind body; each part has a kind and one of
  meshes:    [{file, unit, geometry: [names], mirror: axis, turn: {axis, deg}, move: [x, y, z]}], done in that order;
             names are those of geometries, instances, OBJ objects or groups; turn may be a list of turns, one after
             the other
  region:    taken out of the body's surface, disjoint from the regions of other parts: {box: [[low], [high]]}
             (null: unbounded) or {cylinder: {centre, axis, radius, half_length}}; with `whole: true`
             only connected components that lie inside as a whole
  wheel:     {diameter_m, width_m}: a wheel is made and added at the hinge
  and hinge: [x, y, z] or found (centre of its surface); axis: [x, y, z] or found (its thinnest direction; not for
             wings); by default a rotor's is found, a wheel's sideways, a wing's the front line; sense: ccw or cw
             (rotors, seen from above); parent: a part's name
drop         regions of what is then left of the body that are no part of the target (stands) or that no
             station sees (floors)
licence, attribution, where (a user gets the files), note: words, kept in the cloud's record
"""

import jsonschema

from lowalt.common.classes import like
from lowalt.common.errors import InputError
from lowalt.targets import bird, uav, vehicle
from lowalt.targets.cloud import MOST_TURNING_PARTS
from lowalt.targets.input_files import check_file_name
from lowalt.targets.mesh_files import UNITS_M

AXES = ("x", "-x", "y", "-y", "z", "-z")
SIZES = ("motor diagonal", "length", "width", "height", "largest extent")
ALL_AXES = "length, width and height"
DEFAULTS = {"scale": "published", "scale_limit": 2.5, "drop": []}
MOVING_SHARE = {"UAV": uav.MOVING_SHARE, "Bird": bird.MOVING_SHARE, "Vehicle": vehicle.MOVING_SHARE}
MOVING_KIND = {"UAV": "rotor", "Bird": "wing", "Vehicle": "wheel"}

_POINT = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_CORNER = {"type": "array", "items": {"type": ["number", "null"]}, "minItems": 3, "maxItems": 3}
_POSITIVE = {"type": "number", "exclusiveMinimum": 0}
_PLAIN = {"enum": ["x", "y", "z"]}
_TEXT = {"type": "string"}


def _object(required: list[str], **properties: dict) -> dict:
    return {"type": "object", "required": required, "properties": properties, "additionalProperties": False}


_CYLINDER = _object(
    ["centre", "axis", "radius", "half_length"], centre=_POINT, axis=_PLAIN, radius=_POSITIVE, half_length=_POSITIVE
)
_REGION = _object(
    [],
    box={"type": "array", "items": _CORNER, "minItems": 2, "maxItems": 2},
    cylinder=_CYLINDER,
    whole={"type": "boolean"},
) | {"oneOf": [{"required": ["box"]}, {"required": ["cylinder"]}]}
_UNIT = {"anyOf": [{"enum": list(UNITS_M)}, _POSITIVE | {"maximum": 1e6}]}
_TURN = _object(["axis", "deg"], axis=_PLAIN, deg={"type": "number"})
_MESH = _object(
    ["file"],
    file=_TEXT,
    unit=_UNIT,
    geometry={"type": "array", "items": _TEXT, "minItems": 1},
    mirror=_PLAIN,
    turn={"anyOf": [_TURN, {"type": "array", "items": _TURN, "minItems": 1}]},
    move=_POINT,
)
_PART = _object(
    ["kind"],
    kind={"enum": ["body", "rotor", "wing", "wheel"]},
    meshes={"type": "array", "items": _MESH, "minItems": 1},
    region=_REGION,
    wheel=_object(["diameter_m", "width_m"], diameter_m=_POSITIVE, width_m=_POSITIVE),
    hinge={"anyOf": [_POINT, {"const": "found"}]},
    axis={"anyOf": [_POINT, {"const": "found"}]},
    sense={"enum": ["ccw", "cw"]},
    parent=_TEXT,
) | {"oneOf": [{"required": ["meshes"]}, {"required": ["region"]}, {"required": ["wheel"]}]}
_FLAP = _object([], **{key: {"type": "number"} for key in bird.FLAP})
SCHEMA = _object(
    ["unit", "up", "front", "parts"],
    unit=_UNIT,
    up={"enum": list(AXES)},
    front={"enum": list(AXES)},
    size_is={"enum": [*SIZES, ALL_AXES]},
    scale={"enum": ["published", "uniform", "none"]},
    scale_limit={"type": "number", "minimum": 1},
    wheel_size={"enum": ["published", "mesh"]},
    moving_share={"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1},
    flap=_FLAP,
    parts={"type": "object", "minProperties": 1, "additionalProperties": _PART},
    drop={"type": "array", "items": _REGION},
    licence=_TEXT,
    attribution=_TEXT,
    where=_TEXT,
    note=_TEXT,
)
"""JSON schema of the keys that only a mesh record has."""


def _schema_fault(extra: dict, where: str) -> None:
    fault = jsonschema.exceptions.best_match(jsonschema.Draft202012Validator(SCHEMA).iter_errors(extra))
    if fault is not None:
        place = ".".join(str(key) for key in fault.absolute_path) or "record"
        raise InputError(f"{where}: {place}: {fault.message}")


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
    """The parent of a part, the parent's parent and so on; it ends at a name that stands there already."""
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


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record of a mesh, checked, with its defaults.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    if category not in MOVING_SHARE:
        raise InputError(f"{where}: source is 'mesh' for a {category}, expected mocap or gait")
    _schema_fault(extra, where)
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
    if category == "Vehicle":
        result.setdefault("wheel_size", "published")
    for name in record_files(result):
        check_file_name(name, f"{where}: file")
    return result


def record_files(record: dict) -> list[str]:
    """Return the user's files a mesh record needs, relative to the folder of inputs, each once, in order."""
    files = [mesh["file"] for part in record["parts"].values() for mesh in part.get("meshes", [])]
    return list(dict.fromkeys(files))
