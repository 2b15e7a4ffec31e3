"""Draw a few targets under choices: `python studies/open-choices/picture.py OUT.png [--rows NAME
...]`.

One row per target, two columns per choice (VRP and TRP of station A, no noise, the same motion
model throughout).
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from choice_rows import HERE, clean, motion_rows

import trainings
from lowalt.config.command import run
from lowalt.config.layers import merge
from lowalt.files.yaml_files import load_yaml
from lowalt.shards.dataset import Dataset
from lowalt.tiles import colour_map

TARGETS = (
    "DJI Mini 2",
    "Type-A Firefighting UAV",
    "EH 216 S",
    "Audi A6L 2019",
    "Kingfisher",
    "Sparrow",
)


def images_of(table: dict, block: dict, model: int) -> dict[str, np.ndarray]:
    """Return the images (9, S, S) uint8 of each target's motion model under a row's choice, without
    noise.
    """
    config = merge(merge(trainings.config_of(), table["base"]), block.get("overlay", {}))
    config["targets"]["select"] = list(TARGETS)
    dataset = Dataset(config)
    local = block.get("local", {})
    rows = [row for row in motion_rows(dataset, local) if row["model"] == model]
    signals = clean(dataset, local, rows, list(config["network"]["stations"]))[
        local.get("cell", "")
    ]
    return {
        row["subtype"]: dataset.maker.renderer.some(signals[:, place], list(range(9)))
        for place, row in enumerate(rows)
    }


def main(arguments: list[str]) -> None:
    """Draw the picture."""
    line = argparse.ArgumentParser("picture.py", description=__doc__.splitlines()[0])
    line.add_argument("out", type=Path, help="picture to write (.png)")
    line.add_argument("--rows", nargs="+", default=["base"], help="rows of choices.yaml")
    line.add_argument("--model", type=int, default=0, help="motion model (default: 0)")
    given = line.parse_args(arguments)
    table = load_yaml(HERE / "choices.yaml")
    figure, axes = plt.subplots(
        len(TARGETS),
        2 * len(given.rows),
        squeeze=False,
        layout="constrained",
        figsize=(3.2 * len(given.rows), 1.6 * len(TARGETS)),
    )
    for place, name in enumerate(given.rows):
        images = images_of(table, table["rows"][name], given.model)
        for row, target in enumerate(TARGETS):
            for column, (number, kind) in enumerate(((0, "VRP"), (1, "TRP"))):
                axis = axes[row, 2 * place + column]
                axis.imshow(colour_map("viridis")[images[target][number]])
                axis.set(xticks=[], yticks=[])
                if row == 0:
                    axis.set_title(
                        f"{name}\n{kind}" if column == 0 else kind, fontsize=7, loc="left"
                    )
                if place == column == 0:
                    axis.set_ylabel(target, fontsize=7)
    figure.savefig(given.out, dpi=75)


if __name__ == "__main__":
    run(main)
