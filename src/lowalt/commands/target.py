"""`lowalt target inspect | new | make | show`: from a user's mesh to a cloud and a picture of it."""

import argparse
import os
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from lowalt.commands.for_programs import acts, as_json
from lowalt.files.atomic import existing, replacing, slug
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED
from lowalt.targets.cloud import read, write
from lowalt.targets.dimensions import estimates
from lowalt.targets.draft import chosen, drafted, refuse_miscount, row_lines
from lowalt.targets.guesses import UNUSUAL, USUAL_M, box_of
from lowalt.targets.inspection import described, inspect_mesh
from lowalt.targets.mesh_files import UNITS_M
from lowalt.targets.mesh_record import MOVING_KIND, body_axes
from lowalt.targets.records import load_table, merge, read_records, with_row
from lowalt.targets.robot_files import is_description, read_robot
from lowalt.targets.robots import category_of, drafted_robot, parts_of, write_parts

AXES = ("x", "-x", "y", "-y", "z", "-z")
TABLE = SHIPPED / "config/targets.csv"


def _unit(text: str) -> str | float:
    """Unit of a command line: a name of UNITS_M, or metres. Raises: ArgumentTypeError for other text."""
    if text in UNITS_M:
        return text
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value <= 1e6:
        raise argparse.ArgumentTypeError(f"{text!r}, expected one of {list(UNITS_M)} or metres")
    return value


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `target` and its four commands to a parser's commands."""
    target = commands.add_parser(
        "target", help="your own mesh or recording: look, draft a record, make its cloud",
        epilog="example: lowalt target inspect inputs/mydrone.stl",
    )  # fmt: skip
    actions = target.add_subparsers(dest="action", required=True)
    inspect = actions.add_parser(
        "inspect", help="unit, sizes, pieces and possible moves of a mesh file, and a picture",
        epilog="example: lowalt target inspect inputs/mydrone.stl",
    )  # fmt: skip
    inspect.add_argument("file", type=Path)
    inspect.add_argument("--category", default="UAV", choices=("UAV", "Bird", "Vehicle"))
    inspect.add_argument("--unit", type=_unit, help="unit of the file's numbers: m, cm, mm, in, ft or metres")
    inspect.add_argument(
        "--size", type=float, dest="size_m", help="largest extent of the target (m), instead of --unit"
    )
    inspect.add_argument("--out", type=Path, help="picture to write (default: the file's name and -inspect.png, here)")
    new = actions.add_parser(
        "new", help="draft a record of a mesh or a robot's description; figures to confirm are marked",
        epilog='example: lowalt target new inputs/mydrone.stl --subtype "DJI Mini 2" --inputs inputs --out mine.yaml',
    )  # fmt: skip
    new.add_argument("file", type=Path, help="mesh, or a robot's description: URDF, SDF or MJCF")
    new.add_argument("--subtype", help="the published target whose place it takes; another name (default: the file's) "
                     "makes a row of its own")  # fmt: skip
    new.add_argument("--category", choices=("UAV", "Bird", "Vehicle"), help="of a target with a row of its own")
    new.add_argument("--unit", type=_unit)
    new.add_argument("--size", type=float, dest="size_m", help="largest extent of the target (m), instead of --unit")
    for axis in ("up", "front"):
        new.add_argument(
            f"--{axis}", choices=AXES, help=f"axis of the file that points {axis}; --{axis}=-y for a minus"
        )
    new.add_argument("--rotors", "--wheels", type=int, dest="count", metavar="N",
                     help="number of its rotors or wheels, 0 for none")  # fmt: skip
    new.add_argument("--moving", nargs="+", metavar="NUMBER", help="pieces that turn, numbered as in the picture; 5+6 "
                     "for two that are one rotor or wheel")  # fmt: skip
    new.add_argument("--out", type=Path, help="record file to write (default: print it)")
    make = actions.add_parser(
        "make", help="one record to one cloud and a picture",
        epilog="example: lowalt target make mydrone.yaml --inputs inputs",
    )  # fmt: skip
    make.add_argument("record", type=Path, help="YAML file of records")
    make.add_argument("--subtype", help="which record of the file (default: its only one)")
    make.add_argument("--seed", type=int, default=20260701)
    make.add_argument("--out", type=Path, help="cloud file to write (default: SUBTYPE.npz)")
    show = actions.add_parser(
        "show", help="picture of a cloud with axes, hinges, normals, its motion and its spectra",
        epilog="example: lowalt target show results/default/clouds/crow.npz --out crow.png",
    )  # fmt: skip
    show.add_argument("cloud", type=Path)
    show.add_argument("--out", type=Path, help="picture to write (default: the cloud's name, .png); .gif: its motion")
    for parser, act in ((inspect, _inspect), (new, _new), (make, _make), (show, _show)):
        acts(parser, act)
    for parser in (new, make):
        parser.add_argument("--table", type=Path, default=TABLE, help="table of targets (default: the package's)")
        parser.add_argument("--inputs", type=Path, default=Path(os.environ.get("LOWALT_INPUTS", ".")),
                            help="folder that a record's files are in (default: $LOWALT_INPUTS or .)")  # fmt: skip


