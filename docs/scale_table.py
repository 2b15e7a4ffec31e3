"""Time and disk that a configuration would take, scaled from the measured stages of a finished run.

Data stages scale with samples: core-seconds per sample of the measured run, times the samples
planned. Training scales with images through the backbone: milliseconds per training sample of the
same backbone at the same size on one core, as accuracy_cost.csv has it, times all steps of all
schemes. Early stopping and validation are left out. A network that was never timed gets no
estimate. All times are those of the measured processor, not of a GPU.
"""

import argparse
import math
from pathlib import Path

from lowalt.config.command import run
from lowalt.config.layers import load
from lowalt.config.network import station_names
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.errors import InputError
from lowalt.recognition.schemes import named
from lowalt.shards.plan import Plan
from lowalt.targets.records import records_of

DATA_RULES = ("motion", "echo", "noise", "tiles", "shard", "index")
UNUSED = {"image": set(), "signal": {"tiles"}, "recipe": {"tiles", "noise"}}
"""Data stages that a kind of shards does without."""
COLUMNS = (
    "configuration",
    "motion_models",
    "samples",
    "core_hours",
    "shards_gb",
    "noisy_gb",
    "measured_on",
    "trainings",
    "training_core_hours",
    "training_measured_on",
)
COST_COLUMNS = ("backbone", "pixels", "network_bytes", "train_ms", "hardware")


def samples_of(config: dict) -> tuple[int, int]:
    """Return (motion models, samples) of a checked configuration.

    Raises: InputError where its plan is refused.
    """
    plan = Plan.of(
        config, {name: item["published"] for name, item in records_of(config["targets"]).items()}
    )
    models = plan.models * sum(map(len, plan.groups.values()))
    return models, models * len(plan.snrs)


def _images(row: dict[str, str]) -> int:
    """Number of images of a sample that the network of a row takes in: bytes over pixels, a byte a
    pixel.
    """
    return int(row["network_bytes"]) // int(row["pixels"]) ** 2


def training_hours(costs: list[dict[str, str]], config: dict) -> tuple[int, float | None, str]:
    """Return (trainings, core-hours of them all, hardware) of a configuration; None and "" if a
    network was not timed.

    costs: rows of accuracy_cost.csv. Of each network the row of the most images per sample counts;
    a scheme of another number of images takes time in proportion.
    """
    block = config["recognition"]
    known = {}
    for row in costs:
        key = row["backbone"], int(row["pixels"] or 0)
        if row["train_ms"] and (key not in known or _images(row) > _images(known[key])):
            known[key] = row
    most = max(map(_images, known.values()), default=0)
    stations = station_names(config["network"])
    number = 0
    hours = 0.0
    hardware = ""
    for scheme in (named(block["table"], name, stations) for name in block["schemes"]):
        settings = scheme.settled(block)
        repeats = len(set(block["protocols"]) & set(scheme.protocols)) * len(block["seeds"])
        number += repeats
        measured = known.get((scheme.backbone or block["network"]["backbone"], settings["size"]))
        if measured is None or _images(measured) < most:
            hours = math.nan
            continue
        visits = repeats * settings["training"]["steps"] * settings["training"]["batch"]
        hours += visits * float(measured["train_ms"]) * len(scheme.columns) / most / 3.6e6
        hardware = measured["hardware"]
    return (number, None, "") if math.isnan(hours) else (number, hours, hardware)


def estimate(
    stages: list[dict[str, str]], costs: list[dict[str, str]], config: dict, name: str
) -> dict[str, object]:
    """Return one row of COLUMNS for `config`, scaled from rows of stages.csv and accuracy_cost.csv.

    Raises: InputError where a data stage was not measured.
    """
    seconds = {row["rule"]: float(row["wall_s"]) for row in stages}
    missing = [rule for rule in DATA_RULES if rule not in seconds]
    if missing:
        raise InputError(f"stages: no row for {missing}, expected a finished run's stages.csv")
    measured = int(stages[0]["samples"])
    models, samples = samples_of(config)
    made = set(DATA_RULES) - UNUSED[config["shards"]["kind"]]
    core_hours = sum(seconds[rule] for rule in made) / measured * samples / 3600
    signal = 8 * config["network"]["symbols"] * len(config["network"]["stations"])
    levels = len(config["noise"]["snr_db"])
    by_kind = {
        "image": float(stages[0]["sample_bytes"]),
        "signal": signal,
        "recipe": signal / levels,
    }
    disk = by_kind[config["shards"]["kind"]]
    trainings, hours, hardware = training_hours(costs, config)
    row = (
        name,
        models,
        samples,
        round(core_hours, 2),
        round(disk * samples / 1e9, 1),
        round(signal * samples / 1e9, 1),
        stages[0]["hardware"],
        trainings,
        "" if hours is None else round(hours, 1),
        hardware,
    )
    return dict(zip(COLUMNS, row, strict=True))


def main(arguments: list[str]) -> None:
    """Write a row of every overlay."""
    line = argparse.ArgumentParser(prog="scale_table.py", description=__doc__)
    line.add_argument("--stages", required=True, help="stages.csv of a finished run")
    line.add_argument("--costs", required=True, help="table of lowalt.measure.accuracy_cost (.csv)")
    line.add_argument("--schema", required=True, help="schema of the configuration (.yaml)")
    line.add_argument(
        "--base", required=True, help="configuration on which the overlays lie (.yaml)"
    )
    line.add_argument(
        "--overlays", nargs="+", required=True, help="configurations to estimate (.yaml)"
    )
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args(arguments)
    stages = read_csv(options.stages, "rule", "wall_s", "samples", "sample_bytes", "hardware")
    costs = read_csv(options.costs, *COST_COLUMNS)
    rows = [
        estimate(stages, costs, load([options.base, overlay], options.schema), Path(overlay).stem)
        for overlay in options.overlays
    ]
    write_csv(options.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
