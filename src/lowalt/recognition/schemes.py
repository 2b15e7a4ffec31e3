"""A scheme: which stations and spectra the network sees, how they are fused, on which backbone.

`config/schemes.csv` contains the rows of the paper's tables, one line per scheme:

    scheme      published name, "ABC:VRP+TRP+VT"; also the key of accuracy.csv
    stations    names of stations of the run's network, joined by "+"; names of one letter may
                stand together, "ABC"
    spectra     spectra joined by "+"
    fusion      attention (the paper's proposal) | mean (its baseline)
    backbone    timm name, or empty for the configuration's own backbone
    protocols   protocols in whose tables the paper has this row, joined by "+"

A table may have these columns too; an empty cell means the configuration's value:

    size, steps pixels per side the network sees; optimiser steps
    share       share of the motion models of each subtype used for training, 0..1 (empty: all)
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from lowalt.config.schema import check_brought
from lowalt.files.atomic import slug
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.spectra.catalogue import NAMES

TABLE = "config/schemes.csv"
"""Default path of the table of schemes."""
SPECTRA = tuple(name.upper() for name in NAMES)
"""Spectra as the table of schemes writes them, in the catalogue's order."""
FUSIONS = ("attention", "mean")
PROTOCOLS = ("seen", "unseen")
COLUMNS = ("scheme", "stations", "spectra", "fusion", "backbone", "protocols")
OPTIONAL = ("size", "steps", "share")


@dataclass(frozen=True)
class Scheme:
    """One row of the table of schemes.

    stations, spectra: indices into the network's stations and SPECTRA; size, steps: 0 where the row
    leaves them to the configuration.
    """

    name: str
    stations: tuple[int, ...]
    spectra: tuple[int, ...]
    fusion: str = "attention"
    backbone: str = ""
    protocols: tuple[str, ...] = PROTOCOLS
    size: int = 0
    steps: int = 0
    share: float = 1.0

    @property
    def record(self) -> dict:
        """The scheme as models and checkpoints keep it."""
        return asdict(self)

    def backbone_of(self, network: dict) -> str:
        """Return the scheme's own backbone, or that of the block `recognition.network`."""
        return self.backbone or network["backbone"]

    def settled(self, settings: dict) -> dict:
        """Return the settings of a training with this row's own size and steps in them."""
        training = dict(settings["training"])
        if self.steps:
            training["steps"] = self.steps
        return {**settings, "size": self.size or settings["size"], "training": training}

    @property
    def slug(self) -> str:
        """File name of the scheme: lower case, every run of other characters a hyphen."""
        return slug(self.name)

    @property
    def columns(self) -> list[int]:
        """Numbers of the scheme's views, station-major, counting all spectra of the catalogue.

        `columns_in` converts them to indices in a data set, which may have fewer spectra.
        """
        result = []
        for station in self.stations:
            result += [len(SPECTRA) * station + spectrum for spectrum in self.spectra]
        return result


def of_record(record: dict) -> Scheme:
    """Return the scheme of a checked record in a trained model."""
    values = dict(record)
    for key, value in record.items():
        if isinstance(value, list):
            values[key] = tuple(value)
    return Scheme(**values)


def with_scheme(settings: dict) -> tuple[Scheme, dict]:
    """Return the scheme that the settings of a training hold as a record, and the other settings.

    The others are as the scheme settles them.

    Raises: InputError where there is no record of a scheme, or a wrong one.
    """
    others = {**settings}
    record = others.pop("scheme", None)
    check_brought("scheme", record, "settings.scheme")
    scheme = of_record(record)
    return scheme, scheme.settled(others)


def columns_in(
    columns: Sequence[int], spectra: Sequence[str], stations: int, where: str
) -> list[int]:
    """Return the indices of views (`Scheme.columns`) among the images of a data set.

    spectra: names of the data set's spectra, in the order of its tiles; stations: how many stations
    it has.
    Raises: InputError naming `where` and the spectrum or the number of stations that is missing.
    """
    pairs = [divmod(column, len(NAMES)) for column in columns]
    needed = 1 + max(station for station, _ in pairs)
    if needed > stations:
        raise InputError(f"{where}: {stations} stations, the scheme needs {needed}")
    lacking = {NAMES[number] for _, number in pairs} - set(spectra)
    if lacking:
        raise InputError(
            f"{where}: spectra {list(spectra)}, the scheme also needs {sorted(lacking)}"
        )
    names = list(spectra)
    return [len(names) * station + names.index(NAMES[number]) for station, number in pairs]


