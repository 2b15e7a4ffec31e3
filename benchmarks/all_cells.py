"""All range cells of one sample: the echo engine compared with one non-uniform FFT (FINUFFT) per symbol, in one run.

    python benchmarks/all_cells.py [--points 300] [--out all_cells.csv]

The sample has the symbols and subcarriers of the default and one core. relative_difference: the largest one from the
closed form, cell by cell, relative to the largest value. Run it on a quiet machine.
"""

import argparse
import functools
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.config.layers import overlaid
from lowalt.config.network import Network
from lowalt.echo import Rigid, echo_matrix
from lowalt.echo.api import prepared
from lowalt.echo.pointwise import results
from lowalt.files.csv_tables import write_csv
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.machine.timing import in_turn
from lowalt.measure.echo_baselines import finufft_cells
from lowalt.measure.echo_cost import hardware


def closed(*arguments: object) -> np.ndarray:
    """All range cells (N, M), each by the closed form."""
    scene, radio, refs, aims, paths = prepared(*arguments, None, "")
    out = np.empty((len(refs), radio.subcarriers), np.complex128)
    results.matrix(scene, radio, refs, aims, paths, out)
    return out


@one_blas_thread()
def main() -> None:
    """Measure all ways in turn and write the table."""
    line = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    line.add_argument("--points", type=int, default=300)
    line.add_argument("--out", type=Path, default=Path("results/benchmarks/all_cells.csv"))
    given = line.parse_args()
    network, rng = Network.from_settings(overlaid([])["network"]), np.random.default_rng(1)
    turning = Rotation.from_rotvec(np.outer(network.times_s, [0.0, 0.0, 120.0])).as_matrix()[:, None]
    flown = (np.array([200.0, 100.0, 60.0]) + np.outer(network.times_s, [3.0, 2.0, 0.0]))[:, None]
    motion = Rigid(turning, flown, 0.5 * rng.normal(size=(given.points, 3)), np.zeros(given.points, int))
    arguments = network, network.stations[0], motion, np.ones(given.points), flown[0, 0]
    calls = {
        "echo_matrix": functools.partial(echo_matrix, *arguments, "cells"),
        "FINUFFT, 1e-9": functools.partial(finufft_cells, *arguments),
        "FINUFFT, 1e-12": functools.partial(finufft_cells, *arguments, 1e-12),
        "closed form, cell by cell": functools.partial(closed, *arguments),
    }
    for call in calls.values():
        call()
    timed = in_turn([(call, 7, 1) for call in calls.values()])
    truth = timed[-1][1]
    rows = [
        {"way": way, "points": given.points, "seconds": seconds, "hardware": hardware(),
         "relative_difference": float(abs(found - truth).max() / abs(truth).max())}
        for way, (seconds, found) in zip(calls, timed, strict=True)
    ]  # fmt: skip
    write_csv(given.out, ("way", "points", "seconds", "relative_difference", "hardware"), rows)
    print(given.out.read_text(), end="")


if __name__ == "__main__":
    main()
