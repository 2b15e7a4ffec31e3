"""A picture of a recording of unknown layout: its spectrogram under each of the readings that fit best."""

import numpy as np
from matplotlib import pyplot as plt
from scipy.signal import spectrogram

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.recordings.file_inspection import FileInspection
from lowalt.report.figures.style import png

PANELS = 3
RANGE_DB = 50.0


def recording_picture(inspection: FileInspection, words: list[str]) -> bytes:
    """Return a PNG of the spectrograms of the first readings, over radial speed (m/s) or, without a carrier, Hz.

    words: a title for each reading. Colours span `RANGE_DB` below the strongest line, without the constant part.
    """
    seen = inspection.readings[:PANELS]
    figure, panels = plt.subplots(1, len(seen), figsize=(5 * len(seen), 4.2), squeeze=False)
    scale = SPEED_OF_LIGHT / 2 / inspection.carrier_hz if inspection.carrier_hz else 1.0
    for panel, one, title in zip(panels[0], seen, words, strict=False):
        values = one.values - one.values.mean()
        length = int(2 ** np.clip(np.round(np.log2(len(values) / 60)), 5, 11))
        real = np.isrealobj(values)
        hertz, times, power = spectrogram(values, one.rate_hz, "hann", min(length, len(values)), length // 2,
                                          detrend=False, return_onesided=real, mode="psd")  # fmt: skip
        order = np.argsort(hertz)
        level = 10 * np.log10(np.maximum(power[order], 1e-300))
        top = float(level.max())
        panel.pcolormesh(times, hertz[order] * scale, level, vmin=top - RANGE_DB, vmax=top, shading="nearest")
        panel.set(title=title, xlabel="time (s)" if inspection.rate_hz else "samples")
    panels[0][0].set(ylabel="radial speed (m/s), approaching is positive" if inspection.carrier_hz else "Doppler (Hz)")
    figure.tight_layout()
    return png(figure)
