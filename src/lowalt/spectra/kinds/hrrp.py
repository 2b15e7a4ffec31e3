"""HRRP: the range profile over slow time, range cells around the chosen one by symbols.

It is computed from the cube (`lowalt.tiles.cubes`), not from a station's signal, which contains
only one cell.
"""

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.spectra.cube import Cube
from lowalt.spectra.settings import RangeCells as Settings
from lowalt.spectra.settings import windows

TITLE = "range profile (HRRP)"
SOURCE = "AirGuard, arXiv 2603.13112; paper, Eq. 25"
SIGNED = False
ZERO_FIRST = False
DEFAULTS = Settings(1, 1, 33)


def rows(settings: Settings) -> int:
    """Return the number of range cells."""
    return settings.cells


def columns(settings: Settings, symbols: int) -> int:
    """Return the number of symbols at which a window is computed.

    Raises: InputError where a look is too short.
    """
    return (windows(symbols, settings.window, settings.hop, "hrrp") - 1) * settings.hop + 1


def axes(
    settings: Settings, network: Network, station: Station
) -> tuple[tuple[str, float, float], ...]:
    """Return name, first and last value of the columns.

    Columns are time (s), rows range from the chosen cell (m).
    """
    reach = settings.cells // 2 * network.cell_m
    last = (network.symbols - settings.window) * network.symbol_interval_s
    return ("time (s)", 0.0, last), ("range (m from the chosen cell)", -reach, reach)


def definition(cube: Cube, settings: Settings) -> np.ndarray:
    """Return root mean square magnitudes (ranges, symbols) of a cube, range ascending.

    The chosen cell is the middle at each symbol, and a window begins at every symbol. Raises:
    InputError where the look is no longer than the window.
    """
    cells = cube.cells
    chosen = cube.chosen
    steps = np.arange(-(settings.cells // 2), settings.cells // 2 + 1)
    symbol = np.arange(len(cells))[:, None]
    near = cells[symbol, (chosen[:, None] + steps) % cells.shape[1]].astype(np.complex128)
    power = near.real**2 + near.imag**2
    count = columns(settings, len(cells))
    summed = sum(power[step : step + count] for step in range(settings.window))
    return np.sqrt(summed / settings.window).T
