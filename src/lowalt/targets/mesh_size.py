"""The shape and size of a user's mesh: whether its parts and its unit are right, and scaling.

A wrong direction, unit or hinge still gives a cloud, but the geometry of the parts shows the
mistake: wheels lie below a car, and a hub lies in the middle of its blades. Body axes: x right, y
front, z up, metres.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lowalt.files.errors import InputError, warn
from lowalt.numerics import portable
from lowalt.targets import bird
from lowalt.targets.mesh_files import UNITS_M, metres
from lowalt.targets.mesh_parts import Pool
from lowalt.targets.mesh_record import ALL_AXES

SMALLEST_PART = 25
"""A part that is smaller than the whole mesh by more than this factor has a wrong unit."""

SMALLEST_ROTOR_M = 0.01
"""Least diameter (m) of a rotor at its final size; the smallest craft sold have 25 mm."""


ACROSS = np.cos(np.radians(20.0))
"""Least cosine of the angle between an axle and the car's width; models have straight wheels."""
ROUND = 1.1
"""Largest ratio of a wheel's width to the smaller of its two extents across the axis."""
OFF_HUB = 1.0
"""Largest distance between a rotor's hub and the middle of its surface.

It is a share of the rotor's largest extent: that of a single blade without its hub.
"""
FEWEST_WHEELS = 3
OFF_MIDDLE = 0.1
"""A part stands on one side where it is farther from the middle than this share of its own size."""
LISTED = 4
"""A message names this many parts of one fault."""
SPANS = (0.7, 6.0)
"""Least and largest wing span of a bird over its published length; the table has 1.2 to 5.5."""


def _fault(kind: str, pool: Pool, body: np.ndarray) -> str:
    """Return why a part's position, axis or shape is not that of its kind, "" where it is.

    body (2, 3): the lowest and highest corner of the body, m. A wrong axis also makes a wheel wide
    and a wrong `up` turns its axis, so only the cause is named and not what follows from it.
    """
    low = pool.points.min(axis=0)
    high = pool.points.max(axis=0)
    middle = (low + high) / 2
    width, length, height = high - low
    if kind == "wheel":
        below, above = body[:, 2]
        if abs(pool.axis[0]) < ACROSS:
            way = ("right", "front", "up")[int(np.abs(pool.axis).argmax())]
            along = np.round(np.abs(pool.axis), 3).tolist()
            return (
                f"axle points {way}, {along} (right, front, up), expected right or left: is "
                "`front` (--front) or `up` (--up) another axis, or is it no wheel that rolls?"
            )
        if middle[2] > (below + above) / 2:
            return (
                f"centre lies {middle[2] - below:.3g} m above the lowest point of a body "
                f"{above - below:.3g} m high, expected the lower half: is `up` (--up) reversed?"
            )
        # Twin wheels on one axle are wider than high, but round about it.
        shorter = min(length, height)
        if width > ROUND * shorter and max(length, height) > ROUND * shorter:
            return (
                f"surface measures {width:.3g} m along its axle and {length:.3g} x {height:.3g} m "
                "across, expected a wheel that is thinnest along its axle"
            )
    elif kind == "rotor":
        reach = float((high - low).max())
        away = float(np.linalg.norm(middle - pool.hinge))
        if away > OFF_HUB * reach:
            return (
                f"hinge lies {away:.3g} m from the middle of its surface, which reaches "
                f"{reach:.3g} m, expected the hub"
            )
    else:
        middle_x = body[:, 0].mean()
        hinge = pool.hinge[0] - middle_x
        centre = pool.points.mean(axis=0)[0] - middle_x
        if abs(hinge) > abs(centre) or (hinge * centre < 0 and abs(hinge) > 0.1 * abs(centre)):
            return (
                f"hinge lies {hinge:.3g} m and its surface {centre:.3g} m right of the body's "
                "middle, expected the hinge between body and wing"
            )
    return ""


def _doubts(
    of_kind: dict[str, list[Pool]], category: str, count: int | None, body: np.ndarray
) -> Iterator[str]:
    """Yield what is unusual but possible about the parts of each kind.

    of_kind: the wings in it are those that hang on the body. body (2, 3): the lowest and highest
    corner of the body, m; its middle divides left from right, wherever the file's origin lies.
    """
    middle = body[:, 0].mean()
    wheels = len(of_kind["wheel"])
    rotors = len(of_kind["rotor"])
    if category == "Vehicle" and wheels < FEWEST_WHEELS:
        yield f"{wheels} wheels, expected at least {FEWEST_WHEELS}"
    if category == "UAV" and count and rotors != count:
        yield f"{rotors} rotors, expected the {count} of its row"
    for kind in ("wheel", "wing"):
        offsets = np.array([pool.points[:, 0].mean() - middle for pool in of_kind[kind]])
        extents = [float(np.ptp(pool.points, axis=0).max()) for pool in of_kind[kind]]
        width = max(extents, default=0.0)
        # The wheels of a bicycle stand in the middle.
        aside = np.abs(offsets) > OFF_MIDDLE * width
        if len(offsets) > 1 and aside.all() and len(set(np.sign(offsets))) < 2:
            yield f"every {kind} is on one side of the target, expected both sides"


