"""The cost of correct rounding of the echo, and how many values need a second computation.

    python benchmarks/rounding.py --out results/benchmarks/rounding.csv

Signals of all subtypes of the default at its three stations, with the clouds as they are and
resampled to 400 points. Each signal is computed with rounding and without it in turn; a time is the
least of some calls, summed over signals. The share is that of the signal's time; poses, files and a
job's start, which the echo stage also has, are left out.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from lowalt.config.layers import load
from lowalt.echo import echo_signal
from lowalt.echo.echo_input import Rigid, Target, target
from lowalt.echo.rounding import nearest
from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.motion import poses
from lowalt.numerics.streams import stream
from lowalt.shards.dataset import Dataset, Place

COLUMNS = (
    "points",
    "signals",
    "symbols",
    "again",
    "left_open",
    "signal_ms",
    "rounding_ms",
    "percent",
    "hardware",
)


def inputs(dataset: Dataset, models: int, points: int | None) -> list[tuple[Target, np.ndarray]]:
    """Return targets in motion and their aims (3,) m; points: that many drawn from each cloud, None
    for all.
    """
    found = []
    for group in dataset.groups:
        for subtype in dataset.plan.groups[group]:
            for model in range(models):
                cloud = dataset.clouds[subtype]
                row = dataset.row(Place(group, subtype, model, 0.0))
                rng = stream(1, "rounding", subtype, model)
                pick = (
                    slice(None)
                    if points is None
                    else np.sort(rng.integers(0, len(cloud.points), points))
                )
                # Drawn points stand apart by millimetres, as those of a denser cloud.
                places = cloud.points[pick] + (
                    0.0 if points is None else rng.normal(scale=1e-3, size=(points, 3))
                )
                motion = Rigid(
                    *poses(cloud, row, dataset.maker.network.times_s), places, cloud.part[pick]
                )
                aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
                found.append((target(motion, cloud.rcs_m2[pick], subtype), aim))
    return found


def measured(dataset: Dataset, models: int, points: int | None, calls: int) -> dict:
    """Return a row of COLUMNS."""
    correct = nearest.correct
    again = np.zeros(2, int)
    spent = np.zeros(2)
    network = dataset.maker.network
    given = inputs(dataset, models, points)
    try:
        for seen, aim in given:
            for station in network.stations:
                least = [np.inf, np.inf]
                for _ in range(calls):
                    for place, how in enumerate((correct, lambda *_: (0, 0))):
                        nearest.correct = how
                        start = time.perf_counter()
                        result = echo_signal(network, station, seen, None, aim)
                        least[place] = min(least[place], time.perf_counter() - start)
                        again += result.method.again if place == 0 and least[1] == np.inf else 0
                spent += least
    finally:
        nearest.correct = correct
    signals = len(given) * len(network.stations)
    with_ms, without_ms = (1e3 * value / signals for value in spent)
    return {
        "points": "as they are" if points is None else points,
        "signals": signals,
        "symbols": signals * network.symbols,
        "again": again[0],
        "left_open": again[1],
        "signal_ms": f"{with_ms:.4f}",
        "rounding_ms": f"{with_ms - without_ms:.4f}",
        "percent": f"{100 * (with_ms - without_ms) / without_ms:.1f}",
        "hardware": describe(),
    }


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--models", type=int, default=5, help="motion models per subtype (default 5)"
    )
    options.add_argument(
        "--calls", type=int, default=9, help="calls of a signal in each way (default 9)"
    )
    options.add_argument("--out", type=Path, required=True, help="table to write")
    given = options.parse_args()
    dataset = Dataset(load(["config/default.yaml"], "workflow/schemas/config.schema.yaml"))
    rows = [measured(dataset, given.models, points, given.calls) for points in (None, 400)]
    write_csv(given.out, COLUMNS, rows)
    print(given.out.read_text(), end="")


if __name__ == "__main__":
    main()
