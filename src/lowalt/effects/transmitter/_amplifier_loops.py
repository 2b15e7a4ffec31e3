"""The compiled loops of an amplifier: samples that it compresses, and whole symbols of 256 subcarriers."""

import math

import numpy as np

from lowalt.common.jit import INNER, LEAN
from lowalt.effects.transform_loops import transformed


@INNER
def _gain(power, smoothness):
    """The gain at a power over that of saturation: (1 + power^p)^(-1/(2p))."""
    return (1.0 + power**smoothness) ** (-0.5 / smoothness)


@INNER
def compressed(re, im, over_square, smoothness):
    """Divide s = re + j im (K,) by (1 + (|s|^2 over_square)^p)^(1/(2p)); at p = 2, roots cost a tenth of powers."""
    if smoothness == 2.0:
        for i in range(np.uint64(len(re))):
            power = (re[i] * re[i] + im[i] * im[i]) * over_square
            gain = 1.0 / math.sqrt(math.sqrt(1.0 + power * power))
            re[i], im[i] = re[i] * gain, im[i] * gain
        return
    for i in range(len(re)):
        gain = _gain((re[i] * re[i] + im[i] * im[i]) * over_square, smoothness)
        re[i], im[i] = re[i] * gain, im[i] * gain


@LEAN
def compress(samples, over_square, smoothness, work):
    """Compress samples (K,) in place as `compressed` does; work: (2, any number)."""
    for first in range(0, len(samples), work.shape[1]):
        some = samples[first : first + work.shape[1]]
        re, im = work[0, : len(some)], work[1, : len(some)]
        for i in range(np.uint64(len(some))):
            re[i], im[i] = some[i].real, some[i].imag
        compressed(re, im, over_square, smoothness)
        for i in range(np.uint64(len(some))):
            some[i] = complex(re[i], im[i])


@LEAN
def symbols(sent, over_square, smoothness, later, table, work, result):
    """Fill result (N, 256) with the subcarriers on the air of symbols of the data sent (N, 256).

    later: (R, 2, 256) cosine and sine of the phases, in the transform's order, by which each subcarrier turns in r of R
    shares of a sample; so R transforms give samples R times as dense; table: `transform_loops.turns`; work: (8, 256).
    """
    re, im, out_re, out_im, sum_re, sum_im = work[0], work[1], work[2], work[3], work[4], work[5]
    own_re, own_im, count = work[6], work[7], np.uint64(256)
    half, scale = np.uint64(128), 1.0 / (len(later) * result.shape[1])
    for n in range(len(sent)):
        above, below, to_above, to_below = sent[n, 128:], sent[n, :128], result[n, 128:], result[n, :128]
        for m in range(half):
            own_re[m], own_im[m] = above[m].real, above[m].imag
        for m in range(half):
            own_re[m + half], own_im[m + half] = below[m].real, below[m].imag
        for m in range(count):
            sum_re[m], sum_im[m] = 0.0, 0.0
        for r in range(len(later)):
            c, s = later[r, 0], later[r, 1]
            for m in range(count):
                re[m], im[m] = own_re[m] * c[m] - own_im[m] * s[m], own_re[m] * s[m] + own_im[m] * c[m]
            transformed(im, re, out_im, out_re, table)
            compressed(out_re, out_im, over_square, smoothness)
            transformed(out_re, out_im, re, im, table)
            for m in range(count):
                sum_re[m] += re[m] * c[m] + im[m] * s[m]
                sum_im[m] += im[m] * c[m] - re[m] * s[m]
        for m in range(half):
            to_above[m] = complex(sum_re[m] * scale, sum_im[m] * scale)
        for m in range(half):
            to_below[m] = complex(sum_re[m + half] * scale, sum_im[m + half] * scale)
