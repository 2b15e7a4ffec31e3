"""A first look at a user's mesh: its unit, extents, named pieces, connected components, and guesses on their kinds.

The text calls everything a guess that the file does not state (`guesses`); nothing here changes a record.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lowalt.files.atomic import existing
from lowalt.targets.guesses import Component, box_of, cut_axis, guessed_axes, guessed_unit, mirror_axis, rotors, wheels
from lowalt.targets.mesh_files import UNITS_M, Mesh, read_mesh, stated_unit_m
from lowalt.targets.mesh_scene import Piece, pieces

SLICES = 40
"""Number of slices of a bird from its middle to a wing tip; the height of each is measured."""
MOST_POINTS = 20_000
"""Most triangles whose middles an inspection keeps."""


@dataclass(frozen=True)
class Inspection:
    """Result of an inspection of a file; lengths in metres along the file's axes.

    `unit` as a record takes it and how it is known (`unit_from`), `low` and `high` (3,), `up` and `front` as guessed,
    `pieces` the names with triangles and extents (3,), `components` from the largest down; `points` (K, 3) m the
    middles of some of the triangles, `owner` (K,) the number of each one's component; `groups` of components that may
    be one moving part each; `sides_seen`: whether a bird's left and right are given or mirror one another; `cut`: the
    axis that a half of a target is cut off along, empty for a whole one.
    """

    path: Path
    unit: str | float
    unit_from: str
    low: np.ndarray
    high: np.ndarray
    triangles: int
    up: str
    front: str
    pieces: list[tuple[str, int, np.ndarray]]
    components: list[Component] = field(default_factory=list)
    category: str = "UAV"
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    groups: list[list[Component]] = field(default_factory=list)
    sides_seen: bool = True
    cut: str = ""

    @property
    def shoulder_m(self) -> float:
        """Distance (m) from the middle to the wing: farther out, no slice is both at least half as high as the highest
        and half as long as the longest, as a body is and neither a drooping wing nor a tail."""
        up, front = "xyz".index(self.up[-1]), "xyz".index(self.front[-1])
        right = 3 - up - front
        across = np.abs(self.points[:, right] - (self.low + self.high)[right] / 2)
        edges = np.linspace(0, across.max() * (1 + 1e-9), SLICES + 1)
        sizes = np.zeros((SLICES, 2))
        for index in range(SLICES):
            inside = self.points[(across >= edges[index]) & (across < edges[index + 1])][:, [up, front]]
            sizes[index] = np.ptp(inside, axis=0) if len(inside) else 0.0
        return float(edges[np.flatnonzero((sizes >= 0.5 * sizes.max(axis=0)).all(axis=1)).max(initial=0) + 1])


def components_of(mesh: Mesh, names: list[str]) -> list[Component]:
    """Return the connected components of a repaired mesh, those with the largest extent first.

    `names`: the name of the piece that each component lies in, (C,).
    """
    result = []
    for number in range(len(mesh.closed)):
        mask = mesh.component == number
        points = mesh.vertices[mesh.faces[mask]].reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        a, b, c = np.moveaxis(points.reshape(-1, 3, 3), 1, 0)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        middle = (areas[:, None] * (a + b + c)).sum(axis=0) / (3 * max(areas.sum(), 1e-300))
        closed, area = bool(mesh.closed[number]), float(areas.sum()) / 2
        spread, axes = np.linalg.eigh(np.cov(points.T))
        slender = float(np.sqrt(max(spread[1], 0.0) / max(spread[2], 1e-300)))
        shape = (middle, area, axes[:, 2], slender)
        result.append(Component(number, low, high, int(mask.sum()), closed, names[number], "", *shape))
    return sorted(result, key=lambda part: -float(part.extent.max()))


def _piece_names(mesh: Mesh, found: list[Piece], metres: float) -> list[str]:
    """Return for each component the name of the smallest piece whose box holds it, or an empty text where none does."""
    boxes = [
        (", ".join(piece.names), piece.vertices.min(axis=0) * metres, piece.vertices.max(axis=0) * metres)
        for piece in found
    ]
    names = []
    for number in range(len(mesh.closed)):
        points = mesh.vertices[mesh.faces[mesh.component == number]].reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        slack = 1e-5 * np.ptp(mesh.vertices, axis=0).max()
        inside = [(float(np.prod(top - base + slack)), name) for name, base, top in boxes
                  if (low >= base - slack).all() and (high <= top + slack).all()]  # fmt: skip
        names.append(min(inside)[1] if inside else "")
    return names


def _unit_of(path: Path, size: float, size_m: float | None, category: str, row: dict) -> tuple[str | float, str]:
    """The unit of a file whose largest extent is `size`, and where it is from; size_m: the same in metres."""
    stated = stated_unit_m(path)
    if size_m is not None:
        return float(f"{size_m / size:.6g}"), "given by the size"
    if stated is not None:
        return {metres: name for name, metres in UNITS_M.items()}.get(stated, stated), "stated by the file"
    wanted = row.get("len_m") if category == "Vehicle" else row.get("size_m")
    return guessed_unit(size, category, wanted), "guessed from the size"


def inspect_mesh(
    path: str | Path, category: str, unit: str | float | None = None, row: dict | None = None,
    size_m: float | None = None, axes: tuple[str | None, str | None] = (None, None),
) -> Inspection:  # fmt: skip
    """Return the facts and guesses on a mesh file for a target of the category UAV, Bird or Vehicle.

    `unit`, `size_m` (the largest extent) and `axes` (up, front) are given where the user knows them; otherwise the unit
    is the file's own statement or a guess from the size, which of the published `row` is known, and the axes are
    guessed from rotors and extents.
    Raises: InputError naming the file and the reason where it cannot be read.
    """
    path = existing(path, "mesh")
    found = pieces(path)
    corners = [piece.vertices for piece in found] or [np.zeros((1, 3))]
    size = max(float(np.ptp(np.concatenate(corners), axis=0).max()), 1e-12)
    row = row or {}
    unit, source = (unit, "given") if unit is not None else _unit_of(path, size, size_m, category, row)
    metres = UNITS_M[unit] if isinstance(unit, str) else unit
    mesh = read_mesh(path, unit)
    some = np.unique(np.linspace(0, len(mesh.faces) - 1, min(len(mesh.faces), MOST_POINTS)).astype(int))
    points = mesh.vertices[mesh.faces[some]].mean(axis=1)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    parts = components_of(mesh, _piece_names(mesh, found, metres))
    up, front = (name and "xyz".index(name[-1]) for name in axes)
    ups = [up] if up is not None else [int(axis) for axis in np.argsort(high - low, kind="stable") if axis != front]
    groups: list[list[Component]] = []
    count = row.get("n_rotors_or_wings")
    if count == 0:
        pass
    elif category == "UAV":
        best, groups = rotors(parts, ups, high - low, count)
        up = best if up is None and groups else up
    elif category == "Vehicle":
        groups = wheels(parts, high - low)
    right = mirror_axis(points) if category == "Bird" and None in axes else None
    if category == "Vehicle" and groups:
        # Wheels are thinnest along their axes.
        right = int(np.argmin(np.mean([np.subtract(*box_of(group)[::-1]) for group in groups], axis=0)))
    up = ups[0] if up is None and category == "UAV" else up
    guessed = guessed_axes(high - low, category, up, None if right in (up, front) else right)
    seen = category != "Bird" or None not in axes or right is not None
    if category == "UAV" and groups and axes[0] is None:
        axis = "xyz".index(guessed[0])
        hubs = np.mean([np.mean(box_of(group), axis=0) for group in groups], axis=0)
        # Rotors stand in the upper half; some files have their down axis first.
        guessed = ("-" * bool(hubs[axis] < (low + high)[axis] / 2 - 1e-9) + guessed[0], guessed[1])
    cut = cut_axis(mesh, points, [axis for axis in range(3) if axis not in ("xyz".index(guessed[0][-1]), front)])
    kind = {"UAV": "rotor", "Vehicle": "wheel"}.get(category, "")
    moving = {part.number for group in groups for part in group}
    parts = [replace(part, guess=kind if part.number in moving else "") for part in parts]
    groups = [[next(one for one in parts if one.number == part.number) for part in group] for group in groups]
    named = [(", ".join(piece.names), len(piece.faces), np.ptp(piece.vertices, axis=0) * metres) for piece in found]
    return Inspection(
        path, unit, source, low, high, len(mesh.faces), axes[0] or guessed[0], axes[1] or guessed[1], named, parts,
        category, points, mesh.component[some], groups, seen,
        "" if cut is None else "xyz"[cut],
    )  # fmt: skip


def _size(values: np.ndarray) -> str:
    """Return sizes as text with four digits: a x b x c."""
    return " x ".join(f"{value:.4g}" for value in values)


def described(found: Inspection, most: int = 30) -> str:
    """Return an inspection as text, at most `most` components, the largest and those with a guess first."""
    lines = [
        f"{found.path}: {found.triangles} triangles, {len(found.components)} connected components",
        f"category {found.category} (give --category where it is another)",
        f"unit     {found.unit} ({found.unit_from})",
        f"extent   {_size(found.high - found.low)} m along x, y, z, from {np.round(found.low, 4).tolist()} to "
        f"{np.round(found.high, 4).tolist()}",
        f"up       {found.up} (unless given, guessed from rotors or the smallest extent; the sign is unknown)",
        f"front    {found.front} (unless given, guessed; the sign is unknown)",
        *([f"half     it ends flat along {found.cut}, as one half of a target does"] if found.cut else []),
        *(
            [f"wings    may begin {found.shoulder_m:.4g} m right and left of the middle"]
            if found.category == "Bird"
            else []
        ),
        "",
        "named pieces (for `geometry:`)",
        *(f"  {name!r}: {count} triangles, {_size(extent)} m" for name, count, extent in found.pieces),
        "",
        "connected components (for `region:` with `whole: true`)",
    ]
    ranked = sorted(found.components, key=lambda part: (not part.guess, -float(part.extent.max())))
    for part in ranked[:most]:
        guess = f"  may be a {part.guess}" if part.guess else ""
        number = found.components.index(part) + 1
        lines.append(
            f"  {number} {part.piece!r}: {part.triangles} triangles, {_size(part.extent)} m at "
            f"{np.round(part.centre, 4).tolist()}, {'closed' if part.closed else 'open'}{guess}"
        )
    if len(ranked) > most:
        lines.append(f"  and {len(ranked) - most} smaller ones")
    return "\n".join(lines)
