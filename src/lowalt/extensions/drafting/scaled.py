"""A record drafted from a data sheet: the figures it states, and all others scaled from the published target of the
same frame that is nearest in size."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from lowalt.files.atomic import write_file
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED
from lowalt.targets.builtin import UNITS
from lowalt.targets.record_schema import figures, schema
from lowalt.targets.records import load_table, merge, read_records, with_row

FILES = ("uav", "bird", "vehicle", "more")
"""Files of config/targets whose records lend what a data sheet does not say."""
SIZE_IS = {"UAV": "motor diagonal", "Bird": "bill tip to tail tip", "Vehicle": "length, width and height"}
"""What the size of a drafted target measures."""
SHEET = "sheet"
KEPT = ("coaxial", "flap", "wheel_size", "moving_share")
"""Keys of a record that a draft takes from the target that lends its figures."""
BY_SIDE = {"track": "wid_m", "tyre_width": "wid_m", "rolling_diameter": "hgt_m", "ground_clearance": "hgt_m"}
"""Figures of a vehicle that grow with its width or height; all others grow with its length."""


class Kind(NamedTuple):
    """A kind of data sheet: its category and usual frame, and of each word of the sheet the cells of the table of
    targets, or the figure of the frame, that it states."""

    category: str
    frame: str
    cells: Mapping[str, tuple[str, ...]]
    figures: Mapping[str, str]


FLIES = {"rate": ("freq_lo_hz", "freq_hi_hz"), "speed": ("vx_abs_max", "vy_abs_max"), "climb": ("vz_abs_max",)}
KINDS = {
    "drone": Kind("UAV", "radial", {"rotors": ("n_rotors_or_wings",), "diagonal": ("size_m",), **FLIES},
                  {"propeller": "propeller_diameter", "blades": "blade_count"}),
    "bird": Kind("Bird", "bird", {"length": ("size_m",), **FLIES}, {"length": "length", "span": "span"}),
    "vehicle": Kind("Vehicle", "car", {"length": ("len_m",), "width": ("wid_m",), "height": ("hgt_m",),
                    "speed": ("speed_hi",)}, {"wheel": "rolling_diameter", "wheel_base": "wheel_base"}),
}  # fmt: skip


class Sheet(NamedTuple):
    """What a data sheet states: `row`, cells of the table of targets, and `figures` of the frame in metres or as
    counts; `about` says which sheet it is."""

    category: str
    frame: str
    row: Mapping[str, float]
    figures: Mapping[str, float]
    about: str


def frames(category: str) -> list[str]:
    """Return the frames (built-in models) of a category that a data sheet can be drafted with."""
    known = schema()["models"].items()
    return [name for name, model in known if model["like"] == category and SIZE_IS[category] in model["size_is"]]


def _lender(sheet: Sheet) -> tuple[dict, dict]:
    """The record and the row of the published target of the sheet's frame that is nearest in size."""
    table, key = load_table(SHIPPED / "config/targets.csv"), "len_m" if sheet.category == "Vehicle" else "size_m"
    found = []
    for file in FILES:
        for name, record in read_records(SHIPPED / f"config/targets/{file}.yaml").items():
            if record.get("model") == sheet.frame:
                row = table[name] if name in table else with_row(None, name, record["row"], file)
                found.append((abs(np.log(row[key] / sheet.row[key])), len(found), record, row))
    return min(found)[2:]


def _figures(sheet: Sheet, record: dict, lent: dict) -> dict[str, list]:
    """Every figure [value, unit, source] of the draft."""
    kinds, result = figures(sheet.frame), {}
    for name, kind in kinds.items():
        value, unit, _ = record["figures"][name]
        side = BY_SIDE.get(name, "len_m") if sheet.category == "Vehicle" else "size_m"
        if name in sheet.figures:
            result[name] = [sheet.figures[name], "m" if kind == "length" else 1, SHEET]
        elif kind == "length":
            grown = value * UNITS[str(unit)] * sheet.row[side] / lent[side]
            result[name] = [float(f"{grown:.3g}"), "m", "estimate"]
        else:
            result[name] = [value, unit, "estimate"]
    return result


