"""The settings of the paper's spectra: windows, hops, FFT points and the grid of matched speeds."""

from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError

MOST_SPEEDS = 65_536
"""Most matched speeds, as many as a transform may have points."""


def whole(where: str, value: object, least: int) -> int:
    """Return an integer of at least `least`. Raises: InputError naming `where`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{where} is {value!r}, expected an integer >= {least}")
    return int(value)


def _power_of_two(where: str, value: object, least: int) -> int:
    """Return a power of two of at least `least`. Raises: InputError naming `where`."""
    number = whole(where, value, least)
    # The sliding transform doubles its window and its points level by level.
    if number & (number - 1):
        raise InputError(f"{where} is {number}, expected a power of two")
    return number


@dataclass(frozen=True)
class Fourier:
    """One short-time Fourier transform.

    window, hop: in symbols; points: of the zero-padded FFT.
    """

    window: int
    hop: int
    points: int

    def __post_init__(self) -> None:
        _power_of_two("window", self.window, 2)
        whole("hop", self.hop, 1)
        _power_of_two("points", self.points, self.window)


@dataclass(frozen=True)
class Transfer:
    """The velocity-transfer spectrum.

    window, hop: in symbols; the grid of matched speeds is in m/s.
    """

    window: int
    hop: int
    speed_min_mps: float
    speed_max_mps: float
    speed_step_mps: float

    def __post_init__(self) -> None:
        whole("window", self.window, 1)
        whole("hop", self.hop, 1)
        values = (self.speed_min_mps, self.speed_max_mps, self.speed_step_mps)
        names = ("speed_min_mps", "speed_max_mps", "speed_step_mps")
        for name, value in zip(names, values, strict=True):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not is_number or not np.isfinite(value):
                raise InputError(f"{name} is {value!r}, expected a finite speed in m/s")
        if self.speed_step_mps <= 0 or self.speed_max_mps <= self.speed_min_mps:
            raise InputError(f"speeds {values}, expected min < max and a positive step")
        if (self.speed_max_mps - self.speed_min_mps) / self.speed_step_mps >= MOST_SPEEDS:
            raise InputError(
                f"speeds {values}, min, max and step, expected a step that makes at most "
                f"{MOST_SPEEDS} of them"
            )

    @property
    def speeds_mps(self) -> np.ndarray:
        """Matched speeds v_min : step : v_max (m/s), (speeds,), ascending; positive recedes."""
        steps = (self.speed_max_mps - self.speed_min_mps) / self.speed_step_mps
        # A whole number of steps may come out a little too small.
        whole_steps = int(np.floor(steps + 1e-9))
        last = self.speed_min_mps + whole_steps * self.speed_step_mps
        return np.linspace(self.speed_min_mps, last, whole_steps + 1)


@dataclass(frozen=True)
class RangeCells:
    """A range profile over slow time.

    window, hop: in symbols, a column averages the powers of a window; cells: of a profile, odd.
    """

    window: int
    hop: int
    cells: int

    def __post_init__(self) -> None:
        whole("window", self.window, 1)
        whole("hop", self.hop, 1)
        if whole("cells", self.cells, 3) % 2 == 0:
            raise InputError(
                f"cells is {self.cells}, expected an odd number: the chosen one is the middle"
            )


@dataclass(frozen=True)
class Doppler:
    """A range-Doppler map.

    cells: of range, odd; points: of the zero-padded FFT over the symbols of a look.
    """

    cells: int
    points: int

    def __post_init__(self) -> None:
        whole("points", self.points, 2)
        if whole("cells", self.cells, 3) % 2 == 0:
            raise InputError(
                f"cells is {self.cells}, expected an odd number: the chosen one is the middle"
            )


def windows(symbols: int, window: int, hop: int, name: str) -> int:
    """Return the number of windows, floor((N - L) / hop).

    It is one fewer than the usual count, as published.

    Raises: InputError naming the spectrum where the signal is no longer than the window.
    Source: paper, section IV-B (G), and IV-E (G_transfer).
    """
    count = (symbols - window) // hop
    if count < 1:
        raise InputError(
            f"spectrum {name}: a signal of {symbols} symbols with a window of {window} and a hop "
            f"of {hop} has no window, expected at least {window + hop} symbols"
        )
    return count
