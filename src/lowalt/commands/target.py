"""`lowalt target inspect | new | make | show`: from a user's mesh to a cloud and a picture of it."""

import argparse
import os
from pathlib import Path

import yaml

from lowalt.commands.for_programs import acts, as_json
from lowalt.common.errors import InputError
from lowalt.common.files import replacing, slug
from lowalt.common.shipped import SHIPPED
from lowalt.targets.cloud import read, write
from lowalt.targets.dimensions import estimates
from lowalt.targets.draft import drafted
from lowalt.targets.inspection import described, inspect_mesh
from lowalt.targets.mesh_files import UNITS_M
from lowalt.targets.records import load_table, merge, read_records, with_row

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
    inspect.add_argument("--out", type=Path, help="picture to write (default: the file's name and -inspect.png, here)")
    new = actions.add_parser(
        "new", help="draft a record of a mesh file; figures to confirm are marked",
        epilog='example: lowalt target new inputs/mydrone.stl --subtype "DJI Mini 2" --inputs inputs --out mine.yaml',
    )  # fmt: skip
    new.add_argument("file", type=Path)
    new.add_argument("--subtype", required=True, help="the published target whose place the mesh takes")
    new.add_argument("--unit", type=_unit)
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


def _row(table: Path, subtype: str) -> dict:
    """The row of a subtype in a table of targets. Raises: InputError for an unknown subtype."""
    rows = load_table(table)
    if subtype not in rows:
        raise InputError(f"--subtype is {subtype!r}, expected one of {list(rows)}")
    return rows[subtype]


def _inspect(given: argparse.Namespace) -> str:
    """Inspect a mesh and draw it."""
    from lowalt.report.figures.inspection import inspection_picture

    found = inspect_mesh(given.file, given.category, given.unit)
    out = given.out or Path(f"{given.file.stem}-inspect.png")
    with replacing(out) as temporary:
        temporary.write_bytes(inspection_picture(found))
    if given.json:
        parts = [vars(part) | {"extent": part.extent, "centre": part.centre} for part in found.components]
        pieces = [{"name": name, "triangles": count, "extent": extent} for name, count, extent in found.pieces]
        told = {name: value for name, value in vars(found).items() if name not in ("points", "owner")}
        wings = {"wings_from_m": found.shoulder_m} if found.category == "Bird" else {}
        return as_json({**told, "components": parts, "pieces": pieces, **wings, "picture": out})
    return f"{described(found)}\n\npicture  {out}"


def _new(given: argparse.Namespace) -> str:
    """Draft a record of a mesh file."""
    row = _row(given.table, given.subtype)
    if row["category"] == "Pedestrian":
        raise InputError(f"--subtype is {given.subtype!r}, a pedestrian, expected a UAV, a bird or a vehicle")
    try:
        name = given.file.resolve().relative_to(given.inputs.resolve()).as_posix()
    except ValueError:
        raise InputError(
            f"{given.file}: not inside the folder of inputs {given.inputs}, expected --inputs with it"
        ) from None
    text = drafted(inspect_mesh(given.file, row["category"], given.unit), given.subtype, row, name)
    record = yaml.safe_load(text)[given.subtype]
    merge(row, record, f"draft: {given.subtype}")
    moving, marks = len(record["parts"]) - 1, text.count("GUESSED")
    if given.out is not None:
        if given.out.exists():
            raise InputError(f"{given.out}: is there already, expected a new file")
        with replacing(given.out) as temporary:
            temporary.write_text(text)
    if given.json:
        return as_json({"file": given.out, "text": text, "moving_parts": moving, "marked_lines": marks})
    if given.out is None:
        return text
    return f"{given.out}: {moving} moving parts drafted; confirm the {marks} marked lines"


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
    from lowalt.report.figures.target import target_animation, target_picture

    draw = target_animation if out.suffix == ".gif" else target_picture
    with replacing(out) as temporary:
        temporary.write_bytes(draw(read(cloud)))
    return str(out)


def _show(given: argparse.Namespace) -> str:
    """Draw a cloud's file."""
    picture = _picture(given.cloud, given.out or given.cloud.with_suffix(".png"))
    return as_json({"picture": picture}) if given.json else picture
