"""Compiled loops over a target's points: where rigid parts carry them, and the ball that holds them.

Coordinates of a symbol's points stand together in memory, (N, 3, L).
"""

import numpy as np

from lowalt.machine.jit import VECTOR


@VECTOR
def carry(rotation, translation, points, part, result):
    """Fill result (N, 3, L) with rotation (N, P, 3, 3) times points (3, L) plus translation (N, P, 3), by part (L,)."""
    # Points of a part stand next to each other.
    first = 0
    while first < len(part):
        p, last = part[first], first + 1
        while last < len(part) and part[last] == p:
            last += 1
        for n in range(len(result)):
            for axis in range(3):
                turn, row, shift = rotation[n, p, axis], result[n, axis], translation[n, p, axis]
                a, b, c = turn[0], turn[1], turn[2]
                for i in range(np.uint64(first), np.uint64(last)):
                    row[i] = a * points[0, i] + b * points[1, i] + c * points[2, i] + shift
        first = last


@VECTOR
def ball(places, middle):
    """Fill middle (N, 3) with the mean of places (N, 3, L) m; return how far the farthest place is from it."""
    farthest = 0.0
    for n in range(len(places)):
        x, y, z = places[n, 0], places[n, 1], places[n, 2]
        for axis in range(3):
            row, total = places[n, axis], 0.0
            for i in range(np.uint64(len(row))):
                total += row[i]
            middle[n, axis] = total / len(row)
        a, b, c = middle[n, 0], middle[n, 1], middle[n, 2]
        for i in range(np.uint64(len(x))):
            farthest = max(farthest, (x[i] - a) ** 2 + (y[i] - b) ** 2 + (z[i] - c) ** 2)
    return np.sqrt(farthest)
