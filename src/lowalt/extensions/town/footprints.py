"""Reading buildings from footprints with heights, GeoJSON as OpenStreetMap's tools export it.

Source: RFC 7946; OpenStreetMap wiki, Simple 3D Buildings (height, min_height, building:levels, building:material).
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from lowalt.extensions.town.building_surfaces import Surfaces, joined
from lowalt.extensions.town.materials import named
from lowalt.files.errors import InputError, lacking
from lowalt.files.json_objects import json_object

try:
    import shapely
    from pyproj import Transformer
    from shapely.geometry import Polygon, shape
    from shapely.geometry.polygon import orient
except ImportError as error:
    raise lacking(error) from None

STOREY_M = 3.0
"""Height of a storey, for buildings whose file has `building:levels` alone. Source: Simple 3D Buildings."""
LARGEST_BYTES = 200 << 20
HEIGHT = re.compile(r"\s*([0-9]+(?:\.[0-9]+)?)\s*(m|ft|')?\s*$")


def _metres(value: object) -> float | None:
    """A height as OpenStreetMap writes it, such as 12, "12.5 m" or "40'", in metres; None for anything else."""
    match = HEIGHT.match(str(value)) if value is not None else None
    return float(match[1]) * (0.3048 if match[2] in ("ft", "'") else 1.0) if match else None


def _height(properties: dict) -> float | None:
    """The height (m) of a building over the ground, None where its file does not say."""
    for key in ("height", "building:height"):
        if (height := _metres(properties.get(key))) is not None:
            return height
    storeys = _metres(properties.get("building:levels"))
    return None if storeys is None else storeys * STOREY_M


def _is_building(properties: dict) -> bool:
    """Whether a feature is a building and not, say, a road: it is called one, or has a height."""
    kinds = [properties[key] for key in ("building", "building:part") if properties.get(key) is not None]
    return any(kind != "no" for kind in kinds) if kinds else _height(properties) is not None


def _prism(polygon: Polygon, height_m: float, low_m: float) -> np.ndarray:
    """The walls and the roof (F, 3, 3) of a footprint in metres, walls turned outward."""
    polygon, walls = orient(polygon.simplify(0.0)), []
    for ring in (polygon.exterior, *polygon.interiors):
        places = np.asarray(ring.coords)[:, :2]
        first, second = places[:-1], places[1:]
        corners = [np.column_stack([xy, np.full(len(xy), z)]) for z in (low_m, height_m) for xy in (first, second)]
        walls += [np.stack([corners[0], corners[1], corners[3]], axis=1)]
        walls += [np.stack([corners[0], corners[3], corners[2]], axis=1)]
    flat = shapely.constrained_delaunay_triangles(polygon)
    roof = np.array([np.asarray(orient(part).exterior.coords)[:3, :2] for part in flat.geoms]).reshape(-1, 3, 2)
    roofs = [np.concatenate([roof, np.full((*roof.shape[:2], 1), height_m)], axis=2)]
    if low_m > 0.0:
        roofs.append(np.concatenate([roof[:, ::-1], np.full((*roof.shape[:2], 1), low_m)], axis=2))
    return np.concatenate([*walls, *roofs])


def _polygons(path: Path, place: Callable[[np.ndarray], np.ndarray]) -> tuple[list, dict[str, int]]:
    """The footprints of a file in metres, each with its properties, and what was left out."""
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: over {LARGEST_BYTES >> 20} MiB, expected a town")
    features = json_object(path.read_text(encoding="utf-8"), str(path), "GeoJSON").get("features")
    if not isinstance(features, list):
        raise InputError(f"{path}: has no list `features`, expected a GeoJSON FeatureCollection")
    found, left_out = [], {}
    for feature in features:
        properties, geometry = (feature or {}).get("properties") or {}, (feature or {}).get("geometry") or {}
        label = "" if _is_building(properties) else "features that are no buildings"
        if not label and geometry.get("type") not in ("Polygon", "MultiPolygon"):
            label = "buildings without an area"
        outline = None if label else shapely.transform(shapely.force_2d(shape(geometry)), place)
        if outline is not None and not outline.is_valid:
            label = "footprints that cross themselves"
        if label:
            left_out[label] = left_out.get(label, 0) + 1
            continue
        found += [(part, properties) for part in getattr(outline, "geoms", [outline])]
    return found, left_out


def _degrees(path: Path, places: np.ndarray) -> np.ndarray:
    """Return the places (K, 2) of a file. Raises: InputError where they are no longitudes and latitudes."""
    if not (abs(places) <= (180, 90)).all():
        shown = ", ".join(f"{value:g}" for value in places[0])
        raise InputError(
            f"{path}: the place [{shown}] is no longitude and latitude in degrees, expected EPSG:4326 (RFC 7946): "
            "in QGIS export with this reference system"
        )
    return places


def middle_of(path: Path) -> tuple[float, float]:
    """Return the middle (longitude, latitude) of a file's buildings. Raises: InputError where it has none."""
    found, _ = _polygons(path, lambda degrees: _degrees(path, degrees))
    if not found:
        raise InputError(f"{path}: has no building, expected polygons with the key building or height")
    low_x, low_y, high_x, high_y = np.array([part.bounds for part, _ in found]).T
    return float((low_x.min() + high_x.max()) / 2), float((low_y.min() + high_y.max()) / 2)


