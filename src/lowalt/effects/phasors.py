"""Unit phasors of many angles, compiled: cosine and sine as polynomials of the angle's rest to the nearest turn."""

import math

import numpy as np

from lowalt.common.jit import kernel
from lowalt.effects.waves import COSINE, SINE, WAVE

LOOPS = kernel(error_model="numpy", _nrt=False, fastmath={"contract"})
INSIDE = kernel(inner=True, forceinline=True, error_model="numpy", _nrt=False, fastmath={"contract"})
TURN = 2 * math.pi
TURN_REST = 2.4492935982947064e-16
"""2 pi less its double, so that rests of whole turns keep their digits."""
# Written out one by one, all steps of a polynomial stay in registers.
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11 = WAVE[COSINE].tolist()
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9, _S10, _S11 = WAVE[SINE].tolist()


@INSIDE
def phasor(angle):
    """Cosine and sine of an angle (rad), at most some thousand turns."""
    whole = np.rint(angle * (1.0 / TURN))
    turn = ((angle - whole * TURN) - whole * TURN_REST) * (1.0 / TURN)
    z = turn * turn
    c = (((((_C11 * z + _C10) * z + _C9) * z + _C8) * z + _C7) * z + _C6) * z + _C5
    c = ((((c * z + _C4) * z + _C3) * z + _C2) * z + _C1) * z + _C0
    s = (((((_S11 * z + _S10) * z + _S9) * z + _S8) * z + _S7) * z + _S6) * z + _S5
    s = ((((s * z + _S4) * z + _S3) * z + _S2) * z + _S1) * z + _S0
    return c, s * turn


SMALL = 0.375
"""Largest angle (rad) of `small_phasor`."""
# 1 / k!, whose series leave out less than 2e-17 of cosine and sine up to SMALL.
_F2, _F3, _F4, _F5, _F6, _F7, _F8, _F9, _F10, _F11, _F12, _F13 = (1.0 / math.factorial(k) for k in range(2, 14))


@INSIDE
def small_phasor(angle):
    """Cosine and sine of an angle (rad) of at most SMALL to either side of zero, in less than half of the time."""
    z = angle * angle
    c = 1.0 - z * (_F2 - z * (_F4 - z * (_F6 - z * (_F8 - z * (_F10 - z * _F12)))))
    s = 1.0 - z * (_F3 - z * (_F5 - z * (_F7 - z * (_F9 - z * (_F11 - z * _F13)))))
    return c, s * angle


@LOOPS
def phasors(angle, out):
    """Fill out (K,) complex128 with exp(j angle), angle (K,) rad."""
    for i in range(np.uint64(len(angle))):
        c, s = phasor(angle[i])
        out[i] = complex(c, s)
