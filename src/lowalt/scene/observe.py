"""A scene with its random streams, and the view of a moving target from one of its stations."""

from dataclasses import dataclass, replace

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.files.errors import InputError
from lowalt.scene.checks import refuse_unmodelled
from lowalt.scene.contract import numbers
from lowalt.scene.effects import NamedEffect, every, look_stream, only
from lowalt.scene.view import Perturbations, View, located
from lowalt.targets.cloud import Cloud


@dataclass(frozen=True)
class Scene:
    """A scene: its network, seed, the echo engine's tolerance, and its effects.

    The effects are in the chain's order.
    """

    network: Network
    seed: int
    tolerance: float | None
    effects: tuple[NamedEffect, ...]

    def __post_init__(self) -> None:
        refuse_unmodelled(self.network, {effect.name: effect.module for effect in self.effects})

    def stream(self, name: str, row: dict, *ends: str) -> np.random.Generator:
        """Return the stream of an effect for the motion model `row`, from its start.

        ends: names of the stations for which it is drawn, none if all stations share it.
        """
        # Each SNR has a stream of its own, so its noise does not depend on the other SNRs.
        levels = []
        for effect in self.effects:
            if effect.name == name and effect.snr_db is not None:
                levels.append(effect.snr_db)
        return look_stream(self.seed, name, row, *ends, *levels)

    def drawn(self, row: dict, station: Station, name: str) -> np.random.Generator:
        """Return the random stream of an effect, or of another name, at a station, from its start.

        An effect may share it (`contract`: STREAM) or draw for the whole look or the pair of a
        link's stations (DRAWN).
        """
        module = next((effect.module for effect in self.effects if effect.name == name), None)
        name = getattr(module, "STREAM", name)
        drawn = getattr(module, "DRAWN", "station")
        if drawn == "look":
            return self.stream(name, row)
        ends = [end for end in (station.transmitter, station.receiver) if end is not None]
        if drawn == "pair" and ends:
            return self.stream(name, row, *sorted(end.name for end in ends))
        return self.stream(name, row, station.name)

    def at_snr(self, snr_db: float) -> "Scene":
        """Return the scene with noise in all range cells at this SNR (dB).

        In the scene itself noise is added at each of noise.snr_db.
        """
        changed = [effect.at_snr(snr_db) for effect in self.effects]
        return replace(self, effects=tuple(effect for effect in changed if not effect.idle))


def with_cross_sections(scene: Scene, cloud: Cloud) -> Cloud:
    """Return the cloud with the cross sections that the scene gives its points."""
    wavelength_m = SPEED_OF_LIGHT / scene.network.carrier_hz
    for name, cross_sections in every(scene.effects, "cross_sections").items():
        found = cross_sections(cloud, wavelength_m)
        rcs_m2 = numbers(name, "cross_sections", found, [cloud.rcs_m2.shape], real=True)
        if (rcs_m2 < 0).any():
            raise InputError(
                f"{name}: cross_sections gives {rcs_m2.min():g} m2, expected no number below 0"
            )
        cloud = replace(cloud, rcs_m2=rcs_m2)
    return cloud


def observe(
    scene: Scene,
    station: Station,
    cloud: Cloud,
    row: dict,
    occluders: dict | None = None,
    beside: View | None = None,
) -> View:
    """Return the view of a sample from a station, with the motion effects of the scene.

    All stations share these effects.

    The view's cloud has the cross sections that the scene gives its points. occluders: the target's
    surfaces; beside: of a companion, the view of the labelled target, whose instants and beams it
    shares.
    """
    network = scene.network
    cloud = with_cross_sections(scene, cloud)
    grid_s = np.append(network.times_s, len(network.times_s) * network.symbol_interval_s)
    changes = []
    for name, perturb in every(scene.effects, "perturb").items():
        changes.append(perturb(cloud, row, grid_s, scene.stream(name, row)))
    moved = Perturbations(grid_s, tuple(changes))
    if beside is not None:
        motion, places = located(cloud, row, beside.times_s, moved)
        return replace(
            beside,
            cloud=cloud,
            row=row,
            motion=motion,
            places=places,
            moved=moved,
            occluders=occluders,
        )
    times_s = network.times_s
    sampling = None
    for name, sample in every(scene.effects, "sampling").items():
        sampling = sample(network, scene.stream(name, row, station.name))
        times_s = sampling.times_s
    motion, places = located(cloud, row, times_s, moved)
    element = only(scene.effects, "element")
    origin_m = np.array([row["x_m"], row["y_m"], row["z_m"]])
    view = View(
        network,
        station,
        cloud,
        row,
        times_s,
        motion,
        places,
        moved,
        origin_m,
        element=element() if element else None,
        occluders=occluders,
        sampling=sampling,
    )
    stations = [end for end in network.stations if end.transmitter is None]
    for name, beams in every(scene.effects, "beams").items():
        drawn = {}
        for end in stations:
            drawn[end.name] = beams(view.of(end), scene.stream(name, row, end.name))
        view = replace(view, beams=drawn)
    return view
