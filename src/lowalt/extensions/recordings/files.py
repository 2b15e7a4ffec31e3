"""A recording's samples as one checked baseband channel, out of a file of any kind in
`formats.READERS`.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.recordings import faults
from lowalt.extensions.recordings.chirps import slow_time
from lowalt.extensions.recordings.column_names import rises_evenly, role, unit
from lowalt.extensions.recordings.formats import (
    MOST_COLUMNS,
    MOST_RECORDING_BYTES,
    RAW,
    READERS,
    Table,
    refuse_kind,
)
from lowalt.extensions.recordings.layouts import (
    GROUPS,
    TYPES,
    contradiction,
    parted,
    raw_readings,
    readings,
)
from lowalt.extensions.recordings.record import Record
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError, reading

FEWEST = 1024
"""Least number of numbers in a file whose layout is checked."""


class Baseband(NamedTuple):
    """A recording's samples: values (samples,) complex128 or float64, and their rate (Hz)."""

    values: np.ndarray
    rate_hz: float


def _column(table: Table, name: int | str, path: Path) -> np.ndarray:
    """One column of a table, by its name or number."""
    place = table.names.index(name) if name in table.names else name
    if isinstance(place, str) or not 0 <= place < len(table.columns):
        known = list(table.names) or f"0 to {len(table.columns) - 1}"
        raise InputError(f"{path}: no column {name!r}, expected one of {known}")
    return table.columns[place]


def _named(table: Table, name: int | str) -> str:
    """What the name of a column says, as `column_names.role`."""
    text = (
        name
        if name in table.names
        else table.names[name]
        if table.names and isinstance(name, int)
        else ""
    )
    return role(str(text))


def times_of(table: Table, record: Record) -> np.ndarray | None:
    """Sample times (samples,) s in the record's column of times, or in the only one whose name says
    so.
    """
    name = record.times
    if name is None:
        named = [each for each in table.names if role(each) == "time"]
        name = named[0] if len(named) == 1 and record.trust is None else None
    return None if name is None else _column(table, name, record.file) * unit(name)


def _chosen(table: Table, record: Record) -> tuple[tuple[int | str, ...], str | None]:
    """Columns of the channel and their layout: those of the record, or else those that their names
    say.

    Raises: InputError where the record contradicts the names and does not say that it is right.
    """
    path = record.file
    columns = record.columns
    layout = record.layout
    if columns is None:
        free = [
            name
            for name in table.names or range(len(table.columns))
            if not table.names or (name != record.times and _named(table, name) != "time")
        ]
        for pair, order in ((("i", "q"), layout), (("magnitude", "phase"), "polar")):
            by_role = [[name for name in free if _named(table, name) == part] for part in pair]
            if record.channel == "complex" and [len(names) for names in by_role] == [1, 1]:
                return (by_role[0][0], by_role[1][0]), order
        columns = tuple(free)
    said = tuple(_named(table, name) for name in columns) if record.trust is None else ()
    wrong = (
        "time" in said
        or said in (("q", "i"), ("phase", "magnitude"))
        or (said == ("magnitude", "phase") and layout != "polar")
        or (layout == "polar" and said == ("i", "q"))
    )
    if wrong:
        raise InputError(
            f"{path}: the columns {list(columns)} are {' and '.join(said)} by their names, expected"
            " in-phase and quadrature, magnitude and phase (layout 'polar'), or trust 'record'"
        )
    return columns, layout


def channel_of(table: Table, record: Record) -> np.ndarray:
    """The record's channel out of a table's columns."""
    path = record.file
    columns, layout = _chosen(table, record)
    parts = [_column(table, name, path) for name in columns]
    if len(table.columns) > 1 and record.trust is None and any(map(rises_evenly, parts)):
        name = columns[[*map(rises_evenly, parts)].index(True)]
        raise InputError(
            f"{path}: column {name!r} rises by equal steps, as sample times do, expected `columns` "
            "without it"
        )
    if layout == "polar":
        if len(parts) != 2 or any(map(np.iscomplexobj, parts)):
            raise InputError(
                f"{path}: {len(parts)} columns, expected magnitude and phase for layout 'polar'"
            )
        turn = unit(str(columns[1] if columns[1] in table.names else ""))
        parts = [parts[0] * np.exp(1j * turn * parts[1])]
    elif layout is None and record.dtype is None and len(parts) == 1:
        layout = next(iter(RAW.get(path.suffix.lower(), ())[1:]), None)
    if layout in GROUPS:
        if len(parts) != 1:
            raise InputError(f"{path}: {len(parts)} columns, expected one for layout {layout!r}")
        parts = parted(parts[0], layout, str(path))
        if record.receiver >= len(parts):
            raise InputError(
                f"{path}: receiver is {record.receiver}, expected less than {len(parts)} for layout"
                f" {layout!r}"
            )
        parts = [parts[record.receiver]] if record.chirps is None or layout == "dca4" else parts
    complex_already = len(parts) == 1 and np.iscomplexobj(parts[0])
    if record.channel == "real" or (record.chirps and len(parts) == 1 and not complex_already):
        if len(parts) != 1 or complex_already:
            raise InputError(
                f"{path}: {len(parts)} columns of {parts[0].dtype}, expected one real column for"
                " channel 'real'; name it as `columns`"
            )
        return parts[0].astype(np.float64)
    if complex_already:
        return parts[0].astype(np.complex128)
    if len(parts) != 2 or any(map(np.iscomplexobj, parts)):
        raise InputError(
            f"{path}: {len(parts)} columns, expected one complex or two (in-phase, quadrature) for "
            "channel 'complex'; name them as `columns`, or say `layout`"
        )
    return parts[0].astype(np.float64) + 1j * parts[1].astype(np.float64)