def _inspect(given: argparse.Namespace) -> str:
    """Inspect a mesh and draw it."""
    from lowalt.report.figures.mesh_picture import inspection_picture

    found = inspect_mesh(given.file, given.category, given.unit, size_m=given.size_m)
    out = given.out or Path(f"{given.file.stem}-inspect.png")
    with replacing(out) as temporary:
        temporary.write_bytes(inspection_picture(found))
    if given.json:
        parts = [vars(part) | {"extent": part.extent, "centre": part.centre} for part in found.components]
        pieces = [{"name": name, "triangles": count, "extent": extent} for name, count, extent in found.pieces]
        told = {
            name: value
            for name, value in vars(found).items()
            if name not in ("points", "owner", "groups", "sides_seen")
        }
        wings = {"wings_from_m": found.shoulder_m} if found.category == "Bird" else {}
        return as_json({**told, "components": parts, "pieces": pieces, **wings, "picture": out})
    return f"{described(found)}\n\npicture  {out}"


def _target(given: argparse.Namespace, table: dict[str, dict]) -> tuple[str, dict]:
    """The name and the published row of a target to draft, an empty row for one of its own.

    Raises: InputError for a pedestrian, and for a name that is not published where no category is given.
    """
    stem = given.file.stem if given.file.stem != "model" else given.file.resolve().parent.name
    name = given.subtype or stem
    row = table.get(name, {})
    if row.get("category") == "Pedestrian":
        raise InputError(f"--subtype is {name!r}, a pedestrian, expected a UAV, a bird or a vehicle")
    if not (row or given.category or is_description(given.file)):
        if given.subtype:
            raise InputError(f"--subtype is {name!r}, expected one of {list(table)}, or --category for a row of its "
                             "own")  # fmt: skip
        raise InputError(f"{given.file}: its category cannot be seen, expected --category UAV, --category Bird or "
                         "--category Vehicle, or --subtype with a published target")  # fmt: skip
    return name, row


def _robot(given: argparse.Namespace, name: str, row: dict, table: dict) -> tuple[str, bytes]:
    """The record of a robot's description and the bytes of the GLB of its parts."""
    file = f"{(given.out or given.file).stem}.glb"
    robot = read_robot(given.file, given.inputs)
    try:
        category = row.get("category") or given.category or category_of(robot)
        joints, triangles = parts_of(robot, MOVING_KIND[category])
    except InputError as error:
        raise InputError(f"{given.file}: {error}") from None
    if not joints:
        # The names of links tell rotors that no joint turns.
        triangles = {link: np.concatenate(found) for link, found in robot.surfaces.items() if found}
    with TemporaryDirectory() as folder:
        path = Path(folder) / file
        write_parts(path, triangles)
        if joints:
            count, kind = row.get("n_rotors_or_wings", len(joints)), MOVING_KIND[category]
            if kind != "wing" and count != len(joints):
                raise InputError(f"{given.file}: {len(joints)} {kind}s turn, {name} has {count}: leave --subtype out "
                                 "for a row of its own, or choose a target with as many")  # fmt: skip
            names = (name, given.file.name, file)
            return drafted_robot(robot, joints, triangles, category, table, names, not row), path.read_bytes()
        # As where a drone is one mesh: its pieces are looked at.
        given.up, given.front, given.unit = given.up or "z", given.front or "x", "m"
        return _draft(given, path, file, name, row, category, table), path.read_bytes()


def _draft(
    given: argparse.Namespace, path: Path, file: str, name: str, row: dict, category: str, table: dict
) -> str:  # fmt: skip
    """The record of a mesh file."""
    count = row.get("n_rotors_or_wings") if given.count is None else given.count
    known = row | {"n_rotors_or_wings": count}
    found = inspect_mesh(path, category, given.unit, known, given.size_m, (given.up, given.front))
    found = replace(found, path=given.file)  # of a description, not the file that its parts lie in for now
    if not found.sides_seen:
        raise InputError(f"{path}: left and right of the bird cannot be seen, expected --up and --front")
    if found.cut:
        raise InputError(f"{given.file}: one half of a target, cut off along {found.cut}: join it with its mirror "
                         f"image first, or give --front {found.cut} where a whole one ends flat there")  # fmt: skip
    groups = chosen(found, given.moving) if given.moving else found.groups
    count = len(groups) if given.moving and count is None else count
    picture = Path(f"{(given.out or given.file).stem}-pieces.png")
    try:
        refuse_miscount(found, groups, count, str(picture))
    except InputError:
        from lowalt.report.figures.mesh_picture import inspection_picture

        with replacing(picture) as temporary:
            temporary.write_bytes(inspection_picture(found, numbered=True))
        raise
    frame = body_axes(found.front, found.up)
    extent = np.abs(frame @ (found.high - found.low))
    hubs = np.array([frame[:2] @ np.mean(box_of(group), axis=0) for group in groups]).reshape(-1, 2)
    wheel = max((float(np.subtract(*box_of(group)[::-1]).max()) for group in groups), default=None)
    lines = [] if row else row_lines(category, extent, hubs, wheel, table)
    given_axes = " ".join(axis for axis in ("up", "front") if getattr(given, axis))
    return drafted(found, name, file, lines, groups, given_axes)


