"""From a model's parts, each a set of closed shells, to a calibration point cloud.

The cloud has an exact count of points.

Allotment of points over parts (the rule, also in the cloud's record): the moving parts of a model
share `moving_share` of the points between them, by their weights, each rounded to whole copies (at
least one point a copy); the body gets the rest. Parts with several copies (the blades of a rotor)
are sampled once and turned, so that blades are equal. Echo strength goes with the count of points,
so the share is also that of the echo that carries micro-Doppler.
"""

import json
from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.cloud import Cloud
from lowalt.targets.surfaces import Surface, face_normals, inside, merged, sample_faces, thin

CANDIDATES_PER_POINT = 12
SPARE_CANDIDATES = 200
"""Dense samples drawn before the farthest-point thinning: for each wanted point, and for a part."""


@dataclass(frozen=True)
class Part:
    """One part of a model: closed shells in body axes (m), and how the part moves.

    `copies` > 1: the shells are one of that many equal copies about the hinge's axis. `cuts` are
    volumes (wheel wells) inside which the part has no surface. `weight` is its share among the
    moving parts.
    """

    name: str
    kind: str
    shells: tuple[Surface, ...]
    hinge: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    axis: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    parent: int = -1
    copies: int = 1
    weight: float = 1.0
    cuts: tuple[Surface, ...] = ()


def allot(parts: list[Part], count: int, moving_share: float, where: str) -> list[int]:
    """Return the number of points of each part, whole copies each, `count` in total.

    The rule is the module's.

    Raises: InputError naming `where` if `count` leaves the body without a point.
    """
    is_body = np.array([part.kind == "body" for part in parts])
    weights = np.where(is_body, 0.0, [part.weight for part in parts])
    shares = count * moving_share * weights / max(float(portable.total(weights)), 1e-300)
    counts = []
    for part, share in zip(parts, shares, strict=True):
        in_a_copy = max(1, round(share / part.copies))
        counts.append(part.copies * in_a_copy)
    body = int(np.argmax(is_body))
    counts[body] += count - sum(counts)
    if counts[body] < 1:
        raise InputError(
            f"{where}: {count} points for {len(parts)} parts leave none for the body, expected more"
        )
    return counts


def _tips(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """The outermost points along each axis (up to 6, 3) and their normals.

    Each lies just inside its largest face.
    """
    unit, areas = face_normals(surface.vertices, surface.faces)
    points = []
    normals = []
    outermost = np.concatenate([surface.vertices.argmin(0), surface.vertices.argmax(0)])
    for vertex in np.unique(outermost):
        # On a face, not at the vertex: there the normal is that of a surface.
        face = np.argmax(np.where((surface.faces == vertex).any(1), areas, -1.0))
        corner = surface.vertices[vertex]
        middle = portable.mean(surface.vertices[surface.faces[face]], 0)
        points.append(corner + 1e-4 * (middle - corner))
        normals.append(unit[face])
    return np.array(points), np.array(normals)


def sample_part(part: Part, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return `count` points (count, 3) on the part's outer skin and their unit normals (count, 3).

    The outermost points along each axis are kept first, so that a cloud is as large as its model;
    of a blade with few points the one farthest from the hinge alone, so that the others lie along
    it.
    """
    whole = merged(part.shells)
    candidates = CANDIDATES_PER_POINT * count + SPARE_CANDIDATES
    points, face = sample_faces(whole.vertices, whole.faces, candidates, rng)
    normals = face_normals(whole.vertices, whole.faces[face])[0]
    tips, facing = _tips(whole)
    if part.kind == "rotor" and count < 2 * len(tips):
        farthest = portable.norm(tips - np.array(part.hinge)).argmax()
        tips = tips[farthest : farthest + 1]
        facing = facing[farthest : farthest + 1]
    points = np.concatenate([tips, points])
    normals = np.concatenate([facing, normals])
    # A millionth of the part's size along the normal clears the point's own shell and no other.
    outward = points + 1e-6 * np.ptp(points) * normals
    hidden = [inside(volume, outward) for volume in (*part.shells, *part.cuts)]
    seen = ~np.any(hidden, axis=0)
    kept = min(int(seen[: len(tips)].sum()), count)
    points = points[seen]
    normals = normals[seen]
    chosen = thin(points, count, rng, keep=range(kept))
    return points[chosen], normals[chosen]


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation matrix (3, 3) by `angle` (rad) about the unit vector `axis` (3,).

    Source: Rodrigues' formula.
    """
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = portable.sine_cosine(angle)
    return np.eye(3) + sine * cross + (1 - cosine) * portable.product(cross, cross)


def cloud_of_parts(
    parts: list[Part], samples: list[tuple[np.ndarray, np.ndarray]], record: dict
) -> Cloud:
    """Return the cloud of parts from the points and normals (N, 3) of each.

    The record gets counts and extents.
    """
    counts = [len(points) for points, _ in samples]
    points = np.concatenate([points for points, _ in samples])
    names = tuple(part.name for part in parts)
    facts = {
        "points_by_part": dict(zip(names, counts, strict=True)),
        "extent_m": np.ptp(points, axis=0).tolist(),
    }
    return Cloud(
        points=points,
        normals=np.concatenate([normals for _, normals in samples]),
        part=np.repeat(np.arange(len(parts)), counts),
        kinds=tuple(part.kind for part in parts),
        names=names,
        parents=np.array([part.parent for part in parts], np.int64),
        hinges=np.array([part.hinge for part in parts], float),
        axes=np.array([part.axis for part in parts], float),
        rcs_m2=np.full(len(points), float(record["rcs_m2_per_point"])),
        record=json.loads(json.dumps(record | facts)),
    )


def assemble(parts: list[Part], record: dict, rng: np.random.Generator) -> Cloud:
    """Return the cloud of `parts` with record["points"] points.

    Moving parts get record["moving_share"] of them.

    Raises: InputError where there are too few points for the parts.
    """
    counts = allot(parts, record["points"], record["moving_share"], record["subtype"])
    samples = []
    for part, count in zip(parts, counts, strict=True):
        points, normals = sample_part(part, count // part.copies, rng)
        all_points = []
        all_normals = []
        for copy in range(part.copies):
            matrix = np.eye(3)
            centre = np.zeros(3)
            if copy > 0:
                matrix = turn(np.array(part.axis), 2 * np.pi * copy / part.copies)
                centre = np.array(part.hinge)
            all_points.append(portable.applied(matrix, points - centre) + centre)
            all_normals.append(portable.applied(matrix, normals))
        samples.append((np.concatenate(all_points), np.concatenate(all_normals)))
    return cloud_of_parts(parts, samples, record)
