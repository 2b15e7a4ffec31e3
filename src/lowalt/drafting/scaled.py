"""A record drafted from a data sheet: the figures it states, and all others scaled from the published target of the
same frame that is nearest in size."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import yaml

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
