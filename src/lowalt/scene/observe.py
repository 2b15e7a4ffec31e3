"""A scene, its random streams, and the motion of a target as one of its stations sees it."""

from dataclasses import dataclass, replace

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.numerics.streams import stream
from lowalt.scene import protocols
from lowalt.scene.catalogue import LOOK_WIDE, PAIR_WIDE, SHARED_STREAMS, NamedEffect, placed, providing
from lowalt.scene.view import View
from lowalt.targets.cloud import Cloud


@dataclass(frozen=True)
class Scene:
    """A scene: its network, seed, the echo engine's tolerance, and its effects in the chain's order."""

    network: Network
    seed: int
    tolerance: float | None
    effects: tuple[NamedEffect, ...]

    def stream(self, name: str, row: dict, *more: str) -> np.random.Generator:
        """Return the stream of an effect for the motion model `row`, from its start at every call."""
        # Noise at one SNR does not depend on noise at another.
        levels = [effect.settings["snr_db"] for effect in self.effects if effect.name == name == "cell_noise"]
        return stream(self.seed, "effect", name, row["subtype"], row["model"], *more, *filter(None, levels))

    def drawn(self, row: dict, station: Station, name: str) -> np.random.Generator:
        """Return the stream of an effect at a station, from its start: one for the look where its draws belong to it.

        Both directions of a link share the stream of an effect whose draws belong to the pair.
        """
        name = SHARED_STREAMS.get(name, name)
        if name in LOOK_WIDE:
            return self.stream(name, row)
        if name in PAIR_WIDE and station.transmitter is not None:
            return self.stream(name, row, *sorted((station.transmitter.name, station.receiver.name)))
        return self.stream(name, row, station.name)

    def at_snr(self, snr_db: float) -> "Scene":
        """Return the scene with noise in all range cells at this SNR (dB), instead of at each of noise.snr_db."""
        changed = [
            effect._replace(settings=effect.settings | {"snr_db": snr_db}) if effect.name == "cell_noise" else effect
            for effect in self.effects
        ]
        return replace(self, effects=tuple(effect for effect in changed if not effect.module.idle(effect.settings)))


def with_cross_sections(scene: Scene, cloud: Cloud) -> Cloud:
    """Return the cloud with the cross sections that the scene gives its points."""
    wavelength_m = SPEED_OF_LIGHT / scene.network.carrier_hz
    for effect in providing(scene.effects, protocols.SetsCrossSections):
        cloud = replace(cloud, rcs_m2=effect.module.cross_sections(effect.settings, cloud, wavelength_m))
    return cloud


def observe(scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None) -> View:
    """Return the view of a sample with the scene's motion effects drawn; their draws do not depend on the station."""
    times_s = scene.network.times_s
    grid_s = np.append(times_s, len(times_s) * scene.network.symbol_interval_s)
    sampling = None
    for effect in providing(scene.effects, protocols.SamplesTime):
        draws = scene.stream(effect.name, row, station.name)
        sampling = effect.module.sampling(effect.settings, scene.network, draws)
        times_s = sampling.times_s
    moved = tuple(
        effect.module.perturb(effect.settings, cloud, row, grid_s, scene.stream(effect.name, row))
        for effect in placed(scene.effects, "motion")
    )
    shaped = [effect.module.element(effect.settings) for effect in providing(scene.effects, protocols.ShapesElements)]
    view = View(
        scene.network, station, cloud, row, times_s, grid_s, moved, occluders, shaped[0] if shaped else None, None,
        sampling,
    )  # fmt: skip
    for effect in providing(scene.effects, protocols.PointsBeams):
        beams = {
            end.name: effect.module.beams(effect.settings, view.of(end), scene.stream(effect.name, row, end.name))
            for end in ends_of(scene.network, station)
        }
        view = replace(view, beams=beams)
    return view


def ends_of(network: Network, station: Station) -> list[Station]:
    """All stations of the network that are not links, and those of `station`."""
    own = [station] if station.transmitter is None else [station.transmitter, station.receiver]
    others = [each for each in network.stations if each.transmitter is None]
    return list({each.name: each for each in [*others, *own]}.values())
