"""Compiled loops between responses, sent symbols and tones.

Tones stand in the transform's order: the oscillator's subcarrier and those above it first, then those below it.
"""

from lowalt.common.jit import LEAN


@LEAN
def looked_up(numbers, table, out):
    """Fill out (K,) with table[numbers[k] >> 6], numbers (K,) uint8."""
    for k in range(len(out)):
        out[k] = table[numbers[k] >> 6]


@LEAN
def carried(response, data, tones):
    """Fill tones (N, M) with response (N, M) times data (N, M), in the transform's order."""
    half = response.shape[1] // 2
    rest = response.shape[1] - half
    for n in range(len(response)):
        for m in range(rest):
            tones[n, m] = response[n, m + half] * data[n, m + half]
        for m in range(half):
            tones[n, m + rest] = response[n, m] * data[n, m]


@LEAN
def divided(tones, data, response):
    """Fill response (N, M) with tones (N, M) in the transform's order, times the conjugate of data (N, M)."""
    half = tones.shape[1] // 2
    rest = tones.shape[1] - half
    for n in range(len(tones)):
        for m in range(rest):
            response[n, m + half] = tones[n, m] * complex(data[n, m + half].real, -data[n, m + half].imag)
        for m in range(half):
            response[n, m] = tones[n, m + rest] * complex(data[n, m].real, -data[n, m].imag)
