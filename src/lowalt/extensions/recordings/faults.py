"""Faults that make a recording unusable; each has a name and is found before anything is computed.

Swapped channels cannot be recognised in general. Exchanging I and Q gives the conjugate signal,
which could as well be a recording of a target that moves the other way; and a hovering or
reciprocating target has Doppler of both signs. Two cases are recognised: both channels hold the
same signal (there is no quadrature), or the record says whether the target moves towards the radar
or away and the energy lies on the other side.
"""

from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError

RATE_SHARE = 1e-3
"""Largest relative difference between the rate of the record and that of the file."""
CLIPPED_RUN = 3
"""Least number of equal samples in a row at the extreme value that count as a clipped peak."""
ROUND_STEPS = 2.5
"""Steps of the quantiser by which a smooth wave's top may fall to the next sample."""
ROUND_RUN = 8
"""Times that a smooth wave may stay longer at its highest level than at the next."""
LOST_RUN = 16
"""Least number of exact zeros in a row that count as lost samples."""
LOST_STEPS = 16
"""Least ratio of a signal's median to its smallest value, both without zeros, at which zeros in a
row are no rest.
"""
MIRRORED = 0.9
"""Least correlation of a spectrum with its mirror about a quarter of the rate that shows I and Q in
turn.
"""
SAME_SHARE = 0.999
"""Least squared correlation of I and Q that makes them the same signal."""
NEARLY_SAME = 0.8
"""Least squared correlation at which two columns of sound are no I and Q."""
SLOW_SHARE = 1e-3
SIDE_RATIO = 4.0
"""How many times stronger the wrong side of the Doppler axis must be to call the channels swapped
(6 dB).
"""


def agreed_rate(
    path: Path, stated_hz: float | None, header_hz: float | None, times_s: np.ndarray | None
) -> float:
    """Return the sampling rate (Hz) on which record, file header and sample times (s) agree.

    Raises: InputError where nothing says the rate, two sources differ, or the times are not evenly
    spaced.
    """
    rates: dict[str, float | None] = {"record": stated_hz, "file": header_hz}
    if times_s is not None:
        steps = np.diff(times_s)
        if len(steps) < 1 or not np.isfinite(steps).all() or steps.min() <= 0:
            raise InputError(
                f"{path}: the sample times do not increase, expected evenly spaced seconds"
            )
        middle = (times_s[-1] - times_s[0]) / len(steps)
        if abs(steps - middle).max() > 0.5 * middle:
            place = int(abs(steps - middle).argmax())
            raise InputError(
                f"{path}: the sample times jump by {steps[place]:.4g} s at sample {place + 1},"
                f" expected {middle:.4g} s everywhere"
            )
        rates["times"] = float(1 / middle)
    known = {name: rate for name, rate in rates.items() if rate is not None}
    if not known:
        raise InputError(f"{path}: nothing says the sampling rate, expected rate_hz in the record")
    low = min(known.values())
    high = max(known.values())
    if high > low * (1 + RATE_SHARE):
        words = ", ".join(f"{name} {rate:.6g} Hz" for name, rate in known.items())
        raise InputError(f"{path}: wrong rate, {words}, expected one rate")
    # Prefer the record's rate, then the header's: sample times are often rounded.
    return float(next(iter(known.values())))


def _cut(values: np.ndarray) -> np.ndarray:
    """Which samples of one channel lie in cut tops: runs of equal samples at the largest or the
    smallest value.

    The rounded top of a smooth wave is flat too, but a rounded parabola stays at its highest level
    at most five times as long as at the next level on either side, one step below; samples in
    between may miss a level. A cut wave leaves its top as steeply as it reached it, so it falls by
    more steps or stays far longer than one step lasts.
    """
    starts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0)
    levels = values[starts]
    lengths = np.diff(starts, append=len(values))
    smallest_step = float(np.diff(np.unique(values)).min())
    rounding_step = float(np.abs(values).max()) * float(np.finfo(np.float32).eps)
    step = max(smallest_step, rounding_step)
    top = np.flatnonzero(
        (lengths >= CLIPPED_RUN) & ((levels == values.max()) | (levels == values.min()))
    )
    cut = np.zeros(len(levels), bool)
    for side in (-1, 1):
        inside = (top + side >= 0) & (top + side < len(levels))
        beside = np.where(inside, top + side, top)
        cut[top] |= abs(levels[beside] - levels[top]) > ROUND_STEPS * step
        cut[top] |= lengths[top] > ROUND_RUN * lengths[beside]
    return np.repeat(cut, lengths)


def clipped(values: np.ndarray) -> np.ndarray:
    """Return which samples (samples,) of a recording, real or complex, the receiver has clipped,
    (samples,) bool.
    """
    return _cut(values.real) | _cut(values.imag) if np.iscomplexobj(values) else _cut(values)


