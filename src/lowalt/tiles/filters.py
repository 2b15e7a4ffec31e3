"""PNG's Paeth filter of rows, compiled.

Source: PNG specification (W3C, third edition), section 9.
"""

import numpy as np
from numba import njit

PAETH = 4


@njit(cache=True)
def apply_paeth(image, out):
    """Filter image (H, W) uint8 into out (H, W + 1) uint8: filter type 4, then pixel minus Paeth predictor."""
    height, width = image.shape
    for r in range(height):
        line = out[r]
        row = image[r]
        line[0] = PAETH
        if r == 0:
            line[1] = row[0]
            for c in range(1, width):
                line[c + 1] = row[c] - row[c - 1]
            continue
        up = image[r - 1]
        line[1] = row[0] - up[0]
        for c in range(1, width):
            a = np.int16(row[c - 1])
            b = np.int16(up[c])
            d = np.int16(up[c - 1])
            to_a = np.int16(abs(b - d))
            to_b = np.int16(abs(a - d))
            to_d = np.int16(abs(np.int16(a + b) - np.int16(d + d)))
            best = a if to_a <= to_b and to_a <= to_d else (b if to_b <= to_d else d)
            line[c + 1] = np.uint8(np.int16(row[c]) - best)
