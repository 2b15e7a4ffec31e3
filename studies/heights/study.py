"""Measured heights and invented sizes: the best recipe known for subtypes that were not trained on.

    python studies/heights/study.py [--data default] [--seeds 0 1 2] [--no-heights] [--no-invented]
    [--for-cost]

Trains on the samples of a finished run and on those of the run `invented`, with the height that
each station measures; writes accuracy.csv and its companions into results/heights-DATA[-...].
"""

import argparse
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from heights import Heights, built, of_run

import trainings
from lowalt.config.command import run
from lowalt.recognition.recogniser import built as plain
from lowalt.recognition.samples import Samples, joined_sources
from lowalt.recognition.schemes import PROTOCOLS, TABLE, Scheme, named

INVENTED = Path("results/invented")


def source(
    data: Path, heights: bool, invented: bool, size: int, scheme: Scheme, pairs: set, part: str
) -> Samples:
    """Return the samples of a part: of the run, and those of invented sizes where it trains.

    The other run has a seed of its own, so its samples of equal keys are other ones; its motion
    models are numbered after the run's, since an epoch takes only a few SNRs of each number.
    """
    folders = [data, *([INVENTED] if invented and part == "train" else [])]
    images = [trainings.images_of(folder, scheme, pairs, size) for folder in folders]
    measured = []
    for folder, found in zip(folders, images, strict=True) if heights else ():
        of_key = of_run(folder)
        measured.append(
            np.array([of_key[key] for key in found.facts.key.tolist()])[:, list(scheme.stations)]
        )
    whole = images[0]
    for more in images[1:]:
        more.facts = replace(more.facts, model=more.facts.model + 1 + whole.facts.model.max())
        whole = joined_sources(whole, more)
    return Heights(whole, np.concatenate(measured)) if heights else whole


def main(arguments: list[str]) -> None:
    """Train both schemes in both protocols and write the tables."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument(
        "--data",
        default="default",
        help="finished run whose data set is trained on (default: default)",
    )
    line.add_argument(
        "--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)"
    )
    line.add_argument("--no-heights", action="store_true", help="images alone")
    line.add_argument("--no-invented", action="store_true", help="the run's own samples alone")
    line.add_argument(
        "--for-cost", action="store_true", help="three stations, unseen protocol, no tables"
    )
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    given = line.parse_args(arguments)
    config = trainings.config_of(Path(__file__).with_name("config.yaml"))
    data = Path("results") / given.data
    schemes = [
        named(TABLE, name, list(config["network"]["stations"]))
        for name in ("A:VRP+TRP+VT", "ABC:VRP+TRP+VT")
    ]
    kept = (not given.no_heights, not given.no_invented)
    words = ("heights", "invented")
    out = Path("results") / "-".join(
        [given.data, *(word for word, keep in zip(words, kept, strict=True) if keep)]
    )
    if kept[0]:
        # By its name no table takes the scheme for one that sees images alone. Heights are measured
        # once, not by each.
        schemes = [replace(one, name=f"{one.name} with height") for one in schemes]
        for folder in (data, *([INVENTED] if kept[1] else [])):
            of_run(folder)
    # `make accuracy-cost` compares three stations in the unseen protocol.
    asked = (schemes[1:], ["unseen"]) if given.for_cost else (schemes, PROTOCOLS)
    jobs = [trainings.Job(*one) for one in product(*asked, given.seeds)]
    of = partial(source, data, *kept, config["recognition"]["size"])
    call = partial(
        trainings.trained,
        config=config,
        data=data,
        out=out,
        source=of,
        build=built if kept[0] else plain,
    )
    paths = trainings.side_by_side(call, jobs, given.workers)
    if not given.for_cost:
        trainings.write_tables(paths, out, config["seed"])
        print(f"{out / 'accuracy.csv'}: written")


if __name__ == "__main__":
    run(main)
