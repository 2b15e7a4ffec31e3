"""Buildings from a file: a mesh, footprints with heights (GeoJSON), or a Mitsuba scene.

They are in metres, z up.
"""

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.building_surfaces import (
    Surfaces,
    joined,
    mesh_parts,
    refuse_many,
    such_as,
)
from lowalt.extensions.town.facets import Town, corner_numbers, sizes, town
from lowalt.extensions.town.materials import MATERIALS
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError, reading
from lowalt.targets.mesh_files import suffixes

FLOOR_M = 0.05
"""Triangles whose corners are all lower than this are the ground, which is a plane of its own."""
LOWEST_M = -1.0
"""A triangle that reaches deeper is refused: the ground is flat."""
TALLEST_M = (2.0, 900.0)
SMALLEST_M = 3.0
LARGEST_M = 20_000.0
"""Heights of the tallest building, and least and largest extents of a town.

Outside of these the unit is wrong.
"""

SMALLEST_M2 = 5e-7
"""A smaller triangle counts as one without an area."""

KEYS = ("height_m", "unit", "up", "material", "ground", "left_out")
"""Settings of the effect `town` that say how a file is read, beside its origin."""


class Buildings(NamedTuple):
    """A town that was read.

    town: of its paths; corners: (F, 3, 3) m, of its triangles; facts: what was merged or dropped.
    """

    town: Town
    corners: np.ndarray
    facts: dict


def _surfaces(path: Path, settings: dict) -> Surfaces:
    """The surfaces of a file by its ending, moved so that the settings' origin is (0, 0, 0)."""
    kind = path.suffix.lower()
    origin = settings["origin"]
    if kind in (".geojson", ".json"):
        from lowalt.extensions.town.footprints import read_footprints

        return read_footprints(path, origin, settings)
    if kind == ".xml":
        from lowalt.extensions.town.mitsuba import read_mitsuba

        found = read_mitsuba(path, settings["unit"])
    elif kind in suffixes():
        # glTF states its axes: y is up.
        up = "y" if kind == ".glb" else settings["up"]
        walls, unknown = mesh_parts(path, settings["unit"], up)
        found = joined(walls, {}, {}, unknown)
    else:
        known = (".geojson", ".xml", *suffixes())
        raise InputError(
            f"{path}: ends in {kind!r}, expected a file of buildings that ends in one of {known}"
        )
    x, y = origin or (0.0, 0.0)
    return found._replace(corners=found.corners - np.array([x, y, 0.0]))


def _cleaned(path: Path, found: Surfaces) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Return corners (F, 3, 3) and materials (F,) of the buildings alone.

    The ground, triangles without an area and repeated ones are left out.

    Raises: InputError for no triangle, too many, numbers that are not finite, or a town of the
    wrong size.
    """
    corners = found.corners
    material = found.material
    dropped = dict(found.left_out)
    if not len(corners):
        raise InputError(f"{path}: has no surface of a building, expected some")
    refuse_many(path, len(corners))
    if not np.isfinite(corners).all() or abs(corners).max() > 1e9:
        raise InputError(f"{path}: a corner is NaN, infinite or beyond 1e9 m, expected finite ones")
    low = corners.min(axis=(0, 1))
    high = corners.max(axis=(0, 1))
    extent = float((high - low)[:2].max())
    tallest = float(high[2])
    advice = "expected a town in metres, z up, on ground z = 0: set unit and up of effects.town"
    if not SMALLEST_M <= extent <= LARGEST_M or not TALLEST_M[0] <= tallest <= TALLEST_M[1]:
        raise InputError(f"{path}: {extent:.3g} m wide and up to {tallest:.3g} m high, {advice}")
    if low[2] < LOWEST_M:
        raise InputError(f"{path}: reaches {-low[2]:.3g} m below the ground z = 0, {advice}")

    def keep(which: np.ndarray, reason: str) -> None:
        """Keep some triangles and count the others."""
        nonlocal corners, material
        dropped[reason] = dropped.get(reason, 0) + int(len(which) - which.sum())
        corners = corners[which]
        material = material[which]

    keep(corners[..., 2].max(axis=1) >= FLOOR_M, "triangles of the ground")
    ordered = np.sort(corner_numbers(corners), axis=1)
    different = (ordered[:, 0] < ordered[:, 1]) & (ordered[:, 1] < ordered[:, 2])
    _, area_m2 = sizes(corners)
    keep((area_m2 > SMALLEST_M2) & different, "triangles without an area")
    _, first = np.unique(np.sort(corner_numbers(corners), axis=1), axis=0, return_index=True)
    keep(np.isin(np.arange(len(corners)), first), "repeated triangles")
    if not len(corners):
        raise InputError(f"{path}: has no surface above the ground, expected buildings")
    return corners, material, dropped


def files_of(buildings: str | Path) -> list[str]:
    """Return the path of a file of buildings, and those of the meshes that a Mitsuba scene names.

    Raises: InputError where one is not there, or not in the scene's folder.
    """
    path = existing(buildings, "file of buildings")
    if path.suffix.lower() != ".xml":
        return [str(path)]
    from lowalt.extensions.town.mitsuba import meshes_of

    return [str(path), *map(str, meshes_of(path))]


def read(settings: dict) -> Buildings:
    """Return the buildings of the file that the settings of the effect `town` name.

    The last few are kept.

    Raises: InputError naming the file and what is wrong with it, or a material that is not known.
    """
    if settings["buildings"] is None:
        raise InputError(
            "effects.town.buildings: not set, expected the file of the buildings, such as "
            "town.geojson"
        )
    path = existing(settings["buildings"], "file of buildings")
    origin = settings["origin"]
    key = tuple(settings[name] for name in KEYS)
    return _read(path, path.stat().st_mtime_ns, None if origin is None else tuple(origin), key)


@lru_cache(maxsize=4)
def _read(path: Path, changed_ns: int, origin: tuple[float, float] | None, key: tuple) -> Buildings:
    """The buildings of a file as it was at an instant."""
    settings = dict(zip(KEYS, key, strict=True)) | {"origin": origin}
    for name in ("material", "ground"):
        if settings[name] not in MATERIALS:
            raise InputError(
                f"effects.town.{name}: {settings[name]!r}, expected one of {list(MATERIALS)}"
            )
    with reading(path, "file of buildings"):
        found = _surfaces(path, settings)
        corners, material, dropped = _cleaned(path, found)
        names = tuple(name or settings["material"] for name in found.names)
        made = town(corners, material, names, settings["ground"])
    # The last facet is the ground.
    rise = made.facets.normal[:-1, 2]
    walls = int((abs(rise) < 0.5).sum())
    used = {name: int((material == k).sum()) for k, name in enumerate(names)}
    notes = dict(found.notes)
    if found.unknown:
        lacking = f"surfaces of materials that no table has{such_as(found.unknown)}"
        notes[f"{lacking}: {settings['material']} stands for them"] = len(found.unknown)
    facts = {
        "low_m": corners.min(axis=(0, 1)).tolist(),
        "high_m": corners.max(axis=(0, 1)).tolist(),
        "buildings": int(made.building.max()) + 1,
        "triangles": len(corners),
        "facets": len(rise),
        "walls": walls,
        "roofs": len(rise) - walls,
        "materials": used,
        "ground": settings["ground"],
        "dropped": {reason: number for reason, number in dropped.items() if number},
        "notes": notes,
    }
    return Buildings(made, corners, facts)