def refuse_span(parts: dict[str, Pool], where: str) -> None:
    """Refuse a bird whose wing span does not fit the length that its row states.

    A mesh is scaled as a whole, so that scaling cannot correct the ratio.
    Raises: InputError naming `where`, both sizes and what was expected.
    """
    low, high = _bounds(parts)
    span, length, _ = high - low
    if not SPANS[0] <= span / length <= SPANS[1]:
        raise InputError(
            f"{where}: its wings span {span:.3g} m and it measures {length:.3g} m from bill to "
            f"tail, expected a span of {SPANS[0]} to {SPANS[1]} lengths: is `front` (--front) or "
            "`up` (--up) another axis?"
        )


def refuse_implausible(
    parts: dict[str, Pool],
    kinds: dict[str, str],
    parents: dict[str, str],
    category: str,
    where: str,
    count: int | None = None,
) -> None:
    """Refuse parts whose shape contradicts their kind, and warn of unusual ones.

    `parts` are pools in body axes by name, `kinds` their kinds, `parents` the parent of each part
    that has one, `category` the published class that the target is like, `count` the rotors of its
    row.
    Raises: InputError naming `where`, the part, the measures and what was expected. Warns:
    InputWarning.
    """
    points = next(pool.points for name, pool in parts.items() if kinds[name] == "body")
    body = np.stack([points.min(axis=0), points.max(axis=0)])
    of_kind: dict[str, list[Pool]] = {"rotor": [], "wheel": [], "wing": []}
    faults: dict[str, list[str]] = {}
    for name, pool in parts.items():
        kind = kinds[name]
        if kind == "body" or (kind == "wing" and name in parents):
            continue
        of_kind[kind].append(pool)
        if fault := _fault(kind, pool, body):
            faults.setdefault(fault, []).append(name)
    for fault, names in faults.items():
        listed = ", ".join(names[:LISTED])
        if len(names) > LISTED:
            listed += f" and {len(names) - LISTED} more"
        raise InputError(f"{where}: {listed}: its {fault}")
    if category == "Bird":
        refuse_span(parts, where)
    for doubt in _doubts(of_kind, category, count, body):
        warn(f"{where}: {doubt}")


def _refuse_size(
    record: dict,
    measure: str,
    size_m: float,
    wanted_m: float,
    whole_m: float,
    row_m: float | None = None,
) -> None:
    """Refuse a size (m) that differs from `wanted_m` by more than the record's limit.

    measure: what has the size, such as "the whole mesh"; whole_m: the mesh's largest extent.
    Raises: InputError with the line to write: the unit with which the size fits best, or else the
    scale that fits and the size of a row of its own, `row_m` or by default the size.
    """
    limit = record["scale_limit"]
    unit = record["unit"]
    ratio = wanted_m / max(size_m, 1e-12)
    if 1 / limit <= ratio <= limit:
        return
    numbers = size_m / metres(unit)
    misfits = {}
    if size_m:
        for name, unit_m in UNITS_M.items():
            misfits[name] = abs(np.log(numbers * unit_m / wanted_m))
    best = min(misfits, key=misfits.__getitem__, default="")
    if best and misfits[best] <= np.log(limit):
        way = (
            f"write `unit: {best}` (--unit {best}), with which it measures "
            f"{numbers * UNITS_M[best]:.4g} m"
        )
    else:
        key = "len_m" if record["size_is"] == ALL_AXES else "size_m"
        own = f"`row: {{{key}: {row_m or size_m:.4g}}}`"
        fitting = f"`unit: {metres(unit) * ratio:.4g}` (metres for 1.0 in the file)"
        size = f"`lowalt target new --size {whole_m * ratio:.4g}`"
        way = (
            f"no unit fits: write {fitting} or draft it with {size}, or give it a row with its own "
            f"size, {own}"
        )
    off = max(ratio, size_m / wanted_m)
    raise InputError(
        f"{record['subtype']}: {measure} measures {size_m:.4g} m where {wanted_m:.4g} m is "
        f"published: {off:.3g} times off; is the unit {unit!r} right? {way}"
    )


