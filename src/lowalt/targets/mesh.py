"""A user's mesh to a calibration point cloud: load, repair, cut into parts, scale to the published size, thin.

The steps of the paper's Fig. 4. Files are read in `mesh_files`, parts cut in `mesh_parts`, records checked in
`mesh_record`; here parts become a target of the right size and count. Body axes: x right, y front, z up, metres.
"""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from lowalt.common import portable
from lowalt.common.classes import like
from lowalt.common.errors import InputError, InputWarning
from lowalt.common.files import sha256
from lowalt.common.streams import stream
from lowalt.targets import bird, vehicle
from lowalt.targets.assemble import Part, allot, sample_part
from lowalt.targets.builtin import checksum
from lowalt.targets.cloud import Cloud
from lowalt.targets.mesh_files import Mesh, joined, read_mesh
from lowalt.targets.mesh_parts import Pool, cut, hinged, placed, pool_of, refuse_shared
from lowalt.targets.mesh_record import ALL_AXES, check_record, ordered_parts, record_files
from lowalt.targets.plausible import refuse_implausible
from lowalt.targets.sampling import thin

__all__ = ["check_record", "mesh_cloud", "record_files"]

DENSE = 200
"""Dense samples of a part's surface for each point of the cloud, before regions are cut and the rest is thinned."""

THINNED = 25
"""Of those, how many for each wanted point go into the thinning, whose time grows with both."""

FEWEST_SAMPLES = 100
"""At least so many samples of a made wheel."""

SMALLEST_PART = 25
"""A moving part this many times smaller than the target has a wrong unit."""

SMALLEST_ROTOR_M = 0.01
"""Least diameter of a rotor at the target's final size: the smallest craft sold have propellers of 25 mm."""


def _vector(axis: str) -> np.ndarray:
    """Return the unit vector (3,) of an axis name such as "-y"."""
    return np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1)


def _refuse_size(record: dict, what: str, size_m: float, wanted_m: float, low: float, high: float) -> None:
    """Raise InputError if `what` measures less than wanted / high or more than wanted / low (m)."""
    if not low <= wanted_m / max(size_m, 1e-12) <= high:
        raise InputError(
            f"{record['subtype']}: {what} measures {size_m:.4g} m where {wanted_m:.4g} m is published: "
            f"{max(wanted_m / max(size_m, 1e-12), size_m / wanted_m):.3g} times off; is the unit "
            f"{record['unit']!r} right?"
        )


def _published_m(record: dict) -> np.ndarray:
    """Return the published sizes (3,) along right, front and up, or three times the one there is."""
    table = record["published"]
    if record["size_is"] == ALL_AXES:
        return np.array([table["wid_m"], table["len_m"], table["hgt_m"]])
    return np.full(3, table["size_m"])


def _wheel_size(part: dict) -> tuple[float, float]:
    """Diameter and width (m) of a made wheel."""
    return part["wheel"]["diameter_m"], part["wheel"]["width_m"]


def _made_wheels(record: dict, rng: np.random.Generator) -> dict[tuple, tuple[np.ndarray, np.ndarray]]:
    """Return points and normals (N, 3) of each size of wheel the record wants made: right ones, at the origin."""
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
    front, up = _vector(record["front"]), _vector(record["up"])
    frame = np.stack([np.cross(front, up), front, up])
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


def _bounds(parts: dict[str, Pool]) -> tuple[np.ndarray, np.ndarray]:
    low = np.min([pool.points.min(axis=0) for pool in parts.values()], axis=0)
    return low, np.max([pool.points.max(axis=0) for pool in parts.values()], axis=0)


def measured_m(size_is: str, parts: dict[str, Pool], kinds: dict[str, str]) -> float:
    """Return the size (m) that `size_is` names, of pools in body axes.

    Raises: InputError where a motor diagonal is asked of fewer than two rotors.
    """
    extent = np.subtract(*_bounds(parts)[::-1])
    if size_is == "motor diagonal":
        hubs = np.array([pool.hinge[:2] for name, pool in parts.items() if kinds[name] == "rotor"])
        if len(hubs) < 2:
            raise InputError(f"size_is is 'motor diagonal' for {len(hubs)} rotors, expected at least two")
        return float(portable.norm(hubs[:, None] - hubs[None]).max())
    return float({"width": extent[0], "length": extent[1], "height": extent[2]}.get(size_is, extent.max()))


