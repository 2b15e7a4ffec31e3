"""A record drafted from a data sheet: its figures, and others scaled from a published target.

That target has the same frame and is nearest in size.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

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
SIZE_IS = {
    "UAV": "motor diagonal",
    "Bird": "bill tip to tail tip",
    "Vehicle": "length, width and height",
}
"""What the size of a drafted target measures."""
SHEET = "sheet"
KEPT = ("coaxial", "flap", "moving_share")
"""Keys of a record that a draft takes from the target that lends its figures."""
BY_SIDE = {
    "track": "wid_m",
    "tyre_width": "wid_m",
    "rolling_diameter": "hgt_m",
    "ground_clearance": "hgt_m",
}
"""Figures of a vehicle that grow with its width or height; all others grow with its length."""


COAXIAL = "coaxial"
"""Frame of which each arm carries two rotors; no published target has it. The figures of a radial
one are lent, and the distance between the two rotors is that of the published craft with two layers
of blades nearest in size."""


class Kind(NamedTuple):
    """A kind of data sheet.

    category, frame: its category and usual frame; cells, figures: of each word of the sheet the
    cells of the table of targets, or the figure of the frame, that it states.
    """

    category: str
    frame: str
    cells: Mapping[str, tuple[str, ...]]
    figures: Mapping[str, str]


FLIES = {
    "rate": ("freq_lo_hz", "freq_hi_hz"),
    "speed": ("vx_abs_max", "vy_abs_max"),
    "climb": ("vz_abs_max",),
}
KINDS = {
    "drone": Kind(
        "UAV",
        "radial",
        {"rotors": ("n_rotors_or_wings",), "diagonal": ("size_m",), **FLIES},
        {"propeller": "propeller_diameter", "blades": "blade_count"},
    ),
    "bird": Kind(
        "Bird", "bird", {"length": ("size_m",), **FLIES}, {"length": "length", "span": "span"}
    ),
    "vehicle": Kind(
        "Vehicle",
        "car",
        {"length": ("len_m",), "width": ("wid_m",), "height": ("hgt_m",), "speed": ("speed_hi",)},
        {"wheel": "rolling_diameter", "wheel_base": "wheel_base"},
    ),
}


class Sheet(NamedTuple):
    """What a data sheet states.

    row: cells of the table of targets; figures: of the frame, in metres or as counts; about: which
    sheet it is.
    """

    category: str
    frame: str
    row: Mapping[str, float]
    figures: Mapping[str, float]
    about: str


def frames(category: str) -> list[str]:
    """Return the frames (built-in models) of a category that a data sheet can be drafted with."""
    names = []
    for name, model in schema()["models"].items():
        if model["like"] == category and SIZE_IS[category] in model["size_is"]:
            names.append(name)
    return names


def _nearest(sheet: Sheet, model: str) -> tuple[dict, dict]:
    """The record and the row of the published target of a model that is nearest in size."""
    table = load_table(SHIPPED / "config/targets.csv")
    key = "len_m" if sheet.category == "Vehicle" else "size_m"
    found = []
    for file in FILES:
        for name, record in read_records(SHIPPED / f"config/targets/{file}.yaml").items():
            if record.get("model") != model:
                continue
            row = table.get(name)
            if row is None:
                row = with_row(None, name, record["row"], file)
            found.append((abs(np.log(row[key] / sheet.row[key])), record, row))
    _, record, row = min(found, key=lambda candidate: candidate[0])
    return record, row


def _lender(sheet: Sheet) -> tuple[dict, dict]:
    """The record and the row of the published target that lends what the sheet does not state."""
    if sheet.frame != COAXIAL:
        return _nearest(sheet, sheet.frame)
    record, row = _nearest(sheet, "radial")
    layered, layered_row = _nearest(sheet, "tanker")
    gap, unit, source = layered["figures"]["layer_gap"]
    # All figures grow with the size of the radial craft.
    gap *= row["size_m"] / layered_row["size_m"]
    return record | {"figures": record["figures"] | {"layer_gap": [gap, unit, source]}}, row


def _figures(sheet: Sheet, record: dict, lent: dict) -> dict[str, list]:
    """Every figure [value, unit, source] of the draft."""
    kinds = figures(sheet.frame)
    result = {}
    for name, kind in kinds.items():
        value, unit, _ = record["figures"][name]
        if name in sheet.figures:
            result[name] = [sheet.figures[name], "m" if kind == "length" else 1, SHEET]
        elif kind == "length":
            side = "size_m"
            if sheet.category == "Vehicle":
                side = BY_SIDE.get(name, "len_m")
            grown = value * UNITS[str(unit)] * sheet.row[side] / lent[side]
            result[name] = [float(f"{grown:.3g}"), "m", "estimate"]
        else:
            result[name] = [value, unit, "estimate"]
    return result


def drafted_sheet(sheet: Sheet, subtype: str) -> tuple[str, str]:
    """Return a record file's text for a subtype with a row of its own, and the lender's name.

    The lender is the published target that lends what the sheet does not state. Raises: InputError
    for a frame that does not exist, naming those that do, and for figures that fit no such target.
    """
    known = frames(sheet.category)
    if sheet.frame not in known:
        raise InputError(f"--frame is {sheet.frame!r}, expected one of {known}")
    record, lent = _lender(sheet)
    if sheet.frame == COAXIAL:
        rotors = sheet.row["n_rotors_or_wings"]
        if rotors % 2:
            raise InputError(
                f"rotors is {rotors}, expected an even number with the frame {COAXIAL}, two on "
                "each arm"
            )
        # The row counts motor axes, as it does for every craft with two layers of blades.
        sheet = sheet._replace(row={**sheet.row, "n_rotors_or_wings": rotors // 2})
    stated = {name: value for name, value in sheet.row.items() if value is not None}
    cells = {
        name: value
        for name, value in lent.items()
        if value is not None and name not in ("name", "idx")
    }
    cells |= {"category": sheet.category, "unseen_protocol": "seen", **stated}
    body = {
        "row_from": dict.fromkeys(stated, sheet.about),
        "source": "builtin",
        "model": sheet.frame,
        "size_is": SIZE_IS[sheet.category],
        **{key: record[key] for key in KEPT if key in record},
    }
    if sheet.category == "Vehicle":
        body["wheel_size"] = "rolling"
    body["sources"] = {SHEET: sheet.about}
    body["figures"] = _figures(sheet, record, lent)
    # Refuse figures that fit no such target.
    merge(with_row(None, subtype, cells, "data sheet"), body, "data sheet")
    body = {"row": cells, **body}
    lines = yaml.safe_dump(
        {subtype: body}, sort_keys=False, allow_unicode=True, default_flow_style=None, width=400
    )
    lender = lent["name"]
    head = (
        f"# Drafted from a data sheet: figures of the source `{SHEET}` are the sheet's, estimates "
        f"are those of\n# {lender}, scaled to this size; cells of the row that row_from does not "
        f"name are {lender}'s.\n"
    )
    return head + lines, lender


def draft_target(
    kind: str,
    out: str | Path | None = None,
    *,
    subtype: str = "",
    frame: str = "",
    about: str = "data sheet",
    **stated: float | tuple[float, float] | None,
) -> tuple[str, str]:
    """Return the record of a target drafted from its data sheet, and the lender's name.

    The record is the text of a YAML file; the lender is the published target whose figures were
    scaled for what the sheet does not state.
    kind: "drone", "bird" or "vehicle"; out: new file to write the text to, for `targets.own` of a
    configuration;
    subtype: its name (default: that of the file); frame: built-in model (default: that of `KINDS`);
    stated: in m, Hz and m/s: of a drone `rotors`, `diagonal` (largest distance between two motor
    axes), `propeller` (diameter), `blades` of a rotor; of a bird `length` (bill tip to tail tip),
    `span`; of both `rate` (lowest, highest turns or beats per second), `speed` and perhaps `climb`,
    the highest ones; of a vehicle `length`, `width`, `height`, `wheel` (rolling diameter),
    `wheel_base` and `speed`.
    Raises: InputError for a word that is missing or unknown, as `drafted_sheet`, and where the file
    is there already.
    """
    if kind not in KINDS:
        raise InputError(f"{kind!r} is no kind of data sheet, expected one of {list(KINDS)}")
    category, usual, cells, figures = KINDS[kind]
    known = {*cells, *figures}
    needed = known - {"climb"}
    if not needed <= set(stated) <= known:
        raise InputError(f"data sheet of a {kind}: it states {[*stated]}, expected {sorted(known)}")
    row: dict = {}
    for word, names in cells.items():
        values: list = np.ravel(np.array(stated.get(word))).tolist()
        if len(values) not in (1, len(names)):
            raise InputError(
                f"data sheet of a {kind}: {word} is {stated[word]}, expected {len(names)} numbers"
            )
        if len(values) == 1:
            values *= len(names)
        row |= dict(zip(names, values, strict=True))
    of_frame: dict[str, Any] = {figures[word]: stated[word] for word in figures}
    sheet = Sheet(category, frame or usual, row, of_frame, about)
    if out is None:
        return drafted_sheet(sheet, subtype or f"My {kind}")
    path = Path(out)
    text, lender = drafted_sheet(sheet, subtype or path.stem)
    if path.exists():
        raise InputError(f"{path}: is there already, expected a new file")
    write_file(path, text)
    return text, lender
