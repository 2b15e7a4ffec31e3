"""From repaired meshes to parts: placing, cutting regions, finding hinges.

All in metres along the file's axes.

A part is a pool of dense samples of its surface. This module decides which samples belong to which
part; `mesh_size` scales and moves the target later.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.matrices import thinnest
from lowalt.targets.mesh_files import Mesh, joined, read_mesh
from lowalt.targets.skeleton import rotation
from lowalt.targets.surfaces import face_normals, sample_faces

SHARED_LIMIT = 0.01
"""Largest share of samples that two regions may have in common; regions that touch share a border.
"""


@dataclass(frozen=True)
class Pool:
    """Dense samples of one part.

    points: (N, 3) m, the first `corners` of them vertices that bound the surface; normals: (N, 3);
    component: (N,) of the mesh; area: in m2; hinge: (3,) and axis: (3,), NaN for a body.
    """

    points: np.ndarray
    normals: np.ndarray
    component: np.ndarray
    corners: int
    area: float
    hinge: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    axis: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))

    def picked(self, mask: np.ndarray) -> "Pool":
        """Return the samples of a mask (N,), in their order."""
        return replace(
            self,
            points=self.points[mask],
            normals=self.normals[mask],
            component=self.component[mask],
            corners=int(mask[: self.corners].sum()),
            area=self.area * float(np.count_nonzero(mask) / max(1, len(mask))),
        )


def surface(part: dict, record: dict, inputs_dir: Path) -> Mesh:
    """Return the meshes of a part's files as one.

    Each is mirrored, turned and moved as the record says, in that order.
    """
    meshes = []
    for item in part["meshes"]:
        unit = item.get("unit", record["unit"])
        mesh = read_mesh(inputs_dir / item["file"], unit, item.get("geometry"))
        matrix = np.eye(3)
        if "mirror" in item:
            matrix["xyz".index(item["mirror"])] *= -1
        turns = item.get("turn", [])
        if not isinstance(turns, list):
            turns = [turns]
        for turn in turns:
            matrix = portable.product(rotation(turn["axis"], np.radians(turn["deg"])), matrix)
        meshes.append(mesh.mapped(matrix).moved(item.get("move", [0.0, 0, 0])))
    return joined(meshes)


def pool_of(mesh: Mesh, count: int, rng: np.random.Generator) -> Pool:
    """Return `count` dense samples of a mesh, its extreme vertices first; hinge and axis unknown.

    Raises: InputError where the surface has no area.
    """
    points, face = sample_faces(mesh.vertices, mesh.faces, count, rng)
    at = mesh.faces.ravel()
    along = mesh.vertices[at]
    corners = np.unique(np.concatenate([along.argmin(axis=0), along.argmax(axis=0)]))
    face = np.concatenate([corners // 3, face])
    normals, areas = face_normals(mesh.vertices, mesh.faces)
    points = np.concatenate([along[corners], points])
    area = float(portable.total(areas))
    return Pool(points, normals[face], mesh.component[face], len(corners), area)


def inside(points: np.ndarray, region: dict) -> np.ndarray:
    """Return whether each point (N, 3) lies in a region's box or cylinder, borders included."""
    if "box" in region:
        lowest, highest = region["box"]
        low = np.array([-np.inf if value is None else value for value in lowest], float)
        high = np.array([np.inf if value is None else value for value in highest], float)
        return np.all((points >= low) & (points <= high), axis=1)
    cylinder = region["cylinder"]
    away = points - np.array(cylinder["centre"])
    axis = "xyz".index(cylinder["axis"])
    across = np.delete(away, axis, axis=1)
    far = portable.dot(across, across) > cylinder["radius"] * cylinder["radius"]
    return ~far & (abs(away[:, axis]) <= cylinder["half_length"])


def taken(pool: Pool, mesh: Mesh, region: dict) -> np.ndarray:
    """Return whether a region takes each sample (N,) of a body's pool.

    With `whole: true` it takes only connected components of `mesh` (the body's) all of whose
    vertices are inside.
    """
    if not region.get("whole"):
        return inside(pool.points, region)
    outside = ~inside(mesh.vertices, region)[mesh.faces].all(axis=1)
    partly = np.zeros(len(mesh.closed), bool)
    partly[mesh.component[outside]] = True
    return ~partly[pool.component]


def refuse_shared(pool: Pool, mesh: Mesh, regions: dict[str, dict], where: str) -> None:
    """Refuse regions (by part) that take the same surface.

    The order of parts would decide which part gets it. Two regions may touch: they may share
    SHARED_LIMIT of the samples of the smaller one.
    Raises: InputError naming `where` and the two parts.
    """
    masks = {name: taken(pool, mesh, region) for name, region in regions.items()}
    for (first, left), (second, right) in combinations(masks.items(), 2):
        shared = int((left & right).sum())
        smaller = min(int(left.sum()), int(right.sum()))
        if shared > SHARED_LIMIT * smaller:
            raise InputError(
                f"{where}: the regions of parts {first!r} and {second!r} take the same surface "
                f"({shared} of {smaller} samples), expected disjoint regions"
            )