def _indices(
    text: str, listed: list[str], known: tuple[str, ...], kind: str, where: str
) -> tuple[int, ...]:
    """Return the sorted indices of names among the known ones; refuse unknown or repeated ones."""
    if not listed or len(set(listed)) != len(listed) or not set(listed) <= set(known):
        raise InputError(f"{where}: {kind} {text!r}, expected some of {known}, each once")
    return tuple(sorted(known.index(name) for name in listed))


def _number(row: dict, column: str, kind: type, low: float, high: float, where: str) -> float:
    """Return the number in an optional column, its default where the cell is empty."""
    text = row.get(column)
    if not text:
        return 1.0 if column == "share" else 0
    try:
        value = kind(text)
    except ValueError:
        value = -1
    if not low <= value <= high:
        raise InputError(
            f"{where}: {column} {text!r}, expected nothing or a number in {low:g}..{high:g}"
        )
    return value


def _station_names(text: str, known: Sequence[str]) -> list[str]:
    """Split names of stations, "north+south" or "ABC"."""
    names = text.split("+")
    if set(names) <= set(known):
        return names
    return list(text)


def joined(names: Sequence[str]) -> str:
    """Return names of stations as the table of schemes writes them: "ABC", "north+south"."""
    if all(len(name) == 1 for name in names):
        return "".join(names)
    return "+".join(names)


def scheme(row: dict, where: str, stations: Sequence[str]) -> Scheme:
    """Return the scheme of one row of the table for a network of these stations, in its order.

    All values of the row are strings.
    Raises: InputError naming `where`, the column and the value.
    """
    if set(row) - set(OPTIONAL) != set(COLUMNS):
        columns = sorted(map(str, row))
        raise InputError(
            f"{where}: columns {columns}, expected {list(COLUMNS)}, perhaps {list(OPTIONAL)}"
        )
    if row["fusion"] not in FUSIONS:
        raise InputError(f"{where}: fusion {row['fusion']!r}, expected one of {FUSIONS}")
    protocols = tuple(row["protocols"].split("+"))
    _indices(row["protocols"], list(protocols), PROTOCOLS, "protocols", where)
    listed = _station_names(row["stations"], stations)
    return Scheme(
        name=row["scheme"],
        stations=_indices(row["stations"], listed, tuple(stations), "stations", where),
        spectra=_indices(row["spectra"], row["spectra"].split("+"), SPECTRA, "spectra", where),
        fusion=row["fusion"],
        backbone=row["backbone"],
        protocols=protocols,
        size=int(_number(row, "size", int, 8, 1024, where)),
        steps=int(_number(row, "steps", int, 1, 1e9, where)),
        share=float(_number(row, "share", float, 1e-6, 1.0, where)),
    )


def _rows(path: str | Path) -> dict[str, tuple[dict, str]]:
    """Rows of a table, each with its file and line in words, by the scheme's name."""
    rows: dict[str, tuple[dict, str]] = {}
    for number, row in enumerate(read_csv(path, "scheme", what="table of schemes"), start=2):
        name = row["scheme"]
        where = f"{path} line {number}"
        if slug(name) in map(slug, rows):
            raise InputError(f"{where}: scheme {name!r} stands twice")
        rows[name] = row, where
    if not rows:
        raise InputError(f"{path}: no schemes, expected at least one row")
    return rows


def names(path: str | Path) -> list[str]:
    """Return the names of all schemes of a table, in its order.

    Raises: InputError for a name that stands twice.
    """
    return list(_rows(path))


def read(path: str | Path, stations: Sequence[str]) -> dict[str, Scheme]:
    """Return all schemes of a table by name, in its order, for a network of these stations.

    Raises: InputError naming the file, the line and what is wrong, or a name that stands twice.
    """
    return {name: scheme(row, where, stations) for name, (row, where) in _rows(path).items()}


def named(path: str | Path, name: str, stations: Sequence[str]) -> Scheme:
    """Return the scheme called `name` (or with that slug) from a table.

    The table's other rows may name other stations.
    Raises: InputError naming the schemes there are, or what is wrong with this one.
    """
    rows = _rows(path)
    for known, (row, where) in rows.items():
        if name in (known, slug(known)):
            return scheme(row, where, stations)
    raise InputError(f"scheme {name!r}: not in {path}, which has {list(rows)}")
