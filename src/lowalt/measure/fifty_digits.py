"""The echo's truth: cells of one symbol in fifty decimal digits, by sums over array elements and subcarriers.

Neither code nor formulas are shared with the closed form in `lowalt.echo`: the steering vectors and the inverse DFT of
Eqs. 8 to 24 of the paper are summed as geometric sums, one point at a time. Needs mpmath (extra `cost`).
"""

import mpmath
import numpy as np

C = 299_792_458
"""Speed of light (m/s), exact."""


def cells_mp(network, station, points_m, rcs_m2, aim_m, cells, digits=50):
    """The cells listed of one symbol, mpmath complex numbers; arguments as `cell_mp`.

    Each point's steering and subcarrier sums are plain geometric sums over exactly given phases; a run of equal
    steps is summed by Horner's rule.
    """
    with mpmath.workdps(digits):
        mpf, pi = mpmath.mpf, mpmath.pi
        carrier, low = mpf(network.carrier_hz), mpf(station.frequency_hz)
        spacing, count = mpf(network.subcarrier_spacing_hz), network.subcarriers
        normal = mpf(station.normal_rad)

        def look(position):
            """Return range and both direction cosines of a position, seen from the station."""
            d = [mpf(a) - mpf(b) for a, b in zip(position, station.position_m, strict=True)]
            r = mpmath.sqrt(sum(v * v for v in d))
            return r, (-mpmath.sin(normal) * d[0] + mpmath.cos(normal) * d[1]) / r, d[2] / r

        def run(step, length):
            """Return the sum of step^k over k = 0..length - 1 by Horner's rule."""
            total = mpmath.mpc(0)
            for _ in range(length):
                total = total * step + 1
            return total

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
                gain *= run(step_h, array[0]) * run(step_v, array[1])
            gain *= mpmath.expjpi(-4 * low * r / mpf(C))
            for place, cell in enumerate(cells):
                step = mpmath.expjpi(2 * mpf(int(cell)) / count - 4 * spacing * r / mpf(C))
                sums[place] += gain * run(step, count) / count
        scale = mpmath.sqrt(mpf(network.power) / (n_t * n_r))
        return [scale * value for value in sums]
