"""The catalogue of spectra, and the settings of those that a configuration names.

A spectrum is a module of `lowalt.spectra.kinds` (`lowalt.spectra.interface`). The catalogue's order
is that of the columns of a tile; a tile has a column for each spectrum in the configuration's block
`spectra`.
"""

import functools
import importlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from lowalt.config.command import pick
from lowalt.config.extensions import module_offered, offered
from lowalt.files.errors import InputError
from lowalt.spectra.interface import ZERO_SIGNED, KnowsTimes, OfCells, Spectrum
from lowalt.spectra.settings import windows

LISTED = ("vrp", "trp", "vt")
"""The paper's three, in its order. Any other module comes after them, in alphabetical order."""
_FILES = (Path(__file__).parent / "kinds").glob("*.py")
_FOUND = sorted(path.stem for path in _FILES if path.stem != "__init__")
ADDED: dict[str, str] = offered("spectra")
"""Modules of the spectra that extensions add, by name."""
NAMES = (*LISTED, *(name for name in _FOUND if name not in LISTED), *ADDED)
"""Names of all spectra."""
TIMES = "times"
"""Key of the block `spectra` that is not a spectrum.

It says whether spectra use the instants of received symbols.
"""
INSTANTS = ("even", "known")


def module_name(name: str) -> str:
    """Return the dotted name of a spectrum's module."""
    return ADDED.get(name, f"lowalt.spectra.kinds.{name}")


@functools.cache
def spectrum(name: str) -> Any:
    """Return the module of a spectrum.

    Raises: InputError for a name that belongs to none, or a module that lacks a name of the
    interface.
    """
    if name not in NAMES:
        raise InputError(f"spectra: unknown spectrum {name!r}, expected some of {list(NAMES)}")
    if name in ADDED:
        module = module_offered("spectra", name, ADDED[name])
    else:
        module = importlib.import_module(f"lowalt.spectra.kinds.{name}")
    if not isinstance(module, (Spectrum, OfCells)):
        raise InputError(
            f"{module.__file__}: lacks a name of lowalt.spectra.interface, Spectrum or OfCells"
        )
    return module


def named(block: Iterable[str]) -> tuple[str, ...]:
    """Return the names of a configuration's block `spectra` in the catalogue's order.

    Raises: InputError for an unknown name, or where there is none.
    """
    for name in block:
        if name != TIMES:
            spectrum(name)
    found = tuple(name for name in NAMES if name in set(block))
    if not found:
        raise InputError(f"spectra: none named, expected some of {list(NAMES)}")
    return found


def of_cells(block: Iterable[str]) -> list[str]:
    """Return the names of a configuration's spectra that are computed from all range cells."""
    return [name for name in NAMES if name in set(block) and isinstance(spectrum(name), OfCells)]


def zero_index(name: str) -> int:
    """Return the index (0..255) that stands for the value zero in the images of a spectrum."""
    return ZERO_SIGNED if spectrum(name).SIGNED else 0


MOST_VALUES = 2**26
"""Limit on the values of a spectrum and of its tables for all stations.

Each takes about 16 bytes of memory.
"""


class Spectra(Mapping[str, Any]):
    """The settings of a data set's spectra by name, in the order of the columns of its tiles."""

    def __init__(self, times: str = "even", **settings: Any) -> None:
        """settings: a `Settings` for each spectrum; without any, the paper's three by default.

        times: "even", symbols are taken as evenly spaced; "known", lines are fitted at the received
        symbols' instants.
        Raises: InputError for an unknown name, or for a spectrum that cannot use known instants.
        """
        if times not in INSTANTS:
            raise InputError(f"spectra.times is {times!r}, expected one of {INSTANTS}")
        self.times = times
        given = settings or {name: spectrum(name).DEFAULTS for name in LISTED}
        self._settings = {name: given[name] for name in named(given)}
        blind = [name for name in self._settings if not isinstance(spectrum(name), KnowsTimes)]
        if times == "known" and blind:
            raise InputError(
                f"spectra.times is 'known', but {blind} know no instants, expected even"
            )

    @classmethod
    def from_settings(cls, block: dict) -> "Spectra":
        """Build from the configuration's `spectra` block, such as {vrp: {window, hop, points}, trp:
        ..., vt: ...}.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        found = {}
        for name in named(block):
            kind = spectrum(name).Settings
            try:
                found[name] = kind(*pick(block[name], *(entry.name for entry in fields(kind))))
            except InputError as error:
                raise InputError(f"spectra.{name}: {error}") from None
        return cls(block.get(TIMES, "even"), **found)

    def __getitem__(self, name: str) -> Any:
        """Settings of one spectrum."""
        return self._settings[name]

    def __iter__(self) -> Iterator[str]:
        """Names, in the order of a tile's columns."""
        return iter(self._settings)

    def __len__(self) -> int:
        """Number of spectra."""
        return len(self._settings)

    def check(self, symbols: int, stations: int = 1, subcarriers: int | None = None) -> None:
        """Refuse signals that are too short for a window.

        Spectra of gigabytes, and more range cells than the band has, are refused, too.

        Raises: InputError naming the spectrum whose window is no shorter than the signal, or that
        is too large.
        """
        for name, settings in self.items():
            kind = spectrum(name)
            if isinstance(kind, OfCells):
                if subcarriers is not None and settings.cells > subcarriers:
                    raise InputError(
                        f"spectra.{name}.cells is {settings.cells}, expected at most the "
                        f"{subcarriers} of the band"
                    )
                values = settings.cells * kind.columns(settings, symbols)
            else:
                windows(symbols, settings.window, settings.hop, name)
                values = kind.rows(settings) * (symbols + stations * settings.window)
            if values > MOST_VALUES:
                raise InputError(
                    f"spectrum {name}: {values} values with its tables, expected at most "
                    f"{MOST_VALUES}"
                )
