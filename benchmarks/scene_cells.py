"""Whether the receiver of every shipped scene finds its targets: the table of chosen cells and
levels by class.

    python benchmarks/scene_cells.py --out results/reference/scene_cells.csv

The samples are the first motion models of the first subtype of each class, at every station and
link of the scene. A symbol is right where the chosen cell is within one of that in which the
target's echo appears (the observed truth); the level is the target in its cell over the mean power
of the loudest cell of all else (land, noise, other stations), behind the canceller. A sample is
tangential where its mean radial speed is below TANGENTIAL_MPS: still land has the same Doppler, and
a canceller removes both.

`finding` of `lowalt.scene.explanation` alone decides what the target's cell is.
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.config.layers import load
from lowalt.files.csv_tables import write_csv
from lowalt.scene.explanation import Finding, finding, samples, scene_of
from lowalt.targets.records import records_of

COLUMNS = (
    "scene",
    "class",
    "samples",
    "right_percent",
    "least_percent",
    "over_rest_db",
    "tangential",
    "tangential_right_percent",
    "others_least_percent",
)
TANGENTIAL_MPS = 0.1
"""Three speed bins, each lambda / (2 T), of a look of one second at 4.9 GHz."""


def findings(root: Path, path: Path, models: int, category: str | None = None) -> list[Finding]:
    """Return the findings of a shipped scene, of one class if named; root: the repository's folder."""
    config = load(
        [root / "config/default.yaml", path], root / "workflow/schemas/config.schema.yaml"
    )
    config["targets"]["table"] = str(root / config["targets"]["table"])
    config["targets"]["records"] = [str(root / name) for name in config["targets"]["records"]]
    firsts: dict[str, str] = {}
    for name, record in records_of(config["targets"], None).items():
        if category in (None, record["published"]["category"]):
            firsts.setdefault(record["published"]["category"], name)
    chosen = samples(
        config, None, [(name, model) for name in firsts.values() for model in range(models)]
    )
    scene = scene_of(config)
    clouds = {sample.cloud.subtype: sample.cloud for sample in chosen}
    return [
        finding(scene, station, sample, clouds)
        for sample in chosen
        for station in scene.network.stations
    ]


def rows(name: str, found: list[Finding]) -> list[list]:
    """Return the table's rows of one scene, one per class."""
    result = []
    for category in dict.fromkeys(each.category for each in found):
        mine = [each for each in found if each.category == category]
        right = 100 * np.array([each.right for each in mine])
        over = np.median([each.over_db for each in mine])
        level = f"{over:.1f}" if np.isfinite(over) else ""
        across = np.array([abs(each.radial_mps) < TANGENTIAL_MPS for each in mine])
        shares = [f"{number:.1f}" for number in (right.mean(), right.min())]
        apart = f"{right[across].mean():.1f}" if across.any() else ""
        others = "" if across.all() else f"{right[~across].min():.1f}"
        result.append([name, category, len(mine), *shares, level, int(across.sum()), apart, others])
    return result


def main() -> None:
    """Compute and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--models", type=int, default=5)
    options.add_argument("--scene", nargs="*", help="names of shipped scenes (default: all)")
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    table = []
    for path in sorted(Path("config/scenes").glob("*.yaml")):
        if not given.scene or path.stem in given.scene:
            table += rows(path.stem, findings(Path(), path, given.models))
            print(*table[-4:], sep="\n", flush=True)
    write_csv(given.out, COLUMNS, table)


if __name__ == "__main__":
    main()
