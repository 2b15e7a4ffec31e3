"""A recording's samples as one checked baseband channel, out of a file of any kind in `formats.READERS`."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.files.array_files import UNREADABLE
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.recordings import faults
from lowalt.recordings.formats import READERS, Table
from lowalt.recordings.record import Record


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


def _parted(values: np.ndarray, layout: str, path: Path) -> list[np.ndarray]:
    """In-phase and quadrature out of one sequence: number by number (iqiq), or one after the other (iiqq)."""
    if np.iscomplexobj(values) or len(values) % 2:
        raise InputError(f"{path}: {len(values)} numbers {values.dtype}, expected an even number of real ones for "
                         f"layout {layout!r}")  # fmt: skip
    return [values[::2], values[1::2]] if layout == "iqiq" else np.split(values, 2)


def _channel(table: Table, record: Record) -> np.ndarray:
    """The record's channel out of a table's columns."""
    path, columns = record.file, record.columns
    if columns is None:
        free = [n for n in range(len(table.columns)) if not table.names or table.names[n] != record.times]
        columns = tuple(free)
    parts = [_column(table, name, path) for name in columns]
    if record.layout is not None:
        if len(parts) != 1:
            raise InputError(f"{path}: {len(parts)} columns, expected one for layout {record.layout!r}")
        parts = _parted(parts[0], record.layout, path)
    complex_already = len(parts) == 1 and np.iscomplexobj(parts[0])
    if record.channel == "real":
        if len(parts) != 1 or complex_already:
            raise InputError(f"{path}: {len(parts)} columns of {parts[0].dtype}, expected one real column for channel "
                             "'real'; name it as `columns`")  # fmt: skip
        return parts[0].astype(np.float64)
    if complex_already:
        return parts[0].astype(np.complex128)
    if len(parts) != 2 or any(map(np.iscomplexobj, parts)):
        raise InputError(f"{path}: {len(parts)} columns, expected one complex or two (in-phase, quadrature) for "
                         "channel 'complex'; name them as `columns`, or say `layout`")  # fmt: skip
    return parts[0].astype(np.float64) + 1j * parts[1].astype(np.float64)


def read(record: Record) -> Baseband:
    """Return the checked samples of a recording and their rate.

    Raises: InputError naming the file where it is missing, of an unknown kind, damaged, has no such column or variable,
    states another rate or carrier than the record, or has samples that are not finite, clipped or silent, whose I and Q
    are the same signal or stand in turn in a real channel, or whose Doppler contradicts the known direction of motion.
    """
    path = existing(record.file, "recording")
    kind = path.suffix.lower()
    if kind not in READERS:
        raise InputError(f"{path}: unknown kind of file {path.suffix!r}, expected one of {sorted(READERS)}")
    try:
        table = READERS[kind](path, record)
    except InputError:
        raise
    except UNREADABLE as error:
        raise InputError(f"{path}: not a readable {path.suffix} file ({error})") from error
    times = None if record.times is None else _column(table, record.times, path)
    if record.trust == "record":
        rate = float(record.rate_hz)
    else:
        rate = faults.agreed_rate(path, record.rate_hz, table.rate_hz, times)
    values = _channel(table, record)
    faults.check(path, values, record.moves)
    return Baseband(values, rate)
