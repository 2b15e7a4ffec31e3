"""The echo's slow truth: every sum of the paper as printed, and one value at a time in 50 digits.

Angles, Kronecker steering vectors, channel matrices, beamforming and the inverse DFT are all
formed, so that nothing here shares an idea (or a line) with the closed form in `lowalt.echo`. Eq.
numbers are the paper's.
"""

import numpy as np

from lowalt.measure.fifty_digits import cells_mp

C = 299_792_458.0


def angles(position_m, station_m, normal_rad):
    """Range (m), horizontal and pitch angle (rad) of one point seen by a station (Eq. 4)."""
    dx, dy, dz = np.asarray(position_m, float) - np.asarray(station_m, float)
    r = np.sqrt(dx**2 + dy**2 + dz**2)
    flat = np.sqrt(dx**2 + dy**2)
    # Straight above the station the azimuth has no meaning; any value will do, since cos(phi) is
    # zero there.
    turn = (dx + 1j * dy) / flat / np.exp(1j * normal_rad) if flat > 0 else 1.0
    return r, np.pi / 2 - np.angle(turn), np.arcsin(np.clip(dz / r, -1, 1))


def steering(counts, kappa, theta, phi):
    """Steering vector (horizontal x vertical,) of a planar array, spacing c / 2 f0 (Eqs. 8 to 13)."""
    psi = np.cos(phi) * np.cos(theta)
    omega = np.sin(phi)
    horizontal = np.exp(1j * np.pi * kappa * psi * np.arange(counts[0]))
    vertical = np.exp(1j * np.pi * kappa * omega * np.arange(counts[1]))
    return np.kron(horizontal, vertical)


def subcarriers(network, station, positions_m, rcs_m2, aim_m):
    """Received signal y (N, M) of Eqs. 7 and 24 with the known symbol removed."""
    n_symbols, n_points = positions_m.shape[:2]
    kappa = station.frequency_hz / network.carrier_hz
    frequency = (
        station.frequency_hz + np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    )
    n_t = np.prod(network.transmit)
    n_r = np.prod(network.receive)
    _, theta0, phi0 = angles(aim_m, station.position_m, station.normal_rad)
    beam_t = np.sqrt(network.power / n_t) * steering(network.transmit, kappa, theta0, phi0)
    beam_r = np.sqrt(1 / n_r) * steering(network.receive, kappa, theta0, phi0)
    wavelength = C / network.carrier_hz
    result = np.zeros((n_symbols, network.subcarriers), complex)
    for n in range(n_symbols):
        for l in range(n_points):  # noqa: E741
            r, theta, phi = angles(positions_m[n, l], station.position_m, station.normal_rad)
            alpha = wavelength * np.sqrt(rcs_m2[l]) / ((4 * np.pi) ** 1.5 * r**2)
            channel = np.outer(
                steering(network.receive, kappa, theta, phi),
                steering(network.transmit, kappa, theta, phi),
            )
            gain = np.conj(beam_r) @ channel @ np.conj(beam_t)
            result[n] += alpha * gain * np.exp(-2j * np.pi * frequency * 2 * r / C)
    return result


def range_cells(network, station, positions_m, rcs_m2, aim_m):
    """All range cells (N, M): the inverse DFT over subcarriers as a matrix (Eq. 25)."""
    m = np.arange(network.subcarriers)
    # The exponent is reduced in integers, so that large M costs no digits.
    turn = np.outer(m, m) % network.subcarriers / network.subcarriers
    inverse = np.exp(2j * np.pi * turn) / network.subcarriers
    return subcarriers(network, station, positions_m, rcs_m2, aim_m) @ inverse


def echo(network, station, positions_m, rcs_m2, aim_m):
    """Signal (N,) at the strongest cell of every symbol, and that cell (N,); the lowest index wins
    a tie.
    """
    cells = range_cells(network, station, positions_m, rcs_m2, aim_m)
    best = np.argmax(abs(cells), axis=1)
    return cells[np.arange(len(cells)), best], best


def cell_mp(network, station, points_m, rcs_m2, aim_m, cell):
    """One cell of one symbol, a Python complex, from fifty decimal digits of arithmetic.

    points_m: a list of L positions of three numbers (floats or mpmath numbers), taken as exact.
    """
    return complex(cells_mp(network, station, points_m, rcs_m2, aim_m, [cell])[0])
