"""`lowalt target inspect | new | make | show`: from a user's mesh to a cloud and a picture."""

import argparse
import os
import re
from pathlib import Path

import yaml

from lowalt.commands.command_line import Answer, add_command, add_group
from lowalt.extensions.drafting.data_sheet import add_sheets
from lowalt.extensions.drafting.inspection import Inspection, described, inspect_mesh
from lowalt.extensions.drafting.new import SEED, Asked, draft
from lowalt.files.atomic import slug, write_file
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED
from lowalt.targets.cloud import read, write
from lowalt.targets.mesh_files import UNITS_M
from lowalt.targets.records import estimates, load_table, merge, read_records, with_row

AXES = ("x", "-x", "y", "-y", "z", "-z")
KINDS = ("UAV", "Bird", "Vehicle")
TABLE = SHIPPED / "config/targets.csv"
INNER = ("points", "owner", "groups", "sides_seen")
"""Parts of an inspection that a program is not told."""


def _unit(text: str) -> str | float:
    """Unit of a command line: a name of UNITS_M, or metres.

    Raises: ArgumentTypeError for other text.
    """
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
    """Add `target` and its commands to a parser's commands."""
    actions = add_group(commands, name)
    _add_inspect(actions)
    _add_new(actions)
    _add_make(actions)
    add_sheets(actions)
    meaning = "picture of a cloud with axes, hinges, normals, its motion and its spectra"
    example = "lowalt target show results/default/clouds/crow.npz --out crow.png"
    show = add_command(actions, "show", _show, meaning, example)
    show.add_argument("cloud", type=Path)
    show.add_argument("--out", type=Path, help="picture to write (default: the cloud's name, .png)")


def _add_inspect(actions: argparse._SubParsersAction) -> None:
    """Add `inspect` with its options."""
    meaning = "unit, sizes, pieces and possible moves of a mesh file, and a picture"
    example = "lowalt target inspect inputs/mydrone.stl"
    line = add_command(actions, "inspect", _inspect, meaning, example)
    line.add_argument("--category", choices=KINDS, help="default: that of --subtype, or UAV")
    line.add_argument(
        "--subtype", help="the published target that it is: its size tells the unit, as for `new`"
    )
    line.add_argument(
        "--out",
        type=Path,
        help="picture to write (default: the file's name and -inspect.png, here)",
    )
    _add_mesh(line)
    _add_table(line)


def _add_new(actions: argparse._SubParsersAction) -> None:
    """Add `new` with its options."""
    meaning = "draft a record of a mesh or a robot's description; figures to confirm are marked"
    example = (
        'lowalt target new inputs/mydrone.stl --subtype "DJI Mini 2" --inputs inputs '
        "--out mine.yaml"
    )
    line = add_command(actions, "new", _new, meaning, example)
    line.add_argument(
        "--subtype",
        help="the published target whose place it takes; another name (default: the file's) "
        "makes a row of its own",
    )
    line.add_argument("--category", choices=KINDS, help="of a target with a row of its own")
    _add_mesh(line)
    for axis in ("up", "front"):
        line.add_argument(
            f"--{axis}",
            choices=AXES,
            help=f"axis of the file that points {axis}; --{axis}=-y for a minus",
        )
    line.add_argument(
        "--rotors",
        "--wheels",
        type=int,
        dest="count",
        metavar="N",
        help="number of its rotors or wheels, 0 for none",
    )
    line.add_argument(
        "--moving",
        nargs="+",
        metavar="NUMBER",
        help="pieces that turn, numbered as in the picture; 5+6 "
        "for two that are one rotor or wheel",
    )
    line.add_argument("--out", type=Path, help="record file to write (default: print it)")
    _add_table(line)
    _add_inputs(line)


def _add_make(actions: argparse._SubParsersAction) -> None:
    """Add `make` with its options."""
    example = "lowalt target make mydrone.yaml --inputs inputs"
    line = add_command(actions, "make", _make, "one record to one cloud and a picture", example)
    line.add_argument("record", type=Path, help="YAML file of records")
    line.add_argument("--subtype", help="which record of the file (default: its only one)")
    line.add_argument("--seed", type=int, default=SEED)
    line.add_argument("--out", type=Path, help="cloud file to write (default: SUBTYPE.npz)")
    _add_table(line)
    _add_inputs(line)


def _add_mesh(line: argparse.ArgumentParser) -> None:
    """Add the mesh file and the options that say how large it is."""
    line.add_argument(
        "file", type=Path, help="mesh, or for `new` a robot's description: URDF, SDF or MJCF"
    )
    line.add_argument(
        "--unit", type=_unit, help="unit of the file's numbers: m, cm, mm, in, ft or metres"
    )
    line.add_argument(
        "--size", type=float, dest="size_m", help="largest extent of the target (m), not --unit"
    )


def _add_table(line: argparse.ArgumentParser) -> None:
    """Add the option of the table of targets."""
    line.add_argument(
        "--table", type=Path, default=TABLE, help="table of targets (default: the package's)"
    )