def lost(values: np.ndarray) -> np.ndarray:
    """Return which samples (samples,) of a recording, real or complex, are lost packets, (samples,)
    bool: exact zeros in a row, for longer than the signal itself stays at one value, between
    samples far from zero."""
    zero = values == 0
    if not zero.any() or zero.all():
        return np.zeros(len(values), bool)
    starts = np.flatnonzero(np.diff(zero, prepend=~zero[0]))
    lengths = np.diff(starts, append=len(values))
    runs = zero[starts]
    size = np.abs(values)
    step = size[~zero].min()
    gaps = runs & (lengths >= LOST_RUN)
    # A quiet channel of few steps rests at zero as well.
    if np.median(size[~zero]) < LOST_STEPS * step:
        return np.zeros(len(values), bool)
    return np.repeat(gaps, lengths)


def _mirrored(values: np.ndarray) -> float:
    """Correlation of a real channel's power spectrum with itself mirrored about a quarter of the
    rate.

    In-phase and quadrature in turn are two slow sequences: with w the frequency in radians a
    number, the spectrum is E(2w) + exp(-jw) O(2w), and its value at pi - w is the conjugate of
    E(2w) - exp(-jw) O(2w). For a Doppler far below the rate both have one magnitude, since O is E
    turned by a quarter. One channel sampled as it is has nothing there.
    """
    count = len(values) // 4 * 4
    if count < 64:
        return 0.0
    power = np.abs(np.fft.rfft((values[:count] - values[:count].mean()) * np.hanning(count))) ** 2
    edge = max(2, count // 2000)
    quarter = count // 4
    low = power[edge : quarter - max(2, count // 100)]
    high = power[::-1][edge : edge + len(low)]
    spreads = low.std() * high.std()
    return float(np.mean((low - low.mean()) * (high - high.mean())) / spreads) if spreads else 0.0


def _sides(values: np.ndarray) -> tuple[float, float]:
    """Energy at positive and at negative Doppler of a complex signal, without its mean."""
    power = np.abs(np.fft.fft(values - values.mean())) ** 2
    half = len(power) // 2
    return float(power[1:half].sum()), float(power[len(power) - half + 1 :].sum())


def check(path: Path, values: np.ndarray, moves: str | None = None) -> None:
    """Refuse samples (samples,) that no spectrum should be made of.

    moves: "towards", "away" or None. Positive Doppler approaches, as everywhere in this project.
    Raises: InputError naming the file and the fault: not finite, silent, channels swapped.
    """
    if not np.isfinite(values).all():
        place = int(np.flatnonzero(~np.isfinite(values))[0])
        raise InputError(f"{path}: sample {place} is {values[place]}, expected finite numbers")
    channels = (
        {"channel": values} if not np.iscomplexobj(values) else {"I": values.real, "Q": values.imag}
    )
    for name, channel in channels.items():
        if np.ptp(channel) == 0:
            raise InputError(
                f"{path}: silent, all {len(channel)} samples of {name} are {channel[0]}"
            )
    if not np.iscomplexobj(values) and _mirrored(values) > MIRRORED:
        raise InputError(
            f"{path}: the spectrum is mirrored about a quarter of the rate, as where I and Q stand"
            " in turn; expected channel 'complex' with layout 'iqiq', or one real channel"
        )
    if np.iscomplexobj(values):
        shifted = values - values.mean()
        alike = np.mean(shifted.real * shifted.imag) ** 2 / (
            np.mean(shifted.real**2) * np.mean(shifted.imag**2)
        )
        if alike > SAME_SHARE:
            raise InputError(
                f"{path}: I and Q hold the same signal (squared correlation {alike:.6f}), expected "
                "in-phase and quadrature, or channel 'real'"
            )
        refuse_swapped(path, values, moves)


def refuse_alike(path: Path, values: np.ndarray) -> None:
    """Refuse two columns of sound as I and Q where one nearly repeats the other, as a trigger and a
    beat note do.

    What is slower than `SLOW_SHARE` of the rate does not count: a target that moves by a small part
    of a wavelength draws nearly a line, too.
    values: (samples,) complex. Raises: InputError naming the file.
    """
    fast = slice(2 + round(SLOW_SHARE * len(values)), None)
    shown = (values - values.mean()) * np.hanning(len(values))
    first, second = (np.fft.rfft(part)[fast] for part in (shown.real, shown.imag))
    powers = np.sum(np.abs(first) ** 2) * np.sum(np.abs(second) ** 2)
    alike = np.sum((first * second.conj()).real) ** 2 / max(powers, 1e-300)
    if alike > NEARLY_SAME:
        raise InputError(
            f"{path}: two columns that nearly repeat each other (squared correlation {alike:.3f}),"
            " as in-phase and quadrature of a moving target do not, expected channel 'real' with"
            " one of the `columns`, or trust 'record'"
        )


def refuse_swapped(path: Path, values: np.ndarray, moves: str | None) -> None:
    """Refuse a complex signal (samples,) whose energy lies on the other side of the Doppler axis
    than `moves` says.

    Raises: InputError naming the file.
    """
    if moves is not None:
        towards, away = _sides(values)
        right, wrong = (towards, away) if moves == "towards" else (away, towards)
        if wrong > SIDE_RATIO * right:
            raise InputError(
                f"{path}: channels swapped, the record says the target moves {moves}, but the other"
                f" side of the Doppler axis holds {wrong / max(right, 1e-300):.3g} times the"
                " energy; expected the two columns in the order I, Q"
            )
