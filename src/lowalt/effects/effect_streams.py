"""Which random stream an effect draws from in a sample at a station."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lowalt.common.network import Station
from lowalt.effects.catalogue import LOOK_WIDE, PAIR_WIDE
from lowalt.effects.receiving import UNUSED

if TYPE_CHECKING:
    from lowalt.effects.received import Scene


def drawn(scene: Scene, row: dict, station: Station, name: str, end: Station | None = None) -> np.random.Generator:
    """Return an effect's stream: one for all stations if its draws belong to the whole look, else one a station.

    Both directions of a link share the stream of an effect whose draws belong to the pair. end: the station whose
    stream is asked for, None for `station`. An effect that draws nothing gets no stream of its own.
    """
    if name in scene.still:
        return UNUSED
    station = end or station
    if name in LOOK_WIDE:
        return scene.stream(name, row)
    if name in PAIR_WIDE and station.transmitter is not None:
        return scene.stream(name, row, *sorted((station.transmitter.name, station.receiver.name)))
    return scene.stream(name, row, station.name)