def _refuse_misread(table: Table, record: Record) -> None:
    """Refuse a record under which the numbers of a file make far less sense than under another
    reading.
    """
    path = record.file
    raw = record.file.suffix.lower() in RAW
    if (
        record.trust
        or record.chirps
        or not (raw or record.layout in GROUPS)
        or len(table.columns[0]) < FEWEST
    ):
        return
    own = RAW.get(path.suffix.lower(), ())
    dtype = record.dtype or next(iter(own), "") or ""
    layout = record.layout
    if layout is None and record.dtype is None:
        layout = next(iter(own[1:]), None)
    if dtype in ("complex64", "complex128"):
        dtype = {"complex64": "float32", "complex128": "float64"}[dtype]
        layout = "iqiq"
    if (raw and dtype not in TYPES) or (np.iscomplexobj(table.columns[0]) and not raw):
        return
    found = raw_readings(str(path)) if raw else readings(table.columns[0])
    better = contradiction(found, dtype if raw else "", layout or "")
    if better:
        raise InputError(
            f"{path}: the samples do not follow on one another as the record has them, but do with"
            f" {better}; expected that, or trust 'record' (`lowalt recording inspect` shows both)"
        )


def table_of(record: Record) -> Table:
    """Return the columns of a record's file as they stand in it.

    Raises: InputError naming the file where it is missing, of an unknown kind, damaged, or holds no
    sample.
    """
    path = existing(record.file, "recording", MOST_RECORDING_BYTES)
    kind = path.suffix.lower()
    if not record.recorded:
        raise InputError(
            f"{path}: the record of a radar without any recording, expected the key `file`"
        )
    refuse_kind(path)
    with reading(path, f"{path.suffix} file"):
        table = READERS[kind](path, record)
    if len(table.columns) > MOST_COLUMNS:
        raise InputError(f"{path}: {len(table.columns)} columns, expected at most {MOST_COLUMNS}")
    if not table.columns or not len(table.columns[0]):
        raise InputError(f"{path}: no samples, expected a recording")
    return table


def read(record: Record) -> Baseband:
    """Return the checked samples of a recording and their rate.

    Raises: InputError naming the file where it is missing, of an unknown kind, damaged, has no such
    column or variable, states another rate, carrier or names of columns than the record, or has
    samples that are not finite, clipped or silent, make sense in another layout alone, whose I and
    Q are the same signal or stand in turn in a real channel, or whose Doppler contradicts the known
    direction of motion.
    """
    path = record.file
    table = table_of(record)
    times = times_of(table, record)
    if record.trust == "record":
        assert record.rate_hz is not None  # `trust: record` is refused without it.
        rate = float(record.rate_hz)
    else:
        rate = faults.agreed_rate(path, record.rate_hz, table.rate_hz, times)
    values = channel_of(table, record)
    _refuse_misread(table, record)
    faults.check(path, values, None if record.chirps else record.moves)
    # Two columns of sound may be any two channels.
    if np.iscomplexobj(values) and path.suffix.lower() == ".wav" and record.trust is None:
        faults.refuse_alike(path, values)
    if record.chirps is None:
        return Baseband(values, rate)
    samples = record.chirps["samples"]
    receivers = record.chirps.get("receivers", 1)
    whole = len(values) // (samples * receivers) * samples * receivers
    if not whole or (record.receiver >= receivers and record.layout != "dca4"):
        raise InputError(
            f"{path}: {len(values)} samples and receiver {record.receiver}, expected chirps of"
            f" {samples} samples of {receivers} receivers"
        )
    values = slow_time(
        values[:whole], samples, receivers, 0 if record.layout == "dca4" else record.receiver
    )
    faults.refuse_swapped(path, values, record.moves)
    return Baseband(values, rate)
