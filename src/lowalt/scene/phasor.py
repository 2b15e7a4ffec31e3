"""Cosine and sine of an angle in turns as polynomials, for loops that become vector instructions."""

import numpy as np

from lowalt.echo.fast.polynomials import smooth
from lowalt.machine.jit import kernel

# cos(2 pi t) and sin(2 pi t) / t as polynomials of t^2 on [-1/2, 1/2], to rounding; written out one by one, all steps
# stay in registers.
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11 = smooth("cosine", 11)[0].tolist()
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9, _S10, _S11 = smooth("sine", 11)[0].tolist()


@kernel(inner=True, forceinline=True, error_model="numpy", _nrt=False, fastmath={"contract"})
def phasor(turns):
    """Cosine and sine of 2 pi turns; the angle's rounding is that of `turns`."""
    t = turns - np.rint(turns)
    z = t * t
    c = (((((_C11 * z + _C10) * z + _C9) * z + _C8) * z + _C7) * z + _C6) * z + _C5
    c = ((((c * z + _C4) * z + _C3) * z + _C2) * z + _C1) * z + _C0
    s = (((((_S11 * z + _S10) * z + _S9) * z + _S8) * z + _S7) * z + _S6) * z + _S5
    s = ((((s * z + _S4) * z + _S3) * z + _S2) * z + _S1) * z + _S0
    return c, s * t
