"""What shorter numbers cost a stored signal: bytes, the error below the noise, and the pixels that
change.

    python benchmarks/signal_precision.py --out results/benchmarks/signal_precision.csv

Signals of ten motion models of every subtype of the default, at its lowest and highest SNR and
without noise, each kept as complex64, as pairs of half-precision floats at unit power, and as pairs
of 16-bit integers with a power of two as step. The error is its mean power below that of the
sample's noise, and below that of the signal, in decibels; both are exact for a given data set, so
the table names no processor.
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.config.layers import overlaid
from lowalt.files.csv_tables import write_csv
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.sample_record import real_and_imaginary
from lowalt.shards.stored_cubes import restored, rounded

COLUMNS = (
    "kept_as",
    "bytes_a_station",
    "snr_db",
    "samples",
    "error_below_signal_db",
    "error_below_noise_db",
    "pixels_changed_percent",
    "largest_change_levels",
)
MODELS = 10


def halves(signal: np.ndarray) -> np.ndarray:
    """Return a signal (M,) complex64 as it comes back from half-precision floats at unit mean
    power.
    """
    scale = np.sqrt(np.mean(np.abs(signal) ** 2))
    parts = real_and_imaginary(signal / scale).astype(np.float16).astype(np.float32)
    return ((parts[..., 0] + 1j * parts[..., 1]) * scale).astype(np.complex64)


def integers(signal: np.ndarray) -> np.ndarray:
    """Return a signal (M,) complex64 as it comes back from 16-bit integers times a step."""
    return restored(*rounded(signal)).astype(np.complex64)


KINDS = {"complex64": (8, np.copy), "float16": (4, halves), "int16": (4, integers)}
"""By name: bytes of a symbol, and what comes back of a station's signal."""


def rows(dataset: Dataset, snr_db: float) -> list[list]:
    """Return the rows of an SNR (dB)."""
    maker = dataset.maker
    powers: dict[str, list] = {name: [] for name in KINDS}
    pixels: dict[str, list] = {name: [] for name in KINDS}
    groups = dataset.plan.groups.items()
    places = [
        Place(group, name, model, snr_db)
        for group, names in groups
        for name in names
        for model in range(MODELS)
    ]
    for place in places:
        row = dataset.row(place)
        signals = dataset.made_signal(place)
        tile = maker.tile(signals, row, snr_db).astype(int)
        for name, (_, kept) in KINDS.items():
            back = np.array([kept(signal) for signal in signals])
            error = np.mean(np.abs(back.astype(complex) - signals) ** 2, axis=1)
            powers[name].append(error / np.mean(np.abs(signals.astype(complex)) ** 2, axis=1))
            changed = np.abs(maker.tile(back, row, snr_db).astype(int) - tile)
            pixels[name].append((np.count_nonzero(changed) / changed.size, changed.max()))
    found = []
    for name, (size, _) in KINDS.items():
        share = float(np.mean(powers[name]))
        changes = np.array(pixels[name])
        below = -10 * np.log10(share) if share else np.inf
        # The noisy signal's power is that of the signal and the noise together.
        noise = (
            f"{below - 10 * np.log10(1 + 10 ** (snr_db / 10)):.1f}" if np.isfinite(snr_db) else ""
        )
        percent = f"{100 * changes[:, 0].mean():.4f}"
        largest = int(changes[:, 1].max())
        found.append(
            [
                name,
                size * maker.network.symbols,
                snr_db,
                len(places),
                f"{below:.1f}",
                noise,
                percent,
                largest,
            ]
        )
    return found


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    dataset = Dataset(overlaid([]))
    finite = [snr for snr in dataset.plan.snrs if np.isfinite(snr)]
    write_csv(
        given.out,
        COLUMNS,
        [row for snr in (min(finite), max(finite), np.inf) for row in rows(dataset, snr)],
    )


if __name__ == "__main__":
    main()
