"""The interface of a spectrum: the names that a module of `lowalt.spectra.kinds` defines.

Axes: rows are Doppler frequencies or speeds, columns are windows in time. A window starts at every
symbol in the fast path (`fill`); the images take those that the hop asks for. `isinstance(module,
Spectrum)` checks a module.
"""

from typing import Any, Protocol, runtime_checkable

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.spectra.cube import Cube

ZERO_SIGNED = 128
"""Index that stands for the value zero in the images of a spectrum whose values have a sign."""


@runtime_checkable
class Spectrum(Protocol):
    """One time-frequency image of a station's signal."""

    TITLE: str
    """Name in figures."""
    SOURCE: str
    """Equation or reference."""
    SIGNED: bool
    """Whether values have a sign: zero then is index 128 of the image, else index 0."""
    ZERO_FIRST: bool
    """Whether the rows of `fill` begin at frequency zero (FFT order) or at the most negative value.
    """
    Settings: type
    """Frozen dataclass of the settings, the keys of the configuration.

    It has `window` and `hop`, both in symbols.
    """
    DEFAULTS: Any
    """A `Settings`."""

    def rows(self, settings: Any) -> int:
        """Return the number of rows."""
        ...

    def speeds(self, settings: Any, network: Network, station: Station) -> tuple[float, float]:
        """Return the speeds (m/s, positive recedes) of the first and the last row of `definition`.

        They are those of an echo at the effective carrier, as on every speed axis.
        """
        ...

    def definition(
        self,
        signals: np.ndarray,
        settings: Any,
        name: str,
        frequency_hz: float,
        symbol_interval_s: float,
    ) -> np.ndarray:
        """Return the spectrum in float64 by its definition, (..., symbols) -> (..., rows, windows).

        Rows ascend.

        frequency_hz: f_k of the station; symbol_interval_s: T_r; name: how errors call the
        spectrum.
        """
        ...

    def tables(
        self, settings: Any, frequency_hz: float, symbol_interval_s: float
    ) -> tuple[np.ndarray, ...]:
        """Return the float32 arrays that `fill` needs for all signals of a station."""
        ...

    def fill(
        self, re: np.ndarray, im: np.ndarray, settings: Any, tables: tuple, out: np.ndarray
    ) -> None:
        """Fill out (rows, starts) float32 with the windows of one signal (symbols,).

        They start at symbols 0 .. starts - 1.
        """
        ...


@runtime_checkable
class KnowsTimes(Protocol):
    """A spectrum that can use the instants at which symbols were received; needed with `times:
    known`.
    """

    def fill_known(
        self,
        signal: np.ndarray,
        times: np.ndarray,
        settings: Any,
        frequency_hz: float,
        symbol_interval_s: float,
        out: np.ndarray,
    ) -> None:
        """Fill out as `fill` for a signal (N,), zero where no symbol was received.

        times: (N,) in symbol intervals.
        """
        ...


@runtime_checkable
class OfCells(Protocol):
    """An image that is made of all range cells, a `Cube`, instead of the chosen ones' signal."""

    TITLE: str
    SOURCE: str
    SIGNED: bool
    ZERO_FIRST: bool
    Settings: type
    DEFAULTS: Any

    def rows(self, settings: Any) -> int:
        """Return the number of rows."""
        ...

    def columns(self, settings: Any, symbols: int) -> int:
        """Return the number of columns for a look of so many symbols."""
        ...

    def axes(
        self, settings: Any, network: Network, station: Station
    ) -> tuple[tuple[str, float, float], ...]:
        """Return name with unit, first and last value of the columns and of the rows."""
        ...

    def definition(self, cube: Cube, settings: Any) -> np.ndarray:
        """Return the image of a cube in float64, (rows, columns)."""
        ...
