"""A user's mesh to a calibration point cloud: load, repair, cut into parts, scale to the published size, thin.

These are the steps of the paper's Fig. 4. `mesh_files` reads files, `mesh_parts` cuts parts, `mesh_record` checks
records and `mesh_size` scales; this module calls them in order and thins each part to its number of points. Body axes:
x right, y front, z up, metres.
"""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from lowalt.config.classes import like
from lowalt.files.atomic import sha256
from lowalt.files.errors import InputError, InputWarning
from lowalt.numerics import portable
from lowalt.numerics.streams import stream
from lowalt.targets import vehicle
from lowalt.targets.assemble import Part, allot, sample_part
from lowalt.targets.builtin import checksum
from lowalt.targets.cloud import Cloud
from lowalt.targets.input_files import record_files
from lowalt.targets.mesh_files import Mesh, joined, read_mesh
from lowalt.targets.mesh_parts import Pool, cut, hinged, placed, pool_of, refuse_shared
from lowalt.targets.mesh_record import body_axes, check_record, ordered_parts
from lowalt.targets.mesh_size import sized
from lowalt.targets.plausible import refuse_implausible
from lowalt.targets.sampling import thin

__all__ = ["check_record", "mesh_cloud"]

DENSE = 200
"""Dense samples of a part's surface for each point of the cloud, before regions are cut and the rest is thinned."""

THINNED = 25
"""Most samples for each point of the cloud that go into the thinning; its time grows with samples x points."""

FEWEST_SAMPLES = 100
"""Least number of samples of a wheel that the record asks to be made."""


def _wheel_size(part: dict) -> tuple[float, float]:
    """Return diameter and width (m) of a wheel that the record asks to be made."""
    return part["wheel"]["diameter_m"], part["wheel"]["width_m"]


def _made_wheels(record: dict, rng: np.random.Generator) -> dict[tuple, tuple[np.ndarray, np.ndarray]]:
    """Return points and normals (N, 3) of each size of wheel to be made: that of a right wheel at the origin."""
    parts = ordered_parts(record["parts"]).values()
    sizes = {_wheel_size(part): part["wheel"] for part in parts if "wheel" in part}
    count = max(FEWEST_SAMPLES, round(record["points"] * record["moving_share"]))
    return {
        key: sample_part(Part("wheel", "wheel", vehicle.wheel(size["diameter_m"], size["width_m"])), count, rng)
        for key, size in sizes.items()
    }


def _made_wheel(part: dict, samples: tuple[np.ndarray, np.ndarray], frame: np.ndarray) -> Pool:
    """Return the pool of a made wheel at its hinge, in the file's axes, mirrored on the left."""
    size, hinge = part["wheel"], np.array(part["hinge"], float)
    side = np.array([np.sign(portable.dot(frame[0], hinge)) or 1.0, 1, 1])
    points, normals = (portable.applied(frame.T, array * side) for array in samples)
    area = np.pi * size["diameter_m"] * (size["diameter_m"] / 2 + size["width_m"])
    nothing = np.full(3, np.nan)
    # sample_part puts the points that bound the wheel first.
    return Pool(points + hinge, normals, np.zeros(len(points), np.int64), 6, area, nothing, nothing)


def _surface(part: dict, record: dict, inputs_dir: Path) -> Mesh:
    """Return the meshes of a part's files, each moved to its place, as one mesh in metres along the file's axes."""
    meshes = []
    for item in part["meshes"]:
        mesh = read_mesh(inputs_dir / item["file"], item.get("unit", record["unit"]), item.get("geometry"))
        meshes.append(placed(mesh, item))
    return joined(meshes)


