"""The echo's accuracy carried down the chain: how many pixels change at each tolerance.

    python -m lowalt.measure.echo_pixels --settings JSON --table cost.csv --clouds a.npz ...
        --targets config/targets.csv --out cost_pixels.csv

Settings: network, motion, spectra, images and cost blocks of the configuration, and its seed. `--table` is the table of
`lowalt.measure.echo_cost` for the same clouds; its rows with a cloud's own number of points give the time saved.
"""

import sys
from collections.abc import Iterable

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import Network
from lowalt.echo import echo_signal
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.errors import BelowFloor, InputError
from lowalt.measure.echo_cost import sample
from lowalt.spectra import Spectra
from lowalt.targets.cloud import Cloud, read
from lowalt.tiles.render import Renderer
from lowalt.tiles.settings import Images

COLUMNS = (
    "category", "subtype", "points", "range_m", "tolerance", "models", "pixels", "changed_pixels", "changed_share",
    "largest_step", "time_saved",
)  # fmt: skip
NEEDED = ("method", "subtype", "points", "range_m", "tolerance", "seconds")
"""Columns of the measured table that are used here."""


def signals(network: Network, given: tuple, tolerance: float | None) -> np.ndarray:
    """Return clean signals (stations, N) complex64 as the echo stage stores them; None is the exact mode.

    Where float64 cannot guarantee the tolerance at a station, the exact signal stays, as it would for a user.
    """
    result = np.empty((len(network.stations), network.symbols), np.complex64)
    for place, station in enumerate(network.stations):
        try:
            found = echo_signal(network, station, *given, tolerance)
        except BelowFloor:
            found = echo_signal(network, station, *given)
        result[place] = found.signal
    return result


def changes(before: np.ndarray, after: np.ndarray) -> tuple[int, int]:
    """Return how many values of two uint8 tiles of equal shape differ, and the largest difference in steps of 8 bits.

    Raises: InputError where the shapes differ.
    """
    if before.shape != after.shape:
        raise InputError(f"tiles: shapes {before.shape} and {after.shape}, expected equal shapes")
    step = np.abs(before.astype(np.int16) - after.astype(np.int16))
    return int(np.count_nonzero(step)), int(step.max())


def pixels(renderer: Renderer, clouds: list[Cloud], published: dict, block: dict) -> list[dict]:
    """Return a row (keys COLUMNS without `time_saved`) for every cloud, distance and tolerance: pixels that change.

    The tiles are those of noise-free signals at all stations, the hardest case: noise hides small errors.
    """
    network, rows = renderer.network, []
    for cloud in clouds:
        for distance_m in block["distances_m"]:
            found = {tolerance: (0, 0) for tolerance in block["tolerances"]}
            count = 0
            for model in range(block["models"]):
                given = sample(
                    cloud, published[cloud.subtype], network, block["motion"], block["seed"] + model, distance_m, None
                )
                exact = renderer.tile(signals(network, given, None)).copy()
                count += exact.size
                for tolerance, (changed, largest) in found.items():
                    more, step = changes(exact, renderer.tile(signals(network, given, tolerance)))
                    found[tolerance] = changed + more, max(largest, step)
            base = {"category": cloud.category, "subtype": cloud.subtype, "points": len(cloud.points),
                    "range_m": distance_m, "models": block["models"], "pixels": count}  # fmt: skip
            rows += [
                base | {"tolerance": tolerance, "changed_pixels": changed, "changed_share": changed / count,
                        "largest_step": largest}
                for tolerance, (changed, largest) in found.items()
            ]  # fmt: skip
            print(f"{cloud.subtype}, {distance_m} m: {block['models']} tiles", file=sys.stderr)
    return rows


def saved(measured: Iterable[dict[str, str]], row: dict) -> float | str:
    """Return the share of the exact mode's time that this row's tolerance saves; empty where it was not measured."""
    times = {
        line["tolerance"]: float(line["seconds"])
        for line in measured
        if line["method"] == "engine"
        and (line["subtype"], int(line["points"]), float(line["range_m"]))
        == (row["subtype"], row["points"], float(row["range_m"]))
    }
    cheap = times.get(str(float(row["tolerance"])))
    return "" if cheap is None or "exact" not in times else 1 - cheap / times["exact"]


def main(arguments: list[str]) -> None:
    """Count the pixels that change, and write the table."""
    options = parser("lowalt.measure.echo_pixels", __doc__.splitlines()[0])
    options.add_argument("--table", required=True, help="table of lowalt.measure.echo_cost (.csv)")
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files, the same as that table's")
    options.add_argument("--out", required=True, help="table of changed pixels to write (.csv)")
    given = options.parse_args(arguments)
    keys = ("network", "motion", "spectra", "images", "seed", "cost", "published")
    network, motion, spectra, images, seed, block, published = pick(given.settings, *keys)
    block |= {"motion": motion, "seed": seed}
    measured = read_csv(given.table, *NEEDED)
    renderer = Renderer(Network.from_settings(network), Spectra.from_settings(spectra), Images.from_settings(images))
    rows = pixels(renderer, [read(path) for path in given.clouds], published, block)
    write_csv(given.out, COLUMNS, [row | {"time_saved": saved(measured, row)} for row in rows])


if __name__ == "__main__":
    run(main)
