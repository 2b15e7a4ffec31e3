"""Command line of the motion stage: clouds of a group -> the motion table of one chunk."""

import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.motion.drawing import region_polygon
from lowalt.motion.table import write_table
from lowalt.motion.track_files import path_of
from lowalt.motion.tracks import model_rows
from lowalt.targets.cloud import read


def main(arguments: list[str]) -> None:
    """Draw rows `--first` .. `--first + --count - 1` of every cloud's subtype, and write the table.

    If the settings' block `motion` has `looks`, each motion model has that many rows, one per look.
    """
    options = parser("lowalt.motion", __doc__)
    options.add_argument(
        "--clouds", nargs="+", required=True, help="cloud files, in the order of the rows"
    )
    options.add_argument("--group", required=True, choices=("seen", "unseen"))
    options.add_argument("--first", type=int, required=True, help="first row of each subtype")
    options.add_argument("--count", type=int, required=True, help="rows of each subtype")
    options.add_argument("--out", required=True, help="motion table to write (.csv)")
    asked = options.parse_args(arguments)
    names = ("seed", "masts_m", "motion", "published")
    seed, masts_m, motion, published = pick(asked.settings, *names)
    masts_m = np.array(masts_m, dtype=float).reshape(-1, 2)
    corners = region_polygon(masts_m, motion["region"]["polygon_m"])
    clouds = [read(path) for path in asked.clouds]
    rows = []
    looks = motion.get("looks", 1)
    path = path_of(motion, corners, masts_m)
    for model in range(asked.first // looks, (asked.first + asked.count) // looks):
        drawn = [
            model_rows(seed, cloud, published[cloud.subtype], masts_m, corners, motion, model, path)
            for cloud in clouds
        ]
        for look, of_subtypes in enumerate(zip(*drawn, strict=True)):
            number = model * looks + look
            rows += [{**row, "group": asked.group, "model": number} for row in of_subtypes]
    write_table(asked.out, rows)
    print(f"{asked.out}: {len(rows)} rows", file=sys.stderr)


if __name__ == "__main__":
    run(main)
