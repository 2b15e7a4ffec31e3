"""The slow truth beyond Eq. 7: every element, path, subcarrier and time sample summed one by one.

Distances from every element to every point are formed as they are; nothing is expanded,
interpolated or bounded, and no line is shared with `lowalt.scene`.
"""

import numpy as np

C = 299_792_458.0


def one_way(network, station, shape, places, aim_m, f, squint, wavefront):
    """Array factor over distance with its phase, exp(-j 2 pi f r / c) / r summed over elements, for
    points (L, 3).
    """
    origin = np.array(station.position_m)
    normal = station.normal_rad
    across = np.array([-np.sin(normal), np.cos(normal), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    spacing = C / (2 * network.carrier_hz)
    toward = (np.asarray(aim_m) - origin) / np.linalg.norm(np.asarray(aim_m) - origin)
    d = places - origin
    r = np.linalg.norm(d, axis=1)
    seen = f if squint else station.frequency_hz
    total = np.zeros(len(places), complex)
    for i in range(shape[0]):
        for j in range(shape[1]):
            element = spacing * (i * across + j * up)
            weight = np.exp(-2j * np.pi * station.frequency_hz / C * (element @ toward))
            if wavefront:
                own = np.linalg.norm(d - element, axis=1)
                total += weight * np.exp(-2j * np.pi * seen / C * (own - r)) / own
            else:
                total += weight * np.exp(2j * np.pi * seen / C * (d @ element) / r) / r
    return total * np.exp(-2j * np.pi * f / C * r)


def subcarriers(network, station, places, rcs_m2, aim_m, paths=(), squint=False, wavefront=False):
    """Y (N, M) of points at `places` (N, L, 3); rcs_m2: (L,) or (N, L); paths: further ones
    (places, coefficient).
    """
    elements = np.prod(network.transmit) * np.prod(network.receive)
    scale = np.sqrt(network.power / elements) * C / network.carrier_hz / (4 * np.pi) ** 1.5
    f = station.frequency_hz + np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    strength = scale * np.sqrt(np.broadcast_to(rcs_m2, places.shape[:2]))
    result = np.zeros((len(places), network.subcarriers), complex)
    for n in range(len(places)):
        for m in range(network.subcarriers):
            every = [
                (places[n], 1.0),
                *((p[n], np.broadcast_to(c, places.shape[:2])[n]) for p, c in paths),
            ]
            out, back = (
                sum(
                    c * one_way(network, station, shape, p, aim_m, f[m], squint, wavefront)
                    for p, c in every
                )
                for shape in (network.transmit, network.receive)
            )
            result[n, m] = (strength[n] * out * back).sum()
    return result


def moving(network, station, places_at, rcs_m2, aim_m, times_s, sent):
    """Y (N, M) where points move during the symbol: `places_at(t)` (1, L, 3) at every time sample
    by itself.
    """
    count = network.subcarriers
    m = np.arange(count)
    result = np.zeros((len(times_s), count), complex)
    for n, start in enumerate(times_s):
        samples = np.zeros(count, complex)
        for i in range(count):
            t = i / (count * network.subcarrier_spacing_hz)
            y = subcarriers(network, station, places_at(start + t), rcs_m2, aim_m)[0]
            samples[i] = (
                y * sent[n] * np.exp(2j * np.pi * (m - count // 2) * i / count)
            ).sum() / count
        for k in range(count):
            result[n, k] = (
                samples * np.exp(-2j * np.pi * (k - count // 2) * m / count)
            ).sum() / sent[n, k]
    return result
