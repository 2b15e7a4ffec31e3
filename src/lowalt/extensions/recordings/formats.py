"""Tables of samples out of WAV, MAT, HDF5, CSV, NPY, SigMF and raw files, as they stand in the
file.

This module only reads. `lowalt.extensions.recordings.files` picks the channel,
`lowalt.extensions.recordings.faults` judges it.
"""

import copy
import io
import math
import re
from collections.abc import Callable
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lowalt.extensions.recordings.chirps import chirp_rows, in_chirps
from lowalt.extensions.recordings.faults import agreed_rate
from lowalt.extensions.recordings.layouts import number_type
from lowalt.extensions.recordings.mat_files import read_mat
from lowalt.extensions.recordings.record import Record
from lowalt.files.array_files import array_of
from lowalt.files.atomic import bytes_of, text_file
from lowalt.files.errors import InputError, missing_package
from lowalt.files.inside import inside
from lowalt.files.json_objects import read_object

SAME_CARRIER = 1e-3
"""Largest relative difference between the carrier of the record and that of a SigMF capture."""
MOST_RECORDING_BYTES = 1 << 30
"""Largest size of a file; the bytes of a sample become sixteen."""
MOST_COLUMNS = 10_000
"""Largest number of columns of a file; a table may have a chirp a row."""
FEWEST_SWEEPS = 16
"""Length from which two axes of an array of three are frames and the sweeps of each."""
GAP_S = 0.05
"""Largest difference between the stated start of a SigMF capture and the one that its place in the
samples gives.
"""
RAW = {
    ".iq": (),
    ".bin": (),
    ".dat": (),
    ".raw": (),
    ".cfile": ("complex64", None),
    ".cf32": ("complex64", None),
    ".cu8": ("uint8", "iqiq"),
    ".cs8": ("int8", "iqiq"),
    ".cs16": ("int16", "iqiq"),
}
"""Endings of numbers without a header, and the type and layout that an ending stands for where the
record has none.
"""

COMPRESSED = (".mp3", ".m4a", ".aac", ".ogg", ".opus", ".wma")
"""Endings of sound without what ears do not hear."""


def refuse_kind(path: Path) -> None:
    """Raise InputError where no reader knows a file's ending, with what to do."""
    kind = path.suffix.lower()
    if kind in COMPRESSED:
        raise InputError(
            f"{path}: {kind} keeps what ears hear and drops faint lines of a radar, expected the "
            "recording as it was made, saved as .wav"
        )
    if kind not in READERS:
        raise InputError(
            f"{path}: unknown kind of file {path.suffix!r}, expected one of {sorted(READERS)}"
        )


class Table(NamedTuple):
    """Content of a file: columns, each (samples,), their names, and the rate and carrier the file
    states (Hz) or None."""

    columns: list[np.ndarray]
    names: tuple[str, ...] = ()
    rate_hz: float | None = None
    carrier_hz: float | None = None


def _columns(values: np.ndarray, path: Path, record: Record) -> list[np.ndarray]:
    """Columns of an array: the longer axis is time. An array of chirps is one column."""
    shape = np.shape(values)
    values = np.squeeze(np.asarray(values))
    if record.chirps and values.dtype.kind in "iufc" and values.size:
        return [in_chirps(values, record.chirps["samples"], str(path))]
    if len(shape) > 2 and sum(length >= FEWEST_SWEEPS for length in shape) > 1:
        # Nothing in the numbers says reliably whether time is lost between two frames.
        raise InputError(
            f"{path}: array {values.dtype} {shape}, frames of sweeps, expected an array with all"
            " sweeps along one axis, from a radar that loses no time between frames"
        )
    if values.dtype.kind not in "iufc" or not 1 <= values.ndim <= 2 or values.size == 0:
        raise InputError(
            f"{path}: array {values.dtype} {values.shape}, expected numbers in one or a few columns"
        )
    if values.ndim == 1:
        return [values]
    return list(values.T if values.shape[0] >= values.shape[1] else values)


def _wav(path: Path, record: Record) -> Table:
    """Read a WAV file, which states its rate."""
    from scipy.io import wavfile

    try:
        rate, values = wavfile.read(path)
    except (UnboundLocalError, ZeroDivisionError) as error:
        # scipy's reader ends so where a file states no format or channel, or holds no data.
        raise InputError(
            f"{path}: a .wav file without a format or without samples, or of no channel"
        ) from error
    return Table([values] if values.ndim == 1 else list(values.T), rate_hz=float(rate))


def _mat(path: Path, record: Record) -> Table:
    """Read the record's variable of a MATLAB or HDF5 file, or its only one.

    `rec.iq` is a field of a struct, `rec/iq` or `rec.iq` an array in a group.
    """
    variables = read_mat(path)
    name = record.variable and record.variable.strip("/").replace("/", ".")
    if name is None:
        arrays = [key for key, value in variables.items() if value.size > 1]
        if len(arrays) != 1:
            raise InputError(
                f"{path}: variables {sorted(variables)}, expected the record to name one as"
                " `variable`"
            )
        name = arrays[0]
    if name not in variables:
        raise InputError(f"{path}: no variable {name!r}, expected one of {sorted(variables)}")
    return Table(_columns(variables[name], path, record))


