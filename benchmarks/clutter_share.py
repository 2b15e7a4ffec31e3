"""How much of the land's power comes from close to the mast, with isotropic elements and with TR 38.901's.

    python benchmarks/clutter_share.py --config config/default.yaml --out results/benchmarks/clutter_share.csv

Mean powers of the effect `clutter` (its law draws nothing here) under beams that follow the first subtype of each
class: medians and means over motion models at the first station, and the share of all their powers together.
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.common.config import load
from lowalt.common.csv_tables import write_csv
from lowalt.common.network import Network, masts_m
from lowalt.common.streams import stream
from lowalt.effects.antenna import Element
from lowalt.effects.channel import clutter, patches
from lowalt.motion.sample import draw, region_polygon
from lowalt.targets.make import make
from lowalt.targets.records import records_of

COLUMNS = ("elements", "category", "models", "median_share", "mean_share", "share_of_all", "median_dbm")
ELEMENTS = {
    "isotropic, no back": None, "TR 38.901": Element(), "TR 38.901, 6 degrees downtilt": Element(downtilt_deg=6.0),
}  # fmt: skip
NEAR_M = 50.0


def aims(config: dict, models: int) -> dict[str, np.ndarray]:
    """Return where the beams point (models, 3) m for the first subtype of each category."""
    masts = np.array(masts_m(config["network"]), dtype=float)
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    found = {}
    for name, record in records_of(config["targets"], None).items():
        category = record["published"]["category"]
        if category in found:
            continue
        cloud = make(record, None, config["seed"])
        given = cloud, record["published"], masts, corners, config["motion"]
        rows = [draw(stream(config["seed"], "motion", name, k), *given) for k in range(models)]
        found[category] = np.array([[row["x_m"], row["y_m"], row["z_m"]] for row in rows])
    return found


def near(network: Network, aim_m: np.ndarray, element: Element | None) -> tuple[float, float]:
    """Return the land's mean power (W) from within 50 m slant range of the first station, and all of it."""
    power = clutter.cell_power(clutter.DEFAULTS, network, network.stations[0], aim_m, element)
    middle = (np.arange(len(power)) + patches.OFFSET) * network.cell_m
    return float(power[middle <= NEAR_M].sum()), float(power.sum())


def table(config: dict, models: int) -> list[list]:
    """Return the rows of the table."""
    network, result = Network.from_settings(config["network"]), []
    for category, places in aims(config, models).items():
        for name, element in ELEMENTS.items():
            power = np.array([near(network, aim, element) for aim in places])
            share = power[:, 0] / power[:, 1]
            level = 10 * np.log10(np.median(power[:, 1])) + 30
            shares = np.median(share), share.mean(), power[:, 0].sum() / power[:, 1].sum()
            result.append([name, category, models, *(f"{one:.3f}" for one in shares), f"{level:.1f}"])
    return result


def main() -> None:
    """Compute and write the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--config", type=Path, default=Path("config/default.yaml"))
    options.add_argument("--models", type=int, default=60)
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    found = table(load([given.config], Path("workflow/schemas/config.schema.yaml")), given.models)
    for row in found:
        print(*row, sep=", ")
    write_csv(given.out, COLUMNS, found)


if __name__ == "__main__":
    main()
