"""Reading buildings from footprints with heights, GeoJSON as OpenStreetMap's tools export it.

Where parts of a building lie in its outline, they stand in the outline's place. What is left out,
and what is read otherwise than the file states it, is counted.
Source: RFC 7946; OpenStreetMap wiki, Simple 3D Buildings (height, min_height, building:part,
building:material).
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.building_surfaces import (
    MOST_TRIANGLES,
    Surfaces,
    joined,
    such_as,
)
from lowalt.extensions.town.building_tags import height_of, is_building, is_part, low_of
from lowalt.extensions.town.materials import named
from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError, in_one_line, missing_package, reading
from lowalt.files.json_objects import json_object

try:
    import shapely
    from pyproj import Transformer
    from shapely.geometry import MultiPolygon, Polygon, shape
    from shapely.geometry.polygon import orient
except ImportError as error:
    raise missing_package(error) from None

LARGEST_BYTES = 64 << 20
MOST_PLACES = MOST_TRIANGLES // 3
MOST_CORNERS = 10_000
"""Largest number of corners of all outlines, each of which makes two triangles of a wall and one of
a roof, and of one feature, whose triangulation takes a time beyond proportion.
"""
JOINT_M = 1e-3
"""Parts of a footprint that are no farther apart adjoin."""
NO_BUILDING = "features that are no buildings"
NO_AREA = "buildings without an area"
CROSSED = "footprints that cross themselves"
NO_HEIGHT = "buildings that end below where they begin"


class Footprint(NamedTuple):
    """A building of a file.

    outline: in degrees or metres; properties: its tags; place: where it stands in the file.
    """

    outline: Polygon | MultiPolygon
    properties: dict
    place: str


def _prism(polygon: Polygon, height_m: float, low_m: float) -> np.ndarray:
    """The walls and the roof (F, 3, 3) of a footprint in metres, walls turned outward."""
    polygon = orient(polygon.simplify(0.0))
    walls = []
    for ring in (polygon.exterior, *polygon.interiors):
        corners = np.asarray(ring.coords)[:, :2]
        foot = np.column_stack([corners, np.full(len(corners), low_m)])
        eaves = np.column_stack([corners, np.full(len(corners), height_m)])
        # Each wall is two triangles, from one corner of the ring to the next.
        walls.append(np.stack([foot[:-1], foot[1:], eaves[1:]], axis=1))
        walls.append(np.stack([foot[:-1], eaves[1:], eaves[:-1]], axis=1))
    triangles = shapely.constrained_delaunay_triangles(polygon).geoms
    corners_of = [np.asarray(orient(triangle).exterior.coords)[:3, :2] for triangle in triangles]
    roof = np.array(corners_of).reshape(-1, 3, 2)
    level = (*roof.shape[:2], 1)
    roofs = [np.concatenate([roof, np.full(level, height_m)], axis=2)]
    if low_m > 0.0:
        underside = roof[:, ::-1]
        roofs.append(np.concatenate([underside, np.full(level, low_m)], axis=2))
    return np.concatenate([*walls, *roofs])


def _features(path: Path) -> list:
    """The features of a file. Raises: InputError where it has none."""
    text = text_of(path, "file of buildings", LARGEST_BYTES)
    features = json_object(text, str(path), "GeoJSON").get("features")
    if not isinstance(features, list):
        raise InputError(f"{path}: has no list `features`, expected a GeoJSON FeatureCollection")
    return features


def _object_of(feature: dict, key: str, place: str) -> dict:
    """An object of a feature, {} for none. Raises: InputError where it is something else."""
    value = feature.get(key)
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise InputError(f"{place}: `{key}` is no object, expected a feature of GeoJSON")
    return value


def _places(coordinates: object) -> int:
    """The number of lists of numbers in nested lists, which are places."""
    count = 0
    waiting = [coordinates]
    while waiting:
        value = waiting.pop()
        if isinstance(value, list) and value:
            if isinstance(value[0], list):
                waiting += value
            else:
                count += 1
    return count


def _footprints(path: Path, all_polygons: bool) -> tuple[list[Footprint], Counter, Counter]:
    """The buildings of a file in degrees, what was left out, and what was not read as stated.

    all_polygons: whether all polygons of a file without any tag of buildings are buildings.
    """
    found: list[Footprint] = []
    others: list[Footprint] = []
    left_out: Counter[str] = Counter()
    notes: Counter[str] = Counter()
    places = 0
    for number, feature in enumerate(_features(path)):
        place = f"features[{number}]"
        if not isinstance(feature, dict):
            raise InputError(f"{path}: {place} is no object, expected a feature of GeoJSON")
        properties = _object_of(feature, "properties", f"{path}: {place}")
        geometry = _object_of(feature, "geometry", f"{path}: {place}")
        called = is_building(properties)
        is_area = geometry.get("type") in ("Polygon", "MultiPolygon")
        if not is_area:
            left_out[NO_AREA if called else NO_BUILDING] += 1
            continue
        if not called and not all_polygons:
            left_out[NO_BUILDING] += 1
            continue
        own_places = _places(geometry.get("coordinates"))
        places += own_places
        if own_places > MOST_CORNERS or places > MOST_PLACES:
            raise InputError(
                f"{path}: {place}: {own_places} corners, {places} with those before it, expected "
                f"at most {MOST_CORNERS} of a building and {MOST_PLACES} of a town"
            )
        try:
            outline = shapely.force_2d(shape(geometry))
        except Exception as error:
            said = in_one_line(error)
            raise InputError(
                f"{path}: {place}: its geometry cannot be read ({said}), expected polygons"
            ) from None
        name = feature.get("id") or properties.get("@id")
        label = f"{place} ({str(name)[:40]})" if name is not None else place
        (found if called else others).append(Footprint(outline, properties, label))
    if found:
        left_out[NO_BUILDING] += len(others)
    elif others:
        found = others
        note = "polygons without a tag of buildings, read as buildings: the file tags none"
        notes[note] = len(others)
    kept = [footprint for footprint in found if not footprint.outline.is_empty]
    left_out[NO_AREA] += len(found) - len(kept)
    for footprint in kept:
        _refuse_metres(path, shapely.get_coordinates(footprint.outline))
    return kept, left_out, notes


def _refuse_metres(path: Path, places: np.ndarray) -> None:
    """Raise InputError where the places (K, 2) of a file are no longitudes and latitudes."""
    if not (abs(places) <= (180, 90)).all():
        shown = ", ".join(f"{value:g}" for value in places[0])
        raise InputError(
            f"{path}: the place [{shown}] is no longitude and latitude in degrees, expected "
            "EPSG:4326 (RFC 7946): in QGIS export with this reference system"
        )


def middle_of(path: Path, height_m: float | None) -> tuple[float, float]:
    """Return the middle (longitude, latitude) of a file's buildings.

    height_m: of buildings that state none; where it is given and the file tags no building, all its
    polygons count.
    Raises: InputError where the file has none, or cannot be read.
    """
    with reading(path, "file of buildings"):
        found, _, _ = _footprints(path, height_m is not None)
        if not found:
            raise InputError(
                f"{path}: has no building, expected polygons with the key building or height, or "
                "--height, with which polygons without a tag of buildings are read as well"
            )
        bounds = np.array([footprint.outline.bounds for footprint in found])
        low_x, low_y, high_x, high_y = bounds.T
    longitude = (low_x.min() + high_x.max()) / 2
    latitude = (low_y.min() + high_y.max()) / 2
    return float(longitude), float(latitude)


def _local(origin: Sequence[float]) -> Transformer:
    """From longitude and latitude to metres east and north of an origin (degrees)."""
    text = f"+proj=aeqd +lon_0={origin[0]!r} +lat_0={origin[1]!r} +datum=WGS84 +units=m"
    return Transformer.from_crs("EPSG:4326", text, always_xy=True)


def moved(origin: Sequence[float], offset_m: Sequence[float]) -> list[float]:
    """Return the place (longitude, latitude; degrees) that lies beside an origin.

    offset_m: (2,), east and north.
    """
    east_m, north_m = offset_m
    there = _local(origin).transform(east_m, north_m, direction="INVERSE")
    return [round(float(value), 7) for value in there]


def _united(outline: Polygon | MultiPolygon) -> Polygon | MultiPolygon | None:
    """The outline (m) of a building whose polygons may adjoin or overlap.

    It is None where one of them crosses itself.
    """
    if outline.is_valid:
        return outline
    members = getattr(outline, "geoms", [outline])
    if not all(member.is_valid for member in members):
        return None
    return shapely.union_all(list(members), grid_size=JOINT_M)


def _without_replaced(footprints: list[Footprint]) -> list[Footprint]:
    """The footprints but outlines in which a building:part lies.

    Source: Simple 3D Buildings.
    """
    points = []
    for footprint in footprints:
        if is_part(footprint.properties):
            points.append(footprint.outline.representative_point())
    if not points:
        return footprints
    parts = shapely.STRtree(points)
    kept = []
    for footprint in footprints:
        held = parts.query(footprint.outline, predicate="contains")
        if is_part(footprint.properties) or not len(held):
            kept.append(footprint)
    return kept


def _refuse_many_left_out(path: Path, left_out: Counter, kept: int, share: float) -> None:
    """Raise InputError where more than a share of a file's buildings is left out."""
    missing = {
        reason: count for reason, count in left_out.items() if count and reason != NO_BUILDING
    }
    count = sum(missing.values())
    if count > share * (count + kept):
        reasons = ", ".join(f"{number} {reason}" for reason, number in missing.items())
        raise InputError(
            f"{path}: {count} of {count + kept} buildings are left out ({reasons}), expected at "
            f"most {share:.3g} of them: mend the file, or allow a larger share: --left-out, or "
            "effects.town.left_out of a scene"
        )


