"""Accuracy of the echo over its time: every method and tolerance, clouds of each category at several distances.

    python -m lowalt.measure.echo_cost --settings JSON --clouds a.npz ... --targets config/targets.csv --out cost.csv

Settings: network, motion and cost blocks of the configuration, and its seed.
"""

import functools
import os
import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import Network, Station
from lowalt.echo.api import echo_signal
from lowalt.echo.scene import Rigid
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import BelowFloor
from lowalt.machine.hardware import processor
from lowalt.machine.timing import in_turn
from lowalt.measure import echo_baselines
from lowalt.motion import poses
from lowalt.motion.sample import draw, region_polygon
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import Cloud, read

COLUMNS = (
    "method", "category", "subtype", "points", "range_m", "tolerance", "seconds", "relative_error", "proved_bound",
    "ratio_to_finufft", "ratio_to_direct", "hardware",
)  # fmt: skip


def hardware() -> str:
    """The processor's name and how many of its cores were used, as the table gives them."""
    return f"{processor()}, {os.cpu_count()} cores, one used"


def sample(
    cloud: Cloud, published: dict, network: Network, motion: dict, seed: int, distance_m: float, points: int | None
) -> tuple[Rigid, np.ndarray, np.ndarray]:
    """A random motion of `cloud` that starts `distance_m` from the first station: (motion, rcs_m2, aim_m).

    points: take so many of the cloud's points, at random and repeated if need be (None: all, as they are).
    """
    rng = stream(seed, "cost", cloud.subtype, distance_m, points or 0)
    masts = np.array([station.position_m[:2] for station in network.stations])
    row = draw(rng, cloud, published, masts, region_polygon(masts, motion["region"]["polygon_m"]), motion)
    station = network.stations[0]
    rise = row["z_m"] - station.position_m[2]
    rise = float(np.clip(rise, -0.9 * distance_m, 0.9 * distance_m))
    flat, turn = np.sqrt(distance_m**2 - rise**2), station.normal_rad + rng.uniform(-0.8, 0.8)
    row["x_m"] = station.position_m[0] + flat * np.cos(turn)
    row["y_m"] = station.position_m[1] + flat * np.sin(turn)
    row["z_m"] = station.position_m[2] + rise
    row["model"] = 0
    chosen = np.arange(len(cloud.points)) if points is None else np.sort(rng.integers(0, len(cloud.points), points))
    order = chosen[np.argsort(cloud.part[chosen], kind="stable")]
    moved = Rigid(*poses(cloud, row, network.times_s), cloud.points[order], cloud.part[order])
    return moved, cloud.rcs_m2[order], np.array([row["x_m"], row["y_m"], row["z_m"]])


def truths(network: Network, station: Station, given: tuple, signal: np.ndarray, seed: int) -> dict[int, np.ndarray]:
    """All cells at eight random symbols and the two deepest fades, by `echo_baselines.judge`."""
    rng = stream(seed, "judged symbols")
    chosen = {*rng.choice(len(signal), min(8, len(signal)), replace=False).tolist(), *np.argsort(abs(signal))[:2]}
    return {int(n): echo_baselines.judge(network, station, *given, int(n)) for n in chosen}


def error(signal: np.ndarray, truth: dict[int, np.ndarray]) -> float:
    """Largest error at the judged symbols relative to max |signal|, each against the judge's strongest cell."""
    worst = max(abs(signal[n] - cells[abs(cells).argmax()]) for n, cells in truth.items())
    return float(worst / abs(signal).max())


def rows_of(network: Network, cloud: Cloud, given: tuple, distance_m: float, seed: int, block: dict) -> list[dict]:
    """Measure all methods on one sample; seconds are medians, ratios come from the same run.

    block: tolerances, repeats, and direct_repeats for the slow direct sum (0: leave it out).
    """
    station = network.stations[0]
    arguments = (network, station, *given)
    repeats = block["repeats"]
    exact = echo_signal(*arguments)
    truth = truths(network, station, given, exact.signal, seed)
    base = {
        "category": cloud.category, "subtype": cloud.subtype, "points": len(given[1]), "range_m": distance_m,
        "hardware": hardware(), "proved_bound": "",
    }  # fmt: skip
    methods = [("closed form, numpy", "", lambda: echo_baselines.closed(*arguments), repeats, 1),
               ("FINUFFT", 1e-9, lambda: echo_baselines.finufft(*arguments), repeats, 1)]  # fmt: skip
    if block["direct_repeats"]:
        methods.append(("direct sum, numpy", "", lambda: echo_baselines.direct(*arguments), block["direct_repeats"], 1))
        methods.append(("factored sum, numpy", "", lambda: echo_baselines.factored(*arguments), repeats, 1))
    for tolerance in (None, *block["tolerances"]):
        call = functools.partial(echo_signal, *arguments, tolerance)
        try:
            call()
        except BelowFloor:
            continue
        # A call takes about a millisecond: with only five calls, one interrupt would be a quarter of the time.
        methods.append(("engine", tolerance or "exact", call, repeats, 8))
    rows = []
    found = in_turn([(call, rounds, calls) for _, _, call, rounds, calls in methods])
    for (method, tolerance, *_), (seconds, result) in zip(methods, found, strict=True):
        signal, bound = (result.signal, result.bound) if method == "engine" else (result, "")
        rows.append(base | {"method": method, "tolerance": tolerance, "seconds": seconds,
                            "relative_error": error(signal, truth), "proved_bound": bound})  # fmt: skip
    for row in rows:
        for column, method in (("ratio_to_finufft", "FINUFFT"), ("ratio_to_direct", "direct sum, numpy")):
            peer = [other["seconds"] for other in rows if other["method"] == method]
            row[column] = peer[0] / row["seconds"] if peer else ""
    return rows


def measure(network: Network, clouds: list[Cloud], published: dict, block: dict) -> list[dict]:
    """Return the table's rows (keys COLUMNS) for all clouds, distances and numbers of points (0: the cloud as it is).

    The direct sum, whose time does not depend on the distance, is timed at `direct_distances_m` alone.
    """
    rows = []
    for cloud in clouds:
        for distance_m in block["distances_m"]:
            direct = block["direct_repeats"] if distance_m in block["direct_distances_m"] else 0
            for points in block["points"]:
                given = sample(
                    cloud, published[cloud.subtype], network, block["motion"], block["seed"], distance_m, points or None
                )
                rows += rows_of(network, cloud, given, distance_m, block["seed"], block | {"direct_repeats": direct})
                print(f"{cloud.subtype}, {distance_m} m, {len(given[1])} points", file=sys.stderr)
    return rows


def main(arguments: list[str]) -> None:
    """Measure and write the table."""
    options = parser("lowalt.measure.echo_cost", __doc__.splitlines()[0])
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files, best one of each category")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    keys = ("network", "motion", "seed", "cost", "published")
    network, motion, seed, block, published = pick(given.settings, *keys)
    block |= {"motion": motion, "seed": seed}
    network = Network.from_settings(network)
    rows = measure(network, [read(path) for path in given.clouds], published, block)
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
