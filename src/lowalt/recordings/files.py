"""Samples of a recording out of WAV, MAT, CSV, NPY and SigMF files, as one checked baseband channel.

This module only reads. `lowalt.recordings.faults` finds the faults of samples that could be read.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.array_files import UNREADABLE
from lowalt.common.errors import InputError
from lowalt.common.files import existing, text_file
from lowalt.recordings import faults
from lowalt.recordings.mat_files import read_mat
from lowalt.recordings.record import Record


class Baseband(NamedTuple):
    """A recording's samples: values (samples,) complex128 or float64, and their rate (Hz)."""

    values: np.ndarray
    rate_hz: float


class _Table(NamedTuple):
    """Content of a file: values (samples, columns), names of the columns, the rate it states (Hz) or None."""

    values: np.ndarray
    names: tuple[str, ...]
    rate_hz: float | None


def _columns(values: np.ndarray, path: Path) -> np.ndarray:
    """Values as (samples, columns): the longer axis is time."""
    values = np.squeeze(np.asarray(values))
    if values.dtype.kind not in "iufc" or not 1 <= values.ndim <= 2 or values.size == 0:
        raise InputError(f"{path}: array {values.dtype} {values.shape}, expected numbers in one or a few columns")
    if values.ndim == 1:
        return values[:, None]
    return values if values.shape[0] >= values.shape[1] else values.T


def _wav(path: Path, record: Record) -> _Table:
    """Read a WAV file, which states its rate."""
    from scipy.io import wavfile

    try:
        rate, values = wavfile.read(path)
    except UnboundLocalError as error:
        # scipy's reader ends so where a file states no format or holds no data.
        raise InputError(f"{path}: a .wav file without a format or without samples") from error
    values = values[:, None] if values.ndim == 1 else values
    return _Table(values, (), float(rate))


def _mat(path: Path, record: Record) -> _Table:
    """Read the record's variable of a MATLAB file, or its only one."""
    held = read_mat(path)
    name = record.variable
    if name is None:
        arrays = [key for key, value in held.items() if value.size > 1]
        if len(arrays) != 1:
            raise InputError(f"{path}: variables {sorted(held)}, expected the record to name one as `variable`")
        name = arrays[0]
    if name not in held:
        raise InputError(f"{path}: no variable {name!r}, expected one of {sorted(held)}")
    return _Table(_columns(held[name], path), (), None)


def _csv(path: Path, record: Record) -> _Table:
    """Read a CSV table; its first line names the columns unless all its cells are numbers."""
    with text_file(path, "recording") as file:
        first = file.readline().strip().split(",")
    try:
        [complex(cell.strip()) for cell in first]
        names: tuple[str, ...] = ()
    except ValueError:
        names = tuple(cell.strip() for cell in first)
    values = np.loadtxt(path, delimiter=",", skiprows=int(bool(names)), ndmin=2, encoding="utf-8-sig")
    return _Table(values, names, None)


def _npy(path: Path, record: Record) -> _Table:
    """Read a NumPy array."""
    return _Table(_columns(np.load(path, allow_pickle=False), path), (), None)


def _sigmf(path: Path, record: Record) -> _Table:
    """Read a SigMF recording, which may state its rate."""
    try:
        import sigmf
    except ImportError as error:
        raise InputError(
            f"{path}: the package sigmf is not installed ({error}), expected `pip install 'lowalt[sigmf]'`"
        ) from error

    try:
        signal = sigmf.sigmffile.fromfile(str(path))
        values, rate = signal.read_samples(), signal.get_global_field("core:sample_rate")
    except (sigmf.error.SigMFError, KeyError) as error:
        raise InputError(f"{path}: not a SigMF recording ({error})") from error
    return _Table(_columns(values, path), (), None if rate is None else float(rate))


READERS: dict[str, Callable[[Path, Record], _Table]] = {
    ".wav": _wav, ".mat": _mat, ".csv": _csv, ".npy": _npy, ".sigmf-meta": _sigmf, ".sigmf-data": _sigmf,
}  # fmt: skip


def _column(table: _Table, name: int | str, path: Path) -> np.ndarray:
    """One column of a table, by its name or number."""
    place = table.names.index(name) if name in table.names else name
    if isinstance(place, str) or not 0 <= place < table.values.shape[1]:
        known = list(table.names) or f"0 to {table.values.shape[1] - 1}"
        raise InputError(f"{path}: no column {name!r}, expected one of {known}")
    return table.values[:, place]


def _channel(table: _Table, record: Record) -> np.ndarray:
    """The record's channel out of a table's columns."""
    path, count = record.file, table.values.shape[1]
    wanted = record.columns
    if wanted is None:
        free = [column for column in range(count) if not table.names or table.names[column] != record.times]
        wanted = tuple(free)
    parts = [_column(table, name, path) for name in wanted]
    complex_already = len(parts) == 1 and np.iscomplexobj(parts[0])
    if record.channel == "real":
        if len(parts) != 1 or complex_already:
            raise InputError(f"{path}: {len(parts)} columns of {parts[0].dtype}, expected one real column for channel "
                             "'real'; name it as `columns`")  # fmt: skip
        return parts[0].astype(np.float64)
    if complex_already:
        return parts[0].astype(np.complex128)
    if len(parts) != 2 or any(map(np.iscomplexobj, parts)):
        raise InputError(f"{path}: {len(parts)} columns, expected two (in-phase, quadrature) for channel 'complex'; "
                         "name them as `columns`")  # fmt: skip
    return parts[0].astype(np.float64) + 1j * parts[1].astype(np.float64)


def read(record: Record) -> Baseband:
    """Return the checked samples of a recording and their rate.

    Raises: InputError naming the file where it is missing, of an unknown kind, damaged, has no such column or variable,
    states another rate than the record, or has samples that are not finite, clipped or silent, whose I and Q are the
    same signal, or whose Doppler contradicts the known direction of motion.
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
    rate = faults.agreed_rate(path, record.rates_hz or record.rate_hz, table.rate_hz, times)
    values = _channel(table, record)
    faults.check(path, values, record.moves)
    return Baseband(values, rate)
