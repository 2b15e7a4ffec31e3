"""`lowalt target inspect | new | make | show`: from a user's mesh to a cloud and a picture of it."""

import argparse
import os
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from lowalt.commands.command_line import Answer, add_command
from lowalt.commands.command_table import COMMANDS
from lowalt.files.atomic import existing, replacing, slug
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED
from lowalt.targets.cloud import read, write
from lowalt.targets.draft import chosen, drafted, refuse_miscount
from lowalt.targets.guesses import UNUSUAL, USUAL_M
from lowalt.targets.inspection import described, inspect_mesh
from lowalt.targets.mesh_files import UNITS_M
from lowalt.targets.mesh_record import MOVING_KIND
from lowalt.targets.records import estimates, load_table, merge, read_records, with_row
from lowalt.targets.robot_files import is_description, read_robot
from lowalt.targets.robots import category_of, drafted_robot, parts_of, write_parts

AXES = ("x", "-x", "y", "-y", "z", "-z")
KINDS = ("UAV", "Bird", "Vehicle")
TABLE = SHIPPED / "config/targets.csv"
INNER = ("points", "owner", "groups", "sides_seen")
"""Parts of an inspection that a program is not told."""


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


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `target` and its four commands to a parser's commands."""
    _, meaning, example = COMMANDS[name]
    target = commands.add_parser(name, help=meaning, epilog=f"example: {example}")
    actions = target.add_subparsers(dest="action", required=True)
    meaning = "unit, sizes, pieces and possible moves of a mesh file, and a picture"
    inspect = add_command(actions, "inspect", _inspect, meaning, "lowalt target inspect inputs/mydrone.stl")
    inspect.add_argument("--category", default="UAV", choices=KINDS)
    inspect.add_argument("--out", type=Path, help="picture to write (default: the file's name and -inspect.png, here)")
    meaning = "draft a record of a mesh or a robot's description; figures to confirm are marked"
    example = 'lowalt target new inputs/mydrone.stl --subtype "DJI Mini 2" --inputs inputs --out mine.yaml'
    new = add_command(actions, "new", _new, meaning, example)
    new.add_argument("--subtype", help="the published target whose place it takes; another name (default: the file's) "
                     "makes a row of its own")  # fmt: skip
    new.add_argument("--category", choices=KINDS, help="of a target with a row of its own")
    for line in (inspect, new):
        line.add_argument("file", type=Path, help="mesh, or for `new` a robot's description: URDF, SDF or MJCF")
        line.add_argument("--unit", type=_unit, help="unit of the file's numbers: m, cm, mm, in, ft or metres")
        line.add_argument("--size", type=float, dest="size_m", help="largest extent of the target (m), not --unit")
    for axis in ("up", "front"):
        new.add_argument(
            f"--{axis}", choices=AXES, help=f"axis of the file that points {axis}; --{axis}=-y for a minus"
        )
    new.add_argument("--rotors", "--wheels", type=int, dest="count", metavar="N",
                     help="number of its rotors or wheels, 0 for none")  # fmt: skip
    new.add_argument("--moving", nargs="+", metavar="NUMBER", help="pieces that turn, numbered as in the picture; 5+6 "
                     "for two that are one rotor or wheel")  # fmt: skip
    new.add_argument("--out", type=Path, help="record file to write (default: print it)")
    example = "lowalt target make mydrone.yaml --inputs inputs"
    make = add_command(actions, "make", _make, "one record to one cloud and a picture", example)
    make.add_argument("record", type=Path, help="YAML file of records")
    make.add_argument("--subtype", help="which record of the file (default: its only one)")
    make.add_argument("--seed", type=int, default=20260701)
    make.add_argument("--out", type=Path, help="cloud file to write (default: SUBTYPE.npz)")
    for line in (new, make):
        line.add_argument("--table", type=Path, default=TABLE, help="table of targets (default: the package's)")
        line.add_argument("--inputs", type=Path, default=Path(os.environ.get("LOWALT_INPUTS", ".")),
                          help="folder that a record's files are in (default: $LOWALT_INPUTS or .)")  # fmt: skip
    meaning = "picture of a cloud with axes, hinges, normals, its motion and its spectra"
    example = "lowalt target show results/default/clouds/crow.npz --out crow.png"
    show = add_command(actions, "show", _show, meaning, example)
    show.add_argument("cloud", type=Path)
    show.add_argument("--out", type=Path, help="picture to write (default: the cloud's name, .png); .gif: its motion")


