"""Records of all subtypes, read from the table of published values and from record files.

A record file is YAML, one record per name. Later files replace earlier ones, whole records at a
time; files of the configuration's key `targets.own` come last. A record may have a key `row`, whose
cells replace those of the subtype's row in the table of targets or make a new row: one file is then
a whole new target. Keys of one source alone (a mesh's unit, the frames of a recording) are checked
by that source's own `check_record`.
"""

import math
from pathlib import Path

from lowalt.config.classes import AIRBORNE, classes_of, like, refuse_subtype
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError, reading
from lowalt.files.yaml_files import load_yaml
from lowalt.targets import record_schema
from lowalt.targets.make import source_module
from lowalt.targets.record_schema import check_file_name, record_files

COMMON_KEYS = tuple(record_schema.schema()["sources"][record_schema.COMMON]["properties"])
"""Keys every record may have; `source` it must have. Each source adds its own."""

_WORDS = ("category", "name", "unseen_protocol")
_WHOLE = ("idx", "n_rotors_or_wings", "points_in_published_cloud_approx")
AIR_SPEEDS = ("vx_abs_max", "vy_abs_max", "vz_abs_max")
GROUND_SPEEDS = ("speed_lo", "speed_hi")
"""Columns of speeds of targets in the air and on the ground.

They may be 0: a craft hovers, a car stands.
"""
_NUMBERS = (
    "size_m",
    "freq_lo_hz",
    "freq_hi_hz",
    *AIR_SPEEDS,
    "len_m",
    "wid_m",
    "hgt_m",
    "wheel_diam_m",
    *GROUND_SPEEDS,
)
COLUMNS = (*_WORDS, *_WHOLE, *_NUMBERS)


def load_table(path: str | Path) -> dict[str, dict]:
    """Return the published table by name, in its order.

    Metres, hertz and m/s are numbers, empty cells None.

    Raises: InputError naming the file, the subtype and the column that is missing, unknown or no
    positive number; a speed may be 0.
    """
    rows = read_csv(path, what="table of published targets")
    if not rows:
        raise InputError(f"{path}: no row, expected one row per subtype")
    if wrong := sorted(set(rows[0]) ^ set(COLUMNS)):
        raise InputError(f"{path}: columns {wrong} missing or unknown")
    table: dict[str, dict] = {}
    for row in rows:
        name = row["name"]
        where = f"{path}: {row['name']}"
        refuse_subtype(name, path)
        if name in table:
            raise InputError(f"{where}: named twice, expected one row per subtype")
        if row["unseen_protocol"] not in ("seen", "unseen"):
            raise InputError(
                f"{where}: unseen_protocol {row['unseen_protocol']!r}, expected seen or unseen"
            )
        table[name] = {column: _cell(where, column, text) for column, text in row.items()}
    with reading(path, "table of targets"):
        classes_of(table)
    return table


def _cell(where: str, column: str, text: str) -> str | int | float | None:
    """Return a cell as text, number or None. Raises: InputError naming `where` and the column."""
    if column in _WORDS:
        return text
    if text == "":
        return None
    try:
        value = int(text) if column in _WHOLE else float(text)
    except ValueError:
        value = math.nan
    may_be_zero = column in (*AIR_SPEEDS, *GROUND_SPEEDS)
    good = value > 0 or (value == 0 and may_be_zero)
    if not (good and math.isfinite(value)):
        least = "a number of at least 0" if may_be_zero else "a positive number"
        raise InputError(f"{where}: {column} is {text!r}, expected {least}")
    return value


def read_records(path: str | Path) -> dict[str, dict]:
    """Return the records of one file by subtype, as written.

    Raises: InputError where the file is no mapping of names to records, or names a subtype or a key
    twice.
    """
    holds = "subtypes' names to their records"
    records = load_yaml(path, "record file", holds)
    for name, record in records.items():
        if not isinstance(record, dict):
            raise InputError(f"{path}: {name} is {record!r}, expected a mapping of {holds}")
    return records


def records_of(targets: dict, inputs: str | Path | None = None) -> dict[str, dict]:
    """Return the merged records of the block `targets` of a configuration.

    Those of its `own` files come last.

    inputs: the folder of the user's files, in which a record's files must stand where
    `where_missing` is "builtin".
    Raises: InputError as `load_records`.
    """
    own_files = targets.get("own", {}).values()
    falls = targets.get("where_missing") == "builtin"
    return load_records(targets["table"], [*targets["records"], *own_files], inputs, falls)


def load_records(
    table_path: str | Path,
    record_paths: list[str | Path],
    inputs: str | Path | None = None,
    fall_back: bool = False,
) -> dict[str, dict]:
    """Return every subtype's merged and checked record, in the table's order; new rows come last.

    fall_back: if a record names files that the folder `inputs` lacks, use the subtype's previous
    record.

    A merged record is the record as written, with `subtype`, `category`, `group` (seen or unseen),
    `published` (the table's row), and the defaults of `points` (the published count) and
    `rcs_m2_per_point` (1 m2).
    Raises: InputError naming file, subtype, key, value and what was expected: a subtype the table
    lacks or a file names twice, an unknown key, a value out of range, a subtype that no file has a
    record of.
    """
    table = load_table(table_path)
    chosen: dict[str, list[tuple[str, dict]]] = {}
    for path in record_paths:
        for name, record in read_records(path).items():
            where = f"{path}: {name}"
            if "row" in record:
                table[name] = with_row(table.get(name), name, record["row"], where)
            if name not in table:
                raise InputError(
                    f"{path}: unknown subtype {name!r}, expected a key `row` or one of "
                    f"{list(table)}"
                )
            without_row = {key: item for key, item in record.items() if key != "row"}
            chosen.setdefault(name, []).append((where, without_row))
    missing = [name for name in table if name not in chosen]
    if missing:
        raise InputError(
            f"no record for {missing} in {[str(path) for path in record_paths]}, expected one each"
        )
    classes_of(table)
    return {name: _last(row, chosen[name], inputs, fall_back) for name, row in table.items()}


