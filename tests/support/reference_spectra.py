"""Slow truths of the spectra and images, straight from the definitions with plain loops; nothing
from src/.
"""

import cmath
import math

import numpy as np

LIGHT = 299_792_458.0


def stft(signal, window, hop, points):
    """|FFT| of every window by the sum itself; rows from the most negative frequency up."""
    count = math.floor((len(signal) - window) / hop)
    out = np.zeros((points, count))
    for g in range(count):
        for row in range(points):
            p = row - points // 2
            total = 0j
            for n in range(window):
                total += complex(signal[g * hop + n]) * cmath.exp(
                    -2j * math.pi * ((p * n) % points) / points
                )
            out[row, g] = abs(total)
    return out


def velocity_transfer(signal, frequency_hz, interval_s, window, hop, speeds):
    """Eq. 30 to 35 of the paper, one matched filter after the other."""
    count = math.floor((len(signal) - window) / hop)
    out = np.zeros((len(speeds), count))
    for i, speed in enumerate(speeds):
        for g in range(count):
            matches = []
            for length in (window, window + 1):
                total = 0j
                for step in range(length):
                    entry = cmath.exp(
                        -1j * 4 * math.pi * frequency_hz * speed * interval_s * step / LIGHT
                    )
                    total += entry.conjugate() * complex(signal[g * hop + step])
                matches.append(abs(total))
            out[i, g] = (matches[1] / ((window + 1) / window)) ** 2 - matches[0] ** 2
    return out


def resampled_line(values, out):
    """The triangle kernel on one axis, one output value after the other."""
    ratio = len(values) / out
    result = []
    for j in range(out):
        top = bottom = 0.0
        for i, value in enumerate(values):
            weight = max(0.0, 1 - abs(i + 0.5 - (j + 0.5) * ratio) / max(1.0, ratio))
            top += weight * value
            bottom += weight
        result.append(top / bottom)
    return result


def index_image(values, signed, scale, floor_db=40.0, gamma=1.0):
    """Index values of an image of values whose row 0 is the most negative: turned round, scaled,
    rounded.
    """
    values = np.asarray(values)[::-1]
    largest = max(abs(float(value)) for value in values.ravel())
    out = np.zeros(values.shape, int)
    for place, value in np.ndenumerate(values):
        x = abs(float(value)) / largest if largest > 0 else 0.0
        if scale == "linear":
            y = x
        elif scale == "power":
            y = x**gamma
        else:
            y = max(0.0, 1 + 20 * math.log10(x) / floor_db) if x > 0 else 0.0
        if signed:
            step = math.floor(127 * y + 0.5)
            out[place] = 128 - step if value < 0 else 128 + step
        else:
            out[place] = math.floor(255 * y + 0.5)
    return out
