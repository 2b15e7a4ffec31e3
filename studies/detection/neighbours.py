"""Whether a weaker target near a stronger one of the same speed is detected: neighbours.csv and neighbours.png.

    python studies/detection/neighbours.py --out studies/detection/results

Two point echoes of one radial speed stand in a look of 64 symbols with noise in all cells, the weaker one 20 dB above
the noise of the range-Doppler map. It counts as detected where a detection lies within one cell and two speeds of it
(`lowalt.tiles.detections`, at its default false-alarm rate); `without_percent` counts the same detections in looks that
hold the stronger echo alone, whose side lobes can be taken for a target.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from lowalt.config.layers import load
from lowalt.config.network import Network
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.tiles.detections import detections

SYMBOLS, CELL = 64, 128
WEAKER_DB = 20.0
"""Level of the weaker echo over the noise of the map (dB)."""
RULES = [(cfar, window) for window in ("none", "hann") for cfar in ("cell_averaging", "ordered_statistic")]
STRONGER_DB = (3, 6, 10, 20, 30)
DISTANCES = (3, 4, 6, 8, 12, 16, 20, 32)
COLUMNS = (
    "cfar", "range_window", "weaker_by_db", "distance_cells", "looks", "detected_percent", "without_percent",
)  # fmt: skip


def network() -> Network:
    """Return the default's network with looks of SYMBOLS symbols."""
    block = load([Path("config/default.yaml")], "workflow/schemas/config.schema.yaml")["network"]
    return Network.from_settings(block | {"symbols": SYMBOLS})


def echo(radio: Network, cell: float, speed_mps: float, amplitude: complex) -> np.ndarray:
    """Return the range cells (N, M) of a point in a range cell, which need not be whole, that recedes at a speed."""
    response = np.exp(-2j * np.pi * np.arange(radio.subcarriers) * cell / radio.subcarriers)
    turns = np.arange(SYMBOLS) * speed_mps / (2 * radio.largest_mps(radio.stations[0]))
    return amplitude * np.exp(-2j * np.pi * turns)[:, None] * np.fft.ifft(response)


def seen(radio: Network, cells: np.ndarray, cell: float, speed_mps: float, rule: tuple[str, str]) -> bool:
    """Return whether a detection is that of a target in a cell at a speed; the look was chosen around CELL."""
    truth = np.zeros((SYMBOLS, len(TRUTH)))
    truth[:, [TRUTH.index(name) for name in ("cell", "observed_cell")]] = np.rint(cell)
    truth[:, [TRUTH.index(name) for name in ("radial_mps", "observed_mps")]] = speed_mps
    cube = Cube(cells.astype(np.complex64), np.full(SYMBOLS, CELL), truth)
    found = detections(cube, radio, radio.stations[0], cfar=rule[0], range_window=rule[1])
    return bool(found["true"].any())


def row(radio: Network, rule: tuple[str, str], stronger_db: float, distance: int, looks: int) -> list:
    """Return a row of the table; stronger_db -inf: no stronger target."""
    weaker = without = 0
    for look in range(looks):
        rng = stream(1, "neighbours", look)
        place, speed_mps = CELL - 8 + rng.uniform(-0.5, 0.5), rng.uniform(-5, 5)
        beside = place + distance
        noise = (rng.normal(size=(SYMBOLS, radio.subcarriers, 2)) @ [1, 1j]) / np.sqrt(2)
        # The map's Hann window leaves 1.5 / N of the noise of a symbol.
        level = np.sqrt(1.5 / SYMBOLS * 10 ** (WEAKER_DB / 10))
        turns = np.exp(2j * np.pi * rng.random(2))
        loud = noise + echo(radio, place, speed_mps, turns[0] * level * 10 ** (stronger_db / 20))
        both = loud + echo(radio, beside, speed_mps, turns[1] * level)
        weaker += seen(radio, both, beside, speed_mps, rule)
        without += seen(radio, loud, beside, speed_mps, rule)
    shares = (f"{100 * count / looks:.0f}" for count in (weaker, without))
    alone = np.isneginf(stronger_db)
    return [*rule, *(("", "") if alone else (f"{stronger_db:g}", distance)), looks, *shares]


def table(looks: int) -> list[list]:
    """Return all rows: the weaker target alone, then beside the stronger one."""
    radio, rows = network(), []
    for rule in RULES:
        rows.append(row(radio, rule, -np.inf, DISTANCES[0], looks))
        rows += [row(radio, rule, level, distance, looks) for level in STRONGER_DB for distance in DISTANCES]
        print(*rule, flush=True)
    return rows


def picture(rows: list[list], path: Path) -> None:
    """Draw detection over the distance: a panel for each threshold and window, a line for each difference in level."""
    figure, panels = plt.subplots(1, 4, figsize=(12, 3.2), sharex=True, sharey=True, layout="constrained")
    for panel, rule in zip(panels, RULES, strict=True):
        for level in STRONGER_DB:
            mine = [each for each in rows if tuple(each[:2]) == rule and each[2] == f"{level:g}"]
            panel.plot([each[3] for each in mine], [float(each[5]) for each in mine], "o-", label=f"{level} dB")
        panel.set(title=f"{rule[0].replace('_', ' ')},\nrange window {rule[1]}", ylim=(-3, 103))
    figure.supxlabel("distance of the two targets (range cells)")
    panels[0].set_ylabel("weaker one detected (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), title="weaker by", loc="outside right")
    figure.savefig(path, dpi=90)


def main() -> None:
    """Compute the table and the picture."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--looks", type=int, default=100, help="looks per row")
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    rows = table(given.looks)
    write_csv(given.out / "neighbours.csv", COLUMNS, rows)
    picture(rows, given.out / "neighbours.png")


if __name__ == "__main__":
    main()
