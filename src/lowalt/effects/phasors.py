"""Unit phasors of many angles, compiled: cosine and sine as polynomials of the angle's rest to the nearest turn."""

import math

import numpy as np

from lowalt.common.jit import kernel
from lowalt.effects.waves import COSINE, DEGREE, SINE, WAVE

LOOPS = kernel(error_model="numpy", fastmath={"contract"})
TURN = 2 * math.pi
TURN_REST = 2.4492935982947064e-16
"""2 pi less its double, so that rests of whole turns keep their digits."""
BLOCK = 256


@LOOPS
def phasors(angle, out):
    """Fill out (K,) complex128 with exp(j angle), angle (K,) rad."""
    cosine, sine = WAVE[COSINE], WAVE[SINE]
    turn, square, c, s = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, len(angle), BLOCK):
        size = min(BLOCK, len(angle) - first)
        for i in range(size):
            whole = np.rint(angle[first + i] * (1.0 / TURN))
            turn[i] = ((angle[first + i] - whole * TURN) - whole * TURN_REST) * (1.0 / TURN)
            square[i] = turn[i] * turn[i]
            c[i], s[i] = cosine[DEGREE], sine[DEGREE]
        for k in range(DEGREE - 1, -1, -1):
            for i in range(size):
                c[i] = c[i] * square[i] + cosine[k]
                s[i] = s[i] * square[i] + sine[k]
        for i in range(size):
            out[first + i] = complex(c[i], s[i] * turn[i])
