"""A picture of a recording of unknown layout: its spectrogram under each of the readings that fit best."""

import math

import numpy as np
from matplotlib import pyplot as plt
from scipy.signal import spectrogram

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.file_inspection import FileInspection, Seen
from lowalt.report.figures.style import png

PANELS = 3
RANGE_DB = 50.0
SEEN_SHARE = 0.005
"""Share of the time in which a speed must show a colour to be drawn."""
ROWS = 64
"""Least number of rows of a spectrogram up to the largest speed that is drawn."""


def _levels(one: Seen, length: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies (rows,) Hz ascending, times (columns,) s and levels (rows, columns) dB of a reading's samples."""
    values = one.values - one.values.mean()
    hertz, times, power = spectrogram(values, one.rate_hz, "hann", length, length // 2, detrend=False,
                                      return_onesided=np.isrealobj(values), mode="psd")  # fmt: skip
    order = np.argsort(hertz)
    return hertz[order], times, 10 * np.log10(np.maximum(power[order], 1e-300))


def _reach(hertz: np.ndarray, level: np.ndarray) -> float:
    """Largest frequency (Hz) that the colours of levels (rows, columns) dB show."""
    shown = (level > level.max() - RANGE_DB).mean(axis=1) > SEEN_SHARE
    return float(np.abs(hertz[shown]).max(initial=hertz[1] - hertz[0]))


def recording_picture(inspection: FileInspection, words: list[str]) -> bytes:
    """Return a PNG of the spectrograms of the first readings, over radial speed (m/s) or, without a carrier, Hz.

    words: a title for each reading. Colours span `RANGE_DB` below the strongest line, without the constant part, and
    speeds that they do not show are left out.
    """
    seen = inspection.readings[:PANELS]
    figure, panels = plt.subplots(1, len(seen), figsize=(5 * len(seen), 4.2), squeeze=False)
    scale = SPEED_OF_LIGHT / 2 / inspection.carrier_hz if inspection.carrier_hz else 1.0
    for panel, one, title in zip(panels[0], seen, words, strict=False):
        count = len(one.values)
        length = min(int(2 ** np.clip(np.round(np.log2(count / 60)), 5, 11)), count)
        reach = _reach(*_levels(one, length)[::2])
        finer = 2 ** math.ceil(math.log2(max(ROWS * one.rate_hz / reach, 1)))
        hertz, times, level = _levels(one, max(length, min(finer, count // 16)))
        top = float(level.max())
        panel.pcolormesh(times, hertz * scale, level, vmin=top - RANGE_DB, vmax=top, shading="nearest")
        least = 0.0 if np.isrealobj(one.values) else -reach * scale
        panel.set_ylim(max(1.2 * least, hertz[0] * scale), min(1.2 * reach, hertz[-1]) * scale)
        panel.set(title=title, xlabel="time (s)" if inspection.rate_hz else "samples")
    sign = "sign lost" if np.isrealobj(seen[0].values) else "approaching is positive"
    panels[0][0].set(ylabel=f"radial speed (m/s), {sign}" if inspection.carrier_hz else "Doppler (Hz)")
    figure.tight_layout()
    return png(figure)