def _made_wheel(
    size: tuple[float, float],
    hinge: np.ndarray,
    samples: tuple[np.ndarray, np.ndarray],
    frame: np.ndarray,
) -> Pool:
    """The pool of a made wheel of a diameter and a width at its hinge, in the file's axes.

    It is mirrored on the left.
    """
    diameter, width = size
    side = np.array([np.sign(portable.dot(frame[0], hinge)) or 1.0, 1, 1])
    points = portable.applied(frame.T, samples[0] * side)
    normals = portable.applied(frame.T, samples[1] * side)
    area = np.pi * diameter * (diameter / 2 + width)
    # `sample_part` puts the points that bound the wheel first, six of them.
    return Pool(points + hinge, normals, np.zeros(len(points), np.int64), 6, area)


def cut_parts(
    record: dict,
    inputs_dir: Path,
    frame: np.ndarray,
    sampled: Callable[[Mesh, bool], Pool],
    wheel: Callable[[float, float], tuple[np.ndarray, np.ndarray]],
) -> tuple[dict[str, Pool], Mesh]:
    """Return the pool of every part of a checked mesh record by name, and the mesh of the body.

    The body's pool comes first.

    sampled: gives the pool of a mesh, told whether that is the body; wheel: gives points and
    normals (N, 3) of a made right wheel at the origin, in body axes, from its diameter and width
    (m); frame (3, 3): body axes in the file's.
    Raises: InputError naming the file, or the part whose region holds nothing.
    """
    where = record["subtype"]
    (body_name, body_part), *moving = record["parts"].items()
    mesh = surface(body_part, record, inputs_dir)
    body = sampled(mesh, True)
    pools = {}
    # Wheels of one size have the same samples, drawn before any other part's.
    made = {}
    for _, part in moving:
        if "wheel" in part:
            size = (part["wheel"]["diameter_m"], part["wheel"]["width_m"])
            if size not in made:
                made[size] = wheel(*size)
    for name, part in moving:
        if "region" in part:
            mask = taken(body, mesh, part["region"])
            pools[name] = body.picked(mask)
            body = body.picked(~mask)
        elif "wheel" in part:
            size = (part["wheel"]["diameter_m"], part["wheel"]["width_m"])
            pools[name] = _made_wheel(size, np.array(part["hinge"], float), made[size], frame)
        else:
            pools[name] = sampled(surface(part, record, inputs_dir), False)
        if not len(pools[name].points):
            low = [float(f"{value:.3g}") for value in mesh.vertices.min(axis=0)]
            high = [float(f"{value:.3g}") for value in mesh.vertices.max(axis=0)]
            raise InputError(
                f"{where}: parts.{name}.region holds nothing of the body, expected a part of its "
                f"surface, which reaches from {low} to {high} m; is the unit {record['unit']!r} "
                "right?"
            )
    for region in record["drop"]:
        body = body.picked(~taken(body, mesh, region))
    if not len(body.points):
        raise InputError(f"{where}: regions and drop leave nothing of {body_name}, expected a body")
    return {body_name: body, **pools}, mesh


def hinged(pool: Pool, part: dict, up: np.ndarray, front: np.ndarray, where: str) -> Pool:
    """Return the pool with its hinge and unit axis, given by the record or found from its samples.

    Where the record says "found", the hinge is the middle of a wheel's extents or the mean of a
    rotor's samples, and the axis is the direction in which the samples are thinnest. Where it names
    no axis, that of a rotor is found, that of a wheel points sideways, and that of a wing to the
    front. Signs: at positive angles a rotor turns anticlockwise seen from above, a wheel rolls to
    the front and a wing rises; `sense: cw` reverses a rotor's axis. `up` and `front` (3,) are the
    target's, in the file's axes.
    Raises: InputError naming `where` for too few samples to find an axis.
    """
    right = np.cross(front, up)
    kind = part["kind"]
    hinge = part.get("hinge", "found")
    axis = part.get("axis", {"wheel": right, "wing": front}.get(kind, "found"))
    centre = portable.mean(pool.points, 0)
    if isinstance(hinge, str):
        hinge = centre
        if kind == "wheel":
            hinge = (pool.points.min(axis=0) + pool.points.max(axis=0)) / 2
    if isinstance(axis, str):
        if len(pool.points) < 4:
            raise InputError(
                f"{where}: {len(pool.points)} samples, expected enough to find an axis"
            )
        axis = thinnest(pool.points - centre)
    hinge = np.array(hinge, float)
    axis = np.array(axis, float)
    axis = axis / portable.norm(axis)
    if kind == "rotor":
        axis = axis * np.sign(portable.dot(axis, up) or 1)
        if part.get("sense") == "cw":
            axis = -axis
    elif kind == "wheel":
        axis = axis * -np.sign(portable.dot(axis, right) or 1)
    else:
        out = portable.dot(centre - hinge, right)
        axis = axis * np.sign(portable.dot(np.cross(axis, out * right), up) or 1)
    return replace(pool, hinge=hinge, axis=axis)