def _new(given: argparse.Namespace) -> str:
    """Draft a record of a mesh file or a robot's description."""
    table, data = load_table(given.table), None
    name, row = _target(given, table)
    if given.size_m is not None and not 0 < given.size_m < 1e6:
        raise InputError(f"--size is {given.size_m}, expected metres")
    path = existing(given.file, "mesh or description").resolve()
    if not path.is_relative_to(given.inputs.resolve()):
        raise InputError(f"{given.file}: not inside the folder of inputs {given.inputs}, expected --inputs with it")
    file = path.relative_to(given.inputs.resolve()).as_posix()
    if is_description(given.file):
        text, data = _robot(given, name, row, table)
    else:
        text = _draft(given, given.file, file, name, row, row.get("category") or given.category, table)
    record = yaml.safe_load(text)[name]
    cells = record.pop("row", None)
    if cells:
        (low, high), size = USUAL_M[cells["category"]], cells.get("len_m", cells.get("size_m"))
        if not low / UNUSUAL < size < high * UNUSUAL:
            raise InputError(f"{given.file}: measures {size:.4g} m in the unit {record['unit']!r}, expected {low} to "
                             f"{high} m for a {cells['category']}: give --unit or --size")  # fmt: skip
    merge(with_row(None, name, cells, "draft") if cells else row, record, f"draft: {name}")
    moving, marks = len(record["parts"]) - 1, text.count("GUESSED")
    glb = given.inputs / f"{(given.out or given.file).stem}.glb"
    for path in [given.out] * (given.out is not None) + [glb] * (data is not None):
        if path.exists():
            raise InputError(f"{path}: is there already, expected a new file")
    if data is not None:
        with replacing(glb) as temporary:
            temporary.write_bytes(data)
    if given.out is not None:
        with replacing(given.out) as temporary:
            temporary.write_text(text)
    if given.json:
        return as_json({"file": given.out, "text": text, "moving_parts": moving, "marked_lines": marks})
    if given.out is None:
        return text
    ask = re.search(r"  front: .*GUESSED", text) and "; which way is front cannot be seen: confirm it or give --front"
    return f"{given.out}: {moving} moving parts drafted; confirm the {marks} marked lines{ask or ''}"


def _make(given: argparse.Namespace) -> str:
    """Make the cloud of a record and a picture of it."""
    from lowalt.targets.make import make

    records = read_records(given.record)
    subtype = given.subtype or (next(iter(records)) if len(records) == 1 else None)
    if subtype not in records:
        raise InputError(f"{given.record}: --subtype is {subtype!r}, expected one of {list(records)}")
    where, record = f"{given.record}: {subtype}", records[subtype]
    row = load_table(given.table).get(subtype)
    if "row" in record:
        row = with_row(row, subtype, record.pop("row"), where)
    if row is None:
        raise InputError(f"{where}: no row in {given.table}, expected a key `row` or the name of a published subtype")
    record = merge(row, record, where)
    cloud = make(record, given.inputs, given.seed)
    out = given.out or Path(f"{slug(subtype)}.npz")
    write(out, cloud)
    picture = _picture(out, out.with_suffix(".png"))
    guessed, figures = estimates(cloud.record)
    if given.json:
        return as_json({
            "file": out, "points": len(cloud.points), "parts": cloud.kinds, "picture": picture,
            "estimates": guessed, "figures": figures,
        })  # fmt: skip
    words = f"; {guessed} of its {figures} figures are estimates" if guessed else ""
    return f"{out}: {len(cloud.points)} points in {len(cloud.kinds)} parts; {picture}{words}"


def _picture(cloud: Path, out: Path) -> str:
    """Draw a cloud's file and return the picture's path."""
    from lowalt.report.figures.target_picture import target_animation, target_picture

    draw = target_animation if out.suffix == ".gif" else target_picture
    with replacing(out) as temporary:
        temporary.write_bytes(draw(read(cloud)))
    return str(out)


def _show(given: argparse.Namespace) -> str:
    """Draw a cloud's file."""
    picture = _picture(given.cloud, given.out or given.cloud.with_suffix(".png"))
    return as_json({"picture": picture}) if given.json else picture
