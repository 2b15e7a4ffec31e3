"""The record of a built-in model: its keys, and the check of its figures with their units and sources."""

import math

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.targets import bird, uav, vehicle

MODULES = {"UAV": uav, "Bird": bird, "Vehicle": vehicle}
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "1": 1.0}
"""Units a figure may have; "1" is a ratio or a count."""

_KEYS = {
    "UAV": ("model", "size_is", "sources", "figures", "moving_share", "coaxial"),
    "Bird": ("model", "size_is", "sources", "figures", "moving_share", "flap"),
    "Vehicle": ("model", "size_is", "sources", "figures", "moving_share", "wheel_size"),
}
_CHOICES = {
    "UAV": {"size_is": uav.SIZES, "coaxial": (True, False)},
    "Bird": {"size_is": ("bill tip to tail tip",)},
    "Vehicle": {"size_is": ("length, width and height",), "wheel_size": ("published", "rolling")},
}


def _figure(value: object, kind: str, sources: dict, where: str) -> dict:
    """Return the figure [value, unit, source] as a record: value, unit, source and the value in SI."""
    if not (isinstance(value, list) and len(value) == 3):
        raise InputError(f"{where} is {value!r}, expected [value, unit, source]")
    number, unit, source = value[0], str(value[1]), value[2]
    lengths = kind == "length"
    if unit not in UNITS or (unit != "1") != lengths:
        expected = [name for name in UNITS if (name != "1") == lengths]
        raise InputError(f"{where}: unit is {unit!r}, expected one of {expected}")
    low = 0 if kind in ("whole", "offset") else 1e-9
    good = isinstance(number, (int, float)) and not isinstance(number, bool) and math.isfinite(number)
    good = good and low <= number < 1e5 and (kind not in ("count", "whole") or float(number).is_integer())
    if not good:
        raise InputError(f"{where}: value is {number!r}, expected a positive number fit for a {kind}")
    if source != "estimate" and source not in sources:
        raise InputError(f"{where}: source is {source!r}, expected 'estimate' or one of {sorted(sources)}")
    return {"value": number, "unit": unit, "source": source, "si": number * UNITS[unit]}


def _check_flap(flap: object, where: str) -> None:
    """Raise InputError where a bird's wing beat is not given in degrees under its own names."""
    if not isinstance(flap, dict) or set(flap) - set(bird.FLAP):
        raise InputError(f"{where}: flap is {flap!r}, expected some of {sorted(bird.FLAP)} in degrees")
    for key, value in flap.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= 180:
            raise InputError(f"{where}: flap.{key} is {value!r}, expected degrees between -180 and 180")


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record with its figures resolved to SI units, checked.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    if category not in MODULES:
        raise InputError(f"{where}: source is 'builtin', which has no {category} model; expected gait or mocap")
    unknown = sorted(set(extra) - set(_KEYS[category]))
    if unknown:
        raise InputError(f"{where}: unknown keys {unknown}, expected some of {sorted(_KEYS[category])}")
    layouts = MODULES[category].FIGURES
    if extra.get("model") not in layouts:
        raise InputError(f"{where}: model is {extra.get('model')!r}, expected one of {sorted(layouts)}")
    if "size_is" not in extra:
        raise InputError(f"{where}: size_is is missing, expected one of {_CHOICES[category]['size_is']}")
    for key, choices in _CHOICES[category].items():
        if key in extra and extra[key] not in choices:
            raise InputError(f"{where}: {key} is {extra[key]!r}, expected one of {choices}")
    share = extra.get("moving_share", MODULES[category].MOVING_SHARE)
    if isinstance(share, bool) or not isinstance(share, (int, float)) or not 0 < share < 1:
        raise InputError(f"{where}: moving_share is {share!r}, expected a number between 0 and 1")
    _check_flap(extra.get("flap", {}), where)
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


def record_files(record: dict) -> list[str]:
    """Return the user's files a built-in record needs: none."""
    return []
