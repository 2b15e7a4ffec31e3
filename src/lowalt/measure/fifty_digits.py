"""The echo's truth: cells of one symbol in fifty decimal digits, by plain sums.

The sums run over array elements and subcarriers.
Neither code nor formulas are shared with the closed form in `lowalt.echo`: the steering vectors and
the inverse DFT of Eqs. 8 to 24 of the paper are summed as geometric sums, one point at a time.
Needs mpmath (extra `cost`).
"""

import mpmath
import numpy as np

C = 299_792_458
"""Speed of light (m/s), exact."""
DIGITS = 50
"""Decimal digits of all numbers here."""


def _run(step, length: int):
    """Return the sum of step^k over k = 0..length - 1, doubled bit by bit of the length."""
    total = mpmath.mpc(0)
    power = mpmath.mpc(1)
    for bit in f"{length:b}":
        total = total * (1 + power)
        power = power * power
        if bit == "1":
            total = total * step + 1
            power = power * step
    return total


def positions_mp(motion, n: int) -> list[list]:
    """Return the positions (L, 3) of symbol n of a rigid motion as mpmath numbers.

    Nothing is rounded in float64.
    """
    positions = []
    with mpmath.workdps(DIGITS):
        for point, part in zip(motion.points.tolist(), motion.part, strict=True):
            rotation = motion.rotation[n, part].tolist()
            translation = motion.translation[n, part].tolist()
            turned = [mpmath.fdot(row, point) for row in rotation]
            positions.append([turned[axis] + translation[axis] for axis in range(3)])
    return positions


def cells_mp(network, station, points_m, rcs_m2, aim_m, cells):
    """The listed cells of one symbol as mpmath complex numbers.

    points_m: L positions of three numbers, taken as exact.
    Each point's steering and subcarrier sums are plain geometric sums over exactly given phases.
    """
    with mpmath.workdps(DIGITS):
        mpf = mpmath.mpf
        pi = mpmath.pi
        carrier = mpf(network.carrier_hz)
        low = mpf(station.frequency_hz)
        spacing = mpf(network.subcarrier_spacing_hz)
        count = network.subcarriers
        normal = mpf(station.normal_rad)
        ahead = mpmath.cos(normal)
        across = mpmath.sin(normal)

        def look(position):
            """Return range and both direction cosines of a position, seen from the station."""
            d = [mpf(a) - mpf(b) for a, b in zip(position, station.position_m, strict=True)]
            r = mpmath.sqrt(sum(v * v for v in d))
            return r, (-across * d[0] + ahead * d[1]) / r, d[2] / r

        _, psi0, omega0 = look(aim_m)
        n_t, n_r = (int(np.prod(a)) for a in (network.transmit, network.receive))
        sums = [mpmath.mpc(0) for _ in cells]
        for position, rcs in zip(points_m, rcs_m2, strict=True):
            r, psi, omega = look(position)
            alpha = mpf(C) / carrier * mpmath.sqrt(mpf(rcs)) / ((4 * pi) ** mpf(1.5) * r * r)
            step_h = mpmath.expjpi(low / carrier * (psi - psi0))
            step_v = mpmath.expjpi(low / carrier * (omega - omega0))
            gain = mpmath.mpc(alpha)
            for array in (network.transmit, network.receive):
                gain *= _run(step_h, array[0]) * _run(step_v, array[1])
            gain *= mpmath.expjpi(-4 * low * r / mpf(C))
            for index, cell in enumerate(cells):
                step = mpmath.expjpi(2 * mpf(int(cell)) / count - 4 * spacing * r / mpf(C))
                sums[index] += gain * _run(step, count) / count
        scale = mpmath.sqrt(mpf(network.power) / (n_t * n_r))
        return [scale * value for value in sums]
