"""Command line of an extra product of the stage: a target's opaque surfaces.

It is for scenes with self-occlusion.

A target with a surface is stored as triangles, whose vertices move with their part. A recording has
nodes without surfaces, so it is stored as capsules along its bones. Built-in shapes keep all their
triangles, so that points lie exactly on them. A user's mesh is simplified, and the file holds each
point's distance from the simplified surface.
"""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lowalt.config.classes import like
from lowalt.config.command import run
from lowalt.files.archives import write_arrays
from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.targets.__main__ import options
from lowalt.targets.assemble import Part, turn
from lowalt.targets.make import refuse_source
from lowalt.targets.skeleton import NODES, PARENTS
from lowalt.targets.surfaces import GRAIN, Surface, inside, longest_edge, merged, quartered

ARRAYS = ("vertices", "vertex_part", "faces", "offset_m", "closed", "bones", "radius_m")
"""Names of the arrays of a file of occluders.

vertices (V, 3) m in the cloud's axes; vertex_part (V,); faces (F, 3) numbers of vertices; offset_m
(L,) m, distance from each of the cloud's points at which its line of sight starts; closed (P,)
bool, whether a part's surface is closed; bones (B, 2) nodes at the ends of capsules; radius_m (B,)
m.
"""

STATURE_M = 1.756
RADII_M = {
    "lowerback": 0.13,
    "upperback": 0.14,
    "thorax": 0.14,
    "lowerneck": 0.07,
    "upperneck": 0.06,
    "head": 0.09,
    "hipjoint": 0.10,
    "femur": 0.09,
    "tibia": 0.06,
    "foot": 0.04,
    "toes": 0.04,
    "clavicle": 0.08,
    "humerus": 0.05,
    "radius": 0.045,
    "wrist": 0.035,
    "hand": 0.035,
    "fingers": 0.02,
    "thumb": 0.015,
}
"""Radius of the limb round each bone of a person of STATURE_M.

They are from girths and breadths of Gordon et al. 2014, 2012 Anthropometric Survey of U.S. Army
Personnel, men's means, rounded; torso: mean of half breadth and half depth.
"""


def cut_away(surface: Surface, cuts: tuple[Surface, ...]) -> Surface:
    """Return a surface without its triangles inside the convex `cuts`.

    Triangles are divided finely along the borders of the cuts.
    """
    corners = surface.vertices[surface.faces]
    grain = np.ptp(surface.vertices, axis=0).max() / GRAIN
    for volume in cuts:
        low = volume.vertices.min(axis=0)
        high = volume.vertices.max(axis=0)
        kept = []
        while len(corners):
            apart = ((corners.max(axis=1) <= low) | (corners.min(axis=1) >= high)).any(axis=1)
            within = inside(volume, corners.reshape(-1, 3)).reshape(-1, 3)
            size = longest_edge(corners)
            # A large triangle may reach into the cut although all its corners lie outside.
            outside = apart | (~within.any(axis=1) & (size < 0.3 * (high - low).min()))
            small = ~within.all(axis=1) & ~outside & (size <= grain)
            small[small] = ~inside(volume, corners[small].mean(axis=1))
            kept += [corners[outside | small]]
            corners = quartered(corners[~within.all(axis=1) & ~outside & (size > grain)])
        corners = np.concatenate(kept)
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return Surface(vertices, faces.reshape(-1, 3))


def part_surface(part: Part) -> Surface:
    """Return a built-in part's whole surface.

    It consists of all its shells without its cuts, and their copies around the hinge.
    """
    shells = merged(part.shells)
    if part.cuts:
        shells = cut_away(shells, part.cuts)
    copies = [shells]
    for copy in range(1, part.copies):
        matrix = turn(np.array(part.axis), 2 * np.pi * copy / part.copies)
        centre = np.array(part.hinge)
        copies.append(Surface((shells.vertices - centre) @ matrix.T + centre, shells.faces))
    return merged(copies)