def _local(origin: Sequence[float]) -> Transformer:
    """From longitude and latitude to metres east and north of an origin (degrees)."""
    text = f"+proj=aeqd +lon_0={origin[0]!r} +lat_0={origin[1]!r} +datum=WGS84 +units=m"
    return Transformer.from_crs("EPSG:4326", text, always_xy=True)


def moved(origin: Sequence[float], offset_m: Sequence[float]) -> list[float]:
    """Return the place (longitude, latitude; degrees) that lies offset_m (2,), east and north, of an origin."""
    return [round(float(value), 7) for value in _local(origin).transform(*offset_m, direction="INVERSE")]


def read_footprints(path: Path, origin: tuple[float, float] | None, height_m: float | None, material: str) -> Surfaces:
    """Return the walls and roofs of the buildings of a GeoJSON file.

    origin: longitude and latitude (degrees) of x = y = 0, x to the east; height_m, material: of buildings for which the
    file has none.
    Raises: InputError naming the file: no origin, no GeoJSON, places that are no longitudes and latitudes, or heights
    that are missing.
    """
    if origin is None:
        raise InputError(f"{path}: effects.town.origin is not set, expected [longitude, latitude] of x = y = 0; "
                         "`lowalt scene new` proposes one")  # fmt: skip
    if not (abs(origin[0]) <= 180 and abs(origin[1]) <= 89):
        raise InputError(f"effects.town.origin: {list(origin)}, expected longitude and latitude in degrees")
    towards = _local(origin)

    def place(degrees: np.ndarray) -> np.ndarray:
        """Metres (K, 2) of degrees (K, 2)."""
        return np.column_stack(towards.transform(*_degrees(path, degrees).T))

    found, left_out = _polygons(path, place)
    heights = [_height(properties) or height_m for _, properties in found]
    if missing := sum(height is None for height in heights):
        raise InputError(f"{path}: {missing} of {len(found)} buildings have neither height nor building:levels, "
                         "expected their height: --height, or effects.town.height_m of a scene")  # fmt: skip
    parts = []
    for (outline, properties), height in zip(found, heights, strict=True):
        low = _metres(properties.get("min_height")) or 0.0
        if low >= height or outline.is_empty:
            left_out["buildings without a height"] = left_out.get("buildings without a height", 0) + 1
            continue
        name = named(str(properties.get("building:material") or "")) or material
        parts.append((_prism(outline, height, low), name))
    return joined(parts, left_out)
