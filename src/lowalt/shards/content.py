"""Turns the files of a chunk into a function from (motion model, SNR) to the bytes of a member."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from lowalt.config.network import Network
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.noise.__main__ import load_echoes, load_powers
from lowalt.shards.sample_record import npy
from lowalt.shards.stored_cubes import of_cubes
from lowalt.shards.write import Content
from lowalt.tiles.signals import load_signals
from lowalt.tiles.tile_files import Tiles

if TYPE_CHECKING:
    from lowalt.tiles.cubes import Cubes


def _signals(kind: str, path: str | None, network: Network, shape: tuple[int, int]) -> np.ndarray:
    """The chunk's noisy signals (models, SNRs, stations, symbols).

    Raises: InputError if the option is missing, or naming a file with another number of models or
    SNRs.
    """
    if path is None:
        raise InputError(f"--signals: missing, {kind} shards are packed from them")
    signals = load_signals(path, network)
    if signals.shape[:2] != shape:
        raise InputError(
            f"{path}: shape {signals.shape}, expected {shape[0]} models and {shape[1]} SNRs"
        )
    return signals


def noisy_content(
    kind: str, path: str | None, tiles: str | None, network: Network, shape: tuple[int, int]
) -> Content:
    """Return the content of image or signal shards from the chunk's files.

    path: of the noisy signals; shape: numbers of motion models and SNRs of the chunk.
    Raises: InputError naming the option or file that is missing or does not fit.
    """
    signals = _signals(kind, path, network, shape)
    if kind == "signal":
        return lambda model, level: (npy(signals[model, level]), {})
    if tiles is None:
        raise InputError("--tiles: missing, image shards are packed from them")
    images = Tiles(tiles)
    models, levels = shape
    if len(images) != models * levels:
        raise InputError(f"{tiles}: {len(images)} images, expected {models * levels}")
    return lambda model, level: (images[model * levels + level], {})


def clean_content(
    paths: list[str] | None, powers: list[str] | None, network: Network, models: int
) -> tuple[Content, np.ndarray | None]:
    """Return the content of recipe shards from the chunk's clean echoes, and reference powers.

    The powers (stations, models) W are what SNRs refer to, None where no files of powers are given.
    Raises: InputError naming the option or file that is missing or does not fit.
    """
    if not paths:
        raise InputError("--echoes: missing, recipe shards are packed from them")
    stations = [station.name for station in network.stations]
    echoes = load_echoes(paths, stations, models)
    wanted = (models, network.symbols)
    first = echoes[0]
    if len(echoes) != len(stations) or first.shape != wanted or first.dtype != np.complex64:
        path = existing(paths[0], "echo")
        raise InputError(f"{path}: {first.dtype} {first.shape}, expected complex64 {wanted}")

    def content(model: int, level: int) -> tuple[bytes, dict]:
        """The clean echoes of one motion model, which are the same at each SNR."""
        return npy(np.stack([echo[model] for echo in echoes])), {}

    if not powers:
        return content, None
    return content, load_powers(powers, stations, models)


def cube_content(
    path: str | None, cubes: "Cubes", rows: Sequence[dict], snrs: Sequence[float], cell_type: str
) -> Content:
    """Return the content of cube shards from the chunk's noisy signals and what makes their cubes.

    path: of the noisy signals; cell_type: type of the stored cells, "complex64" or "int16".
    Raises: InputError naming the option or file that is missing or does not fit.
    """
    network = cubes.scene.network
    signals = _signals("cube", path, network, (len(rows), len(snrs)))

    def content(model: int, level: int) -> tuple[bytes, dict]:
        """The cubes of one sample and what its record says of them."""
        made = []
        for station, signal in zip(network.stations, signals[model, level], strict=True):
            made.append(cubes.of(rows[model], snrs[level], station, signal))
        return of_cubes(made, network, cell_type)

    return content