def _add_inputs(line: argparse.ArgumentParser) -> None:
    """Add the option of the folder of inputs."""
    line.add_argument(
        "--inputs",
        type=Path,
        default=Path(os.environ.get("LOWALT_INPUTS", ".")),
        help="folder that a record's files are in (default: $LOWALT_INPUTS or .)",
    )


def _write(path: Path, data: bytes) -> Path:
    """Write a file and return its path."""
    write_file(path, data)
    return path


def _inspect(options: argparse.Namespace) -> Answer:
    """Inspect a mesh and draw it."""
    from lowalt.extensions.drafting.mesh_picture import inspection_picture

    row = {}
    if options.subtype is not None:
        table = load_table(options.table)
        if options.subtype not in table:
            raise InputError(f"--subtype is {options.subtype!r}, expected one of {list(table)}")
        row = table[options.subtype]
    category = options.category or row.get("category", "UAV")
    if category not in KINDS:
        raise InputError(
            f"--subtype is {options.subtype!r}, a {category}, expected one of {list(KINDS)}"
        )
    seen = inspect_mesh(options.file, category, options.unit, row, options.size_m)
    out = _write(options.out or Path(f"{options.file.stem}-inspect.png"), inspection_picture(seen))
    facts = {name: value for name, value in vars(seen).items() if name not in INNER}
    facts["components"] = [
        vars(part) | {"extent": part.extent, "centre": part.centre} for part in seen.components
    ]
    facts["pieces"] = [
        {"name": name, "triangles": count, "extent": extent} for name, count, extent in seen.pieces
    ]
    if seen.category == "Bird":
        facts["wings_from_m"] = seen.shoulder_m
    facts["picture"] = out
    facts["front_from"] = seen.front_from.words
    return Answer(facts, f"{described(seen)}\n\npicture  {out}")


def _new(options: argparse.Namespace) -> Answer:
    """Draft a record of a mesh file or a robot's description."""
    stem = (options.out or options.file).stem
    asked = Asked(
        options.file,
        options.inputs,
        load_table(options.table),
        options.subtype,
        options.category,
        options.unit,
        options.size_m,
        options.up,
        options.front,
        options.count,
        options.moving,
        f"{stem}.glb",
        Path(f"{stem}-pieces.png"),
    )

    def show(seen: Inspection) -> None:
        """Draw the numbered pieces of a mesh."""
        from lowalt.extensions.drafting.mesh_picture import inspection_picture

        _write(asked.picture, inspection_picture(seen, numbered=True))

    made = draft(asked, show)
    files: dict[Path, bytes] = {}
    if options.out is not None:
        files[options.out] = made.text.encode()
    if made.glb is not None:
        files[options.inputs / asked.glb] = made.glb
    for path in files:
        if path.exists():
            raise InputError(f"{path}: is there already, expected a new file")
    for path, data in files.items():
        _write(path, data)
    moving = len(yaml.safe_load(made.text)[asked.name]["parts"]) - 1
    marks = made.text.count("GUESSED")
    facts = {"file": options.out, "text": made.text, "moving_parts": moving, "marked_lines": marks}
    if options.out is None:
        return Answer(facts, made.text)
    said = f"{options.out}: {moving} moving parts drafted; confirm the {marks} marked lines"
    if re.search(r"  front: .*GUESSED", made.text):
        said += "; which way is front is not sure: confirm it or give --front"
    return Answer(facts, said)


def _make(options: argparse.Namespace) -> Answer:
    """Make the cloud of a record and a picture of it."""
    from lowalt.targets.make import make

    records = read_records(options.record)
    subtype = options.subtype
    if not subtype and len(records) == 1:
        (subtype,) = records
    if subtype not in records:
        raise InputError(
            f"{options.record}: --subtype is {subtype!r}, expected one of {list(records)}"
        )
    where = f"{options.record}: {subtype}"
    record = records[subtype]
    row = load_table(options.table).get(subtype)
    if "row" in record:
        row = with_row(row, subtype, record.pop("row"), where)
    if row is None:
        raise InputError(
            f"{where}: no row in {options.table}, expected a key `row` or the name of a published "
            "subtype"
        )
    record = merge(row, record, where)
    cloud = make(record, options.inputs, options.seed)
    out = options.out or Path(f"{slug(subtype)}.npz")
    write(out, cloud)
    picture = _picture(out, out.with_suffix(".png"))
    guessed, figures = estimates(cloud.record)
    facts = {"file": out, "points": len(cloud.points), "parts": cloud.kinds, "picture": picture}
    said = f"{out}: {len(cloud.points)} points in {len(cloud.kinds)} parts; {picture}"
    if guessed:
        said += f"; {guessed} of its {figures} figures are estimates"
    return Answer({**facts, "estimates": guessed, "figures": figures}, said)


def _picture(cloud: Path, out: Path) -> str:
    """Draw a cloud's file and return the picture's path."""
    from lowalt.report.figures.target_picture import target_picture

    return str(_write(out, target_picture(read(cloud))))


def _show(options: argparse.Namespace) -> Answer:
    """Draw a cloud's file."""
    picture = _picture(options.cloud, options.out or options.cloud.with_suffix(".png"))
    return Answer({"picture": picture}, picture)
