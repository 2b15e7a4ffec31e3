"""Turn a user's mesh into a calibration point cloud.

It is loaded, repaired, cut into parts, scaled to the published size and thinned.

These are the steps of the paper's Fig. 4. `mesh_files` reads files, `mesh_parts` cuts parts,
`mesh_record` checks records and `mesh_size` scales; this module calls them in order and thins each
part to its number of points. Body axes: x right, y front, z up, metres.
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
from lowalt.targets.assemble import Part, allot, cloud_of_parts, sample_part
from lowalt.targets.builtin import checksum
from lowalt.targets.cloud import Cloud
from lowalt.targets.mesh_files import Mesh
from lowalt.targets.mesh_parts import Pool, cut_parts, hinged, pool_of, refuse_shared
from lowalt.targets.mesh_record import body_axes, check_record, ordered_parts
from lowalt.targets.mesh_size import refuse_implausible, sized
from lowalt.targets.record_schema import record_files
from lowalt.targets.surfaces import thin

__all__ = ["check_record", "mesh_cloud"]

DENSE = 200
"""Number of dense surface samples per point of the cloud.

They are counted before regions are cut out and the rest is thinned.
"""

THINNED = 25
"""Largest number of samples per point of the cloud that are thinned.

The time grows with samples x points.
"""

FEWEST_SAMPLES = 100
"""Least number of samples of a wheel that the record describes by its diameter and width."""


def pools(
    record: dict, inputs_dir: Path, rng: np.random.Generator
) -> tuple[dict[str, Pool], float]:
    """Return the pool of every part by name, and the closed share of the body.

    Pools are in body axes and the mesh's own size. `record` is a checked mesh record. The closed
    share is that of the triangles in watertight components.
    Raises: InputError naming the file, or the part whose region holds nothing.
    """
    frame = body_axes(record["front"], record["up"])
    where = record["subtype"]
    parts = record["parts"]
    dense = DENSE * record["points"]
    in_wheel = max(FEWEST_SAMPLES, round(record["points"] * record["moving_share"]))

    def sampled(mesh: Mesh, is_body: bool) -> Pool:
        """The dense samples of a mesh."""
        if not is_body:
            return pool_of(mesh, dense // 4, rng)
        pool = pool_of(mesh, dense, rng)
        regions = {name: part["region"] for name, part in parts.items() if "region" in part}
        refuse_shared(pool, mesh, regions, where)
        return pool

    def wheel(diameter: float, width: float) -> tuple[np.ndarray, np.ndarray]:
        """Points and normals (N, 3) of a made wheel."""
        return sample_part(Part("wheel", "wheel", vehicle.wheel(diameter, width)), in_wheel, rng)

    cut, mesh = cut_parts(record, inputs_dir, frame, sampled, wheel)
    for name, part in parts.items():
        if part["kind"] != "body":
            cut[name] = hinged(cut[name], part, frame[2], frame[1], f"{where}: parts.{name}")
    turned = {}
    for name, pool in cut.items():
        turned[name] = replace(
            pool,
            points=portable.applied(frame, pool.points),
            normals=portable.applied(frame, pool.normals),
            hinge=portable.applied(frame, pool.hinge),
            axis=portable.applied(frame, pool.axis),
        )
    closed_triangles = np.count_nonzero(mesh.closed[mesh.component])
    return turned, float(closed_triangles / len(mesh.component))


def _thinned(
    pool: Pool, count: int, where: str, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return a part's points and normals (count, 3): corners, then others spread by `thin`."""
    if len(pool.points) < count:
        raise InputError(
            f"{where}: {len(pool.points)} dense samples, expected {count}: fewer points or a "
            "larger part"
        )
    candidates = np.arange(len(pool.points))
    if len(candidates) > pool.corners + THINNED * count:
        others = rng.choice(len(candidates) - pool.corners, THINNED * count, replace=False)
        candidates = np.concatenate([candidates[: pool.corners], pool.corners + np.sort(others)])
    corners = np.arange(min(pool.corners, count))
    chosen = candidates[thin(pool.points[candidates], count, rng, keep=corners)]
    return pool.points[chosen], pool.normals[chosen]


def mesh_cloud(record: dict, inputs_dir: str | Path, seed: int) -> Cloud:
    """Return the cloud of a user's mesh, with its parts and hinges, at the published size.

    It has exactly record["points"] points.

    `record` is a merged record that `check_record` has passed; its files are relative to
    `inputs_dir`. Moving parts share record["moving_share"] of the points by area. Equal record,
    files and seed give equal points.
    Raises: InputError naming the file or the part and the reason.
    """
    return cloud_and_pools(record, inputs_dir, seed)[0]


def cloud_and_pools(
    record: dict, inputs_dir: str | Path, seed: int
) -> tuple[Cloud, dict[str, Pool], dict[str, Pool]]:
    """Return the cloud as `mesh_cloud`, and every part's dense samples by name.

    The samples are given twice: as in the mesh, and as in the cloud.
    """
    where = record["subtype"]
    category = like(record)
    rng = stream(seed, "cloud", where)
    files = record_files(record)
    record = record | {"parts": ordered_parts(record["parts"])}
    kinds = {name: part["kind"] for name, part in record["parts"].items()}
    parents = {name: part["parent"] for name, part in record["parts"].items() if "parent" in part}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", InputWarning)
        raw, closed = pools(record, Path(inputs_dir), rng)
        count = record["published"].get("n_rotors_or_wings")
        refuse_implausible(raw, kinds, parents, category, where, count)
    scaled, facts = sized(record, raw, kinds, category)
    for warning in caught:
        warnings.warn(warning.message, warning.category, stacklevel=3)
    doubts = [str(warning.message) for warning in caught if warning.category is InputWarning]
    names = list(scaled)
    parts = []
    for name, pool in scaled.items():
        hinge = tuple(pool.hinge)
        axis = tuple(pool.axis)
        parent = -1
        if name in parents:
            parent = names.index(parents[name])
        parts.append(Part(name, kinds[name], (), hinge, axis, parent, weight=pool.area))
    counts = allot(parts, record["points"], record["moving_share"], where)
    samples = []
    for (name, pool), count in zip(scaled.items(), counts, strict=True):
        samples.append(_thinned(pool, count, f"{where}: parts.{name}", rng))
    sums = {name: sha256(Path(inputs_dir) / name) for name in files}
    facts |= {
        "closed_share": closed,
        "files_sha256": sums,
        "checksum": checksum(sums),
        "seed": seed,
    }
    if doubts:
        facts["warnings"] = list(dict.fromkeys(doubts))
    return cloud_of_parts(parts, samples, record | facts), raw, scaled
