"""Command line of the motion stage: clouds of a group -> the motion table of one chunk."""

import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.motion.sample import draw, region_polygon
from lowalt.motion.table import write_table
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import read


def main(arguments: list[str]) -> None:
    """Draw models `--first` .. `--first + --count - 1` of every cloud's subtype, model-major, and write the table."""
    options = parser("lowalt.motion", __doc__)
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files, in the order of the rows")
    options.add_argument("--group", required=True, choices=("seen", "unseen"))
    options.add_argument("--first", type=int, required=True, help="first model number")
    options.add_argument("--count", type=int, required=True, help="models of each subtype")
    options.add_argument("--out", required=True, help="motion table to write (.csv)")
    given = options.parse_args(arguments)
    seed, masts_m, motion, published = pick(given.settings, "seed", "masts_m", "motion", "published")
    masts_m = np.array(masts_m, dtype=float).reshape(-1, 2)
    corners = region_polygon(masts_m, motion["region"]["polygon_m"])
    clouds = [read(path) for path in given.clouds]
    rows = []
    for model in range(given.first, given.first + given.count):
        for cloud in clouds:
            rng = stream(seed, "motion", cloud.subtype, model)
            row = draw(rng, cloud, published[cloud.subtype], masts_m, corners, motion)
            rows.append({**row, "group": given.group, "model": model})
    write_table(given.out, rows)
    print(f"{given.out}: {len(rows)} motion models", file=sys.stderr)


if __name__ == "__main__":
    run(main)
