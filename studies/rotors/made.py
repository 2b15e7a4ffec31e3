"""Blade length and number read from made signals of rotors in closed form, whose truth is exact.

    python studies/rotors/study.py made --out made-rotors.csv

made-rotors.csv, one row per kind of rotor, at 20 dB and the default's symbols and stations:
    rotors, blades, lines      equal rotors of one rate; blades of each; lines on either side, on average
    draws, right_percent       signals tried; passing frequencies within one cycle a look of the truth
    length_told_percent, length_error_percent, length_inside_percent
                               length over blades is told; its median error; its interval holds the truth
    parity_told_percent, parity_right
                               even and odd numbers of blades are told apart; how many are right
"""

import argparse
import sys

import numpy as np
from estimates import NEAR_CYCLES, Read, summary
from rotor import folded, passing_of_rests, without_body
from rotor_blades import blades

from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream

COLUMNS = (
    "rotors", "blades", "lines", "draws", "right_percent", "length_told_percent", "length_error_percent",
    "length_inside_percent", "parity_told_percent", "parity_right",
)  # fmt: skip
INTERVAL_S, SYMBOLS, STATIONS = 2.5e-3, 400, 3
KINDS = tuple((rotors, count, lines) for rotors in (1, 4) for count in (2, 3, 4, 5) for lines in (3, 6, 12))
"""Rotors, blades of each and lines on either side, of each row."""
POINTS = 12
"""Points of a blade, one of them at its tip."""


def made(
    rng: np.random.Generator, count: int, reach: float, rate_hz: float, rotors: int, snr_db: float = 20.0
) -> np.ndarray:
    """Return signals (STATIONS, SYMBOLS) complex of a body and equal rotors of `count` blades each.

    reach: 4 pi R over the wavelength, the phase (rad) by which a tip swings. Rotors have phases of their own and turn
    in alternate senses; the body has three times the rotors' amplitude and a speed of its own at each station.
    """
    times = np.arange(SYMBOLS) * INTERVAL_S
    radii = np.append(rng.uniform(0.1, 1.0, POINTS - 1), 1.0)
    senses = np.where(np.arange(rotors) % 2, -1, 1)
    angles = senses * 2 * np.pi * rate_hz * times[:, None] + rng.uniform(0, 2 * np.pi, rotors)
    angles = angles[:, :, None] + 2 * np.pi * np.arange(count) / count
    turning = np.exp(1j * reach * np.cos(angles)[..., None] * radii).sum((2, 3))
    signals = []
    for _ in range(STATIONS):
        blades_ = turning @ np.exp(2j * np.pi * rng.random(rotors))
        signal = 3 + blades_ / np.sqrt(np.mean(np.abs(blades_) ** 2))
        signal = signal * np.exp(2j * np.pi * rng.uniform(-200, 200) * times)
        noise = rng.standard_normal((SYMBOLS, 2)) @ [1, 1j] / np.sqrt(2)
        signals.append(signal + noise * np.sqrt(np.mean(np.abs(signal) ** 2) * 10 ** (-snr_db / 10)))
    return np.array(signals)


def read_made(rng: np.random.Generator, count: int, lines: float, rotors: int) -> Read:
    """Return what one made signal tells; lines: its comb's on either side, drawn 15 % around it."""
    lines, rate_hz = lines * rng.uniform(0.85, 1.15), rng.uniform(60, 160)
    looks = made(rng, count, lines * count, rate_hz, rotors)
    rests = np.array([without_body(look, INTERVAL_S) for look in looks])
    found = passing_of_rests(rests, INTERVAL_S)
    # With a wavelength of 4 pi, length over blades is the number of lines.
    told = blades(rests, found, INTERVAL_S, np.full(STATIONS, 4 * np.pi), np.ones(STATIONS))
    error = abs(found.hertz - folded(count * rate_hz, INTERVAL_S))
    return Read(error, np.nan, found.level, told, lines)


def row(rotors: int, count: int, lines: float, draws: int) -> list:
    """Return the table's row of one of KINDS."""
    rng = stream(0, "made rotors", rotors, count, lines)
    reads = [read_made(rng, count, lines, rotors) for _ in range(draws)]
    right, _, _, _, *lengths = summary(reads, count, NEAR_CYCLES / (SYMBOLS * INTERVAL_S))
    return [rotors, count, lines, draws, right, *lengths]


def main(arguments: list[str]) -> None:
    """Write the table."""
    options = argparse.ArgumentParser("study.py made", description=__doc__.splitlines()[0])
    options.add_argument("--draws", type=int, default=30, help="signals of each kind (default: 30)")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    rows = [row(*kind, given.draws) for kind in KINDS]
    write_csv(given.out, COLUMNS, rows)
    print(f"{given.out}: {len(rows)} rows", file=sys.stderr)
