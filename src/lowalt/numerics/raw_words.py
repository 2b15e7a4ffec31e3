"""The raw words of PCG64 in compiled code: those of `numpy.random.PCG64.random_raw` in half the time.

NumPy works out one word after another, and each waits for the one before. Here LANES consecutive states stand side by
side and all step LANES words ahead at a time, so the loop becomes vector instructions. Only whole numbers are computed,
so the words are the same on every processor.
Source: M. E. O'Neill, PCG: a family of simple fast space-efficient statistically good algorithms for random number
generation, HMC-CS-2014-0905 (128-bit congruential generator, output XSL-RR); jumps: F. B. Brown, Random number
generation with arbitrary strides, Trans. Am. Nucl. Soc. 71, 1994.
"""

from functools import cache

import numpy as np

from lowalt.machine.jit import LEAN

LANES = 32
FEWEST = 8192
"""Fewest words for which compiled code takes less time than NumPy's."""
_MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
_ALL, _WORD = (1 << 128) - 1, (1 << 64) - 1
_LOW, _HALF, _TOP = np.uint64(0xFFFFFFFF), np.uint64(32), np.uint64(58)
_WIDTH, _MOST = np.uint64(64), np.uint64(63)
_CARRY, _NONE = np.uint64(1), np.uint64(0)


@LEAN
def _fill(state, factor, step, out):
    """Fill out (K,) uint64 with the words of the states (2, LANES) uint64 and of those that follow.

    K is a multiple of LANES. The upper halves of the states stand first, and so in factor (2,) and step (2,), uint64: a
    state times factor plus step, modulo 2^128, is the state LANES words later. state is overwritten.
    """
    high, low, factor_high, factor_low = state[0], state[1], factor[0], factor[1]
    a0, a1, step_high, step_low = factor_low & _LOW, factor_low >> _HALF, step[0], step[1]
    for first in range(0, len(out), LANES):
        some = out[first : first + LANES]
        for j in range(np.uint64(LANES)):
            h, g = high[j], low[j]
            mixed, turn = h ^ g, h >> _TOP
            some[j] = (mixed >> turn) | (mixed << ((_WIDTH - turn) & _MOST))
            # The product of the lower halves in parts of 32 bits, whose products fit into 64.
            l0, l1 = g & _LOW, g >> _HALF
            p00, p01, p10 = l0 * a0, l0 * a1, l1 * a0
            middle = (p00 >> _HALF) + (p01 & _LOW) + (p10 & _LOW)
            upper = l1 * a1 + (p01 >> _HALF) + (p10 >> _HALF) + (middle >> _HALF) + g * factor_high + h * factor_low
            product = (middle << _HALF) | (p00 & _LOW)
            low[j] = product + step_low
            high[j] = upper + step_high + (_CARRY if low[j] < product else _NONE)


@cache
def _jumps() -> list[tuple[int, int]]:
    """Factor and share of the increment that lead to each of the next LANES states."""
    jumps, factor, share = [], 1, 0
    for _ in range(LANES):
        factor, share = factor * _MULTIPLIER & _ALL, (share * _MULTIPLIER + 1) & _ALL
        jumps.append((factor, share))
    return jumps


def _halves(numbers: list[int]) -> np.ndarray:
    """The upper and lower halves (2, K) uint64 of 128-bit numbers."""
    return np.array([[number >> 64 for number in numbers], [number & _WORD for number in numbers]], np.uint64)


def words(bits: np.random.BitGenerator, count: int) -> np.ndarray:
    """Return the next `count` raw words (count,) uint64 of a generator, those of `bits.random_raw(count)`."""
    if count < FEWEST or type(bits) is not np.random.PCG64:
        return bits.random_raw(count)
    return _words(bits, count)


def _words(bits: np.random.PCG64, count: int) -> np.ndarray:
    """The next `count` raw words by compiled code."""
    state = bits.state
    now, increment = state["state"]["state"], state["state"]["inc"]
    states = [(now * factor + increment * share) & _ALL for factor, share in _jumps()]
    factor, share = _jumps()[-1]
    step = _halves([increment * share & _ALL])[:, 0]
    result = np.empty(-(-count // LANES) * LANES, np.uint64)
    _fill(_halves(states), _halves([factor])[:, 0].copy(), step.copy(), result)
    bits.advance(count)
    if state["has_uint32"]:
        # `advance` drops the half of a word that NumPy keeps for its own 32-bit draws.
        bits.state = state | {"state": bits.state["state"]}
    return result[:count]
