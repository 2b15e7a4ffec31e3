"""One choice of the paper at a time: `python studies/open-choices/study.py [--table TABLE.yaml]
[--rows NAME ...]`.

Each row of `choices.yaml` makes the data of its change, trains the small network three times on the
subtypes that the unseen protocol trains on, and is judged by the twenty others. Clean signals are
kept by what decides them, so a row repeats only the stages that it changes, and an interrupted run
goes on where it stopped. Writes NAME.csv (a row a choice) and NAME-subtypes.csv (a row a choice and
held-out subtype), NAME that of the table.
"""

import argparse
import sys
import time
from pathlib import Path

from choice_rows import HERE, SVM, judged
from choice_tables import write_tables

import trainings
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.yaml_files import load_yaml


def side_by_side(table: dict, seeds: int, workers: int) -> None:
    """Make the samples of all rows or, of so many of the table's seeds, their trainings, in
    processes side by side.
    """
    jobs = [
        (
            merge(merge(trainings.config_of(), table["base"]), block.get("overlay", {})),
            block.get("local", {}),
            table["scheme"],
            seed,
        )
        for seed in table["base"]["recognition"]["seeds"][:seeds] or [None]
        for block in table["rows"].values()
    ]
    trainings.side_by_side(made, jobs, workers)


def made(job: tuple) -> None:
    """Make what a row's training from one seed needs and, where there is a seed, the training."""
    judged(*job)


def main(arguments: list[str]) -> None:
    """Run every row that is not there yet, and write the tables after each."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument(
        "--table", type=Path, default=HERE / "choices.yaml", help="table of rows (.yaml)"
    )
    line.add_argument("--out", type=Path, default=HERE / "results", help="folder of the tables")
    line.add_argument("--rows", nargs="+", help="first row and others to run (default: all)")
    line.add_argument(
        "--finished", action="store_true", help="tables of what is finished, without a training"
    )
    line.add_argument(
        "--svm", action="store_true", help="a support vector machine instead of the network"
    )
    line.add_argument(
        "--scheme", help="another scheme than the table's; its name goes into those of the tables"
    )
    line.add_argument(
        "--workers",
        type=int,
        help="make samples, then trainings, in as many processes side by side",
    )
    given = line.parse_args(arguments)
    table = load_yaml(given.table)
    if given.scheme:
        table["name"] += f"-{given.scheme.partition(':')[0]}"
        table["scheme"] = given.scheme
    table["rows"] = {
        name: block
        for name, block in table["rows"].items()
        if name in (given.rows or table["rows"])
    }
    paths: dict[str, list[Path]] = {}
    if given.svm:
        table["name"] += "-svm"
        table["base"]["recognition"]["seeds"] = [SVM]
    if given.workers:
        for seeds in (0, len(table["base"]["recognition"]["seeds"])):
            side_by_side(table, seeds, given.workers)
    # Seed by seed, so that an unfinished run has judged every row equally often.
    for seed in table["base"]["recognition"]["seeds"]:
        for name, block in table["rows"].items():
            config = merge(merge(trainings.config_of(), table["base"]), block.get("overlay", {}))
            began = time.process_time()
            path = judged(config, block.get("local", {}), table["scheme"], seed, not given.finished)
            if path is not None:
                paths.setdefault(name, []).append(path)
                print(
                    f"{name}, seed {seed}: {time.process_time() - began:.0f} core-s",
                    file=sys.stderr,
                    flush=True,
                )
        if not given.finished:
            write_tables(table, paths, given.out)
    if given.finished:
        write_tables(table, paths, given.out)


if __name__ == "__main__":
    run(main)
