"""Rotors read from the signals of a finished run, held against the truth of its motion tables and records.

    python studies/rotors/study.py estimates --run results/default --out rotors.csv

rotors.csv, one row a craft with rotors and SNR:
    subtype, group, snr_db, blades, models    blades of a rotor (its record); motion models tried
    right_percent                             passing frequencies within one cycle a look of the truth, blades times
                                              rate, both folded
    chance_percent                            share of right guesses anywhere in the searched range
    median_error_hz, level                    median distance to the truth; median level of the comb over the noise
    pursued_right_percent                     as right_percent, the body taken away by null space pursuit
    length_told_percent                       models in which blade length over number of blades is told
    length_error_percent                      median error of those, over the truth
    length_inside_percent                     those whose interval holds the truth
    parity_told_percent, parity_right         models in which an even number of blades is told from an odd one; how
                                              many of these are right
Craft count as level, since a radar knows a target's direction, not its tilt.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rotor import LEAST_CYCLES, folded, passing, passing_of_rests, without_body, without_pursued_body
from rotor_blades import Blades, blades

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.shipped import located
from lowalt.files.yaml_files import load_yaml
from lowalt.motion import read_table
from lowalt.targets.records import records_of
from lowalt.tiles.signals import load_signals

COLUMNS = (
    "subtype", "group", "snr_db", "blades", "models", "right_percent", "chance_percent", "median_error_hz", "level",
    "pursued_right_percent", "length_told_percent", "length_error_percent", "length_inside_percent",
    "parity_told_percent", "parity_right",
)  # fmt: skip
NEAR_CYCLES = 1.0


class Read(NamedTuple):
    """Of a motion model: errors (Hz) of both separations, level of the comb, what is told of blades, its truth (m)."""

    error_hz: float
    pursued_error_hz: float
    level: float
    told: Blades
    length_over_count_m: float


def level_sines(row: dict, masts_m: np.ndarray) -> np.ndarray:
    """Return the sines (B,) of the angles between a level craft's rotor axes and the lines of sight of masts (B, 3)."""
    way = np.array([row["x_m"], row["y_m"], row["z_m"]]) - masts_m
    return np.hypot(way[:, 0], way[:, 1]) / np.linalg.norm(way, axis=1)


def read_rotors(looks: np.ndarray, row: dict, figures: dict, network: Network) -> Read:
    """Return what the looks (B, N) complex of all stations tell of the rotors of a motion model.

    row: of the motion table; figures: of the craft's record.
    """
    interval_s, stations = network.symbol_interval_s, network.stations
    count, length_m = figures["blade_count"]["si"], figures["propeller_diameter"]["si"] / 2
    rests = np.array([without_body(look, interval_s) for look in looks])
    found = passing_of_rests(rests, interval_s)
    pursued = passing(looks, interval_s, without_pursued_body)
    wavelengths = SPEED_OF_LIGHT / np.array([station.frequency_hz for station in stations])
    sines = level_sines(row, np.array([station.position_m for station in stations]))
    told = blades(rests, found, interval_s, wavelengths, sines)
    truth = folded(count * row["rate_hz"], interval_s)
    return Read(abs(found.hertz - truth), abs(pursued.hertz - truth), found.level, told, length_m / count)


def estimates(folder: Path, models: int) -> dict[tuple, list[Read]]:
    """Return what was read of each motion model, by (subtype, group, SNR, blades); models: of each subtype.

    Raises: InputError naming a file of the run that is missing or damaged.
    """
    config = located(load_yaml(folder / "config.yaml"))
    network = Network.from_settings(config["network"])
    figures = {name: item.get("figures", {}) for name, item in records_of(config["targets"]).items()}
    snrs = [float(snr) for snr in config["noise"]["snr_db"]]
    found: dict[tuple, list[Read]] = {}
    for path in sorted((folder / "noisy").glob("*-00000.npy")):
        signals = load_signals(path, network)
        for number, row in enumerate(read_table(folder / "motion" / f"{path.stem}.csv")):
            mine = figures[row["subtype"]]
            if "blade_count" not in mine or row["model"] >= models:
                continue
            for level, snr in enumerate(snrs):
                key = (row["subtype"], row["group"], f"{snr:g}", int(mine["blade_count"]["si"]))
                read = read_rotors(np.asarray(signals[number, level]), row, mine, network)
                found.setdefault(key, []).append(read)
    if not found:
        raise InputError(f"{folder}: no signals of craft with rotors, expected a finished run with noisy/*-00000.npy")
    return found


def summary(reads: list[Read], count: int, near_hz: float) -> list[str]:
    """Return the values of `right_percent` and of the columns after `chance_percent`; count: true number of blades."""
    errors = np.array([read.error_hz for read in reads])
    pursued = np.array([read.pursued_error_hz for read in reads])
    lengths = [read for read in reads if read.told.length_over_count_m is not None]
    ratios = np.array([read.told.length_over_count_m / read.length_over_count_m for read in lengths])
    inside = [read.told.bounds_m[0] <= read.length_over_count_m <= read.told.bounds_m[1] for read in lengths]
    parities = [read.told.odd == (count % 2 == 1) for read in reads if read.told.odd is not None]

    def share(values) -> str:
        """Percentage of true values, empty where there are none."""
        return f"{100 * np.mean(values):.1f}" if len(values) else ""

    return [
        share(errors < near_hz), f"{np.median(errors):.3f}", f"{np.median([read.level for read in reads]):.1f}",
        share(pursued < near_hz), f"{100 * len(lengths) / len(reads):.1f}",
        f"{100 * np.median(np.abs(ratios - 1)):.1f}" if len(ratios) else "", share(inside),
        f"{100 * len(parities) / len(reads):.1f}", str(sum(parities)),
    ]  # fmt: skip


def main(arguments: list[str]) -> None:
    """Write the table."""
    options = argparse.ArgumentParser("study.py estimates", description=__doc__.splitlines()[0])
    options.add_argument("--run", required=True, type=Path, help="folder of a finished run")
    options.add_argument("--models", type=int, default=20, help="motion models of each subtype (default: 20)")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    found = estimates(given.run, given.models)
    network = Network.from_settings(located(load_yaml(given.run / "config.yaml"))["network"])
    look_s = network.symbols * network.symbol_interval_s
    chance = 100 * 2 * NEAR_CYCLES / (0.5 * network.symbols - LEAST_CYCLES)
    rows = []
    for (subtype, group, snr, blade_count), reads in found.items():
        right, *rest = summary(reads, blade_count, NEAR_CYCLES / look_s)
        rows.append([subtype, group, snr, blade_count, len(reads), right, f"{chance:.1f}", *rest])
    write_csv(given.out, COLUMNS, rows)
    print(f"{given.out}: {len(rows)} rows", file=sys.stderr)
