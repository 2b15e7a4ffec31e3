"""Other methods for the same signal, only for comparison.

Each takes (network, station, motion, rcs_m2, aim_m) like `echo_signal` and computes everything,
including geometry and
gains: the paper's closed form in NumPy, in single or double precision, and a non-uniform FFT per
symbol.
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.echo_input import Rigid


def positions(motion: Rigid) -> np.ndarray:
    """All positions (N, L, 3) in metres, in the precision of the motion's arrays."""
    turned = np.einsum("nlij,lj->nli", motion.rotation[:, motion.part], motion.points)
    return np.ascontiguousarray(turned + motion.translation[:, motion.part])


def _ratio(x: np.ndarray, count: int) -> np.ndarray:
    """Return sin(count x) / sin(x) with its limit."""
    s = np.sin(x)
    small = abs(s) < 1e-12
    return np.where(
        small, x.dtype.type(count), np.sin(count * x) / np.where(small, x.dtype.type(1), s)
    )


def amplitudes(
    network: Network, station: Station, motion: Rigid, rcs_m2, aim_m
) -> tuple[np.ndarray, np.ndarray]:
    """Ranges (N, L) m and complex amplitudes (N, L) with array gains, as precise as the motion."""
    position, horizontal, aim, rcs = (
        np.asarray(value, motion.points.dtype)
        for value in (station.position_m, station.horizontal, aim_m, rcs_m2)
    )
    d = positions(motion) - position
    r = np.sqrt(np.einsum("nli,nli->nl", d, d))
    aim = (aim - position) / np.linalg.norm(aim - position)
    kappa = station.frequency_hz / network.carrier_hz
    psi = d @ horizontal / r - aim @ horizontal
    omega = d[..., 2] / r - aim[2]
    gain = np.ones_like(r)
    phase = np.zeros_like(r)
    for counts in (network.transmit, network.receive):
        for count, x in zip(counts, (psi, omega), strict=True):
            u = np.pi * kappa / 2 * x
            gain *= _ratio(u, count)
            phase += (count - 1) * u
    elements = np.prod(network.transmit) * np.prod(network.receive)
    scale = (
        float(np.sqrt(network.power / elements))
        * SPEED_OF_LIGHT
        / network.carrier_hz
        / (4 * np.pi) ** 1.5
    )
    return r, scale * np.sqrt(rcs) / r**2 * gain * np.exp(1j * phase)


def closed(
    network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, dtype: type = np.float64
) -> np.ndarray:
    """Signal (N,): the closed form in plain NumPy over the cells around the target.

    The strongest cell is not certified.
    dtype: precision of every step, from the positions on.
    """
    arrays = {
        name: getattr(motion, name).astype(dtype) for name in ("rotation", "translation", "points")
    }
    r, amplitude = amplitudes(network, station, motion._replace(**arrays), rcs_m2, aim_m)
    count = network.subcarriers
    rho = r / network.cell_m
    low = np.floor(rho.min(axis=1)).astype(int)
    high = np.ceil(rho.max(axis=1)).astype(int)
    centre = station.frequency_hz + (count - 1) / 2 * network.subcarrier_spacing_hz
    wave = amplitude * np.exp(-4j * np.pi / SPEED_OF_LIGHT * centre * r)
    best = np.zeros(len(r), wave.dtype)
    for j in range(int((high - low).max()) + 1):
        cell = (low + j).astype(dtype)
        value = (wave * _ratio(np.pi / count * (cell[:, None] - rho), count)).sum(axis=1) / count
        value = value * np.exp(1j * np.pi * (count - 1) / count * cell)
        best = np.where(abs(value) > abs(best), value, best)
    return best


def finufft_cells(
    network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, tolerance: float = 1e-9
) -> np.ndarray:
    """Range cells (N, M): one non-uniform FFT a symbol from points to subcarriers, with one plan.

    The transform is of type 1, by FINUFFT.
    """
    from finufft import Plan

    r, amplitude = amplitudes(network, station, motion, rcs_m2, aim_m)
    count = network.subcarriers
    # Modes run from -count // 2, so the middle subcarrier's phase goes into the strengths.
    middle = station.frequency_hz + (count // 2) * network.subcarrier_spacing_hz
    strength = amplitude * np.exp(-4j * np.pi / SPEED_OF_LIGHT * middle * r)
    angle = -4 * np.pi / SPEED_OF_LIGHT * network.subcarrier_spacing_hz * r
    angle -= 2 * np.pi * np.rint(angle / (2 * np.pi))
    plan = Plan(1, (count,), eps=tolerance, isign=1, nthreads=1)
    result = np.empty((len(r), count), np.complex128)
    for n in range(len(r)):
        plan.setpts(angle[n])
        result[n] = np.fft.ifft(plan.execute(strength[n]))
    return result


def finufft(
    network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, tolerance: float = 1e-9
) -> np.ndarray:
    """Signal (N,): the strongest of `finufft_cells`."""
    cells = finufft_cells(network, station, motion, rcs_m2, aim_m, tolerance)
    return np.take_along_axis(cells, abs(cells).argmax(axis=1)[:, None], axis=1)[:, 0]
