"""The processor time that a town adds to one signal: its paths and the echo on them, by kind of target and by town.

The towns are the blocks of the study and a thousand houses on a regular grid, whose facades are aligned. Each row is
the mean and the largest time of three targets at three stations; the pairs of facets that a station's rays may meet are
found before, once per station and process.
"""

import argparse
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np

from lowalt.config.layers import overlaid
from lowalt.scene import explanation
from lowalt.scene.chain import SceneSample
from lowalt.scene.effects.channel.town import paths
from lowalt.scene.observe import observe
from study import HERE, write_blocks

GRID_M = (np.arange(-740.0, 1170.0, 60.0), np.arange(-780.0, 1130.0, 60.0))
"""The middles of the houses of the regular town, 1024 but for those next to a station."""
STREETS_M = ((130.0, 170.0), (250.0, 225.0), (310.0, 350.0))
"""Where targets begin: streets that run along y, between blocks or at a corner of them."""
TARGETS = {
    "drone, 80 m high": ("DJI Mini 2", 80.0, 8.0),
    "drone, 35 m high": ("DJI Mini 2", 35.0, 8.0),
    "car, 2 m/s": ("AITO M9 2024", 0.0, 2.0),
    "car, 20 m/s": ("AITO M9 2024", 0.0, 20.0),
}
"""Subtype, height (m) and speed along the street (m/s)."""


def measured(config: dict, height_m: float, speed_mps: float, subtype: str) -> np.ndarray:
    """Return the processor times (signals, 3) in ms: of the paths, of the echo on them, and the number of paths."""
    (sample,) = explanation.samples(config, None, [(subtype, 0)])
    scene, times = explanation.scene_of(config), []
    settings = next(effect.settings for effect in scene.effects if effect.name == "town")
    for (x, y), station, again in product(STREETS_M, scene.network.stations, (False, True)):
        row = sample.row | {"x_m": x, "y_m": y, "vx_mps": 0.0, "vy_mps": speed_mps, "vz_mps": 0.0}
        if height_m:
            row["z_m"] = height_m
        view = observe(scene, station, sample.cloud, row)
        one = SceneSample(scene, view)
        start_s = time.process_time()
        found = paths(settings, view)
        middle_s = time.process_time()
        one.echo(view)
        end_s = time.process_time()
        # The first call compiles kernels, and finds the station's pairs of facets.
        if again:
            times.append([1e3 * (middle_s - start_s), 1e3 * (end_s - middle_s) - 1e3 * (middle_s - start_s), len(found)])
    return np.array(times)


def main() -> None:
    """Print the table."""
    line = argparse.ArgumentParser(description=__doc__)
    line.add_argument("--towns", nargs="+", default=["blocks", "grid"], choices=["blocks", "grid"])
    line.add_argument("--targets", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    options = line.parse_args()
    print(f"{'town':<8}{'target':<20}{'paths':>6}{'find, mean':>12}{'largest':>9}{'echo, mean':>12}{'largest':>9}  ms")
    with tempfile.TemporaryDirectory() as folder:
        grid = Path(folder) / "grid.geojson"
        write_blocks(grid, *GRID_M)
        for name, target in product(options.towns, options.targets):
            config = overlaid([HERE / "config.yaml"])
            if name == "grid":
                config["effects"]["town"]["buildings"] = str(grid)
            subtype, height_m, speed_mps = TARGETS[target]
            found = measured(config, height_m, speed_mps, subtype)
            (find, echo, count), (find_most, echo_most, _) = found.mean(axis=0), found.max(axis=0)
            print(f"{name:<8}{target:<20}{count:>6.1f}{find:>12.1f}{find_most:>9.1f}{echo:>12.1f}{echo_most:>9.1f}")


if __name__ == "__main__":
    main()