def _write(path: Path, data: bytes) -> Path:
    """Write a file and return its path."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)
    return path


def _inspect(options: argparse.Namespace) -> Answer:
    """Inspect a mesh and draw it."""
    from lowalt.report.figures.mesh_picture import inspection_picture

    seen = inspect_mesh(options.file, options.category, options.unit, size_m=options.size_m)
    out = _write(options.out or Path(f"{options.file.stem}-inspect.png"), inspection_picture(seen))
    facts = {name: value for name, value in vars(seen).items() if name not in INNER} | {
        "components": [vars(part) | {"extent": part.extent, "centre": part.centre} for part in seen.components],
        "pieces": [{"name": name, "triangles": count, "extent": extent} for name, count, extent in seen.pieces],
        **({"wings_from_m": seen.shoulder_m} if seen.category == "Bird" else {}), "picture": out,
    }  # fmt: skip
    return Answer(facts, f"{described(seen)}\n\npicture  {out}")


def _target(options: argparse.Namespace, table: dict[str, dict]) -> tuple[str, dict]:
    """The name and the published row of a target to draft, an empty row for one of its own.

    Raises: InputError for a pedestrian, and for a name that is not published where no category is given.
    """
    stem = options.file.stem if options.file.stem != "model" else options.file.resolve().parent.name
    name = options.subtype or stem
    row = table.get(name, {})
    if row.get("category") == "Pedestrian":
        raise InputError(f"--subtype is {name!r}, a pedestrian, expected a UAV, a bird or a vehicle")
    if not (row or options.category or is_description(options.file)):
        if options.subtype:
            raise InputError(f"--subtype is {name!r}, expected one of {list(table)}, or --category for a row of its "
                             "own")  # fmt: skip
        raise InputError(f"{options.file}: its category cannot be seen, expected --category UAV, --category Bird or "
                         "--category Vehicle, or --subtype with a published target")  # fmt: skip
    return name, row


def _robot(options: argparse.Namespace, name: str, row: dict, table: dict) -> tuple[str, bytes]:
    """The record of a robot's description and the bytes of the GLB of its parts."""
    file = f"{(options.out or options.file).stem}.glb"
    robot = read_robot(options.file, options.inputs)
    try:
        category = row.get("category") or options.category or category_of(robot)
        joints, triangles = parts_of(robot, MOVING_KIND[category])
    except InputError as error:
        raise InputError(f"{options.file}: {error}") from None
    if not joints:
        # The names of links tell rotors that no joint turns.
        triangles = {link: np.concatenate(parts) for link, parts in robot.surfaces.items() if parts}
    with TemporaryDirectory() as folder:
        path = Path(folder) / file
        write_parts(path, triangles)
        if joints:
            count, kind = row.get("n_rotors_or_wings", len(joints)), MOVING_KIND[category]
            if kind != "wing" and count != len(joints):
                raise InputError(f"{options.file}: {len(joints)} {kind}s turn, {name} has {count}: leave --subtype out "
                                 "for a row of its own, or choose a target with as many")  # fmt: skip
            names = (name, options.file.name, file)
            return drafted_robot(robot, joints, triangles, category, table, names), path.read_bytes()
        # As where a drone is one mesh: its pieces are looked at.
        options.up, options.front, options.unit = options.up or "z", options.front or "x", "m"
        return _draft(options, path, file, name, row, category, table), path.read_bytes()


def _draft(
    options: argparse.Namespace, path: Path, file: str, name: str, row: dict, category: str, table: dict
) -> str:  # fmt: skip
    """The record of a mesh file."""
    count = row.get("n_rotors_or_wings") if options.count is None else options.count
    known = row | {"n_rotors_or_wings": count}
    seen = inspect_mesh(path, category, options.unit, known, options.size_m, (options.up, options.front))
    seen = replace(seen, path=options.file)  # of a description, not the file that its parts lie in for now
    if not seen.sides_seen:
        raise InputError(f"{path}: left and right of the bird cannot be seen, expected --up and --front")
    if seen.cut:
        raise InputError(f"{options.file}: one half of a target, cut off along {seen.cut}: join it with its mirror "
                         f"image first, or give --front {seen.cut} where a whole one ends flat there")  # fmt: skip
    groups = chosen(seen, options.moving) if options.moving else seen.groups
    count = len(groups) if options.moving and count is None else count
    picture = Path(f"{(options.out or options.file).stem}-pieces.png")
    try:
        refuse_miscount(seen, groups, count, str(picture))
    except InputError:
        from lowalt.report.figures.mesh_picture import inspection_picture

        _write(picture, inspection_picture(seen, numbered=True))
        raise
    stated_axes = [axis for axis in ("up", "front") if getattr(options, axis)]
    return drafted(seen, name, file, table, groups, stated_axes)


