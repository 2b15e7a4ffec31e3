"""The processor time (ms) that a town adds to one signal, by kind of target and by town.

`finding` is that of finding the paths, `echo` that of the echo on all of them over that on the direct one alone. The
towns are the blocks of the study and a thousand houses on a regular grid, whose facades are aligned. Each row has the
mean and the largest of three targets at three stations. The pairs of facets that a station's rays may meet are found
before, once per station and process.
"""

import argparse
import tempfile
import time
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from study import HERE, write_blocks

from lowalt.config.layers import overlaid
from lowalt.extensions.town.town import paths
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.scene import explanation
from lowalt.scene.chain import SceneSample
from lowalt.scene.observe import observe

GRID_M = (np.arange(-740.0, 1170.0, 60.0), np.arange(-780.0, 1130.0, 60.0))
"""Coordinates x and y of the 1024 houses of the regular grid; those next to a station are left out."""
STREETS_M = ((130.0, 170.0), (250.0, 225.0), (310.0, 350.0))
"""Where targets begin: streets that run along y, between blocks or at a corner of them."""
TARGETS = {
    "drone, 80 m high": ("DJI Mini 2", 80.0, 8.0),
    "drone, 35 m high": ("DJI Mini 2", 35.0, 8.0),
    "car, 2 m/s": ("AITO M9 2024", 0.0, 2.0),
    "car, 20 m/s": ("AITO M9 2024", 0.0, 20.0),
}
"""Subtype, height (m) and speed along the street (m/s)."""


def measured(config: dict, subtype: str, height_m: float, speed_mps: float) -> np.ndarray:
    """Return for each signal the number of its paths, and the processor times (ms) of finding them, of the echo on all
    of them over that on the direct one alone, and of both, (signals, 4)."""
    (sample,) = explanation.samples(config, None, [(subtype, 0)])
    scene, rows = explanation.scene_of(config), []
    settings = next(effect.settings for effect in scene.effects if effect.name == "town")
    for (x, y), station, again in product(STREETS_M, scene.network.stations, (False, True)):
        row = sample.row | {"x_m": x, "y_m": y, "vx_mps": 0.0, "vy_mps": speed_mps, "vz_mps": 0.0}
        view = observe(scene, station, sample.cloud, row | ({"z_m": height_m} if height_m else {}))
        one, times_s = SceneSample(scene, view), []
        with one_blas_thread():
            for work in (partial(paths, settings, view), partial(one.direct_echo, view), partial(one.echo, view)):
                start_s = time.process_time()
                work()
                times_s.append(time.process_time() - start_s)
        find, alone, both = 1e3 * np.array(times_s)
        # The first call compiles kernels, and finds the station's pairs of facets.
        if again:
            rows.append([len(paths(settings, view)), find, both - find - alone, both - alone])
    return np.array(rows)


def main() -> None:
    """Print the table."""
    line = argparse.ArgumentParser(description=__doc__)
    line.add_argument("--towns", nargs="+", default=["blocks", "grid"], choices=["blocks", "grid"])
    line.add_argument("--targets", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    options = line.parse_args()
    heads = "".join(f"{name + ', mean':>14}{'largest':>9}" for name in ("paths", "finding", "echo", "both"))
    print(f"{'town':<8}{'target':<18}{heads}")
    with tempfile.TemporaryDirectory() as folder:
        grid = Path(folder) / "grid.geojson"
        write_blocks(grid, *GRID_M)
        for name, target in product(options.towns, options.targets):
            config = overlaid([HERE / "config.yaml"])
            if name == "grid":
                config["effects"]["town"]["buildings"] = str(grid)
            subtype, height_m, speed_mps = TARGETS[target]
            found = measured(config, subtype, height_m, speed_mps)
            cells = "".join(f"{column.mean():>14.1f}{column.max():>9.1f}" for column in found.T)
            print(f"{name:<8}{target:<18}{cells}", flush=True)


if __name__ == "__main__":
    main()
