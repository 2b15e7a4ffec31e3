"""What the tags of a building say: heights, and whether a feature is a building.

Heights come in several units and spellings.

Source: OpenStreetMap wiki, Simple 3D Buildings (height, min_height, building:levels,
building:min_level, building:part) and Map features/Units.
"""

import re
from typing import NamedTuple

STOREY_M = 3.0
"""Height of a storey, for buildings that state storeys alone. Source: Simple 3D Buildings."""
FOOT_M = 0.3048
INCH_M = 0.0254
NUMBER = r"~?\s*([0-9]+(?:\.[0-9]+|,[0-9]{1,2})?)"
"""A number, with a decimal comma where one or two digits follow: three might be thousands."""
ONE_UNIT = re.compile(rf"{NUMBER}\s*([a-z']*)")
FEET_AND_INCHES = re.compile(rf"{NUMBER}\s*(?:'|ft)\s*([0-9]+(?:\.[0-9]+)?)\s*(?:\"|''|in)")
UNITS_M = (
    dict.fromkeys(["", "m", "metre", "metres", "meter", "meters"], 1.0)
    | dict.fromkeys(["'", "ft", "foot", "feet"], FOOT_M)
    | dict.fromkeys(
        ["storey", "storeys", "stories", "level", "levels", "floor", "floors"], STOREY_M
    )
)


class Height(NamedTuple):
    """A height (m), None where none can be read, and the values that cannot be read."""

    metres: float | None
    unread: tuple[str, ...]


def metres(value: object) -> float | None:
    """Return the height in metres that a text states, None for another text.

    Such texts are "12.5 m", "12,5", "~15", "40'6\\"" or "3 storeys".
    """
    text = str(value).strip().lower()
    if match := FEET_AND_INCHES.fullmatch(text):
        return float(match[1].replace(",", ".")) * FOOT_M + float(match[2]) * INCH_M
    match = ONE_UNIT.fullmatch(text)
    if match is None or match[2] not in UNITS_M:
        return None
    return float(match[1].replace(",", ".")) * UNITS_M[match[2]]


def _stated(properties: dict, keys: dict[str, str], least_m: float) -> Height:
    """Return the first height of at least least_m (m) that the keys state.

    keys: each with the unit of a bare number.
    """
    unread: list[str] = []
    for key, unit in keys.items():
        value = properties.get(key)
        if value is None:
            continue
        found = metres(f"{value} {unit}") if unit else metres(value)
        if found is not None and found >= least_m:
            return Height(found, tuple(unread))
        unread.append(str(value))
    return Height(None, tuple(unread))


def height_of(properties: dict) -> Height:
    """Return the height (m) of a building's top over the ground."""
    return _stated(
        properties, {"height": "", "building:height": "", "building:levels": "levels"}, 0.01
    )


def low_of(properties: dict) -> Height:
    """Return the height (m) over the ground at which a building begins.

    A bridge between two buildings begins above the ground.
    """
    return _stated(properties, {"min_height": "", "building:min_level": "levels"}, 0.0)


def is_building(properties: dict) -> bool:
    """Return whether a feature is a building and not, say, a road.

    It is called one, or has a height.
    """
    kinds = [
        properties[key] for key in ("building", "building:part") if properties.get(key) is not None
    ]
    if kinds:
        return any(kind != "no" for kind in kinds)
    return height_of(properties).metres is not None


def is_part(properties: dict) -> bool:
    """Return whether a feature is a part of a building whose outline is another feature."""
    return properties.get("building:part") not in (None, "no") and properties.get("building") in (
        None,
        "no",
    )