def _last(
    row: dict, choices: list[tuple[str, dict]], inputs: str | Path | None, fall_back: bool
) -> dict:
    """The last of a subtype's records.

    With `fall_back` it is the last one whose files are all in the folder.
    """
    where, record = choices[-1]
    merged = merge(row, record, where)
    if fall_back and len(choices) > 1 and missing_inputs({row["name"]: merged}, inputs):
        return _last(row, choices[:-1], inputs, fall_back)
    return merged


def with_row(row: dict | None, name: str, cells: object, where: str) -> dict:
    """Return a row of the table of targets with the cells of a record's key `row` in it.

    row: None for a new one.

    Raises: InputError naming `where`, the column and the value that is missing, unknown or no
    positive number.
    """
    refuse_subtype(name, where.rpartition(": ")[0] or where)
    known = [column for column in COLUMNS if column not in ("name", "idx")]
    if not isinstance(cells, dict) or set(cells) - set(known):
        raise InputError(f"{where}: row is {cells!r}, expected cells of the columns {known}")
    blank = dict.fromkeys(COLUMNS) | {
        "name": name,
        "unseen_protocol": "seen",
        "points_in_published_cloud_approx": 150,
    }
    result = dict(row or blank)
    for column, cell in cells.items():
        result[column] = None
        if cell is not None:
            result[column] = _cell(f"{where}: row", column, str(cell))
    if not result["category"] or result["unseen_protocol"] not in ("seen", "unseen"):
        raise InputError(
            f"{where}: row is {cells!r}, expected a category and unseen_protocol seen or unseen"
        )
    return result


def merge(row: dict, record: dict, where: str) -> dict:
    """Return one record merged with its row of the published table and checked.

    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    merged = {"rcs_m2_per_point": 1.0, "points": row["points_in_published_cloud_approx"], **record}
    merged |= {
        "subtype": row["name"],
        "category": row["category"],
        "group": row["unseen_protocol"],
        "published": row,
    }
    common = {key: merged[key] for key in COMMON_KEYS if key in merged}
    merged |= record_schema.check(record_schema.COMMON, common, where)
    _check_like(merged, where)
    if unknown := sorted(set(record.get("row_from", {})) - set(row)):
        raise InputError(
            f"{where}: row_from names {unknown}, expected columns of the table of targets"
        )
    source = merged["source"]
    own = {key: value for key, value in record.items() if key not in COMMON_KEYS}
    merged |= record_schema.check(source, own, where)
    for name in record_files(merged):
        check_file_name(name, where)
    return source_module(source).check_record(merged, where)


def _check_like(merged: dict, where: str) -> None:
    """Refuse a record that is like no published class, or whose row lacks that class's speeds."""
    try:
        kind = like(merged)
    except InputError as error:
        raise InputError(f"{where}: {str(error).removeprefix(merged['subtype'] + ': ')}") from None
    speeds = AIR_SPEEDS if kind in AIRBORNE else GROUND_SPEEDS
    if empty := [column for column in speeds if merged["published"][column] is None]:
        raise InputError(
            f"{where}: the table of targets has no {empty}, expected m/s for a target like a {kind}"
        )


def estimates(record: dict) -> tuple[int, int]:
    """Return how many figures of a merged record are estimates, and how many there are.

    Cells of a row of its own count, too.

    A cell that the record's `row_from` does not name is an estimate; the cells of a published row
    do not count.
    """
    row = record.get("published")
    named = record.get("row_from", {})
    sources = [entry["source"] for entry in record.get("figures", {}).values()]
    if row is not None and row["idx"] is None:
        filled = [column for column in _NUMBERS if row[column] is not None]
        sources += [named.get(column, "estimate") for column in filled]
    return sources.count("estimate"), len(sources)


def source_files(record: dict, inputs: str | Path | None) -> list[str]:
    """Return the paths of the user's files that a merged record names, inside the folder `inputs`.

    Raises: InputError where the record names files and there is no folder.
    """
    names = record_files(record)
    if not names:
        return []
    if inputs is None:
        raise InputError(
            f"{record['subtype']}: source {record['source']} reads {names}, expected a folder of "
            "inputs"
        )
    return [str(Path(inputs) / name) for name in names]


def missing_inputs(records: dict[str, dict], inputs: str | Path | None) -> list[str]:
    """Return one line for each file that a record names and the folder `inputs` lacks.

    It says subtype, source, path and where a user gets the file.
    """
    lines = []
    for name, record in records.items():
        for file in record_files(record):
            if inputs is None or not (Path(inputs) / file).is_file():
                get = f"; get it from {record['where']}" if "where" in record else ""
                lines.append(
                    f"{name}: {record['source']} file {file} (inputs folder: "
                    f"{inputs or 'not given'}){get}"
                )
    return lines
