"""Error of the echo against computing time, of every method and tolerance.

Both are measured at several numbers of points.

    python -m lowalt.measure.echo_cost --settings JSON --clouds a.npz ... --out cost.csv

Settings: network, motion and cost blocks of the configuration, its seed, and the published rows of
the targets. The table has one row per method, tolerance and number of points:
    seconds         of one signal at one station on one core: median of the repeats, mean over the
                    clouds
    relative_error  largest error over the judged symbols and clouds, relative to the largest value
                    of the signal
The truth is `lowalt.measure.fifty_digits`, at two random symbols and the deepest fade.
"""

import functools
import os
import sys
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import Network
from lowalt.echo.api import echo_signal
from lowalt.echo.echo_input import Rigid
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import BelowFloor
from lowalt.machine.hardware import processor
from lowalt.machine.timing import in_turn
from lowalt.measure import echo_baselines
from lowalt.measure.fifty_digits import cells_mp, positions_mp
from lowalt.motion import poses
from lowalt.motion.drawing import draw, region_polygon
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import Cloud, read

COLUMNS = ("method", "tolerance", "points", "seconds", "relative_error", "hardware")
ENGINE = "lowalt"
NUFFT = "NUFFT"
NAIVE32 = "NumPy, float32"
NAIVE64 = "NumPy, float64"


def hardware() -> str:
    """The processor's name and how many of its cores were used, as the table gives them."""
    return f"{processor()}, {os.cpu_count()} cores, one used"


def sample(
    cloud: Cloud,
    published: dict,
    network: Network,
    motion: dict,
    seed: int,
    distance_m: float,
    points: int,
) -> tuple[Rigid, np.ndarray, np.ndarray]:
    """A random motion of `cloud` that starts `distance_m` away: (motion, rcs_m2, aim_m).

    The distance is from the first station.
    points: how many of the cloud's points are taken, at random and repeated if need be.
    """
    rng = stream(seed, "cost", cloud.subtype, distance_m, points)
    masts = np.array([station.position_m[:2] for station in network.stations])
    row = draw(
        rng, cloud, published, masts, region_polygon(masts, motion["region"]["polygon_m"]), motion
    )
    station = network.stations[0]
    rise = float(np.clip(row["z_m"] - station.position_m[2], -0.9 * distance_m, 0.9 * distance_m))
    flat = np.sqrt(distance_m**2 - rise**2)
    turn = station.normal_rad + rng.uniform(-0.8, 0.8)
    row["x_m"] = station.position_m[0] + flat * np.cos(turn)
    row["y_m"] = station.position_m[1] + flat * np.sin(turn)
    row["z_m"] = station.position_m[2] + rise
    row["model"] = 0
    chosen = np.sort(rng.integers(0, len(cloud.points), points))
    order = chosen[np.argsort(cloud.part[chosen], kind="stable")]
    moved = Rigid(*poses(cloud, row, network.times_s), cloud.points[order], cloud.part[order])
    return moved, cloud.rcs_m2[order], np.array([row["x_m"], row["y_m"], row["z_m"]])


def truths(
    network: Network, sample: tuple, signal: np.ndarray, cell: np.ndarray, seed: int
) -> dict[int, mpmath.mpc]:
    """The true values of the strongest cells (N,) at three symbols of a signal (N,).

    They are two random symbols and the deepest fade.
    """
    motion, rcs_m2, aim_m = sample
    rng = stream(seed, "judged symbols")
    chosen = {
        *rng.choice(len(signal), min(2, len(signal)), replace=False).tolist(),
        int(np.argmin(abs(signal))),
    }
    station = network.stations[0]
    values = {}
    for n in chosen:
        points_m = positions_mp(motion, n)
        strongest = [int(cell[n])]
        (values[n],) = cells_mp(
            network, station, points_m, rcs_m2.tolist(), aim_m.tolist(), strongest
        )
    return values


def error(signal: np.ndarray, truth: dict[int, mpmath.mpc]) -> float:
    """Largest error of a signal (N,) at the judged symbols, relative to its largest value."""
    with mpmath.workdps(50):
        return float(
            max(abs(mpmath.mpc(complex(signal[n])) - value) for n, value in truth.items())
            / abs(signal).max()
        )


def measured(
    network: Network, sample: tuple, seed: int, block: dict
) -> dict[tuple, tuple[float, float]]:
    """Return median seconds and error of one sample by (method, tolerance).

    Tolerances are those that float64 keeps.
    """
    motion, rcs_m2, aim_m = sample
    arguments = (network, network.stations[0], motion, rcs_m2, aim_m)
    repeats = block["repeats"]
    exact = echo_signal(*arguments)
    truth = truths(network, sample, exact.signal, exact.cell, seed)
    closed = functools.partial(echo_baselines.closed, *arguments)
    finufft = functools.partial(echo_baselines.finufft, *arguments)
    calls: dict[tuple, tuple[Callable[[], Any], int, int]] = {
        (NAIVE32, ""): (functools.partial(closed, dtype=np.float32), repeats, 1),
        (NAIVE64, ""): (closed, repeats, 1),
        (NUFFT, ""): (finufft, repeats, 1),
    }
    for tolerance in (None, *block["tolerances"]):
        call = functools.partial(echo_signal, *arguments, tolerance=tolerance)
        try:
            call()
        except BelowFloor:
            continue
        # A call takes about a millisecond, so with only five calls one interrupt would be a quarter
        # of the time.
        calls[ENGINE, tolerance or "exact"] = call, repeats, 8
    timed: list[tuple[float, Any]] = in_turn(list(calls.values()))
    found = {}
    for (method, tolerance), (seconds, result) in zip(calls, timed, strict=True):
        signal = result.signal if method == ENGINE else result
        found[method, tolerance] = (seconds, error(signal, truth))
    return found


def measure(network: Network, clouds: list[Cloud], published: dict, block: dict) -> list[dict]:
    """Return the table's rows (keys COLUMNS): mean seconds and largest error over all clouds."""
    rows = []
    for points in block["points"]:
        by_method: dict[tuple, list[tuple[float, float]]] = {}
        for cloud in clouds:
            drawn_with = (
                published[cloud.subtype],
                network,
                block["motion"],
                block["seed"],
                block["distance_m"],
                points,
            )
            for key, pair in measured(
                network, sample(cloud, *drawn_with), block["seed"], block
            ).items():
                by_method.setdefault(key, []).append(pair)
            print(f"{cloud.subtype}, {points} points", file=sys.stderr)
        for (method, tolerance), pairs in by_method.items():
            seconds, errors = zip(*pairs, strict=True)
            row = method, tolerance, points, float(np.mean(seconds)), max(errors), hardware()
            rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def main(arguments: list[str]) -> None:
    """Measure and write the table."""
    line = parser("lowalt.measure.echo_cost", __doc__.partition("\n\n")[0])
    line.add_argument(
        "--clouds", nargs="+", required=True, help="cloud files, best one of each category"
    )
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args(arguments)
    keys = ("network", "motion", "seed", "cost", "published")
    network, motion, seed, block, published = pick(options.settings, *keys)
    block |= {"motion": motion, "seed": seed}
    write_csv(
        options.out,
        COLUMNS,
        measure(Network.from_settings(network), list(map(read, options.clouds)), published, block),
    )


if __name__ == "__main__":
    run(main)