def drafted_sheet(sheet: Sheet, subtype: str) -> tuple[str, str]:
    """Return a record file's text for a subtype with a row of its own, and the name of the published target that lends
    what the sheet does not state.

    Raises: InputError for a frame that does not exist, naming those that do, and for figures that fit no such target.
    """
    known = frames(sheet.category)
    if sheet.frame not in known:
        raise InputError(f"--frame is {sheet.frame!r}, expected one of {known}")
    record, lent = _lender(sheet)
    stated = {name: value for name, value in sheet.row.items() if value is not None}
    cells = {name: value for name, value in lent.items() if value is not None and name not in ("name", "idx")}
    cells |= {"category": sheet.category, "unseen_protocol": "seen", **stated}
    body = {
        "row": cells, "row_from": dict.fromkeys(stated, sheet.about), "source": "builtin", "model": sheet.frame,
        "size_is": SIZE_IS[sheet.category], **{key: record[key] for key in KEPT if key in record},
        "sources": {SHEET: sheet.about}, "figures": _figures(sheet, record, lent),
    }  # fmt: skip
    merge(with_row(None, subtype, cells, "data sheet"), {key: body[key] for key in body if key != "row"}, "data sheet")
    lines = yaml.safe_dump({subtype: body}, sort_keys=False, allow_unicode=True, default_flow_style=None, width=400)
    lender = lent["name"]
    head = (
        f"# Drafted from a data sheet: figures of the source `{SHEET}` are the sheet's, estimates are those of\n"
        f"# {lender}, scaled to this size; cells of the row that row_from does not name are {lender}'s.\n"
    )
    return head + lines, lender


def draft_target(
    kind: str, out: str | Path | None = None, *, subtype: str = "", frame: str = "", about: str = "data sheet",
    **stated: float | tuple[float, float] | None,
) -> tuple[str, str]:  # fmt: skip
    """Return the record of a target drafted from its data sheet, as the text of a YAML file, and the name of the
    published target whose figures were scaled for what the sheet does not state.

    kind: "drone", "bird" or "vehicle"; out: new file to write the text to, for `targets.own` of a configuration;
    subtype: its name (default: that of the file); frame: built-in model (default: that of `KINDS`); stated: in m, Hz
    and m/s: of a drone `rotors`, `diagonal` (largest distance between two motor axes), `propeller` (diameter),
    `blades` of a rotor; of a bird `length` (bill tip to tail tip), `span`; of both `rate` (lowest, highest turns or
    beats per second), `speed` and perhaps `climb`, the highest ones; of a vehicle `length`, `width`, `height`, `wheel`
    (rolling diameter), `wheel_base` and `speed`.
    Raises: InputError for a word that is missing or unknown, as `drafted_sheet`, and where the file is there already.
    """
    if kind not in KINDS:
        raise InputError(f"{kind!r} is no kind of data sheet, expected one of {list(KINDS)}")
    category, usual, cells, figures = KINDS[kind]
    if {*cells, *figures} - {"climb"} != set(stated) - {"climb"} or not set(stated) <= {*cells, *figures}:
        raise InputError(f"data sheet of a {kind}: it states {[*stated]}, expected {sorted({*cells, *figures})}")
    row: dict = {}
    for word, names in cells.items():
        values = np.ravel(stated.get(word)).tolist()
        if len(values) not in (1, len(names)):
            raise InputError(f"data sheet of a {kind}: {word} is {stated[word]}, expected {len(names)} numbers")
        row |= dict(zip(names, values * (len(names) if len(values) == 1 else 1), strict=True))
    path = None if out is None else Path(out)
    sheet = Sheet(category, frame or usual, row, {figures[word]: stated[word] for word in figures}, about)
    text, lender = drafted_sheet(sheet, subtype or (path.stem if path else f"My {kind}"))
    if path:
        if path.exists():
            raise InputError(f"{path}: is there already, expected a new file")
        write_file(path, text)
    return text, lender
