"""Other methods for the same signal, for comparison: none of them is used to make data.

Each takes (network, station, motion, rcs_m2, aim_m) like `echo_signal` and does the same work, geometry and gains
included: the direct sum over subcarriers, the same sum factored for matrix products, one FINUFFT a symbol, and the
closed form in plain numpy. `judge` is the slow truth: plain sums whose phases start in extended precision.
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.scene import Rigid


def positions(motion: Rigid) -> np.ndarray:
    """All positions (N, L, 3) in metres."""
    turned = np.einsum("nlij,lj->nli", motion.rotation[:, motion.part], motion.points)
    return np.ascontiguousarray(turned + motion.translation[:, motion.part])


def _ratio(x: np.ndarray, count: int) -> np.ndarray:
    """Return sin(count x) / sin(x) with its limit, written apart from the echo engine that it judges."""
    s = np.sin(x)
    small = abs(s) < 1e-12
    return np.where(small, count, np.sin(count * x) / np.where(small, 1.0, s))


def amplitudes(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m) -> tuple[np.ndarray, np.ndarray]:
    """Ranges (N, L) in m and complex amplitudes (N, L), array gains included, in vectorised float64."""
    d = positions(motion) - np.array(station.position_m)
    r = np.sqrt(np.einsum("nli,nli->nl", d, d))
    aim = np.asarray(aim_m) - np.array(station.position_m)
    aim = aim / np.sqrt(aim @ aim)
    kappa = station.frequency_hz / network.carrier_hz
    psi, omega = d @ station.horizontal / r - aim @ station.horizontal, d[..., 2] / r - aim[2]
    gain = np.ones_like(r)
    phase = np.zeros_like(r)
    for counts in (network.transmit, network.receive):
        for count, x in zip(counts, (psi, omega), strict=True):
            u = np.pi * kappa / 2 * x
            gain *= _ratio(u, count)
            phase += (count - 1) * u
    elements = np.prod(network.transmit) * np.prod(network.receive)
    scale = np.sqrt(network.power / elements) * SPEED_OF_LIGHT / network.carrier_hz / (4 * np.pi) ** 1.5
    return r, scale * np.sqrt(rcs_m2) / r**2 * gain * np.exp(1j * phase)


def _strongest(subcarriers: np.ndarray) -> complex:
    """Value of the strongest range cell of one symbol's subcarriers (M,)."""
    cells = np.fft.ifft(subcarriers)
    return cells[abs(cells).argmax()]


def direct(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m) -> np.ndarray:
    """Signal (N,): every subcarrier's exponential of every point, a matrix product a symbol, an inverse FFT."""
    r, amplitude = amplitudes(network, station, motion, rcs_m2, aim_m)
    frequency = station.frequency_hz + np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    wave = -4j * np.pi / SPEED_OF_LIGHT * frequency
    return np.array([_strongest(np.exp(wave[:, None] * r[n]) @ amplitude[n]) for n in range(len(r))])


