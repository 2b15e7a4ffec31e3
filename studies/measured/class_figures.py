"""Figures of whole recordings by class: a hovering craft, a flapping bird, a vehicle that drives
past, a walker.

Every function takes a signal at the symbol rate, that rate, the wavelength and the pair's block
`figures` with window and hop in symbols. The name of a figure ends in its unit.
"""

import numpy as np
from spectral_figures import (
    EDGE_SHARE,
    above_floor,
    cycle_s,
    line_spacing_hz,
    quantile,
    spectrogram,
    tracks,
)


def rotor_figures(
    signal: np.ndarray, rate_hz: float, wavelength_m: float, spec: dict
) -> dict[str, float]:
    """Return spacing of the blade lines (Hz) and the Doppler edge (m/s) of a hovering craft.

    The edge leaves out the body line, |speed| below spec["slowest_mps"]; spec["spacing_hz"] bounds
    the spacing.
    """
    _, frequency, shown = spectrogram(signal - signal.mean(), rate_hz, spec["window"], spec["hop"])
    speeds = frequency * wavelength_m / 2
    power = (shown**2).mean(axis=1)
    keep = (np.abs(speeds) >= spec["slowest_mps"]) & (
        np.abs(speeds) <= spec.get("fastest_mps", np.inf)
    )
    order = np.argsort(np.abs(speeds[keep]), kind="stable")
    edge = quantile(np.abs(speeds[keep])[order], above_floor(power[keep])[order], [EDGE_SHARE])[0]
    return {
        "line_spacing_hz": line_spacing_hz(signal - signal.mean(), rate_hz, *spec["spacing_hz"]),
        "edge_mps": float(edge),
    }


def wing_figures(
    signal: np.ndarray, rate_hz: float, wavelength_m: float, spec: dict
) -> dict[str, float]:
    """Return wing-beat rate (Hz) and Doppler edge (m/s) of a flapping bird; spec["cycle_s"] bounds
    the beat's time.

    harmonic_hz: the strongest line of the signal within spec["harmonic_hz"]; harmonic_order: that
    line over the beat;
    base_over_harmonic_db: the line at the beat over that line. If the order is a whole number and
    there is a line at the beat itself, the strongest line is a harmonic of the beat.
    """
    _, frequency, shown = spectrogram(signal - signal.mean(), rate_hz, spec["window"], spec["hop"])
    speeds = frequency * wavelength_m / 2
    fast = (speeds >= spec["slowest_mps"]) & (speeds <= spec["fastest_mps"])
    track = tracks(shown[speeds > 0], speeds[speeds > 0], 0.0)
    beat = 1 / cycle_s(shown[fast], spec["hop"] / rate_hz, *spec["cycle_s"])
    harmonic, level = _strongest(signal, rate_hz, *spec["harmonic_hz"])
    # A stretch shorter than two beats has no beat that could be found.
    base = (
        _strongest(signal, rate_hz, 0.8 * beat, 1.2 * beat)[1]
        if np.isfinite(beat)
        else float("nan")
    )
    return {
        "beat_hz": beat,
        "edge_mps": float(np.quantile(track["edge"], 0.9)),
        "harmonic_hz": harmonic,
        "harmonic_order": harmonic / beat,
        "base_over_harmonic_db": base - level,
    }


def _strongest(
    signal: np.ndarray, rate_hz: float, low_hz: float, high_hz: float
) -> tuple[float, float]:
    """Frequency (Hz) and level (dB) of the strongest line between two bounds; Hann window, 1/16 of
    a bin.
    """
    count = 16 * len(signal)
    power = np.abs(np.fft.fft((signal - signal.mean()) * np.hanning(len(signal)), count)) ** 2
    first = round(low_hz * count / rate_hz)
    last = round(high_hz * count / rate_hz)
    at = first + int(power[first : last + 1].argmax())
    return at * rate_hz / count, float(10 * np.log10(power[at] + 1e-300))


PASSING = (0.3, 0.8)
"""A car is passing while its line is between these shares of its driving speed: the radar then sees
its two ends under different angles."""
SPREAD_SHARES = [0.1, 0.9]


def drive_figures(
    signal: np.ndarray, rate_hz: float, wavelength_m: float, spec: dict
) -> dict[str, float]:
    """Return the driving speed (m/s) of a vehicle that drives away, and the spread of its speeds
    (m/s) as it passes.

    speed: 90 % quantile of the line. spread: width of the band of speeds that holds the middle 80 %
    of the energy above the floor, median over the frames whose line is within `PASSING`. The spread
    shows the body's length at short range. Far behind the radar all points of a car have the same
    radial speed, and its line is as narrow as the transform resolves.
    """
    _, frequency, shown = spectrogram(signal - signal.mean(), rate_hz, spec["window"], spec["hop"])
    speeds = frequency * wavelength_m / 2
    power = shown[speeds > 0] ** 2
    speeds = speeds[speeds > 0]
    track = tracks(np.sqrt(power), speeds, spec["slowest_mps"])
    line = track["line"][track["counts"]]
    if not len(line):
        return {"speed_mps": float("nan"), "spread_mps": float("nan")}
    speed = np.quantile(line, 0.9)
    passing = (
        track["counts"]
        & (track["line"] > PASSING[0] * speed)
        & (track["line"] < PASSING[1] * speed)
    )
    spreads = [
        np.ptp(quantile(speeds, above_floor(frame), SPREAD_SHARES)) for frame in power.T[passing]
    ]
    return {
        "speed_mps": float(speed),
        "spread_mps": float(np.median(spreads)) if spreads else float("nan"),
    }


def gait_figures(
    signal: np.ndarray, rate_hz: float, wavelength_m: float, spec: dict
) -> dict[str, float]:
    """Return torso and limb speed (m/s) and the time of a step (s) of a walker; spec["cycle_s"]
    bounds the step.

    Torso: median of the strongest line while it is above spec["slowest_mps"]; limbs: 95th
    percentile of the edge.
    """
    _, frequency, shown = spectrogram(signal - signal.mean(), rate_hz, spec["window"], spec["hop"])
    speeds = frequency * wavelength_m / 2
    keep = (speeds > 0) & (speeds <= spec["fastest_mps"])
    track = tracks(shown[keep], speeds[keep], spec["slowest_mps"])
    walks = track["counts"] & (track["line"] > spec["torso_mps"])
    limbs = (speeds >= spec["torso_mps"]) & (speeds <= spec["fastest_mps"])
    # Divide each frame by its maximum: the echo falls by 40 dB along a walk, and near frames would
    # outweigh the others.
    level = shown[limbs] / np.maximum(shown[keep].max(axis=0), 1e-300)
    return {
        "torso_mps": float(np.median(track["line"][walks])) if walks.any() else float("nan"),
        "limb_mps": float(np.quantile(track["edge"][walks], 0.95)) if walks.any() else float("nan"),
        "step_s": cycle_s(level, spec["hop"] / rate_hz, *spec["cycle_s"]),
    }


KINDS = {"rotor": rotor_figures, "wing": wing_figures, "drive": drive_figures, "gait": gait_figures}
"""Function of the figures by the name that stands as `kind` in a pair's block `figures`."""
