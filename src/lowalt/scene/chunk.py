"""Signals of a chunk in a scene with effects: its motion table and clouds seen from one station."""

from collections.abc import Mapping

import numpy as np

from lowalt.machine.progress import reported
from lowalt.scene.chain import received_signal
from lowalt.scene.observe import Scene
from lowalt.targets.cloud import Cloud, cloud_of


def scene_signals(
    scene: Scene, name: str, clouds: Mapping[str, Cloud], rows: list[dict], occluders: dict[str, dict] | None = None,
    snrs: list[float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return signals (models, N) complex64 at the station `name` and reference powers (models,) W of the motion table.

    clouds: by subtype, companions' too; occluders: each subtype's surfaces, where the scene hides points behind them;
    snrs (dB): signals are (models, snrs, N), with noise in all range cells, where the scene has `cell_noise`.
    Raises: InputError naming the sample where a subtype has no cloud or cannot be computed with.
    """
    station, occluders = scene.network.station(name), occluders or {}
    levels = [scene] if snrs is None else [scene.at_snr(snr) for snr in snrs]
    result = np.empty((len(rows), len(levels), scene.network.symbols), np.complex64)
    power = np.empty(len(rows))
    for index, row in enumerate(reported(rows, len(rows), "models")):
        cloud, surfaces = cloud_of(clouds, row), occluders.get(row["subtype"])
        for place, level in enumerate(levels):
            received = received_signal(level, station, cloud, row, surfaces, clouds)
            result[index, place], power[index] = received.signal, received.power
    return result[:, 0] if snrs is None else result, power
