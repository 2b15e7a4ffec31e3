"""The record of a built-in model: its keys, and the check of its figures with their units and sources."""

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.targets import bird, uav, vehicle

MODULES = {"UAV": uav, "Bird": bird, "Vehicle": vehicle}
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "1": 1.0}
"""Units a figure may have; "1" is a ratio or a count."""

_OWN = {"UAV": "coaxial", "Bird": "flap", "Vehicle": "wheel_size"}
"""The key that only targets like this have."""
_SIZES = {"UAV": uav.SIZES, "Bird": ("bill tip to tail tip",), "Vehicle": ("length, width and height",)}


def _figure(value: list, kind: str, sources: dict, where: str) -> dict:
    """Return the figure [value, unit, source] as a record: value, unit, source and the value in SI."""
    number, unit, source = value[0], str(value[1]), value[2]
    lengths = kind == "length"
    if unit not in UNITS or (unit != "1") != lengths:
        expected = [name for name in UNITS if (name != "1") == lengths]
        raise InputError(f"{where}: unit is {unit!r}, expected one of {expected}")
    low = 0 if kind in ("whole", "offset") else 1e-9
    if not low <= number < 1e5 or (kind in ("count", "whole") and not float(number).is_integer()):
        raise InputError(f"{where}: value is {number!r}, expected a positive number fit for a {kind}")
    if source != "estimate" and source not in sources:
        raise InputError(f"{where}: source is {source!r}, expected 'estimate' or one of {sorted(sources)}")
    return {"value": number, "unit": unit, "source": source, "si": number * UNITS[unit]}


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record with its figures resolved to SI units, checked.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    if category not in MODULES:
        raise InputError(f"{where}: source is 'builtin', which has no {category} model; expected gait or mocap")
    if others := set(extra) & (set(_OWN.values()) - {_OWN[category]}):
        raise InputError(f"{where}: {sorted(others)} are not for a {category}, expected {_OWN[category]!r} at most")
    layouts = MODULES[category].FIGURES
    if extra.get("model") not in layouts:
        raise InputError(f"{where}: model is {extra.get('model')!r}, expected one of {sorted(layouts)}")
    if extra["size_is"] not in _SIZES[category]:
        raise InputError(f"{where}: size_is is {extra['size_is']!r}, expected one of {_SIZES[category]}")
    share = extra.get("moving_share", MODULES[category].MOVING_SHARE)
    wanted, figures = layouts[extra["model"]], extra.get("figures", {})
    if extra["size_is"] == "body diagonal":
        wanted = wanted | {"motor_diagonal": "length"}
    wrong = sorted(set(wanted) ^ set(figures))
    if wrong:
        raise InputError(f"{where}: figures {wrong} missing or unknown, expected exactly {sorted(wanted)}")
    sources = extra.get("sources", {})
    resolved = {
        name: _figure(value, wanted[name], sources, f"{where}: figures.{name}") for name, value in figures.items()
    }
    result = merged | {"figures": resolved, "moving_share": share}
    if fault := MODULES[category].fault(result):
        raise InputError(f"{where}: {fault}")
    return result
