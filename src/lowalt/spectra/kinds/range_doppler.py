"""Range-Doppler map: the range cells of a look against radial speed.

It is one Fourier transform over all symbols of the look.

It is computed from the cube (`lowalt.tiles.cubes`), not from a station's signal, which contains
only one cell.
"""

import numpy as np
from scipy import fft
from scipy.signal.windows import hann

from lowalt.config.network import Network, Station
from lowalt.files.errors import InputError
from lowalt.spectra.cube import Cube
from lowalt.spectra.settings import Doppler as Settings

TITLE = "range-Doppler map"
SOURCE = "M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 5.3"
SIGNED = False
ZERO_FIRST = False
DEFAULTS = Settings(33, 512)


def rows(settings: Settings) -> int:
    """Return the number of range cells."""
    return settings.cells


def columns(settings: Settings, symbols: int) -> int:
    """Return the number of speeds.

    Raises: InputError where they are fewer than the symbols of a look.
    """
    if settings.points < symbols:
        raise InputError(
            f"spectra.range_doppler.points is {settings.points}, expected at least the {symbols} "
            "symbols of a look"
        )
    return settings.points


def axes(
    settings: Settings, network: Network, station: Station
) -> tuple[tuple[str, float, float], ...]:
    """Return name, first and last value of the columns.

    Columns are radial speed (m/s), rows range (m).

    Ranges count from the cell that the receiver chose in the middle of the look; speeds are
    positive away from the station, at the effective carrier.
    """
    speeds = network.bin_speeds_mps(settings.points, station)
    reach = settings.cells // 2 * network.cell_m
    of_columns = ("radial speed (m/s)", speeds[0], speeds[-1])
    of_rows = ("range (m from the chosen cell)", -reach, reach)
    return of_columns, of_rows


def definition(cube: Cube, settings: Settings) -> np.ndarray:
    """Return magnitudes (ranges, speeds) of a cube, both ascending.

    The look is weighted with a Hann window of sum one, so a static echo has the same magnitude as
    in a single symbol.
    Raises: InputError where the look has more symbols than there are speeds.
    """
    cells = cube.cells
    chosen = cube.chosen
    count = columns(settings, len(cells))
    middle = chosen[len(chosen) // 2]
    reach = settings.cells // 2
    around = np.arange(middle - reach, middle + reach + 1) % cells.shape[1]
    near = cells[:, around].astype(np.complex128)
    weights = hann(len(cells), sym=False)
    weights /= weights.sum()
    transformed = fft.fft(near * weights[:, None], count, axis=0)
    spectrum = fft.fftshift(transformed, axes=0)
    # A receding echo has a negative frequency, so the most negative frequency is the largest speed.
    turned = spectrum[::-1].T
    return np.sqrt(turned.real**2 + turned.imag**2)
