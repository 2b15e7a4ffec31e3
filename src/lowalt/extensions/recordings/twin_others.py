"""Echoes of what belongs to no class: hands, fans, branches, rain, a turning lid, a falling thing,
lines, nothing.

A network that learned four classes gives one of them to anything that moves. These teach it to
refuse. Each is a few points whose distances change, without the engine; all of them are drawn from
ranges, none from a recording.
"""

from collections.abc import Callable

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.twin import Twin
from lowalt.numerics.portable import rms

NOTHING = "nothing"
"""Kind of which the receiver alone is heard."""
GRAVITY_MPS2 = 9.81


def _loguniform(
    low: float, high: float, rng: np.random.Generator, size: int | None = None
) -> np.ndarray:
    """Draws whose logarithm is uniform."""
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def _hand(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of one or two hands that move to and fro, each a few points on a forearm about an
    elbow.
    """
    hands = []
    for _ in range(rng.integers(1, 3)):
        rate = _loguniform(0.4, 4.0, rng)
        reach = _loguniform(0.03, 0.4, rng)
        harmonic = rng.uniform(0, 0.3)
        phase = rng.uniform(0, 2 * np.pi, 2)
        wave = np.sin(2 * np.pi * rate * times + phase[0])
        wave += harmonic * np.sin(4 * np.pi * rate * times + phase[1])
        along = rng.uniform(0.3, 1.0, 4)
        hands.append(rng.uniform(0, 1, 4)[:, None] + reach * along[:, None] * wave)
    return np.concatenate(hands)


def _fan(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of points on the blades of a slow fan that is seen from the side."""
    blades = int(rng.integers(3, 7))
    turn = 2 * np.pi * _loguniform(1.0, 20.0, rng) * times
    radius = _loguniform(0.05, 0.7, rng) * np.sin(rng.uniform(0.2, np.pi / 2))
    share = np.linspace(0.3, 1.0, 6)
    angles = turn + 2 * np.pi * np.arange(blades)[:, None] / blades
    return (radius * share[:, None, None] * np.cos(angles)).reshape(-1, len(times))


def _branches(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of leaves and branches that sway, each at its own rate."""
    count = int(rng.integers(8, 30))
    rates = _loguniform(0.3, 4.0, rng, count)[:, None]
    sway = (_loguniform(0.05, 1.5, rng) * rng.uniform(0.2, 1, count)[:, None]) / (2 * np.pi * rates)
    return rng.uniform(0, 3, count)[:, None] + sway * np.sin(
        2 * np.pi * rates * times + rng.uniform(0, 6.3, (count, 1))
    )


def _rain(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of drops that fall at one speed, seen at different angles."""
    count = int(rng.integers(20, 60))
    falls = rng.uniform(3.0, 9.0, (count, 1)) * np.cos(rng.uniform(0, np.pi, (count, 1)))
    return rng.uniform(1, 5, (count, 1)) + falls * times


def _lid(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of the edges of a thing that turns about an axis."""
    turn = 2 * np.pi * _loguniform(0.3, 8.0, rng) * times + rng.uniform(
        0, 6.3, (int(rng.integers(2, 6)), 1)
    )
    return _loguniform(0.03, 0.3, rng) * np.cos(turn)


def _falling(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of things that fall past the radar, from rest or later, and stop on the ground."""
    count = int(rng.integers(1, 4))
    started = np.clip(
        times - rng.uniform(-0.5, 0.3, (count, 1)), 0, rng.uniform(0.3, 0.9, (count, 1))
    )
    height = 0.5 * GRAVITY_MPS2 * started**2
    beside = rng.uniform(0.1, 1.5, (count, 1))
    return np.hypot(beside, rng.uniform(-1, 1.5, (count, 1)) - height)


def _lines(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distances of points whose speeds are unrelated, change quickly, or jump."""
    count = int(rng.integers(2, 7))
    speeds = _loguniform(0.3, 17.0, rng, count)[:, None]
    change = rng.uniform(-25, 25, (count, 1)) * rng.integers(0, 2)
    wobble = _loguniform(0.002, 0.1, rng, count)[:, None] * rng.integers(0, 2)
    return (
        speeds * times
        + change * times**2 / 2
        + wobble * np.sin(2 * np.pi * rng.uniform(1, 30, (count, 1)) * times)
    )


def _nothing(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Distance of a point that sets the receiver's level and is then left out."""
    return rng.uniform(1.0, 10.0) * times[None]


KINDS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    "hand": _hand,
    "fan": _fan,
    "branches": _branches,
    "rain": _rain,
    "lid": _lid,
    "falling": _falling,
    "lines": _lines,
    NOTHING: _nothing,
}
"""Distances (points, samples) m at times (samples,) s of everything that belongs to no class."""


def other_echo(kind: str, twin: Twin, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Return the echo (samples,) complex128 of unit power, at the twin's rate, of a kind of
    `KINDS`.

    Points differ in strength by some decibels, and each fades as its angle changes.
    """
    times = np.arange(samples) / twin.rate_hz
    distances = KINDS[kind](times, rng)
    strength = 10 ** (rng.normal(0, 6, (len(distances), 1)) / 20)
    fading = 1 + 0.5 * np.sin(
        2 * np.pi * rng.uniform(0.2, 4, strength.shape) * times
        + rng.uniform(0, 6.3, strength.shape)
    )
    wave_number = 4 * np.pi * twin.carrier_hz / SPEED_OF_LIGHT
    echo = (strength * fading * np.exp(-1j * wave_number * distances)).sum(axis=0)
    return echo / rms(echo)