def from_surfaces(
    surfaces: list[Surface], offset_m: np.ndarray, closed: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the arrays of one surface a part, in the cloud's order of parts."""
    whole = merged(surfaces)
    owner = np.repeat(np.arange(len(surfaces)), [len(surface.vertices) for surface in surfaces])
    arrays = (whole.vertices, owner, whole.faces.astype(np.int64), offset_m, closed)
    no_limbs = (np.zeros((0, 2), np.int64), np.zeros(0))
    return dict(zip(ARRAYS, arrays + no_limbs, strict=True))


def from_bones(stature_m: float) -> dict[str, np.ndarray]:
    """Return the arrays of a pedestrian's capsules: one along each bone.

    Its radius is scaled with the stature.
    """
    nodes = range(1, len(NODES))
    radii = [RADII_M[name] if name in RADII_M else RADII_M[name[1:]] for name in NODES[1:]]
    nothing = (np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 3), np.int64))
    bones = (
        np.array([[PARENTS[node], node] for node in nodes]),
        np.array(radii) * (stature_m / STATURE_M),
    )
    return dict(
        zip(
            ARRAYS,
            (*nothing, np.zeros(len(NODES)), np.zeros(len(NODES), bool), *bones),
            strict=True,
        )
    )


def make(record: dict, inputs: Path | None, seed: int) -> dict[str, np.ndarray]:
    """Return the arrays of a merged record's target.

    Equal record, files and seed give equal arrays.

    Raises: InputError where the record or an input is wrong, or a folder is needed and none is
    given.
    """
    source = record.get("source")
    if source == "builtin":
        from lowalt.targets.builtin import MODULES

        parts = MODULES[like(record)].parts(record)[0]
        surfaces = [part_surface(part) for part in parts]
        # The offset is larger than rounding, so that a point's own triangle does not hide it, and
        # small enough that a point near a corner stays next to its triangle.
        offset = 1e-9 * np.ptp(merged(surfaces).vertices, axis=0).max()
        return from_surfaces(
            surfaces, np.full(record["points"], offset), np.array([not part.cuts for part in parts])
        )
    if record.get("gait") in ("cycle", "trot"):
        raise InputError(
            f"{record['subtype']}: gait {record['gait']} has no surfaces, expected no effect that "
            "needs them"
        )
    if source in ("gait", "mocap"):
        return from_bones(float(record.get("stature_m", record["published"]["hgt_m"])))
    refuse_source(record, inputs)
    assert inputs is not None  # a record of a mesh is refused without
    from lowalt.targets.occluders_mesh import mesh_surfaces

    return from_surfaces(*mesh_surfaces(record, Path(inputs), seed))


def write(path: str | Path, arrays: dict[str, np.ndarray], subtype: str) -> None:
    """Write the arrays and the subtype they belong to; equal arrays give equal bytes."""
    with replacing(path) as temporary:
        write_arrays(
            temporary,
            {**{name: arrays[name] for name in ARRAYS}, "subtype": np.array(json.dumps(subtype))},
        )


def read(path: str | Path) -> dict:
    """Return a file's arrays (ARRAYS) and its `subtype`.

    Raises: InputError where the file is missing or holds no occluders.
    """
    checked_archive(path, "surfaces")
    try:
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in ARRAYS} | {
                "subtype": json.loads(str(data["subtype"]))
            }
    except UNREADABLE as error:
        raise InputError(f"{path}: not a file of occluders ({error})") from error


def read_all(paths: Iterable[str | Path]) -> dict[str, dict]:
    """Return the surfaces of several files by their subtype; errors as `read`."""
    return {surfaces["subtype"]: surfaces for surfaces in map(read, paths)}


def main(arguments: list[str]) -> None:
    """Write one target's occluders."""
    about = "One subtype's record to its opaque surfaces, for self-occlusion."
    record, inputs, seed, out = options("lowalt.targets.occluders", about, arguments)
    write(out, make(record, inputs, seed), record["subtype"])


if __name__ == "__main__":
    run(main)