def _heights(
    path: Path, footprints: list[Footprint], height_m: float | None, notes: Counter
) -> list[float]:
    """The heights (m) of buildings; notes: takes those that are stated and cannot be read.

    Raises: InputError where one has no height, naming the first by its place in the file.
    """
    result = []
    missing = []
    unread: list[str] = []
    for footprint in footprints:
        stated = height_of(footprint.properties)
        unread += stated.unread
        value = stated.metres or height_m
        if value is None:
            missing.append(footprint.place)
            continue
        result.append(value)
    if missing:
        raise InputError(
            f"{path}: {len(missing)} of {len(footprints)} buildings have neither height nor "
            f"building:levels that can be read, the first is {missing[0]}; expected their height: "
            "--height, or effects.town.height_m of a scene"
        )
    if unread:
        which = f"heights that cannot be read{such_as(unread)}"
        notes[f"{which}: building:levels or --height stands for them"] = len(unread)
    return result


def read_footprints(path: Path, origin: tuple[float, float] | None, settings: dict) -> Surfaces:
    """Return the walls and roofs of the buildings of a GeoJSON file.

    origin: longitude and latitude (degrees) of x = y = 0, x to the east; settings: those of the
    effect `town`, of which height_m and material hold for buildings for which the file has none,
    and left_out is the largest share of buildings that may be left out.
    Raises: InputError naming the file: no origin, no GeoJSON, places that are no longitudes and
    latitudes, heights that are missing, or too many buildings left out.
    """
    if origin is None:
        raise InputError(
            f"{path}: effects.town.origin is not set, expected [longitude, latitude] of x = y = 0; "
            "`lowalt scene new` proposes one"
        )
    if not (abs(origin[0]) <= 180 and abs(origin[1]) <= 89):
        raise InputError(
            f"effects.town.origin: {list(origin)}, expected longitude and latitude in degrees"
        )
    towards = _local(origin)
    footprints, left_out, notes = _footprints(path, settings["height_m"] is not None)
    valid = []
    for footprint in footprints:
        placed = shapely.transform(
            footprint.outline, lambda degrees: np.column_stack(towards.transform(*degrees.T))
        )
        united = _united(placed)
        if united is None:
            left_out[CROSSED] += 1
        else:
            valid.append(footprint._replace(outline=united))
    standing = _without_replaced(valid)
    if len(standing) < len(valid):
        notes["outlines, in whose place their building:parts stand"] = len(valid) - len(standing)
    heights = _heights(path, standing, settings["height_m"], notes)
    walls = []
    unknown = []
    unread: list[str] = []
    for (outline, properties, _), height in zip(standing, heights, strict=True):
        stated = low_of(properties)
        low = stated.metres or 0.0
        unread += stated.unread
        if low >= height:
            left_out[NO_HEIGHT] += 1
            continue
        text = str(properties.get("building:material") or "")
        name = named(text)
        if text and name is None:
            unknown.append(text)
        for polygon in getattr(outline, "geoms", [outline]):
            walls.append((_prism(polygon, height, low), name or settings["material"]))
    if unread:
        which = f"least heights that cannot be read{such_as(unread)}"
        notes[f"{which}: the ground stands for them"] = len(unread)
    kept = len(standing) - left_out[NO_HEIGHT]
    _refuse_many_left_out(path, left_out, kept, settings["left_out"])
    return joined(walls, left_out, notes, unknown)
