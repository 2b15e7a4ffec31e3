"""PNG's row filters, compiled: the Paeth filter forwards, all five backwards.

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


@njit(cache=True)
def undo(rows, image):
    """Unfilter rows (H, W + 1) uint8 into image (H, W) uint8; return the first unknown filter's row or -1."""
    height, width = image.shape
    zeros = np.zeros(width, np.uint8)
    for r in range(height):
        kind = rows[r, 0]
        line = rows[r, 1:]
        row = image[r]
        up = image[r - 1] if r > 0 else zeros
        if kind == 0:
            row[:] = line
        elif kind == 1:
            left = np.uint8(0)
            for c in range(width):
                left = np.uint8(left + line[c])
                row[c] = left
        elif kind == 2:
            for c in range(width):
                row[c] = line[c] + up[c]
        elif kind == 3:
            left = np.uint8(0)
            for c in range(width):
                left = np.uint8(line[c] + ((np.int32(left) + np.int32(up[c])) >> 1))
                row[c] = left
        elif kind == PAETH:
            _undo_paeth(line, up, row)
        else:
            return r
    return -1


@njit(cache=True)
def _undo_paeth(line, up, row):
    """One row: the difference plus what is nearest to left + up - corner, the first of them winning."""
    left = np.int32(0)
    corner = np.int32(0)
    for c in range(row.size):
        above = np.int32(up[c])
        to_left = abs(above - corner)
        to_above = abs(left - corner)
        to_corner = abs(above - corner + left - corner)
        best = above if to_above <= to_corner else corner
        best = left if to_left <= min(to_above, to_corner) else best
        left = (best + np.int32(line[c])) & np.int32(255)
        row[c] = left
        corner = above
