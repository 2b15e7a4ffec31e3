"""A first look at a user's mesh: unit, extents, named pieces, connected components, guesses.

Whatever the file does not state is called a guess (`guesses`). Nothing here changes a record.
"""

import itertools
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lowalt.extensions.drafting import guesses
from lowalt.extensions.drafting.front import NOTHING_TELLS, Front, Shape, Turning, front_of
from lowalt.files.atomic import existing
from lowalt.targets.mesh_files import (
    UNITS_M,
    Mesh,
    metres,
    pieces,
    read_mesh,
    stated_unit_m,
    stated_up_axis,
)
from lowalt.targets.mesh_polygons import Piece

SLICES = 40
"""Number of slices between the middle of a bird and its wing tip; each slice is measured on its
own.
"""
BELIEVED = 5.0
"""A glTF file's metres are believed while its size is at most this factor outside USUAL_M."""
MOST_POINTS = 20_000
"""Largest number of triangles whose centres an inspection keeps."""


@dataclass(frozen=True)
class Inspection:
    """Result of an inspection of a file; lengths in metres along the file's axes.

    `unit` as a record takes it and how it is known (`unit_from`), `low` and `high` (3,), `up` and
    `front` as guessed, `pieces` the names with triangles and extents (3,), `components` from the
    largest down; `points` (K, 3) m the middles of some of the triangles, `owner` (K,) the number of
    each one's component; `groups` of components that may be one moving part each; `sides_seen`:
    whether a bird's left and right are given or mirror one another; `cut`: the axis that a half of
    a target is cut off along, empty for a whole one; `up_from` how the axis up is known and
    `front_from` how the front is.
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
    components: list[guesses.Component] = field(default_factory=list)
    category: str = "UAV"
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    groups: list[guesses.Group] = field(default_factory=list)
    sides_seen: bool = True
    cut: str = ""
    up_from: str = "given"
    front_from: Front = field(default_factory=lambda: Front("y", "", True))

    @property
    def shoulder_m(self) -> float:
        """Distance (m) from the middle of a bird to its wings.

        The body ends at the last slice that is at least half as high as the highest slice and half
        as long as the longest one. A drooping wing is high but short, a tail long but low.
        """
        up = "xyz".index(self.up[-1])
        front = "xyz".index(self.front[-1])
        right = 3 - up - front
        across = np.abs(self.points[:, right] - (self.low + self.high)[right] / 2)
        edges = np.linspace(0, across.max() * (1 + 1e-9), SLICES + 1)
        sizes = np.zeros((SLICES, 2))
        for index in range(SLICES):
            in_slice = (across >= edges[index]) & (across < edges[index + 1])
            if in_slice.any():
                sizes[index] = np.ptp(self.points[in_slice][:, [up, front]], axis=0)
        of_body = (sizes >= 0.5 * sizes.max(axis=0)).all(axis=1)
        last = np.flatnonzero(of_body).max(initial=0)
        return float(edges[last + 1])


def components_of(mesh: Mesh, named: list[Piece], metre: float) -> list[guesses.Component]:
    """Return the connected components of a repaired mesh, those with the largest extent first.

    named: the pieces of its file, whose unit is `metre` metres; a component has the names of the
    smallest piece whose box holds it, or none.
    """
    slack = 1e-5 * np.ptp(mesh.vertices, axis=0).max()
    boxes = []
    for piece in named:
        base = piece.vertices.min(axis=0) * metre - slack
        top = piece.vertices.max(axis=0) * metre + slack
        boxes.append((base, top, ", ".join(piece.names)))
    result = []
    for number, closed in enumerate(mesh.closed.tolist()):
        triangles = mesh.vertices[mesh.faces[mesh.component == number]]
        points = triangles.reshape(-1, 3)
        low = points.min(axis=0)
        high = points.max(axis=0)
        a, b, c = np.moveaxis(triangles, 1, 0)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        middle = (areas[:, None] * (a + b + c)).sum(axis=0) / (3 * max(areas.sum(), 1e-300))
        spread, axes = np.linalg.eigh(np.cov(points.T))
        slender = float(np.sqrt(max(spread[1], 0.0) / max(spread[2], 1e-300)))
        around = []
        for base, top, name in boxes:
            if (low >= base).all() and (high <= top).all():
                around.append((float(np.prod(top - base)), name))
        _, names = min(around, default=(0.0, ""))
        shape = (middle, float(areas.sum()) / 2, axes[:, 2], slender)
        result.append(
            guesses.Component(number, low, high, len(triangles), closed, names, "", *shape)
        )
    return sorted(result, key=lambda part: -float(part.extent.max()))


def _unit_of(
    path: Path, extents: np.ndarray, size_m: float | None, category: str, row: dict
) -> tuple[str | float, str]:
    """The unit of a file with the extents (3,), and where it is from.

    size_m: its largest extent in metres.
    """
    if size_m is not None:
        return float(f"{size_m / extents.max():.6g}"), "given by the size"
    wanted = row.get("len_m") if category == "Vehicle" else row.get("size_m")
    stated = stated_unit_m(path)
    if stated is None:
        return guesses.guessed_unit(extents, category, wanted), "guessed from the size"
    low, high = guesses.USUAL_M[category]
    believed = low / BELIEVED <= float(extents.max()) <= high * BELIEVED
    if path.suffix.lower() != ".glb" or believed or row.get("name"):
        unit_names = {metre: name for name, metre in UNITS_M.items()}
        return unit_names.get(stated, stated), "stated by the file"
    unit = guesses.guessed_unit(extents, category, wanted)
    return unit, "guessed: in glTF's metres no such target has this size"


def inspect_mesh(
    path: str | Path,
    category: str,
    unit: str | float | None = None,
    row: dict | None = None,
    size_m: float | None = None,
    axes: tuple[str | None, str | None] = (None, None),
    usual: str | None = None,
) -> Inspection:
    """Return the facts and guesses on a mesh file for a UAV, Bird or Vehicle.

    `unit`, `size_m` (the largest extent) and `axes` (up, front) are given where the user knows
    them. Otherwise the unit is the file's own statement or a guess from its sizes, for which the
    published `row` is used where there is one; the axes come from rotors, wheels, names and
    extents. usual: the front that such files have by convention; that of glTF is known.
    Raises: InputError naming the file and the reason where it cannot be read or its parts
    contradict one another.
    """
    path = existing(path, "mesh")
    row = row or {}
    named = pieces(path)
    corners = np.concatenate([piece.vertices for piece in named] or [np.zeros((1, 3))])
    extents = np.maximum(np.ptp(corners, axis=0), 1e-12)
    source = "given"
    if unit is None:
        unit, source = _unit_of(path, extents, size_m, category, row)
    mesh = read_mesh(path, unit)
    most = min(len(mesh.faces), MOST_POINTS)
    some = np.unique(np.linspace(0, len(mesh.faces) - 1, most).astype(int))
    points = mesh.vertices[mesh.faces[some]].mean(axis=1)
    parts = components_of(mesh, named, metres(unit))
    low = mesh.vertices.min(axis=0)
    high = mesh.vertices.max(axis=0)
    up, up_from, groups = _upright(
        parts, points, (low, high), category, row.get("n_rotors_or_wings"), axes, path
    )
    if path.suffix.lower() == ".glb" and up == "y":
        usual = "z"
    height = "xyz".index(up[-1])
    unit_vectors = np.eye(3)
    upward = unit_vectors[height]
    if up[0] == "-":
        upward = -upward
    hubs = []
    for group in groups:
        axis = unit_vectors[guesses.turning_axis(group, height, low, high)]
        hubs.append(Turning(group[0].piece, group.centre, axis))
    shape = Shape(category, upward, points, _centres(parts, named), hubs)
    front = front_of(shape, axes[1], usual, guesses.guessed_axes(high - low, category, height)[1])
    sides_seen = category != "Bird" or None not in axes or front.words != NOTHING_TELLS
    ends = [
        axis for axis, name in enumerate("xyz") if name not in (up[-1], axes[1] and axes[1][-1])
    ]
    cut = guesses.cut_axis(mesh, points, ends)
    kind = {"UAV": "rotor", "Vehicle": "wheel"}.get(category, "")
    turning = {part.number for part in itertools.chain.from_iterable(groups)}
    guessed = [replace(part, guess=kind if part.number in turning else "") for part in parts]
    listed = []
    for piece in named:
        extent = np.ptp(piece.vertices, axis=0) * metres(unit)
        listed.append((", ".join(piece.names), len(piece.faces), extent))
    return Inspection(
        path=path,
        unit=unit,
        unit_from=source,
        low=low,
        high=high,
        triangles=len(mesh.faces),
        up=up,
        front=front.axis,
        pieces=listed,
        components=guessed,
        category=category,
        points=points,
        owner=mesh.component[some],
        groups=groups,
        sides_seen=sides_seen,
        cut="" if cut is None else "xyz"[cut],
        up_from=up_from,
        front_from=front,
    )


def _centres(parts: list[guesses.Component], named: list[Piece]) -> dict[str, np.ndarray]:
    """The centre (3,) m of the components of each piece whose name may say where it is, by name."""
    names = {", ".join(piece.names) for piece in named}
    if len(names) < 2:
        return {}
    result = {}
    for name in names:
        centres = [part.centre for part in parts if part.piece == name]
        if centres:
            result[name] = np.mean(centres, axis=0)
    return result


def _upright(
    parts: list[guesses.Component],
    points: np.ndarray,
    box: tuple[np.ndarray, np.ndarray],
    category: str,
    count: int | None,
    axes: tuple[str | None, str | None],
    path: Path,
) -> tuple[str, str, list[guesses.Group]]:
    """The axis up, what it is from, and the groups that may be a moving part each.

    points: (N, 3) m on the surface; box: its lowest and highest corner; count: the number of rotors
    or wheels where it is known; axes: up and front where given.
    """
    low, high = box
    extent = high - low
    stated = stated_up_axis(path)
    given_up, given_front = axes
    front = "xyz".index(given_front[-1]) if given_front else None
    most_probable = given_up or stated
    ups = []
    if most_probable:
        ups.append("xyz".index(most_probable[-1]))
    if not given_up:
        order = np.argsort(extent, kind="stable").tolist()
        ups += [axis for axis in order if axis not in (*ups, front)]
    level, groups = _turning(parts, ups, extent, category, count)
    if given_up:
        return given_up, "given", groups
    if stated and level in (None, "xyz".index(stated[-1])):
        return stated, "as the file's format defines it", groups
    if level is None or level == front:
        # The lowest extent is up, except along the axis that is known to be level: the front, or a
        # bird's right.
        level_axis = front
        if front is None and category == "Bird":
            level_axis = guesses.mirror_axis(points)
        level = "xyz".index(guesses.guessed_axes(extent, category, None, level_axis)[0])
    up = "xyz"[level]
    if groups:
        # Rotors stand in the upper half and wheels in the lower one; some files have their down
        # axis first.
        height = np.mean([group.centre[level] for group in groups]) - (low + high)[level] / 2
        upside = height if category == "UAV" else -height
        if upside < -1e-9 * extent[level]:
            up = f"-{up}"
    return up, "guessed from its parts and extents", groups


def _turning(
    parts: list[guesses.Component],
    ups: list[int],
    extent: np.ndarray,
    category: str,
    count: int | None,
) -> tuple[int | None, list[guesses.Group]]:
    """The axis up as rotors or wheels tell it, None where they do not, and the groups of them.

    ups: numbers of axes that may be up, the most probable first.
    """
    if count == 0 or category == "Bird":
        return None, []
    if category == "Vehicle":
        groups = guesses.wheels(parts, extent)
        if len(groups) <= 2:
            return None, groups
        # Wheels stand on one level.
        centres = np.array([group.centre for group in groups])
        return int(np.ptp(centres, axis=0).argmin()), groups
    level, groups = guesses.rotors(parts, ups, extent, count)
    flat = {int(group.extent.argmin()) for group in groups}
    if len(groups) > 2 and len(flat) == 1:
        # Three rotors that lie flat tell more than a file's format.
        level = flat.pop()
    return level, groups


def _size(values: np.ndarray) -> str:
    """Return sizes as text with four digits: a x b x c."""
    return " x ".join(f"{value:.4g}" for value in values)


def described(inspection: Inspection, most: int = 30) -> str:
    """Return an inspection as text, with at most `most` components.

    The largest components and those with a guess come first.
    """
    low = np.round(inspection.low, 4).tolist()
    high = np.round(inspection.high, 4).tolist()
    lines = [
        f"{inspection.path}: {inspection.triangles} triangles, {len(inspection.components)} "
        "connected components",
        f"category {inspection.category} (give --category where it is another)",
        f"unit     {inspection.unit} ({inspection.unit_from})",
        f"extent   {_size(inspection.high - inspection.low)} m along x, y, z, from {low} to {high}",
        f"up       {inspection.up} ({inspection.up_from})",
        f"front    {inspection.front}{inspection.front_from.comment.replace('  # ', ' (') + ')'}",
    ]
    if inspection.cut:
        lines.append(f"half     it ends flat along {inspection.cut}, as one half of a target does")
    if inspection.category == "Bird":
        lines.append(
            f"wings    may begin {inspection.shoulder_m:.4g} m right and left of the middle"
        )
    lines += ["", "named pieces (for `geometry:`)"]
    lines += [
        f"  {name!r}: {count} triangles, {_size(extent)} m"
        for name, count, extent in inspection.pieces
    ]
    lines += ["", "connected components (for `region:` with `whole: true`)"]
    ranked = sorted(
        enumerate(inspection.components, 1),
        key=lambda item: (not item[1].guess, -item[1].extent.max()),
    )
    for number, part in ranked[:most]:
        guess = f"  may be a {part.guess}" * bool(part.guess)
        surface = "closed" if part.closed else "open"
        lines.append(
            f"  {number} {part.piece!r}: {part.triangles} triangles, {_size(part.extent)} m at "
            f"{np.round(part.centre, 4).tolist()}, {surface}{guess}"
        )
    if len(ranked) > most:
        lines.append(f"  and {len(ranked) - most} smaller ones")
    return "\n".join(lines)