def _bounds(parts: dict[str, Pool]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates (3,) of all parts' points."""
    low = np.min([pool.points.min(axis=0) for pool in parts.values()], axis=0)
    high = np.max([pool.points.max(axis=0) for pool in parts.values()], axis=0)
    return low, high


def _motor_diagonal_m(parts: dict[str, Pool], kinds: dict[str, str], where: str) -> float:
    """Return the largest distance (m) between two hubs. Raises: InputError for less than two."""
    hubs = np.array([pool.hinge[:2] for name, pool in parts.items() if kinds[name] == "rotor"])
    if len(hubs) < 2:
        raise InputError(
            f"{where}: size_is is 'motor diagonal' for {len(hubs)} rotors, expected at least two"
        )
    return portable.norm(hubs[:, None] - hubs[None]).max()


def factors(record: dict, parts: dict[str, Pool], kinds: dict[str, str]) -> tuple[np.ndarray, dict]:
    """Return the scale factors (3,) along right, front and up, and the record's facts about sizes.

    The mesh is compared with the published size even where the record asks for no scaling, to find
    a wrong unit.
    Raises: InputError where mesh and published size differ by more than the record's limit, or
    where `size_is` is the motor diagonal and there are fewer than two rotors.
    """
    low, high = _bounds(parts)
    extent = high - low
    size_is = record["size_is"]
    where = record["subtype"]
    row = record["published"]
    whole = float(extent.max())
    if size_is == ALL_AXES:
        size = extent
        wanted = np.array([row["wid_m"], row["len_m"], row["hgt_m"]])
    else:
        width, length, height = extent
        extents = {"width": width, "length": length, "height": height}
        measured = extents.get(size_is, whole)
        if size_is == "motor diagonal":
            measured = _motor_diagonal_m(parts, kinds, where)
            # Hinges are in metres whatever the files' unit, so a motor diagonal alone would not
            # show a wrong unit. Other sizes are the mesh's own: a gull's span may be more than
            # `limit` times its length.
            _refuse_size(record, "the whole mesh", whole, row["size_m"], whole, measured)
        size = np.full(3, measured)
        wanted = np.full(3, row["size_m"])
    for axis in range(3):
        _refuse_size(record, f"the mesh ({size_is})", size[axis], wanted[axis], whole)
    for name, pool in parts.items():
        largest = float(np.ptp(pool.points, axis=0).max())
        if kinds[name] != "body" and largest < whole / SMALLEST_PART:
            raise InputError(
                f"{where}: part {name} measures {largest:.3g} m in a mesh of {whole:.3g} m, "
                f"expected at least 1/{SMALLEST_PART} of it; is the unit of its file right?"
            )
    ratio = wanted / size
    if record["scale"] == "published":
        scale = ratio
    elif record["scale"] == "uniform":
        scale = np.full(3, ratio[1])
    else:
        scale = np.ones(3)
    return scale, {"mesh_extent_m": extent.tolist(), "scale_factors": scale.tolist()}


def _turned_radius(pool: Pool) -> float:
    """Return the largest distance (m) of a part's samples from its axis."""
    away = pool.points - pool.hinge
    along = portable.dot(away, pool.axis)[:, None]
    return float(portable.norm(away - along * pool.axis).max())


def sized(
    record: dict, parts: dict[str, Pool], kinds: dict[str, str], category: str
) -> tuple[dict[str, Pool], dict]:
    """Return the pools scaled and centred, and the facts that the cloud's record gets.

    category: the published class that the target is like. Wheels stay round: they are scaled about
    their hinge to the published diameter (or by the car's mean factor) and set on the ground. The
    origin is the middle of the extents; in plan, a multirotor's is the middle of its hubs.
    """
    scale, facts = factors(record, parts, kinds)
    ground = _bounds(parts)[0][2] * scale[2]
    result = {}
    for name, pool in parts.items():
        normals = pool.normals / scale
        normals /= portable.norm(normals)[:, None]
        hinge = pool.hinge * scale
        result[name] = replace(pool, points=pool.points * scale, normals=normals, hinge=hinge)
        if kinds[name] == "wheel":
            raw = 2 * _turned_radius(pool)
            if record["wheel_size"] == "published" and record["scale"] != "none":
                diameter = record["published"]["wheel_diam_m"]
            else:
                diameter = raw * float(np.sqrt(scale[1] * scale[2]))
            hinge = np.array([*hinge[:2], ground + diameter / 2])
            points = (pool.points - pool.hinge) * (diameter / raw) + hinge
            result[name] = replace(pool, points=points, hinge=hinge)
            facts["wheel_diameter_m"] = diameter
        if kinds[name] == "rotor":
            diameter = 2 * _turned_radius(result[name])
            if diameter < SMALLEST_ROTOR_M:
                raise InputError(
                    f"{record['subtype']}: rotor {name} has a diameter of {diameter:.2g} m at the "
                    f"final size, expected at least {SMALLEST_ROTOR_M} m"
                )
    low, high = _bounds(result)
    middle = (low + high) / 2
    hubs = [pool.hinge[:2] for name, pool in result.items() if kinds[name] == "rotor"]
    if hubs:
        middle[:2] = portable.mean(np.array(hubs), 0)
    if category == "Vehicle":
        facts["origin_height_m"] = float(middle[2] - ground)
    if category == "Bird":
        facts |= {
            "flap": bird.FLAP | record.get("flap", {}),
            "wing_span_m": float(high[0] - low[0]),
        }
    return {
        name: replace(pool, points=pool.points - middle, hinge=pool.hinge - middle)
        for name, pool in result.items()
    }, facts
