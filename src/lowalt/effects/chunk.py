"""Signals of a chunk in a scene with effects: its motion table and clouds seen from one station."""

import numpy as np

from lowalt.common.progress import reported
from lowalt.effects.received import Scene, received_signal
from lowalt.targets.cloud import Cloud, cloud_of


def scene_signals(
    scene: Scene, name: str, clouds: dict[str, Cloud], rows: list[dict], occluders: dict[str, dict] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return signals (models, N) complex64 at the station `name` and reference powers (models,) W of the motion table.

    occluders: each subtype's surfaces, where the scene hides points behind them.
    Raises: InputError naming the sample where a subtype has no cloud or cannot be computed with.
    """
    station, occluders = scene.network.station(name), occluders or {}
    result = np.empty((len(rows), scene.network.symbols), np.complex64)
    power = np.empty(len(rows))
    for index, row in enumerate(reported(rows, len(rows), "models")):
        received = received_signal(scene, station, cloud_of(clouds, row), row, occluders.get(row["subtype"]))
        result[index], power[index] = received.signal, received.power
    return result, power
