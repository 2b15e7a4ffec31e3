"""All subcarriers of a sample from the points' amplitudes and ranges, by Chebyshev moments and two matrix products.

Over the few range cells of a target the response is a smooth function of frequency
(`numerics.chebyshev_series.band_tables`), so points are summed into a few moments instead of every subcarrier.
"""

import numpy as np

from lowalt.echo.echo_input import EchoInput
from lowalt.echo.pointwise.reference_range import CELL
from lowalt.echo.pointwise.results import Paths, amplitudes
from lowalt.echo.radar import Radar
from lowalt.machine.jit import VECTOR
from lowalt.numerics.chebyshev_series import band_tables, over_band

ERROR = 1e-15
"""Largest error of the expansion, relative to the sum of the points' amplitudes."""
TOGETHER = 1 << 18
"""Values of points and symbols that are held together."""
WIDEST = 64.0
"""Range cells on either side of the middle over which one expansion holds the whole band; of wider ones the band is
cut into pieces."""


@VECTOR
def _moments(z, u, scale, work, out):
    """Fill out (N, 2, P) with the real and imaginary sums over points of z (N, L) times T_p(scale u), u (N, L).

    work: (6, L).
    """
    x, real, imag = work[3], work[4], work[5]
    for n in range(len(z)):
        older, old, new = work[0], work[1], work[2]
        for i in range(np.uint64(len(x))):
            x[i], real[i], imag[i] = scale * u[n, i], z[n, i].real, z[n, i].imag
            older[i], old[i] = 1.0, x[i]
        for p in range(out.shape[2]):
            a, b = 0.0, 0.0
            for i in range(np.uint64(len(x))):
                a += older[i] * real[i]
                b += older[i] * imag[i]
                new[i] = 2.0 * x[i] * old[i] - older[i]
            out[n, 0, p], out[n, 1, p] = a, b
            older, old, new = old, new, older


def _banded(z: np.ndarray, u: np.ndarray, count: int) -> np.ndarray:
    """Sums (K, M) over points of z exp(-j pi x u), x = (2 m - M + 1) / M; z, u: (K, L), u in cells about 0."""
    # A power of sqrt(2), so that a few tables serve all samples.
    reach = 2.0 ** (np.ceil(2 * np.log2(max(float(abs(u).max()), 1e-3))) / 2)
    width = count if reach <= WIDEST else max(1, int(count * WIDEST / reach))
    result, work = np.empty((len(z), count), np.complex128), np.empty((6, z.shape[1]))
    for first in range(0, count, width):
        size = min(width, count - first)
        middle = (2 * first + size - count) / count
        piece = z if size == count else z * np.exp(-1j * np.pi * middle * u)
        tables = band_tables(1, reach * size / count, size, ERROR)
        moments = np.empty((len(z), 2, len(tables[0]) // 2))
        _moments(piece, u, 1 / reach, work, moments)
        bands = over_band(moments.reshape(len(z), -1), tables)
        result[:, first : first + size].real = bands[:, 0]
        result[:, first : first + size].imag = bands[:, 1]
    return result


def found(
    scene: EchoInput, radar: Radar, refs: np.ndarray, aims: tuple[float, float], paths: Paths
) -> tuple[int, np.ndarray]:
    """Return 0 and all subcarriers (N, M) complex128, known symbol removed (Eq. 24), or the fault of `results.signal`.

    Arguments as `results.signal`. Source: Jacobi-Anger expansion.
    """
    count, points = radar.subcarriers, len(scene.part) or scene.translation.shape[1]
    result = np.zeros((len(refs), count), np.complex128)
    columns = points * max(1, len(paths.delays))
    phases, step = np.exp(-1j * np.pi / count * np.arange(2 * count)), max(1, TOGETHER // columns)
    for first in range(0, len(refs), step):
        here = slice(first, min(first + step, len(refs)))
        z = np.empty((here.stop - first, columns), np.complex128)
        u = np.empty(z.shape)
        fault = amplitudes(scene, radar, refs, aims, paths, first, z, u)
        if fault:
            return fault, result
        # Each path has a middle of its own. Two bands' worth of cells turn every subcarrier by whole circles.
        for path in range(0, columns, points):
            cells = u[:, path : path + points]
            cells -= 2 * count * np.rint((cells - cells[:, :1]) / (2 * count))
            middle = np.rint((cells.min(axis=1) + cells.max(axis=1)) / 2)
            base = (refs[here, CELL] + middle).astype(np.int64) % (2 * count)
            turns = (2 * np.arange(count) - count + 1) * base[:, None] % (2 * count)
            band = _banded(z[:, path : path + points], cells - middle[:, None], count)
            result[here] += band * phases[turns]
    return 0, result
