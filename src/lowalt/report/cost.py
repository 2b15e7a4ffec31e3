"""What the echo's accuracy costs, carried down the chain: pixels that change at each tolerance, and the figure.

    python -m lowalt.report.cost --settings JSON --table cost.csv --clouds a.npz ... --targets config/targets.csv
        --out-table cost_pixels.csv --figure cost.png

Settings: network, motion, spectra, images and cost blocks of the configuration, and its seed. `--table` is what
`lowalt.measure.echo_cost` measured on the same clouds; its rows with a cloud's own number of points tell the time
saved.
"""

import sys
from collections.abc import Iterable
from csv import DictWriter
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import BelowFloor, InputError
from lowalt.common.files import replacing
from lowalt.common.network import Network
from lowalt.echo import echo_signal
from lowalt.measure.echo_cost import sample
from lowalt.report.tables import read_csv
from lowalt.spectra import Spectra
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.records import load_table
from lowalt.tiles.render import Renderer
from lowalt.tiles.settings import Images

COLUMNS = (
    "category", "subtype", "points", "range_m", "tolerance", "models", "pixels", "changed_pixels", "changed_share",
    "largest_step", "time_saved",
)  # fmt: skip
NEEDED = ("method", "category", "subtype", "points", "range_m", "tolerance", "seconds", "relative_error")
"""Columns of the measured table that are used here."""


def signals(network: Network, given: tuple, tolerance: float | None) -> np.ndarray:
    """Return clean signals (stations, N) complex64 as the echo stage stores them; None is the exact mode.

    A station at which float64 cannot promise the tolerance keeps the exact signal, as a user would have to.
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
    """Return a row (keys COLUMNS but `time_saved`) for every cloud, distance and tolerance: pixels that change.

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


def _time_panel(panel, measured: list[dict[str, str]], methods: list[str], distances: list[float]) -> None:
    """Time a sample over its error for one category: colour says the method, marker the distance."""
    from matplotlib.ticker import LogLocator, NullFormatter

    for distance in distances:
        curve = [line for line in measured if line["method"] == "engine" and float(line["range_m"]) == distance]
        steps = sorted((float(line["relative_error"]), 1e3 * float(line["seconds"])) for line in curve)
        panel.plot(*np.reshape(steps, (-1, 2)).T, color=f"C{methods.index('engine')}", lw=0.7, alpha=0.5)
    for line in measured:
        error = max(float(line["relative_error"]), 1e-17)
        engine = line["method"] == "engine"
        panel.plot(
            error, 1e3 * float(line["seconds"]), marker="osD^v"[distances.index(float(line["range_m"])) % 5],
            color=f"C{methods.index(line['method'])}", markersize=7 if line["tolerance"] == "exact" else 4.5,
            fillstyle="none" if engine and line["tolerance"] != "exact" else "full", linestyle="none",
        )  # fmt: skip
    panel.set(xscale="log", yscale="log", xlabel="measured error / largest value")
    panel.xaxis.set_major_locator(LogLocator(numticks=6))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(alpha=0.3)


def _pixel_panel(panel, rows: list[dict], distances: list[float]) -> None:
    """Share of pixels that change over the tolerance for one category, a line a distance."""
    for index, distance in enumerate(distances):
        chosen = sorted((row["tolerance"], 100 * row["changed_share"]) for row in rows if row["range_m"] == distance)
        panel.plot(*zip(*chosen, strict=True), "osD^v"[index % 5] + "-", color=str(0.6 * index / len(distances)),
                   markersize=4, linewidth=1)  # fmt: skip
    panel.set(xscale="log", xlabel="tolerance asked for")
    panel.set_yscale("symlog", linthresh=1e-3)
    panel.grid(alpha=0.3)


def figure(measured: list[dict[str, str]], rows: list[dict]):
    """Return the matplotlib figure, a column a category: time over error above, a row a number of points, and changed
    pixels over tolerance below."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    categories = list(dict.fromkeys(row["category"] for row in rows))
    distances = sorted({float(row["range_m"]) for row in rows} | {float(line["range_m"]) for line in measured})
    methods = list(dict.fromkeys(line["method"] for line in measured))
    by_category = {name: [line for line in measured if line["category"] == name] for name in categories}
    counts = {name: sorted({int(line["points"]) for line in mine}) for name, mine in by_category.items()}
    tall = max(map(len, counts.values()))
    result = Figure(figsize=(3.6 * len(categories) + 0.6, 3.3 * tall + 4), dpi=110, layout="constrained")
    panels = result.subplots(tall + 1, len(categories), sharey="row", squeeze=False)
    for column, category in enumerate(categories):
        for row in range(tall):
            if row >= len(counts[category]):
                panels[row, column].set_visible(False)
                continue
            points = counts[category][row]
            mine = [line for line in by_category[category] if int(line["points"]) == points]
            _time_panel(panels[row, column], mine, methods, distances)
            panels[row, column].set_title(f"{category}, {points} points", fontsize=10)
        _pixel_panel(panels[tall, column], [row for row in rows if row["category"] == category], distances)
    top = 100 * max(row["changed_share"] for row in rows)
    panels[tall, 0].set_ylim(-2e-4, max(2 * top, 1e-2))
    for row in range(tall):
        panels[row, 0].set_ylabel("time a signal (ms), one core")
    panels[tall, 0].set_ylabel("8-bit pixels that change (%)")
    keys = [Line2D([], [], color=f"C{index}", marker=".", linestyle="none", markersize=10, label=method)
            for index, method in enumerate(methods)]  # fmt: skip
    keys += [Line2D([], [], color="0.3", marker="osD^v"[index % 5], linestyle="none", label=f"{distance:g} m")
             for index, distance in enumerate(distances)]  # fmt: skip
    note = Line2D([], [], color="none", label="engine: filled exact, open at tolerances")
    result.legend(handles=[*keys, note], loc="outside upper center", ncols=len(keys) // 2 + 1, fontsize=9)
    return result


def main(arguments: list[str]) -> None:
    """Count the pixels that change, and write the table and the figure."""
    options = parser("lowalt.report.cost", __doc__.splitlines()[0])
    options.add_argument("--table", required=True, help="what lowalt.measure.echo_cost measured (.csv)")
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files, the same as that table's")
    options.add_argument("--targets", required=True, help="table of published targets (config/targets.csv)")
    options.add_argument("--out-table", required=True, help="table of changed pixels to write (.csv)")
    options.add_argument("--figure", required=True, type=Path, help="figure to write (.png)")
    given = options.parse_args(arguments)
    keys = ("network", "motion", "spectra", "images", "seed", "cost")
    network, motion, spectra, images, seed, block = pick(given.settings, *keys)
    block |= {"motion": motion, "seed": seed}
    measured = read_csv(given.table, *NEEDED)
    renderer = Renderer(
        Network.from_settings(network), Spectra.from_settings(spectra), Images.from_settings(images)
    )  # fmt: skip
    rows = pixels(renderer, [read(path) for path in given.clouds], load_table(given.targets), block)
    with replacing(given.out_table) as temporary, temporary.open("w", newline="") as file:
        writer = DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(row | {"time_saved": saved(measured, row)} for row in rows)
    with replacing(given.figure) as temporary:
        figure(measured, rows).savefig(temporary, metadata={"Software": None})


if __name__ == "__main__":
    run(main)
