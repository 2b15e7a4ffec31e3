"""The sample of a target on a link, and its response as a slow sum over all routes."""

from dataclasses import replace

import numpy as np

import reference_effects
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.scene.chain import SceneSample
from lowalt.scene.observe import observe
from scenes import A, B, link, linked, scene, target


def link_of(effects):
    """The sample of a target on the link from A to B."""
    radio = linked(subcarriers=16, symbols=3, transmit=(3, 1), receive=(2, 2))
    cloud, row = target(np.random.default_rng(4), points=5)
    asked = scene(effects, radio)
    return SceneSample(asked, observe(asked, link(), cloud, row))


def sum_of_all_routes(sample, paths_of):
    """The response (N, M) of a link as a sum over every path out from A and every path back to B."""
    view = sample.view
    radio = view.network
    sent_hz = A.frequency_hz
    elements = np.prod(radio.transmit) * np.prod(radio.receive)
    scale = np.sqrt(radio.power / elements) * SPEED_OF_LIGHT / sent_hz / (4 * np.pi) ** 1.5
    sender, receiver = view.ends()
    ends = [
        (sender, A, radio.transmit),
        (receiver, replace(B, frequency_hz=sent_hz), radio.receive),
    ]
    result = np.zeros((radio.symbols, radio.subcarriers), complex)
    for n, m in np.ndindex(result.shape):
        one_way = []
        for end, station, shape in ends:
            total = np.zeros(len(view.cloud.rcs_m2), complex)
            direct = [(end.places, np.ones(end.places.shape[:2]))]
            further = [
                (path.places, np.broadcast_to(path.coefficient, end.places.shape[:2]))
                for path in paths_of(end)
            ]
            for places, coefficient in direct + further:
                hz = sent_hz + m * radio.subcarrier_spacing_hz
                wave = reference_effects.one_way(
                    radio, station, shape, places[n], view.aim_m, hz, False, False
                )
                total += coefficient[n] * wave
            one_way.append(total)
        result[n, m] = (scale * np.sqrt(view.cloud.rcs_m2) * one_way[0] * one_way[1]).sum()
    return result


def seen_paths(sample, effect, settings):
    """How many paths each end sees by an effect, after the sample's echo was found to be the sum
    over all routes.
    """
    complete = effect.DEFAULTS | settings

    def paths_of(end):
        """The paths of one end."""
        return effect.paths(complete, end)

    truth = sum_of_all_routes(sample, paths_of)
    assert abs(sample.echo(sample.view) - truth).max() < 1e-10 * abs(truth).max()
    return [sum(np.any(path.coefficient) for path in paths_of(end)) for end in sample.view.ends()]