def factors(record: dict, parts: dict[str, Pool], kinds: dict[str, str]) -> tuple[np.ndarray, dict]:
    """Return the scale factors (3,) along right, front and up, and the facts about sizes for the cloud's record.

    The published size checks the unit also where the record asks for no scaling.
    Raises: InputError where mesh and published size differ by more than the record's limit.
    """
    limit, wanted = record["scale_limit"], _published_m(record)
    low, high = _bounds(parts)
    size = high - low
    if record["size_is"] != ALL_AXES:
        try:
            size = np.full(3, measured_m(record["size_is"], parts, kinds))
        except InputError as error:
            raise InputError(f"{record['subtype']}: {error}") from None
        if record["size_is"] == "motor diagonal":
            # Hinges are in metres whatever the files' unit, so a motor diagonal alone would not show a wrong unit.
            # Other sizes are the mesh's own: a gull's span may be more than `limit` times its length.
            _refuse_size(record, "the whole mesh", float((high - low).max()), wanted[0], 1 / limit, limit)
    for axis in range(3):
        _refuse_size(record, f"the mesh ({record['size_is']})", size[axis], wanted[axis], 1 / limit, limit)
    whole = float((high - low).max())
    for name, pool in parts.items():
        extent = float(np.ptp(pool.points, axis=0).max())
        if kinds[name] != "body" and extent < whole / SMALLEST_PART:
            raise InputError(
                f"{record['subtype']}: part {name} measures {extent:.3g} m in a mesh of {whole:.3g} m, expected at "
                f"least 1/{SMALLEST_PART} of it; is the unit of its file right?"
            )
    ratio = wanted / size
    scale = {"published": ratio, "uniform": np.full(3, ratio[1]), "none": np.ones(3)}[record["scale"]]
    return scale, {"mesh_extent_m": (high - low).tolist(), "scale_factors": scale.tolist()}


def _turned_radius(pool: Pool) -> float:
    """Largest distance (m) of a part's samples from its axis."""
    away = pool.points - pool.hinge
    along = portable.dot(away, pool.axis)[:, None]
    return float(portable.norm(away - along * pool.axis).max())


def sized(record: dict, parts: dict[str, Pool], kinds: dict[str, str]) -> tuple[dict[str, Pool], dict]:
    """Return the pools scaled and centred, and the facts the cloud's record adds.

    Wheels stay round: they are scaled about their hinge to the published diameter (or by the car's mean factor) and
    set on the ground. The origin is the middle of the extents; in plan, a multirotor's is the middle of its hubs.
    """
    scale, facts = factors(record, parts, kinds)
    ground = _bounds(parts)[0][2] * scale[2]
    result = {}
    for name, pool in parts.items():
        normals = pool.normals / scale
        normals /= portable.norm(normals)[:, None]
        result[name] = replace(pool, points=pool.points * scale, normals=normals, hinge=pool.hinge * scale)
        if kinds[name] == "wheel":
            raw = 2 * _turned_radius(pool)
            published = record["wheel_size"] == "published" and record["scale"] != "none"
            diameter = record["published"]["wheel_diam_m"] if published else raw * float(np.sqrt(scale[1] * scale[2]))
            hinge = np.array([*(pool.hinge * scale)[:2], ground + diameter / 2])
            points = (pool.points - pool.hinge) * (diameter / raw) + hinge
            result[name] = replace(pool, points=points, hinge=hinge)
            facts["wheel_diameter_m"] = diameter
        if kinds[name] == "rotor" and 2 * _turned_radius(result[name]) < SMALLEST_ROTOR_M:
            raise InputError(
                f"{record['subtype']}: rotor {name} has a diameter of {2 * _turned_radius(result[name]):.2g} m at the "
                f"final size, expected at least {SMALLEST_ROTOR_M} m"
            )
    low, high = _bounds(result)
    middle = (low + high) / 2
    hubs = [pool.hinge[:2] for name, pool in result.items() if kinds[name] == "rotor"]
    if hubs:
        middle[:2] = portable.mean(np.array(hubs), 0)
    if like(record) == "Vehicle":
        facts["origin_height_m"] = float(middle[2] - ground)
    if like(record) == "Bird":
        facts |= {"flap": bird.FLAP | record.get("flap", {}), "wing_span_m": float(high[0] - low[0])}
    return {
        name: replace(pool, points=pool.points - middle, hinge=pool.hinge - middle) for name, pool in result.items()
    }, facts


def _thinned(pool: Pool, count: int, where: str, rng: np.random.Generator) -> np.ndarray:
    """Return the indices (count,) of a part's points: those that bound it, then spread as evenly as can be."""
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
        refuse_implausible(raw, kinds, hung, like(record), record["subtype"])
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
