"""The record of a recording: a short YAML file with the facts that the samples do not hold.

file         path of the samples, relative to the record (.wav, .mat, .csv, .npy, .sigmf-meta, .sigmf-data, or numbers
             without a header: .iq, .cfile, .bin)
carrier_hz   carrier of the radar (Hz)
rate_hz      sampling rate (Hz); may be left out where the file says it itself (WAV, SigMF, a column of times)
channel      "complex" (in-phase and quadrature) or "real" (one mixer output)
columns      the channel's columns: names (CSV) or numbers from 0; two for complex (I, then Q), one for real.
             May be left out where the file holds just one complex array, or one or two columns
layout       "iqiq" (I and Q in turn) or "iiqq" (all I, then all Q) where one real column holds both
dtype        type of the numbers (.iq and .bin; complex64 in a .cfile): one of DTYPES, little-endian
variable     name of the array (MAT only), `rec.iq` for a field of a struct; may be left out where there is only one
times        name of the column of sample times in seconds (CSV only)
trust        "record" where rate_hz is right and the file's own rate is wrong, else left out
label        one of the four categories, or left out where nobody knows
moves        "towards" or "away" where the target's direction is known, else left out
source       who recorded it
licence      under which terms
"""

import math
from dataclasses import dataclass
from pathlib import Path

from lowalt.config.classes import CATEGORIES
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

CHANNELS = ("complex", "real")
MOVES = ("towards", "away")
LAYOUTS = ("iqiq", "iiqq")
DTYPES = (
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64", "complex64", "complex128",
)  # fmt: skip
REQUIRED = ("file", "carrier_hz", "channel", "source", "licence")
OPTIONAL = ("rate_hz", "columns", "variable", "times", "label", "moves", "layout", "dtype", "trust")


@dataclass(frozen=True)
class Record:
    """One recording; fields as in the module's docstring, `file` with its folder, None where left out."""

    file: Path
    carrier_hz: float
    channel: str
    source: str
    licence: str
    rate_hz: float | None = None
    columns: tuple[int | str, ...] | None = None
    variable: str | None = None
    times: str | None = None
    label: str | None = None
    moves: str | None = None
    layout: str | None = None
    dtype: str | None = None
    trust: str | None = None
    rates_hz: tuple[float, ...] | None = None
    """Possible rates (Hz) where the files of a set have different ones; the file has one of them."""

    @property
    def name(self) -> str:
        """The recording's name: its file's, without the suffix."""
        return self.file.stem


def _positive(where: str, key: str, value: object) -> float:
    """Return the value of a key in hertz; refuse one that is no positive number."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value) and value > 0
    if not good:
        raise InputError(f"{where}: {key} is {value!r}, expected a positive number of hertz")
    return float(value)


def _one_of(where: str, key: str, value: object, known: tuple[str, ...]) -> None:
    """Refuse a value that is not among the known ones."""
    if value not in known:
        raise InputError(f"{where}: {key} is {value!r}, expected one of {known}")


def record(block: dict, folder: Path, where: str) -> Record:
    """Return the record in a mapping; its file is relative to `folder`.

    Raises: InputError naming `where`, the key, its value and what was expected.
    """
    missing = [key for key in REQUIRED if key not in block]
    unknown = [key for key in block if key not in (*REQUIRED, *OPTIONAL)]
    if missing or unknown:
        raise InputError(f"{where}: missing keys {missing}, unknown keys {unknown}, expected {REQUIRED} and perhaps "
                         f"some of {OPTIONAL}")  # fmt: skip
    for key in ("file", "source", "licence", "variable", "times"):
        if key in block and not isinstance(block[key], str):
            raise InputError(f"{where}: {key} is {block[key]!r}, expected text")
    _one_of(where, "channel", block["channel"], CHANNELS)
    known_values = {"label": CATEGORIES, "moves": MOVES, "layout": LAYOUTS, "dtype": DTYPES, "trust": ("record",)}
    for key, known in known_values.items():
        if block.get(key) is not None:
            _one_of(where, key, block[key], known)
    columns = block.get("columns")
    if columns is not None:
        count = 2 if block["channel"] == "complex" else 1
        names = isinstance(columns, list) and all(
            isinstance(column, (int, str)) and not isinstance(column, bool) for column in columns
        )
        if not names or len(set(columns)) != len(columns) or len(columns) not in (1, count):
            raise InputError(f"{where}: columns is {columns!r}, expected a list of {count} different names or numbers")
    if block["channel"] == "real" and block.get("moves") is not None:
        raise InputError(f"{where}: moves is {block['moves']!r}, but a real channel has no sign of Doppler to check")
    if block["channel"] == "real" and block.get("layout") is not None:
        raise InputError(f"{where}: layout is {block['layout']!r}, expected channel 'complex' with it")
    rate = block.get("rate_hz")
    if rate is None and block.get("trust") is not None:
        raise InputError(f"{where}: trust is 'record', but rate_hz is missing, expected a positive number of hertz")
    return Record(
        file=folder / block["file"],
        carrier_hz=_positive(where, "carrier_hz", block["carrier_hz"]),
        channel=block["channel"],
        source=block["source"],
        licence=block["licence"],
        rate_hz=None if rate is None else _positive(where, "rate_hz", rate),
        columns=None if columns is None else tuple(columns),
        variable=block.get("variable"),
        times=block.get("times"),
        label=block.get("label"),
        moves=block.get("moves"),
        layout=block.get("layout"),
        dtype=block.get("dtype"),
        trust=block.get("trust"),
    )


def read_record(path: str | Path) -> Record:
    """Return the record in a YAML file.

    Raises: InputError naming the file, the key, its value and what was expected.
    """
    path = Path(path)
    return record(load_yaml(path, "record of a recording"), path.parent, str(path))