def _is_number(cell: str) -> bool:
    """Whether a cell is a number, real or complex."""
    try:
        complex(cell)
    except ValueError:
        return False
    return True


def _is_real(cell: str) -> bool:
    """Whether a cell is a real number."""
    return _is_number(cell) and not cell.endswith(("j", "J"))


def _csv(path: Path, record: Record) -> Table:
    """Read a table with commas, with blanks or tabs, or with semicolons and perhaps decimal commas.

    Between commas or semicolons cells may be complex (1+2j, 1+2i).

    Its first line names the columns unless all its cells are numbers.
    """
    with text_file(path, "recording") as file:
        lines = [line.strip() for line in file if line.strip()]
    if not lines:
        raise InputError(f"{path}: no lines, expected a table of numbers")
    delimiter = ";" if ";" in lines[0] else ","
    if (
        delimiter not in lines[-1]
        and len(lines[-1].split()) > 1
        and all(map(_is_real, lines[-1].split()))
    ):
        lines = [delimiter.join(line.split()) for line in lines]

    def plain(line: str) -> str:
        """The line as Python writes numbers."""
        dotted = line.replace(",", ".") if delimiter == ";" else line
        return re.sub(r"(?<=[\d.])[iI](?=\W|$)", "j", dotted.replace(" ", ""))

    first = plain(lines[0]).split(delimiter)
    if len(first) > MOST_COLUMNS:
        raise InputError(f"{path}: {len(first)} columns, expected at most {MOST_COLUMNS}")
    names = (
        ()
        if all(map(_is_number, first))
        else tuple(cell.strip() for cell in lines[0].split(delimiter))
    )
    rows = [plain(line) for line in lines[bool(names) :]]
    values = np.loadtxt(
        rows, complex if any("j" in row for row in rows) else float, delimiter=delimiter, ndmin=2
    )
    if record.chirps:
        stream, times = chirp_rows(values, record.chirps["samples"], str(path))
        return Table(
            [stream], rate_hz=None if times is None else agreed_rate(path, None, None, times)
        )
    columns = [
        column if np.iscomplexobj(column) and column.imag.any() else column.real
        for column in values.T
    ]
    return Table(columns, names)


def _npy(path: Path, record: Record) -> Table:
    """Read a NumPy array."""
    return Table(_columns(array_of(path, "recording"), path, record))


def _raw(path: Path, record: Record) -> Table:
    """Read numbers of the record's `dtype`, or of the type that the file's ending stands for,
    without any header.
    """
    name = record.dtype or next(iter(RAW[path.suffix.lower()]), None)
    if name is None:
        raise InputError(
            f"{path}: nothing says the type of its numbers, expected dtype in the record: "
            "`lowalt recording inspect` shows which fit"
        )
    dtype = number_type(name)
    size = path.stat().st_size
    if not size or size % dtype.itemsize:
        raise InputError(
            f"{path}: {size} bytes, expected whole numbers of {dtype.itemsize} bytes ({name})"
        )
    return Table([np.fromfile(path, dtype).astype(dtype.newbyteorder("="))])


def _captured(
    path: Path, record: Record, captures: list[dict], count: int, rate_hz: float | None
) -> slice:
    """Samples of the record's capture, or of all captures; they must follow on one another at one
    carrier.

    Raises: InputError for a capture that the file lacks, at another carrier, that begins outside
    the samples, or later or earlier than the samples before it end.
    """
    chosen = captures if record.capture is None else captures[record.capture : record.capture + 1]
    if captures and not chosen:
        raise InputError(f"{path}: capture is {record.capture}, expected less than {len(captures)}")
    for capture in chosen:
        carrier = capture.get("core:frequency", record.carrier_hz)
        if abs(carrier - record.carrier_hz) > SAME_CARRIER * record.carrier_hz:
            raise InputError(
                f"{path}: a capture at {carrier:.6g} Hz, expected the record's carrier_hz "
                f"{record.carrier_hz:.6g} in all captures"
            )
    starts = [int(capture.get("core:sample_start", 0)) for capture in captures]
    first = starts[record.capture or 0] if captures else 0
    if not 0 <= first < count:
        raise InputError(
            f"{path}: the first capture begins at sample {first} of {count}, expected one inside"
        )
    timed = [
        (start, datetime.fromisoformat(capture["core:datetime"]).timestamp())
        for start, capture in zip(starts, captures, strict=True)
        if "core:datetime" in capture
    ]
    for (start, time), (later, next_time) in pairwise(timed):
        gap = next_time - time - (later - start) / (rate_hz or record.rate_hz or math.nan)
        if record.capture is None and abs(gap) > GAP_S:
            raise InputError(
                f"{path}: the capture at sample {later} begins {gap:.6g} s after the samples before"
                f" it end, expected the number of one, 0 to {len(captures) - 1}, as `capture`"
            )
    last = (
        count
        if record.capture is None
        else next((start for start in starts if start > first), count)
    )
    return slice(first, last)


