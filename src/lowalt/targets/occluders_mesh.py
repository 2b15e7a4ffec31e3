"""The surfaces of a user's mesh, part by part, as its cloud has them.

They are cut, turned, scaled and simplified.

The cloud's own steps cut the mesh; where they take a part's samples, here they take its triangles.
"""

from pathlib import Path

import numpy as np

from lowalt.targets import vehicle
from lowalt.targets.mesh import cloud_and_pools
from lowalt.targets.mesh_files import Mesh
from lowalt.targets.mesh_parts import Pool, cut_parts, inside
from lowalt.targets.mesh_record import body_axes, ordered_parts
from lowalt.targets.surfaces import GRAIN, Surface, face_normals, longest_edge, merged, quartered

TRIANGLES = 1500
"""Largest number of triangles that a part keeps."""


def _pool(mesh: Mesh, regions: list[dict]) -> Pool:
    """Return a mesh as a pool of one sample per triangle, at its centre.

    The triangle's corners (F, 9) take the place of normals.

    Large triangles are divided first where `regions` cut through them, so that their middles say
    where they are.
    """
    corners = mesh.vertices[mesh.faces]
    component = mesh.component
    grain = np.ptp(mesh.vertices, axis=0).max() / GRAIN
    for region in regions:
        while True:
            within = inside(corners.reshape(-1, 3), region).reshape(-1, 3)
            crossing = within.any(axis=1) & ~within.all(axis=1)
            divided = (longest_edge(corners) > grain) & crossing
            if not divided.any():
                break
            kept = ~divided
            corners = np.concatenate([corners[kept], quartered(corners[divided])])
            component = np.concatenate([component[kept], np.tile(component[divided], 4)])
    return Pool(corners.mean(axis=1), corners.reshape(-1, 9), component, 0, 1.0)


def _wheel(diameter: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """The corners (3 F, 3) of a made wheel's triangles, for its points and for its normals."""
    shape = merged(vehicle.wheel(diameter, width))
    corners = shape.vertices[shape.faces].reshape(-1, 3)
    return corners, corners


def _triangles(record: dict, inputs: Path) -> dict[str, np.ndarray]:
    """Triangles (F, 3, 3) of every part in body axes and the mesh's own size.

    A triangle goes where its middle is.
    """
    frame = body_axes(record["front"], record["up"])
    parts = record["parts"]
    regions = [part["region"] for part in parts.values() if "region" in part] + record["drop"]
    cutting = [region for region in regions if not region.get("whole")]

    def of_file(mesh: Mesh, is_body: bool) -> Pool:
        """The pool of a mesh; regions cut through the body's alone."""
        if is_body:
            return _pool(mesh, cutting)
        return _pool(mesh, [])

    cut, _ = cut_parts(record, inputs, frame, of_file, _wheel)
    result = {}
    for name, pool in cut.items():
        corners = pool.normals
        if "wheel" in parts[name]:
            corners = pool.points
        result[name] = corners.reshape(-1, 3, 3) @ frame.T
    return result


def simplified(triangles: np.ndarray, most: int) -> Surface:
    """Return triangles (F, 3, 3) as a surface of at most about `most`.

    This is quadric edge collapse (Garland 1997).
    """
    vertices, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[face_normals(vertices, faces)[1] > 0]
    if len(faces) > most:
        import pymeshlab  # slow to import, and only large meshes need it

        work = pymeshlab.MeshSet()
        work.add_mesh(pymeshlab.Mesh(vertices, faces))
        work.meshing_decimation_quadric_edge_collapse(
            targetfacenum=most, optimalplacement=False, preservenormal=True, planarquadric=True
        )
        vertices = work.current_mesh().vertex_matrix()
        faces = work.current_mesh().face_matrix()
    return Surface(np.asarray(vertices, float), np.asarray(faces, np.int64))


def deviation_m(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Return how far each of `points` (L, 3) lies from the surface (L,) m."""
    from trimesh import Trimesh
    from trimesh.proximity import closest_point_naive

    shape = Trimesh(surface.vertices, surface.faces, process=False)
    blocks = np.array_split(points, len(points) // 50 + 1)
    return np.concatenate([closest_point_naive(shape, block)[1] for block in blocks])


def mesh_surfaces(
    record: dict, inputs: Path, seed: int
) -> tuple[list[Surface], np.ndarray, np.ndarray]:
    """Return one surface a part in the cloud's axes, each point's distance (L,) m, and closedness.

    No surface is closed.

    `record` is a merged record that `mesh_record.check_record` has passed.
    Raises: InputError naming the file or the part and the reason.
    """
    record = record | {"parts": ordered_parts(record["parts"])}
    cloud, raw, final = cloud_and_pools(record, inputs, seed)
    triangles = _triangles(record, inputs)
    surfaces = []
    offsets = []
    for number, name in enumerate(cloud.names):
        # How a part's samples were scaled and moved, recovered from the samples themselves.
        before = np.column_stack([raw[name].points, np.ones(len(raw[name].points))])
        affine = np.linalg.lstsq(before, final[name].points, rcond=None)[0]
        surfaces.append(simplified(triangles[name] @ affine[:3] + affine[3], TRIANGLES))
        offsets.append(deviation_m(surfaces[-1], cloud.points[cloud.part == number]))
    clear = 1e-9 * float(np.ptp(cloud.points, axis=0).max())
    return surfaces, np.concatenate(offsets) + clear, np.zeros(len(surfaces), bool)
