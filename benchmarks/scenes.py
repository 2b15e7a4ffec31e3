"""Cost of a scene without effects against the echo stage alone: the same signals, made by both in one run.

    python benchmarks/scenes.py --run results/default --out results/benchmarks/scenes.csv

Processor seconds of one core, medians of alternating repeats, on the first motion models of the run's first chunk at
its first station. The peer is the echo stage (`lowalt.echo`), which a run without effects uses. It is compared with
the chain of effects (`lowalt.effects`) with no effect named, with only idle ones, and with one effect on the motion.
"""

import argparse
import statistics
import time
from pathlib import Path

import numpy as np

from lowalt.common.config import load_yaml
from lowalt.common.csv_tables import write_csv
from lowalt.common.hardware import describe
from lowalt.common.network import Network
from lowalt.common.timing import once
from lowalt.echo.chunk import clean_signals
from lowalt.effects.catalogue import called
from lowalt.effects.chunk import scene_signals
from lowalt.effects.received import Scene
from lowalt.motion import read_table
from lowalt.targets.cloud import read

COLUMNS = ("method", "models", "ms_per_signal", "ratio_to_echo_stage", "same_bytes", "hardware")
CALLS = {
    "chain, no effect named": {},
    "chain, idle effects named": {"adc": {"bits": 0}, "cell_error": {"probability": 0.0}},
    "chain, rotor_spread": {"rotor_spread": {}},
}


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--run", type=Path, required=True, help="folder of a run with clouds, motion and config.yaml")
    options.add_argument("--models", type=int, default=100)
    options.add_argument("--repeats", type=int, default=7)
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    config = load_yaml(given.run / "config.yaml")
    network = Network.from_settings(config["network"])
    rows = read_table(sorted((given.run / "motion").glob("*.csv"))[0])[: given.models]
    clouds = {cloud.subtype: cloud for cloud in map(read, sorted((given.run / "clouds").glob("*.npz")))}
    name = network.stations[0].name
    work = {"echo stage": lambda: clean_signals(network, [name], clouds, rows, None)[0]}
    for label, block in CALLS.items():
        scene = Scene(network, config["seed"], None, tuple(called(block)))
        work[label] = lambda scene=scene: scene_signals(scene, name, clouds, rows)[0]
    results = {label: call() for label, call in work.items()}
    taken: dict[str, list[float]] = {label: [] for label in work}
    for _ in range(given.repeats):
        for label, call in work.items():
            taken[label].append(once(call, time.process_time)[0])
    base = statistics.median(taken["echo stage"])
    table = []
    for label, times in taken.items():
        spent, same = statistics.median(times), np.array_equal(results[label], results["echo stage"])
        table.append([label, len(rows), f"{1e3 * spent / len(rows):.3f}", f"{spent / base:.3f}", same, describe()])
        print(*table[-1], sep=", ")
    write_csv(given.out, COLUMNS, table)


if __name__ == "__main__":
    main()
