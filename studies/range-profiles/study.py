"""Accuracy with and without range profiles, from the predictions of finished runs.

    python studies/range-profiles/study.py --run results/range-profiles results/range-profiles-narrow --out table.csv

table.csv, one row per run, protocol, task and scheme:
    run, cell_m, protocol       the run, length of its range cells, and its protocol
    task                        "four classes", or "UAV or bird": samples of these two classes alone, the more probable
                                of the two counts
    scheme, over                the scheme, and the scheme without profiles that it is compared with, the run's first
    seeds, by_seed_percent      training seeds; accuracy of each on the test samples
    accuracy_percent            mean over seeds
    difference_points, low, high    accuracy less that of `over`, with its 95 % interval over seeds, subtypes (unseen)
                                and motion models
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from lowalt.config.command import run
from lowalt.config.network import SPEED_OF_LIGHT, station_names
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition.evaluated import Evaluated, whole_subtypes
from lowalt.recognition.intervals import model_shares, strict_difference
from lowalt.recognition.schemes import named

COLUMNS = (
    "run", "cell_m", "protocol", "task", "scheme", "over", "seeds", "by_seed_percent", "accuracy_percent",
    "difference_points", "low", "high",
)  # fmt: skip
TASKS = {"four classes": None, "UAV or bird": ("UAV", "Bird")}


def judged(found: Evaluated, classes: tuple[str, ...] | None) -> tuple[np.ndarray, np.ndarray]:
    """Return which test samples a task has (samples,), and which of these are right (n,); classes: None for all."""
    test = found.test
    places = [found.classes.index(name) for name in classes or found.classes]
    rows = np.isin(test.label, places)
    return rows, np.array(places)[test.probabilities[rows][:, places].argmax(axis=1)] == test.label[rows]


def compared(
    task: str, with_profile: list[Evaluated], without: list[Evaluated], generator: np.random.Generator
) -> dict:
    """Return the columns from `seeds` on for the trainings of a scheme and of the one it is compared with.

    Raises: InputError where the two were tested on different samples.
    """
    test = without[0].test
    if any(not np.array_equal(one.test.key, test.key) for one in (*with_profile, *without)):
        raise InputError(f"{with_profile[0].scheme} and {without[0].scheme} were tested on different samples")
    rows, _ = judged(without[0], TASKS[task])
    right = [[judged(one, TASKS[task])[1] for one in group] for group in (with_profile, without)]
    (first, count, ours), (*_, theirs) = (model_shares(test.motion[rows], group) for group in right)
    by_seed = [100 * float(np.mean(one)) for one in right[0]]
    told = {
        "seeds": len(by_seed), "by_seed_percent": " ".join(f"{one:.2f}" for one in by_seed),
        "accuracy_percent": f"{np.mean(by_seed):.2f}", "difference_points": "", "low": "", "high": "",
    }  # fmt: skip
    if with_profile is without:
        return told
    strict = whole_subtypes(without)
    found = strict_difference(ours, theirs, count, test.subtype[rows][first], strict, generator)
    bounds = {"difference_points": found.value, "low": found.low, "high": found.high}
    return told | {name: f"{100 * value:+.2f}" for name, value in bounds.items()}


def rows_of(folder: Path) -> list[dict]:
    """Return the table's rows of one finished run.

    Raises: InputError where it has no configuration or a prediction is missing.
    """
    config = load_yaml(folder / "config.yaml")
    block, network = config["recognition"], config["network"]
    cell_m = SPEED_OF_LIGHT / (2 * network["subcarriers"] * network["subcarrier_spacing_hz"])
    schemes = [named(block["table"], name, station_names(network)) for name in block["schemes"]]
    found = []
    for protocol in block["protocols"]:
        of = {
            scheme.name: [Evaluated(folder / "predictions" / protocol / scheme.slug / f"{seed}.csv")
                          for seed in block["seeds"]]
            for scheme in schemes if protocol in scheme.protocols
        }  # fmt: skip
        over = next(iter(of))
        for task in TASKS:
            for name, runs in of.items():
                generator = stream(config["seed"], "range profiles", protocol, task, name)
                found.append({
                    "run": config["run"], "cell_m": f"{cell_m:.3f}", "protocol": protocol, "task": task,
                    "scheme": name, "over": "" if name == over else over,
                    **compared(task, runs, of[over], generator),
                })  # fmt: skip
    return found


def main(arguments: list[str]) -> None:
    """Write the table of several runs."""
    options = argparse.ArgumentParser(prog="study.py", description=main.__doc__)
    options.add_argument("--run", required=True, nargs="+", type=Path, help="folders of finished runs")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    rows = [row for folder in given.run for row in rows_of(folder)]
    write_csv(given.out, COLUMNS, [[row[name] for name in COLUMNS] for row in rows])
    print(f"{given.out}: {len(rows)} rows", file=sys.stderr)


if __name__ == "__main__":
    run(main)