def _byte_count(path: Path, fields: dict, key: str) -> int:
    """A number of bytes that a SigMF recording states, 0 where it does not.

    Raises: InputError for anything but a whole number from 0.
    """
    count = fields.get(key, 0)
    if not isinstance(count, int) or isinstance(count, bool) or count < 0:
        raise InputError(f"{path}: {key} is {count!r}, expected a whole number from 0")
    return count


def _other_bytes(path: Path, metadata: dict) -> bool:
    """Whether a SigMF file holds bytes that are no samples, before its captures or at its end.

    Raises: InputError for a number of bytes that is no whole number from 0.
    """
    captures = metadata.get("captures", [])
    listed = [capture for capture in captures if isinstance(capture, dict)]
    headers = [_byte_count(path, capture, "core:header_bytes") for capture in listed]
    trailing = _byte_count(path, metadata["global"], "core:trailing_bytes")
    return any(headers) or trailing > 0


def _samples_alone(path: Path, signal: Any) -> Any:
    """The SigMF recording without the bytes that its metadata declares to be no samples.

    `core:header_bytes` stand before the samples of a capture, `core:trailing_bytes` after the last
    sample; the library's `read_samples` passes over neither at the right place.
    Raises: InputError where the captures' samples lie outside the file.
    Source: SigMF 1.2, non-conforming datasets.
    """
    import sigmf

    data = bytes_of(signal.data_file, "recording", MOST_RECORDING_BYTES)
    end = len(data) - signal.get_global_field("core:trailing_bytes", 0)
    frame_bytes = signal.get_sample_size() * signal.num_channels
    kept = []
    begin = 0
    skipped = 0
    for capture in signal.get_captures():
        header = capture.get("core:header_bytes", 0)
        start = skipped + frame_bytes * int(capture.get("core:sample_start", 0))
        if not begin <= start <= start + header < end:
            raise InputError(
                f"{path}: {len(data)} bytes, of which {end} are not trailing; a capture would begin"
                f" at byte {start + header}, expected its samples inside the file and in order"
            )
        kept.append(data[begin:start])
        begin = start + header
        skipped += header
    kept.append(data[begin:end])
    metadata = copy.deepcopy(signal._metadata)
    for key in ("core:trailing_bytes", "core:dataset", "core:sha512"):
        metadata["global"].pop(key, None)
    for capture in metadata["captures"]:
        capture.pop("core:header_bytes", None)
    alone = sigmf.SigMFFile(metadata=metadata)
    alone.set_data_file(data_buffer=io.BytesIO(b"".join(kept)))
    return alone


def _sigmf(path: Path, record: Record) -> Table:
    """Read a SigMF recording from its first capture on, or one capture; it may state its rate and
    carrier.
    """
    try:
        import sigmf
    except ImportError as error:
        raise missing_package(error) from error

    metadata = read_object(path.with_suffix(".sigmf-meta"), "metadata of a SigMF recording")
    fields = metadata.get("global")
    if not isinstance(fields, dict):
        raise InputError(f"{path}: its metadata has no block global, expected a SigMF recording")
    dataset = fields.get("core:dataset")
    if dataset is not None and Path(str(dataset)).name != dataset:
        raise InputError(
            f"{path}: core:dataset is {dataset!r}, expected the name of a file beside it"
        )
    if dataset is not None:
        inside(path.parent, dataset, str(path), "core:dataset")
    mixed = _other_bytes(path, metadata)
    try:
        signal = sigmf.sigmffile.fromfile(str(path))
        if mixed and signal.data_file is not None:
            signal = _samples_alone(path, signal)
        values = signal.read_samples()
        rate = signal.get_global_field("core:sample_rate")
        captures = signal.get_captures()
    except (sigmf.error.SigMFError, KeyError, AttributeError, AssertionError) as error:
        raise InputError(f"{path}: not a SigMF recording ({error})") from error
    rate = None if rate is None else float(rate)
    carrier = next(
        (float(capture["core:frequency"]) for capture in captures if "core:frequency" in capture),
        None,
    )
    try:
        kept = _captured(path, record, captures, len(values), rate)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path}: captures that cannot be read ({error}), expected those of SigMF"
        ) from error
    return Table(_columns(values[kept], path, record), (), rate, carrier)


READERS: dict[str, Callable[[Path, Record], Table]] = {
    ".wav": _wav,
    ".mat": _mat,
    ".h5": _mat,
    ".hdf5": _mat,
    ".csv": _csv,
    ".txt": _csv,
    ".npy": _npy,
    ".sigmf-meta": _sigmf,
    ".sigmf-data": _sigmf,
    **dict.fromkeys(RAW, _raw),
}