def pools(record: dict, inputs_dir: Path, rng: np.random.Generator) -> tuple[dict[str, Pool], float]:
    """Return the pool of every part by name, in body axes and the mesh's own size, and the closed share of the body.

    `record` is a checked mesh record. The closed share is that of the triangles in watertight components.
    Raises: InputError naming the file, or the part whose region holds nothing.
    """
    frame = body_axes(record["front"], record["up"])
    _, front, up = frame
    where = record["subtype"]
    dense = DENSE * record["points"]
    (body_name, body_part), *moving = ordered_parts(record["parts"]).items()
    mesh = _surface(body_part, record, inputs_dir)
    body, found, wheels = pool_of(mesh, dense, rng), {}, _made_wheels(record, rng)
    refuse_shared(body, mesh, {name: part["region"] for name, part in moving if "region" in part}, where)
    for name, part in moving:
        if "region" in part:
            pool, body = cut(body, mesh, part["region"])
        elif "wheel" in part:
            pool = _made_wheel(part, wheels[_wheel_size(part)], frame)
        else:
            pool = pool_of(_surface(part, record, inputs_dir), dense // 4, rng)
        if not len(pool.points):
            low, high = (
                [float(f"{value:.3g}") for value in limit]
                for limit in (mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))
            )
            raise InputError(
                f"{where}: parts.{name}.region holds nothing of the body, expected a part of its surface, which "
                f"reaches from {low} to {high} m; is the unit {record['unit']!r} right?"
            )
        found[name] = hinged(pool, part, up, front, f"{where}: parts.{name}")
    for region in record["drop"]:
        body = cut(body, mesh, region)[1]
    if not len(body.points):
        raise InputError(f"{where}: regions and drop leave nothing of {body_name}, expected a body")
    closed = float(np.count_nonzero(mesh.closed[mesh.component]) / len(mesh.component))
    turned = {
        name: replace(
            pool, points=portable.applied(frame, pool.points), normals=portable.applied(frame, pool.normals),
            hinge=portable.applied(frame, pool.hinge), axis=portable.applied(frame, pool.axis),
        )
        for name, pool in {body_name: body, **found}.items()
    }  # fmt: skip
    return turned, closed


def _thinned(pool: Pool, count: int, where: str, rng: np.random.Generator) -> np.ndarray:
    """Return the indices (count,) of a part's points: those that bound it, then others spread evenly by `thin`."""
    if len(pool.points) < count:
        raise InputError(
            f"{where}: {len(pool.points)} dense samples, expected {count}: fewer points or a larger region"
        )
    pick = np.arange(len(pool.points))
    if len(pick) > pool.corners + THINNED * count:
        pick = pool.corners + rng.choice(len(pick) - pool.corners, THINNED * count, replace=False)
        pick = np.concatenate([np.arange(pool.corners), np.sort(pick)])
    return pick[thin(pool.points[pick], count, rng, keep=np.arange(min(pool.corners, count)))]


def mesh_cloud(record: dict, inputs_dir: str | Path, seed: int) -> Cloud:
    """Return the cloud of a user's mesh: exactly record["points"] points, parts and hinges, at the published size.

    `record` is a merged record that `check_record` has passed; its files are relative to `inputs_dir`. Moving parts
    share record["moving_share"] of the points by area. Equal record, files and seed give equal points.
    Raises: InputError naming the file or the part and the reason.
    """
    rng = stream(seed, "cloud", record["subtype"])
    record = record | {"parts": ordered_parts(record["parts"])}
    kinds = {name: part["kind"] for name, part in record["parts"].items()}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", InputWarning)
        raw, closed = pools(record, Path(inputs_dir), rng)
        hung = {name: part["parent"] for name, part in record["parts"].items() if "parent" in part}
        count = record["published"].get("n_rotors_or_wings")
        refuse_implausible(raw, kinds, hung, like(record), record["subtype"], count)
    parts, facts = sized(record, raw, kinds)
    for warning in caught:
        warnings.warn(warning.message, warning.category, stacklevel=2)
    doubts = list(dict.fromkeys(str(warning.message) for warning in caught if warning.category is InputWarning))
    facts |= {"warnings": doubts} if doubts else {}
    wanted = [Part(name, kinds[name], (), weight=pool.area) for name, pool in parts.items()]
    try:
        counts = allot(wanted, record["points"], record["moving_share"])
    except InputError as error:
        raise InputError(f"{record['subtype']}: {error}") from None
    chosen = [
        _thinned(pool, count, f"{record['subtype']}: parts.{name}", rng)
        for (name, pool), count in zip(parts.items(), counts, strict=True)
    ]
    points = np.concatenate([pool.points[index] for pool, index in zip(parts.values(), chosen, strict=True)])
    normals = np.concatenate([pool.normals[index] for pool, index in zip(parts.values(), chosen, strict=True)])
    names = list(parts)
    parents = [names.index(part["parent"]) if "parent" in part else -1 for part in record["parts"].values()]
    sums = {name: sha256(Path(inputs_dir) / name) for name in record_files(record)}
    facts |= {
        "points_by_part": dict(zip(names, counts, strict=True)), "extent_m": np.ptp(points, axis=0).tolist(),
        "closed_share": closed, "files_sha256": sums, "checksum": checksum(sums), "seed": seed,
    }  # fmt: skip
    return Cloud(
        points=points, normals=normals, part=np.repeat(np.arange(len(names)), counts),
        kinds=tuple(kinds.values()), names=tuple(names), parents=np.array(parents, np.int64),
        hinges=np.array([pool.hinge for pool in parts.values()]), axes=np.array([pool.axis for pool in parts.values()]),
        rcs_m2=np.full(len(points), float(record["rcs_m2_per_point"])), record=record | facts,
    )  # fmt: skip
