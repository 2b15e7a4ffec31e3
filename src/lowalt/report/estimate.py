"""What a configuration would cost in time and disk, from the measured stages of a finished run.

Data stages scale with samples: core-seconds a sample of the measured run, times the samples planned. Training scales
with sample visits of the same scheme and backbone only; another backbone or device is not extrapolated.
"""

import csv
import sys
from pathlib import Path

from lowalt.config import load
from lowalt.errors import InputError
from lowalt.files import replacing
from lowalt.plan import Plan
from lowalt.report.tables import read_csv
from lowalt.targets.records import load_table

DATA_RULES = ("motion", "echo", "noise", "tiles", "shard", "index")
COLUMNS = ("configuration", "motion_models", "samples", "core_hours", "shards_gb", "noisy_gb", "measured_on")


def samples_of(config: dict) -> tuple[int, int]:
    """Return (motion models, samples) of a checked configuration.

    Raises: InputError where its plan is refused.
    """
    plan = Plan.of(config, load_table(config["targets"]["table"]))
    models = plan.models * sum(map(len, plan.groups.values()))
    return models, models * len(plan.snrs)


def estimate(stages: list[dict[str, str]], config: dict, name: str) -> dict[str, object]:
    """Return one row of COLUMNS for `config`, scaled from measured `stages` (rows of stages.csv).

    Raises: InputError where a data stage was not measured.
    """
    seconds = {row["rule"]: float(row["wall_s"]) for row in stages}
    missing = [rule for rule in DATA_RULES if rule not in seconds]
    if missing:
        raise InputError(f"stages: no row for {missing}, expected a finished run's stages.csv")
    measured = int(stages[0]["samples"])
    models, samples = samples_of(config)
    core_hours = sum(seconds[rule] for rule in DATA_RULES) / measured * samples / 3600
    signal = 8 * config["network"]["symbols"] * len(config["network"]["stations"])
    disk = float(stages[0]["sample_bytes"]) if config["shards"]["kind"] == "image" else signal
    row = (
        name,
        models,
        samples,
        round(core_hours, 2),
        round(disk * samples / 1e9, 1),
        round(signal * samples / 1e9, 1),
    )
    return dict(zip(COLUMNS, (*row, stages[0]["hardware"]), strict=True))


def main(arguments: list[str]) -> None:
    """Write the estimate of every overlay: estimate.py STAGES SCHEMA OUT BASE OVERLAY..."""
    stages, schema, out, base, *overlays = arguments
    rows = read_csv(stages, "rule", "wall_s", "samples", "sample_bytes", "hardware")
    found = [estimate(rows, load([base, overlay], schema), Path(overlay).stem) for overlay in overlays]
    with replacing(out) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
