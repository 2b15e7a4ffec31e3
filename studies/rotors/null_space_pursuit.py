"""Null space pursuit: a signal is parted into a component that an operator of its own annihilates, and the rest.

The operator is (T u)[n] = u[n+1] - p[n] u[n] with a smooth complex course p, so its null space holds one component
whose amplitude and frequency change slowly: the echo of a body. Operator, component, weight and leakage are estimated
in turn. The component minimises |T (s - r)|^2 + weight (|r|^2 + leakage |s - r|^2) over the rest r.
Source: Peng and Hwang, Null Space Pursuit, IEEE Trans. Signal Process. 58, 2010, as its formulas are known to us; the
text was not at hand. They use operators of the second order for real signals; a complex signal needs the first order.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

SMOOTH_CYCLES = 6.4
"""Changes of the operator slower than this many cycles per look are free; faster ones cost."""

START_CYCLES = 2.0
"""Half width of the line that the first round takes, in cycles per look. Pursuit widens it round by round: where rotors
outshine the body and many rounds are taken, it swallows the rotors, so few are taken."""


class Parted(NamedTuple):
    """Component (N,) and rest (N,) of a signal, course p (N-1,) of the operator, leakage, weight and rounds taken."""

    component: np.ndarray
    rest: np.ndarray
    course: np.ndarray
    leakage: float
    weight: float
    rounds: int


def second_difference_bands(symbols: int) -> np.ndarray:
    """Return the lower bands (3, symbols) of D2' D2, D2 being the second differences of `symbols` values."""
    bands = np.zeros((3, symbols))
    for step, weights in enumerate(((1, 4, 1), (-2, -2), (1,))):
        for first, weight in enumerate(weights):
            bands[step, first : first + symbols - 2] += weight
    return bands


def smoothing(symbols: int) -> float:
    """Return the weight of second differences that halves a wave of SMOOTH_CYCLES cycles in `symbols` values."""
    return (symbols / (2 * np.pi * SMOOTH_CYCLES)) ** 4


def course_of(component: np.ndarray) -> np.ndarray:
    """Return the course p (N-1,) complex whose operator best annihilates a component (N,) complex."""
    power = np.abs(component[:-1]) ** 2
    level = max(float(power.mean()), 1e-300)
    bands = smoothing(len(power)) * second_difference_bands(len(power))
    bands[0] += power / level + 1e-9
    sides = component[1:] * component[:-1].conj() / level
    return solveh_banded(bands, sides.real, lower=True) + 1j * solveh_banded(bands, sides.imag, lower=True)


def _applied(course: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return T' T of values (N,), T being the operator of a course (N-1,) and T' its conjugate transpose."""
    inner = values[1:] - course * values[:-1]
    result = np.zeros(len(values), dtype=np.complex128)
    result[1:] += inner
    result[:-1] -= course.conj() * inner
    return result


def _solver(course: np.ndarray, shift: float):
    """Return the function that solves (T' T + shift) x = b for b (N,)."""
    bands = np.zeros((2, len(course) + 1), dtype=np.complex128)
    bands[0] = shift
    bands[0, 1:] += 1
    bands[0, :-1] += np.abs(course) ** 2
    # The element below the diagonal in column n, that of row n + 1.
    bands[1, :-1] = -course
    return lambda values: solveh_banded(bands, values, lower=True)


def pursue(signal: np.ndarray, start_hz: float, interval_s: float, rounds: int = 30, least: float = 1e-2) -> Parted:
    """Return the component of a signal (N,) complex that begins at the line `start_hz`, and the rest.

    interval_s: T_r. The rounds end where the rest changes by less than `least` of the signal.
    """
    signal = np.asarray(signal, dtype=np.complex128)
    size = float(np.linalg.norm(signal))
    course = np.full(len(signal) - 1, np.exp(2j * np.pi * start_hz * interval_s))
    rest, leakage = np.zeros_like(signal), 1.0
    weight = (2 * np.pi * START_CYCLES / len(signal)) ** 2
    for taken in range(1, rounds + 1):
        solve = _solver(course, (1 + leakage) * weight)
        once = solve(signal)
        weight = float(np.vdot(signal, once).real / max(np.vdot(once, once).real, 1e-300)) / (1 + leakage)
        solve = _solver(course, (1 + leakage) * weight)
        before, rest = rest, solve(_applied(course, signal) + weight * leakage * signal)
        part = signal - rest
        leakage = max(float(np.vdot(part, signal).real / max(np.vdot(part, part).real, 1e-300)) - 1, 0.0)
        if taken == rounds or np.linalg.norm(rest - before) < least * size:
            break
        course = course_of(part)
    component = (1 + leakage) * (signal - rest)
    return Parted(component, signal - component, course, leakage, weight, taken)
