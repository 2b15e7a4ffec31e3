"""Blade passing frequencies read from the signals of a finished run, held against the truth of its motion tables.

    python -m lowalt.measure.rotor_estimates --run results/default --out rotors.csv

rotors.csv, one row a craft with rotors and SNR:
    subtype, group, snr_db, blades, models    blades of a rotor (its record); motion models tried
    right_percent                             estimates within 1 Hz of the truth, blades times rate, both folded
    chance_percent                            share of right guesses anywhere in the searched range
    median_error_hz, level                    median distance to the truth; median level of the comb over the noise
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from lowalt.common.command import run
from lowalt.common.csv_tables import write_csv
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.common.shipped import located
from lowalt.common.yaml_files import load_yaml
from lowalt.motion import read_table
from lowalt.recognition.rotor import LEAST_HZ, folded, passing
from lowalt.targets.records import records_of
from lowalt.tiles.signals import load_signals

COLUMNS = ("subtype", "group", "snr_db", "blades", "models", "right_percent", "chance_percent", "median_error_hz",
           "level")  # fmt: skip
NEAR_HZ = 1.0


def estimates(folder: Path, models: int) -> dict[tuple, list[tuple[float, float]]]:
    """Return (error in Hz, level) of each motion model, by (subtype, group, SNR, blades); models: of each subtype.

    Raises: InputError naming a file of the run that is missing or damaged.
    """
    config = located(load_yaml(folder / "config.yaml"))
    network = Network.from_settings(config["network"])
    figures = {name: item.get("figures", {}) for name, item in records_of(config["targets"]).items()}
    snrs = [float(snr) for snr in config["noise"]["snr_db"]]
    found: dict[tuple, list[tuple[float, float]]] = {}
    for path in sorted((folder / "noisy").glob("*-00000.npy")):
        signals = load_signals(path, network)
        for number, row in enumerate(read_table(folder / "motion" / f"{path.stem}.csv")):
            if "blade_count" not in figures[row["subtype"]] or row["model"] >= models:
                continue
            blades = int(figures[row["subtype"]]["blade_count"]["si"])
            truth = folded(blades * row["rate_hz"], network.symbol_interval_s)
            for level, snr in enumerate(snrs):
                told = passing(np.asarray(signals[number, level]), network.symbol_interval_s)
                key = (row["subtype"], row["group"], f"{snr:g}", blades)
                found.setdefault(key, []).append((abs(told.hertz - truth), told.level))
    if not found:
        raise InputError(f"{folder}: no signals of craft with rotors, expected a finished run with noisy/*-00000.npy")
    chance = 100 * 2 * NEAR_HZ / (0.5 / network.symbol_interval_s - LEAST_HZ)
    return {(*key, f"{chance:.1f}"): values for key, values in found.items()}


def main(arguments: list[str]) -> None:
    """Write the table."""
    options = argparse.ArgumentParser("lowalt.measure.rotor_estimates", description=__doc__.splitlines()[0])
    options.add_argument("--run", required=True, type=Path, help="folder of a finished run")
    options.add_argument("--models", type=int, default=20, help="motion models of each subtype (default: 20)")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    rows = []
    for (subtype, group, snr, blades, chance), values in estimates(given.run, given.models).items():
        error, level = np.array(values).T
        right = f"{100 * np.mean(error < NEAR_HZ):.1f}"
        rows.append([subtype, group, snr, blades, len(error), right, chance, f"{np.median(error):.3f}",
                     f"{np.median(level):.1f}"])  # fmt: skip
    write_csv(given.out, COLUMNS, rows)
    print(f"{given.out}: {len(rows)} rows", file=sys.stderr)


if __name__ == "__main__":
    run(main)
