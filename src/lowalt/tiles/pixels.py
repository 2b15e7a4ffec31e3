"""From the values of an image to its index values, by the tables of `lowalt.tiles.scale`."""

import numpy as np

from lowalt.machine.jit import PLAIN
from lowalt.spectra.interface import ZERO_SIGNED


@PLAIN
def _peak(values):
    """The largest |value| of an image, as an array of one float32."""
    bits = values.view(np.int32)
    top = np.int32(0)
    # Non-negative floats order like their bits, which keeps the search free of branches.
    for j in range(bits.shape[0]):
        row = bits[j]
        for c in range(row.size):
            top = max(top, row[c] & np.int32(0x7FFFFFFF))
    peak = np.empty(1, np.int32)
    peak[0] = top
    return peak.view(np.float32)


@PLAIN
def index_image(values, signed, lowest, shift, base, cut, out):
    """Fill out (S, S) uint8 with the index values of one image (S, S) float32.

    signed: whether values have both signs; the others: a `lowalt.tiles.scale.Lookup`, cut as the
    bits of its floats.
    """
    size = values.shape[1]
    largest = _peak(values)[0]
    if largest == 0:
        out[:] = ZERO_SIGNED if signed else 0
        return
    x = np.empty(size, np.float32)
    bits = x.view(np.int32)
    keys = np.empty(size, np.uint32)
    steps = np.empty(size, np.int32)
    for j in range(values.shape[0]):
        line = values[j]
        row = out[j]
        # Short loops over a row, which the compiler turns into vectors one by one.
        for c in range(size):
            x[c] = np.abs(line[c]) / largest
        for c in range(size):
            keys[c] = max(bits[c] - lowest, np.int32(0)) >> shift
        for c in range(size):
            steps[c] = base[keys[c]] + np.int32(bits[c] >= cut[keys[c]])
        if signed:
            for c in range(size):
                row[c] = ZERO_SIGNED - steps[c] if line[c] < 0 else ZERO_SIGNED + steps[c]
        else:
            for c in range(size):
                row[c] = steps[c]