def _new(options: argparse.Namespace) -> Answer:
    """Draft a record of a mesh file or a robot's description."""
    table, data = load_table(options.table), None
    name, row = _target(options, table)
    if options.size_m is not None and not 0 < options.size_m < 1e6:
        raise InputError(f"--size is {options.size_m}, expected metres")
    path = existing(options.file, "mesh or description").resolve()
    if not path.is_relative_to(options.inputs.resolve()):
        raise InputError(f"{options.file}: not inside the folder of inputs {options.inputs}, expected --inputs with it")
    file = path.relative_to(options.inputs.resolve()).as_posix()
    if is_description(options.file):
        text, data = _robot(options, name, row, table)
    else:
        text = _draft(options, options.file, file, name, row, row.get("category") or options.category, table)
    record = yaml.safe_load(text)[name]
    cells = record.pop("row", None)
    if cells:
        (low, high), size = USUAL_M[cells["category"]], cells.get("len_m", cells.get("size_m"))
        if not low / UNUSUAL < size < high * UNUSUAL:
            raise InputError(f"{options.file}: measures {size:.4g} m in the unit {record['unit']!r}, expected {low} to "
                             f"{high} m for a {cells['category']}: give --unit or --size")  # fmt: skip
    merge(with_row(None, name, cells, "draft") if cells else row, record, f"draft: {name}")
    moving, marks = len(record["parts"]) - 1, text.count("GUESSED")
    glb = options.inputs / f"{(options.out or options.file).stem}.glb"
    for path in [options.out] * (options.out is not None) + [glb] * (data is not None):
        if path.exists():
            raise InputError(f"{path}: is there already, expected a new file")
    if data is not None:
        _write(glb, data)
    facts = {"file": options.out, "text": text, "moving_parts": moving, "marked_lines": marks}
    if options.out is None:
        return Answer(facts, text)
    _write(options.out, text.encode())
    ask = re.search(r"  front: .*GUESSED", text) and "; which way is front cannot be seen: confirm it or give --front"
    said = f"{options.out}: {moving} moving parts drafted; confirm the {marks} marked lines{ask or ''}"
    return Answer(facts, said)


def _make(options: argparse.Namespace) -> Answer:
    """Make the cloud of a record and a picture of it."""
    from lowalt.targets.make import make

    records = read_records(options.record)
    subtype = options.subtype or (next(iter(records)) if len(records) == 1 else None)
    if subtype not in records:
        raise InputError(f"{options.record}: --subtype is {subtype!r}, expected one of {list(records)}")
    where, record = f"{options.record}: {subtype}", records[subtype]
    row = load_table(options.table).get(subtype)
    if "row" in record:
        row = with_row(row, subtype, record.pop("row"), where)
    if row is None:
        raise InputError(f"{where}: no row in {options.table}, expected a key `row` or the name of a published subtype")
    record = merge(row, record, where)
    cloud = make(record, options.inputs, options.seed)
    out = options.out or Path(f"{slug(subtype)}.npz")
    write(out, cloud)
    picture = _picture(out, out.with_suffix(".png"))
    guessed, figures = estimates(cloud.record)
    facts = {"file": out, "points": len(cloud.points), "parts": cloud.kinds, "picture": picture}
    words = f"; {guessed} of its {figures} figures are estimates" if guessed else ""
    said = f"{out}: {len(cloud.points)} points in {len(cloud.kinds)} parts; {picture}{words}"
    return Answer({**facts, "estimates": guessed, "figures": figures}, said)


def _picture(cloud: Path, out: Path) -> str:
    """Draw a cloud's file and return the picture's path."""
    from lowalt.report.figures.target_picture import target_animation, target_picture

    draw = target_animation if out.suffix == ".gif" else target_picture
    return str(_write(out, draw(read(cloud))))


def _show(options: argparse.Namespace) -> Answer:
    """Draw a cloud's file."""
    picture = _picture(options.cloud, options.out or options.cloud.with_suffix(".png"))
    return Answer({"picture": picture}, picture)