def factored(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m) -> np.ndarray:
    """Signal (N,): as `direct`, subcarrier m = 16 a + b split into two short tables and one matrix product."""
    r, amplitude = amplitudes(network, station, motion, rcs_m2, aim_m)
    amplitude = amplitude * np.exp(-4j * np.pi / SPEED_OF_LIGHT * station.frequency_hz * r)
    step = -4j * np.pi / SPEED_OF_LIGHT * network.subcarrier_spacing_hz
    fine, coarse = np.arange(16), 16 * np.arange(-(-network.subcarriers // 16))
    result = []
    for n in range(len(r)):
        one = np.exp(step * coarse[:, None] * r[n]) * amplitude[n]
        two = np.exp(step * fine[:, None] * r[n])
        result.append(_strongest((one @ two.T).ravel()[: network.subcarriers]))
    return np.array(result)


def finufft(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, tolerance: float = 1e-9) -> np.ndarray:
    """Signal (N,): one non-uniform FFT (type 1, FINUFFT) a symbol from points to subcarriers, one plan for all."""
    from finufft import Plan

    r, amplitude = amplitudes(network, station, motion, rcs_m2, aim_m)
    count = network.subcarriers
    # Modes run from -count // 2, so the middle subcarrier's phase goes into the strengths.
    middle = station.frequency_hz + (count // 2) * network.subcarrier_spacing_hz
    strength = amplitude * np.exp(-4j * np.pi / SPEED_OF_LIGHT * middle * r)
    angle = -4 * np.pi / SPEED_OF_LIGHT * network.subcarrier_spacing_hz * r
    angle -= 2 * np.pi * np.rint(angle / (2 * np.pi))
    plan = Plan(1, (count,), eps=tolerance, isign=1, nthreads=1)
    result = np.empty(len(r), np.complex128)
    for n in range(len(r)):
        plan.setpts(angle[n])
        result[n] = _strongest(plan.execute(strength[n]))
    return result


def closed(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m) -> np.ndarray:
    """Signal (N,): the closed form in plain numpy over the cells around the target (arg max not certified)."""
    r, amplitude = amplitudes(network, station, motion, rcs_m2, aim_m)
    count = network.subcarriers
    rho = r / network.cell_m
    low, high = np.floor(rho.min(axis=1)).astype(int), np.ceil(rho.max(axis=1)).astype(int)
    centre = station.frequency_hz + (count - 1) / 2 * network.subcarrier_spacing_hz
    wave = amplitude * np.exp(-4j * np.pi / SPEED_OF_LIGHT * centre * r)
    best = np.zeros(len(r), np.complex128)
    for j in range(int((high - low).max()) + 1):
        cell = low + j
        value = (wave * _ratio(np.pi / count * (cell[:, None] - rho), count)).sum(axis=1) / count
        value = value * np.exp(1j * np.pi * (count - 1) / count * cell)
        best = np.where(abs(value) > abs(best), value, best)
    return best


def judge(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, n: int) -> np.ndarray:
    """All cells (M,) of symbol n by plain sums over array elements and subcarriers, ranges in extended precision."""
    wide = np.longdouble
    place = np.array(station.position_m, wide)
    turned = (motion.rotation[n, motion.part].astype(wide) * motion.points[:, None, :].astype(wide)).sum(axis=2)
    offset = (motion.translation[n, motion.part].astype(wide) - place) + turned
    kappa = wide(station.frequency_hz) / wide(network.carrier_hz)
    sine, cosine = np.sin(wide(station.normal_rad)), np.cos(wide(station.normal_rad))

    def look(d):
        """Return range and both direction cosines of vectors d (..., 3) from the station."""
        r = np.sqrt((d * d).sum(axis=-1))
        return r, (cosine * d[..., 1] - sine * d[..., 0]) / r, d[..., 2] / r

    r, psi, omega = look(offset)
    _, psi0, omega0 = look(np.asarray(aim_m, wide) - place)
    gain = np.ones(len(r), complex)
    for counts in (network.transmit, network.receive):
        for number, cosines in zip(counts, (psi - psi0, omega - omega0), strict=True):
            step = (kappa * cosines / 2).astype(float)
            gain *= np.exp(2j * np.pi * np.outer(np.arange(number), step)).sum(axis=0)
    light = wide(299792458)
    start, step = 2 * wide(station.frequency_hz) * r / light, 2 * wide(network.subcarrier_spacing_hz) * r / light
    start, step = (start - np.rint(start)).astype(float), (step - np.rint(step)).astype(float)
    amplitude = np.sqrt(rcs_m2) / ((4 * np.pi) ** 1.5 * r.astype(float) ** 2) * SPEED_OF_LIGHT / network.carrier_hz
    wave = amplitude * gain * np.exp(-2j * np.pi * start)
    y = np.exp(-2j * np.pi * np.outer(np.arange(network.subcarriers), step)) @ wave
    elements = np.prod(network.transmit) * np.prod(network.receive)
    return np.sqrt(network.power / elements) * np.fft.ifft(y)
