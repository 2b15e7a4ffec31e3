"""Clean signals of a chunk: its motion table and clouds seen from several stations."""

from collections.abc import Mapping

import numpy as np

from lowalt.config.network import Network
from lowalt.echo.api import echo_signal
from lowalt.echo.echo_input import Rigid, target
from lowalt.machine.progress import reported
from lowalt.motion import poses
from lowalt.targets.cloud import Cloud, cloud_of


def clean_signals(
    network: Network,
    names: list[str],
    clouds: Mapping[str, Cloud],
    rows: list[dict],
    tolerance: float | None,
) -> np.ndarray:
    """Return clean signals (stations, models, N) complex64 at the stations `names`.

    rows: of the motion table.

    The beams aim at each cloud's origin at the first symbol.
    Raises: InputError naming the sample where a subtype has no cloud or a position cannot be
    computed with.
    """
    stations = [network.station(name) for name in names]
    times_s = network.times_s
    result = np.empty((len(stations), len(rows), network.symbols), np.complex64)
    for index, row in enumerate(reported(rows, len(rows), "models")):
        sample = f"{row['subtype']}, model {row['model']}"
        cloud = cloud_of(clouds, row)
        motion = Rigid(*poses(cloud, row, times_s), cloud.points, cloud.part)
        seen = target(motion, cloud.rcs_m2, sample)
        aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
        for number, station in enumerate(stations):
            where = f"{sample}, station {station.name}"
            echo = echo_signal(network, station, seen, None, aim, tolerance, sample=where)
            result[number, index] = echo.signal
    return result
