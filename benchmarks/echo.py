"""The echo stage as the workflow runs it, files included.

    python benchmarks/echo.py --clouds results/default/clouds/*.npz [--models 2000] [--out
    echo_stage.csv]

Writes the stage's rate on motion models of mixed subtypes by the real command, with one and with
two processes at a time; the shares of its time that poses, signals, kernels and correct rounding
take; and how it scales with points, symbols, stations and cores. A process has one thread; run it
on a quiet machine.
"""

import argparse
import dataclasses
import functools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lowalt.config.layers import canonical
from lowalt.config.network import Network
from lowalt.echo import echo_signal
from lowalt.echo.echo_input import Rigid
from lowalt.echo.fast import driver
from lowalt.echo.rounding import nearest
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.measure import echo_cost as cost
from lowalt.motion import poses, write_table
from lowalt.motion.drawing import draw, region_polygon
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.records import load_table

PAPER = 240_000
"""Motion models of the paper, each seen by three stations."""
CHUNK = 1000
"""Models a job: 50 of each of a protocol's 20 subtypes, in the default's chunks and in the paper's.
"""


def models(config: dict, clouds: list[Cloud], count: int) -> list[dict]:
    """Motion table of `count` models, subtypes in turn."""
    network = Network.from_settings(config["network"])
    published = load_table("config/targets.csv")
    masts = np.array([station.position_m[:2] for station in network.stations])
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    rows = []
    half = len(clouds) // 2
    for index in range(count):
        # As in the workflow, a chunk holds half of the subtypes.
        cloud = clouds[index // CHUNK % 2 * half + index % half]
        rng = stream(1, "benchmark", cloud.subtype, index)
        row = draw(rng, cloud, published[cloud.subtype], masts, corners, config["motion"])
        rows.append(row | {"group": "seen", "model": index})
    return rows


def stage(
    config: dict,
    paths: dict[str, str],
    rows: list[dict],
    jobs_of: list[list[str]],
    processes: int,
    folder: Path,
) -> float:
    """Seconds that the echo command takes for all rows, `processes` at a time: a job per chunk and
    list of stations.

    paths: the cloud file of each subtype; a job gets those of its chunk. A job has one thread, as
    Snakemake gives it: jobs side by side would otherwise fight for cores. Python may keep its
    bytecode, as it does unless forbidden to.
    """
    alone = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    alone.pop("PYTHONDONTWRITEBYTECODE", None)
    block = canonical({"network": config["network"], "tolerance": config["echo"]["tolerance"]})
    jobs = []
    for part in range(0, len(rows), CHUNK):
        table = folder / f"{part}.csv"
        chunk = rows[part : part + CHUNK]
        write_table(table, chunk)
        clouds = dict.fromkeys(paths[row["subtype"]] for row in chunk)
        for names in jobs_of:
            files = [str(folder / f"{part}-{name}.npy") for name in names]
            jobs.append(
                [
                    sys.executable,
                    "-m",
                    "lowalt.echo",
                    "--settings",
                    block,
                    "--motion",
                    str(table),
                    "--clouds",
                    *clouds,
                    "--station",
                    *names,
                    "--out",
                    *files,
                ]
            )
    start = time.perf_counter()
    running = []
    for job in jobs:
        while len(running) == processes:
            time.sleep(0.005)
            ended = [process for process in running if process.poll() is not None]
            if any(process.returncode for process in ended):
                raise SystemExit("the echo command failed")
            running = [process for process in running if process not in ended]
        running.append(subprocess.Popen(job, env=alone, stderr=subprocess.DEVNULL))
    if any(process.wait() for process in running):
        raise SystemExit("the echo command failed")
    return time.perf_counter() - start


def inside(config: dict, clouds: list[Cloud], rows: list[dict]) -> dict:
    """Return the seconds of poses, signals, and in these of kernels and of correct rounding, and
    counts of symbols.

    All rows at all stations, without files and start-up.
    """
    network = Network.from_settings(config["network"])
    by_name = {cloud.subtype: cloud for cloud in clouds}
    kernel = driver.run
    correct = nearest.correct
    spent = {
        "poses_s": 0.0,
        "signals_s": 0.0,
        "kernel_s": 0.0,
        "rounding_s": 0.0,
        "again": 0,
        "symbols": 0,
    }

    def timed(name: str, call: Callable, *arguments):
        """Return the call's result and add its wall time to spent[name]."""
        start = time.perf_counter()
        result = call(*arguments)
        spent[name] += time.perf_counter() - start
        return result

    driver.run = functools.partial(timed, "kernel_s", kernel)
    nearest.correct = functools.partial(timed, "rounding_s", correct)
    try:
        for row in rows:
            cloud = by_name[row["subtype"]]
            aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
            motion = Rigid(
                *timed("poses_s", poses, cloud, row, network.times_s), cloud.points, cloud.part
            )
            for station in network.stations:
                found = timed(
                    "signals_s",
                    echo_signal,
                    network,
                    station,
                    motion,
                    cloud.rcs_m2,
                    aim,
                    config["echo"]["tolerance"],
                )
                spent["again"] += found.method.again[0]
                spent["symbols"] += network.symbols
    finally:
        driver.run = kernel
        nearest.correct = correct
    return spent


def scaling(config: dict, cloud: Cloud) -> list[dict]:
    """Seconds a signal over points, symbols and tolerances, for one cloud resampled."""
    network = Network.from_settings(config["network"])
    published = load_table("config/targets.csv")
    sizes = [(400, 31, None), (400, 100, None), (100, 400, None), (1600, 400, None)]
    sizes += [
        (400, points, tolerance)
        for points in (400, 1600, 5000)
        for tolerance in (None, 1e-9, 1e-6, 1e-4, 1e-2)
    ]
    calls = []
    for symbols, points, tolerance in sizes:
        longer = dataclasses.replace(network, symbols=symbols)
        given = cost.sample(
            cloud, published[cloud.subtype], longer, config["motion"], 1, 200.0, points
        )
        call = functools.partial(echo_signal, longer, longer.stations[0], *given, tolerance)
        call()
        calls.append((call, 7, 3))
    named = ["exact" if tolerance is None else f"{tolerance:g}" for _, _, tolerance in sizes]
    return [
        {
            "what": (
                f"one signal of {cloud.category} {cloud.subtype}, {symbols} symbols x {points}"
                f" points, {name}"
            ),
            "seconds": seconds,
        }
        for (symbols, points, _), name, (seconds, _) in zip(
            sizes, named, cost.in_turn(calls), strict=True
        )
    ]


def main() -> None:
    """Measure the stage and write the table."""
    line = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    line.add_argument("--clouds", nargs="+", required=True)
    line.add_argument("--config", default="config/default.yaml")
    line.add_argument("--models", type=int, default=2000)
    line.add_argument("--out", type=Path, default=Path("results/benchmarks/echo_stage.csv"))
    given = line.parse_args()
    config = load_yaml(given.config)
    clouds = [read(path) for path in given.clouds]
    lacking = set(load_table("config/targets.csv")) - {cloud.subtype for cloud in clouds}
    if lacking:
        raise SystemExit(
            f"--clouds: no cloud of {sorted(lacking)}, expected all subtypes (`make data`)"
        )
    rows = models(config, clouds, given.models)
    everyone = list(config["network"]["stations"])
    first = {cloud.category: cloud for cloud in reversed(clouds)}
    result = scaling(config, first["UAV"]) + scaling(config, first["Vehicle"])
    paths = {cloud.subtype: path for cloud, path in zip(clouds, given.clouds, strict=True)}
    with tempfile.TemporaryDirectory() as folder:
        for processes, how, jobs_of in (
            (1, "echo.job: chunk", [everyone]),
            (2, "echo.job: chunk", [everyone]),
            (2, "echo.job: station", [[name] for name in everyone]),
        ):
            seconds = stage(config, paths, rows, jobs_of, processes, Path(folder))
            result.append(
                {
                    "what": (
                        f"echo stage, {len(rows)} models x {len(everyone)} stations, {how}, "
                        f"{processes} process(es)"
                    ),
                    "seconds": seconds,
                    "models_per_s": len(rows) / seconds,
                    "paper_minutes": PAPER / (len(rows) / seconds) / 60,
                }
            )
        start = stage(config, paths, rows[:1], [everyone[:1]], 1, Path(folder))
    result.append(
        {"what": "a job of one model and station: start, files and first calls", "seconds": start}
    )
    alone = [row["seconds"] for row in result if "1 process" in row["what"]][-1]
    spent = inside(config, clouds, rows)
    again = spent.pop("again")
    symbols = spent.pop("symbols")
    result += [
        {
            "what": f"inside the stage, 1 process: {name[:-2]}",
            "seconds": value,
            "share": value / alone,
        }
        for name, value in spent.items()
    ]
    result[-1]["what"] += f", {again} of {symbols} symbols computed again"
    columns = ("what", "seconds", "models_per_s", "paper_minutes", "share", "hardware")
    write_csv(given.out, columns, [row | {"hardware": cost.hardware()} for row in result])
    print(given.out.read_text(), end="")


if __name__ == "__main__":
    main()
