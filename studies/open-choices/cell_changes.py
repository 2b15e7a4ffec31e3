"""How often a target's strongest range cell changes within a look: `python cell_changes.py
OUT.csv`.

One row per subtype: its published size and its longest side (m), and the median, smallest and
largest number of changes from symbol to symbol at station A over ten motion models of the row
`base` of `choices.yaml`.
"""

import sys
from pathlib import Path

import numpy as np
from choice_rows import HERE

import trainings
from lowalt.config.layers import merge
from lowalt.echo import Rigid
from lowalt.echo.api import echo_signal
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.motion.poses import poses
from lowalt.shards.dataset import Dataset, Place
from lowalt.targets.cloud import extent

MODELS = 10


def main(out: Path) -> None:
    """Count the changes and write the table."""
    dataset = Dataset(merge(trainings.config_of(), load_yaml(HERE / "choices.yaml")["base"]))
    network = dataset.maker.network
    rows = []
    for group, names in dataset.plan.groups.items():
        for name in names:
            cloud = dataset.clouds[name]
            changes = []
            for model in range(MODELS):
                row = dataset.row(Place(group, name, model, np.inf))
                motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
                aim = np.array([row[f"{axis}_m"] for axis in "xyz"])
                cells = echo_signal(network, network.stations[0], motion, cloud.rcs_m2, aim).cell
                changes.append(int(np.count_nonzero(np.diff(cells))))
            size = dataset.published[name]["size_m"]
            rows.append(
                [
                    cloud.category,
                    name,
                    "" if size is None else size,
                    f"{extent(cloud):.2f}",
                    f"{np.median(changes):.0f}",
                    min(changes),
                    max(changes),
                ]
            )
    columns = (
        "class",
        "subtype",
        "published_m",
        "longest_side_m",
        "median_changes",
        "fewest",
        "most",
    )
    write_csv(out, columns, sorted(rows, key=lambda row: -int(row[4])))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
