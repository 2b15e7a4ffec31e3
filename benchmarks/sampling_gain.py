"""Gain of every sampling of a recording at tones across its band.

    python benchmarks/sampling_gain.py --out results/benchmarks/sampling_gain.csv

A tone of unit amplitude lasts a second at each rate of `RATES_HZ` and goes to 3000 symbols a second
(`symbol_rate`).
    sampling, channel   how it is sampled, and of which channel; a real channel hears towards and
    away alike tone_hz, speed_mps  the tone, and the radial speed that it means at 24 GHz
    appears_hz          where a symbol rate of 3000 shows it
    gain_RATE_db        of the tone in a recording of RATE samples a second, over what went in;
    `FAINT_DB` stands for
                        anything below, and nothing for a tone from half that rate on
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.config.command import run
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.channel import SAMPLINGS, symbol_rate
from lowalt.files.csv_tables import write_csv

SYMBOL_RATE_HZ = 3000.0
CARRIER_HZ = 24e9
RATES_HZ = (6000.0, 44100.0, 48000.0)
COLUMNS = (
    "sampling",
    "channel",
    "tone_hz",
    "speed_mps",
    "appears_hz",
    *(f"gain_{rate:.0f}_db" for rate in RATES_HZ),
)
TONES_HZ = (4.0, 16.0, 32.0, 64.0, 80.0, 150.0, 240.0, 640.0, 1200.0, 1350.0, 1450.0, 1600.0, 2400.0, 2700.0, 2820.0,
            2900.0, 3016.0, 3080.0, 3640.0)  # fmt: skip
ENDS = 150
"""Symbols at either end that are left out: there the filters hear the start and the end of the
tone.
"""
FAINT_DB = -70.0


def gain(
    sampling: str,
    channel: str,
    rate_hz: float,
    tone_hz: float,
    symbol_rate_hz: float = SYMBOL_RATE_HZ,
) -> float:
    """Return the gain (dB) of a tone (Hz) in a second of a recording, sampled to `symbol_rate_hz`."""
    tone = np.exp(2j * np.pi * tone_hz * np.arange(int(rate_hz)) / rate_hz)
    values = symbol_rate(
        tone if channel == "complex" else tone.real, rate_hz, 1 / symbol_rate_hz, sampling
    )
    symbols = np.arange(len(values))[ENDS:-ENDS]
    taper = np.hanning(len(symbols))
    line = (
        np.sum(taper * values[symbols] * np.exp(-2j * np.pi * tone_hz / symbol_rate_hz * symbols))
        / taper.sum()
    )
    return max(20 * np.log10(abs(line) + 1e-12), FAINT_DB)


def main(arguments: list[str]) -> None:
    """Write the table."""
    line = argparse.ArgumentParser("sampling_gain.py", description=__doc__.partition("\n\n")[0])
    line.add_argument("--out", required=True, type=Path, help="table to write (.csv)")
    rows = []
    for sampling in SAMPLINGS:
        for channel in ("real",) if sampling == "one_sided" else ("complex", "real"):
            for tone_hz in TONES_HZ:
                appears = (tone_hz + SYMBOL_RATE_HZ / 2) % SYMBOL_RATE_HZ - SYMBOL_RATE_HZ / 2
                speed = tone_hz * SPEED_OF_LIGHT / CARRIER_HZ / 2
                levels = [
                    f"{gain(sampling, channel, rate, tone_hz):z.2f}" if tone_hz < rate / 2 else ""
                    for rate in RATES_HZ
                ]
                rows.append(
                    [sampling, channel, f"{tone_hz:.0f}", f"{speed:.3g}", f"{appears:.0f}", *levels]
                )
    write_csv(line.parse_args(arguments).out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
