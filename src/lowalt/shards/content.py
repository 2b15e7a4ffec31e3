"""The files of a chunk from earlier stages, as a function from (motion model, SNR) to a shard member's bytes."""

from collections.abc import Sequence

import numpy as np

from lowalt.config.network import Network
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.noise.__main__ import load_echoes, load_powers
from lowalt.shards.record import npy, of_cubes
from lowalt.shards.write import Content
from lowalt.tiles.cubes import Cubes
from lowalt.tiles.files import Tiles
from lowalt.tiles.signals import load_signals


def noisy_content(
    kind: str, signals: str | None, tiles: str | None, network: Network, expected: tuple[int, int]
) -> Content:
    """Return the content of image or signal shards from the chunk's files.

    expected: how many motion models and SNRs the chunk has.
    Raises: InputError naming the option or file that is missing or does not fit.
    """
    if signals is None:
        raise InputError(f"--signals: missing, {kind} shards are packed from them")
    found = load_signals(signals, network)
    models, levels = expected
    if found.shape[:2] != expected:
        raise InputError(f"{signals}: shape {found.shape}, expected {models} models and {levels} SNRs")
    if kind == "signal":
        return lambda number, level: (npy(found[number, level]), {})
    if tiles is None:
        raise InputError("--tiles: missing, image shards are packed from them")
    images = Tiles(tiles)
    if len(images) != models * levels:
        raise InputError(f"{tiles}: {len(images)} images, expected {models * levels}")
    return lambda number, level: (images[number * levels + level], {})


def clean_content(
    echoes: list[str] | None, powers: list[str] | None, network: Network, models: int
) -> tuple[Content, np.ndarray | None]:
    """Return the content of recipe shards from the chunk's clean echoes, and the powers (stations, models) W or None.

    Raises: InputError naming the option or file that is missing or does not fit.
    """
    if not echoes:
        raise InputError("--echoes: missing, recipe shards are packed from them")
    stations = [station.name for station in network.stations]
    found = load_echoes(echoes, stations, models)
    wanted = (len(stations), models, network.symbols)
    if (len(found), *found[0].shape) != wanted or found[0].dtype != np.complex64:
        raise InputError(
            f"{existing(echoes[0], 'echo')}: {found[0].dtype} {found[0].shape}, expected complex64 {wanted[1:]}"
        )

    def content(number: int, level: int) -> tuple[bytes, dict]:
        """The clean echoes of one motion model."""
        return npy(np.stack([echo[number] for echo in found])), {}

    return content, load_powers(powers, stations, models) if powers else None


def cube_content(
    signals: str | None, cubes: Cubes, rows: Sequence[dict], snrs: Sequence[float], network: Network
) -> Content:
    """Return the content of cube shards from the chunk's noisy signals and what makes their cubes.

    Raises: InputError naming the option or file that is missing or does not fit.
    """
    if signals is None:
        raise InputError("--signals: missing, cube shards are packed from them")
    found = load_signals(signals, network)
    if found.shape[:2] != (len(rows), len(snrs)):
        raise InputError(f"{signals}: shape {found.shape}, expected {len(rows)} models and {len(snrs)} SNRs")

    def content(number: int, level: int) -> tuple[bytes, dict]:
        """The cubes of one sample and what its record tells of them."""
        heard = zip(network.stations, found[number, level], strict=True)
        return of_cubes([cubes.of(rows[number], snrs[level], *each) for each in heard], network)

    return content
