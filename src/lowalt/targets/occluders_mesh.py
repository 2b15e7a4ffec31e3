"""The surfaces of a user's mesh, part by part, as its cloud has them: cut, turned, scaled and simplified.

The cloud's own steps are repeated with its own stream; where they take a part's samples, they take its triangles.
"""

from pathlib import Path

import numpy as np

from lowalt.numerics.streams import stream
from lowalt.targets import mesh, vehicle
from lowalt.targets.mesh_files import Mesh
from lowalt.targets.mesh_parts import Pool, cut, inside
from lowalt.targets.mesh_record import body_axes, ordered_parts
from lowalt.targets.mesh_size import sized
from lowalt.targets.occluders import GRAIN, longest_edge, quartered
from lowalt.targets.sampling import face_normals
from lowalt.targets.surfaces import Surface, merged

TRIANGLES = 1500
"""Most triangles a part keeps."""


def _pool(found: Mesh, regions: list[dict]) -> Pool:
    """A mesh as a pool with a "sample" a triangle, at its middle; its corners (F, 9) stand where normals do.

    Large triangles are divided first where `regions` cut through them, so that their middles say where they are.
    """
    corners, component = found.vertices[found.faces], found.component
    grain = np.ptp(found.vertices, axis=0).max() / GRAIN
    for region in regions:
        while True:
            within = inside(corners.reshape(-1, 3), region).reshape(-1, 3)
            long = (longest_edge(corners) > grain) & (within.any(axis=1) & ~within.all(axis=1))
            if not long.any():
                break
            corners = np.concatenate([corners[~long], quartered(corners[long])])
            component = np.concatenate([component[~long], np.tile(component[long], 4)])
    return Pool(corners.mean(axis=1), corners.reshape(-1, 9), component, 0, 1.0, np.full(3, np.nan), np.full(3, np.nan))


def _triangles(record: dict, inputs: Path, frame: np.ndarray) -> dict[str, np.ndarray]:
    """Triangles (F, 3, 3) of every part in body axes and the mesh's own size; a triangle goes where its middle is."""
    (body_name, body_part), *moving = record["parts"].items()
    whole = mesh._surface(body_part, record, inputs)
    regions = [part["region"] for _, part in moving if "region" in part] + record["drop"]
    body, found = _pool(whole, [region for region in regions if not region.get("whole")]), {}
    for name, part in moving:
        if "region" in part:
            pool, body = cut(body, whole, part["region"])
        elif "wheel" in part:
            size = part["wheel"]
            shape = merged(vehicle.wheel(size["diameter_m"], size["width_m"]))
            soup = shape.vertices[shape.faces].reshape(-1, 3)
            soup = mesh._made_wheel(part, (soup, soup), frame).points
            found[name] = soup.reshape(-1, 9)
            continue
        else:
            pool = _pool(mesh._surface(part, record, inputs), [])
        found[name] = pool.normals
    for region in record["drop"]:
        body = cut(body, whole, region)[1]
    return {name: corners.reshape(-1, 3, 3) @ frame.T for name, corners in {body_name: body.normals, **found}.items()}


def simplified(triangles: np.ndarray, most: int) -> Surface:
    """Return triangles (F, 3, 3) as a surface of at most about `most`, by quadric edge collapse (Garland 1997)."""
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
        vertices, faces = work.current_mesh().vertex_matrix(), work.current_mesh().face_matrix()
    return Surface(np.asarray(vertices, float), np.asarray(faces, np.int64))


def deviation_m(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Return how far each of `points` (L, 3) lies from the surface (L,) m."""
    from trimesh import Trimesh
    from trimesh.proximity import closest_point_naive

    shape = Trimesh(surface.vertices, surface.faces, process=False)
    blocks = np.array_split(points, len(points) // 50 + 1)
    return np.concatenate([closest_point_naive(shape, block)[1] for block in blocks])


def mesh_surfaces(record: dict, inputs: Path, seed: int) -> tuple[list[Surface], np.ndarray, np.ndarray]:
    """Return one surface a part in the cloud's axes, how far (L,) m each point lies off, and that none is closed.

    `record` is a merged record that `mesh_record.check_record` has passed.
    Raises: InputError naming the file or the part and the reason.
    """
    record = record | {"parts": ordered_parts(record["parts"])}
    cloud = mesh.mesh_cloud(record, inputs, seed)
    raw, _ = mesh.pools(record, inputs, stream(seed, "cloud", record["subtype"]))
    kinds = {name: part["kind"] for name, part in record["parts"].items()}
    final, _ = sized(record, raw, kinds)
    triangles = _triangles(record, inputs, body_axes(record["front"], record["up"]))
    surfaces, offsets = [], []
    for number, name in enumerate(cloud.names):
        # How a part's samples were scaled and moved, recovered from the samples themselves.
        before = np.column_stack([raw[name].points, np.ones(len(raw[name].points))])
        affine = np.linalg.lstsq(before, final[name].points, rcond=None)[0]
        placed = triangles[name] @ affine[:3] + affine[3]
        surface = simplified(placed, TRIANGLES)
        surfaces.append(surface)
        points = cloud.points[cloud.part == number]
        offsets.append(deviation_m(surface, points))
    clear = 1e-9 * float(np.ptp(cloud.points, axis=0).max())
    return surfaces, np.concatenate(offsets) + clear, np.zeros(len(surfaces), bool)
