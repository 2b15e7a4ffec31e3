"""Small scenes that run most functions of the echo and of the effects, in groups, for `kept_numbers`."""

import sys
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace
from unittest import mock

import numpy as np

import driven_echo
from every_effect import NUMBERS_OF_A_SCENE, case
from lowalt.common.config import load
from lowalt.common.network import Network
from lowalt.echo import Path, Rigid, echo_matrix, echo_signal, range_profile
from lowalt.echo.fast import workspace
from lowalt.effects.catalogue import called
from lowalt.effects.chunk import scene_signals
from lowalt.effects.explain import ExplainedSample, sample_facts
from lowalt.effects.received import Scene, received_signal
from lowalt.shards.dataset import Dataset
from lowalt.targets.occluders import make
from lowalt.targets.records import records_of
from small_echo import NETWORK, pieces, places

TOLERANCES = (None, 1e-2, 1e-4, 1e-6, 1e-9)
SHIPPED = (
    "detection", "flock", "frames", "links", "paper", "reuse", "rural", "sensing", "streets", "triangle", "urban",
    "worst",
)  # fmt: skip
SCHEMA = "workflow/schemas/config.schema.yaml"
SYMBOLS = 20
RANDOM, EACH = 3, 8
"""Groups of random scenes of effects, and scenes in each."""
RECORDED = 4
"""Which number of a random scene says whether its target is a recording."""
RARE = {50: False, 51: True, 101: True, 136: False, 220: False}
"""Random scenes of `rare_effects`, and whether their target must be a recording."""


def turning(symbols: int, sizes: tuple[int, ...], away: tuple[float, float, float], seed: int) -> Rigid:
    """Points on parts that turn steadily, the first one still, and move on together."""
    rng = np.random.default_rng(seed)
    angle = np.outer(np.arange(symbols), 0.3 * np.arange(len(sizes)))
    rotation = np.zeros((symbols, len(sizes), 3, 3))
    rotation[..., 0, 0], rotation[..., 0, 1] = np.cos(angle), -np.sin(angle)
    rotation[..., 1, 0], rotation[..., 1, 1], rotation[..., 2, 2] = np.sin(angle), np.cos(angle), 1.0
    along = np.asarray(away) + 0.02 * np.arange(symbols)[:, None] * np.array([1.0, -0.5, 0.2])
    translation = along[:, None] + rng.normal(0, 0.3, (len(sizes), 3))
    part = np.repeat(np.arange(len(sizes)), sizes)
    return Rigid(rotation, translation, rng.normal(0, 0.4, (sum(sizes), 3)), part)


def echoes(motion: Rigid, net: Network = NETWORK, tolerances: tuple = TOLERANCES) -> None:
    """The signal of a target at every tolerance."""
    count = len(motion.points)
    aim = motion.translation[0, 0] + np.array([1.0, 2.0, -1.5])
    for tolerance in tolerances:
        echo_signal(net, net.stations[0], motion, driven_echo.weights(count), aim, tolerance)


def near_and_far() -> None:
    """Few points at several ranges, over the station, at a network of other sizes, as places and by all answers."""
    for away in ((90.0, 120.0, 40.0), (9.0, 2.0, 20.0), (4000.0, 3000.0, 500.0), (4.0, -7.0, 90.0)):
        echoes(pieces(away=away))
    for subcarriers, transmit, receive in ((1, (1, 1), (4, 2)), (3, (5, 1), (5, 1)), (300, (16, 4), (16, 4))):
        net = replace(NETWORK, subcarriers=subcarriers, transmit=transmit, receive=receive)
        echoes(pieces(), net)
    motion, station = pieces(), NETWORK.stations[0]
    aim, spots = motion.translation[0, 0], places(motion).astype(float)
    echo_signal(NETWORK, station, spots, 1.0, aim)
    echo_signal(NETWORK, station, spots, 1.0, aim, paths=[Path(), Path(3e-8, 0.5j)])
    for columns in ("cells", "subcarriers"):
        echo_matrix(NETWORK, station, motion, 2.0, aim, columns, paths=[Path(1e-8, 0.3), Path(0.0, 1.0)])
        echo_matrix(NETWORK, station, spots, 2.0, aim, columns)
    range_profile(NETWORK, station, motion, 1.5, aim, 9)


def many_points() -> None:
    """More points than a strip holds, in many symbols: slow parts are interpolated in time."""
    net = replace(NETWORK, symbols=400, subcarriers=256, transmit=(16, 4), receive=(16, 4))
    echoes(turning(400, (300, 20, 100), (150.0, 80.0, 60.0), 2), net, (1e-2, 1e-4, 1e-6, None))
    wide = replace(NETWORK, symbols=90)
    echoes(turning(90, (3, 200, 40), (40.0, 20.0, 30.0), 3), wide)


def interpreted_echo() -> None:
    """The fast kernel, run by the interpreter: every function that it calls is seen. Its work space begins as zeros."""
    cleared = SimpleNamespace(**vars(np) | {"empty": np.zeros})
    with mock.patch.object(workspace, "np", cleared):
        for error in (0.0, 1e-3, 1e-7):
            driven_echo.computed(pieces((6, 3, 9), symbols=2), error)
        driven_echo.computed(pieces((6, 3, 9), symbols=2, away=(3000.0, 2500.0, 300.0)))


def random_effects(group: int) -> None:
    """Scenes of any of all effects, with what their tolerance leaves out and without."""
    for number in range(EACH):
        _received(np.random.default_rng([77, group, number]).random(NUMBERS_OF_A_SCENE))


def rare_effects() -> None:
    """Random scenes that run functions which those of `random_effects` do not."""
    for number, recorded in RARE.items():
        numbers = np.random.default_rng([78, number]).random(NUMBERS_OF_A_SCENE)
        numbers[RECORDED] = 0.95 if recorded else numbers[RECORDED]
        _received(numbers)


def _received(numbers: np.ndarray) -> None:
    """The signal of the scene of these numbers, to its tolerance and exactly."""
    one = case(numbers)
    one.received(one.tolerance)
    one.received(None)


@cache
def _targets() -> tuple[dict, dict, dict]:
    """A small craft and a bird, made unwatched: the configuration without a scene, their clouds, and their surfaces."""
    watching = sys.getprofile()
    sys.setprofile(None)
    config = load(["config/default.yaml"], SCHEMA)
    names = config["targets"]["select"] = ["DJI Mini 2", "Owl"]
    records = records_of(config["targets"], None)
    surfaces = {name: make(records[name], None, config["seed"]) | {"subtype": name} for name in names}
    clouds = Dataset(config).clouds
    sys.setprofile(watching)
    return config, clouds, surfaces


def shipped(names: tuple[str, ...]) -> None:
    """Scenes that the project ships, of few symbols, with a craft or a bird, at the first and at the last station."""
    base, clouds, surfaces = _targets()
    for count, name in enumerate(names):
        config = load(["config/default.yaml", f"config/scenes/{name}.yaml"], SCHEMA)
        config["network"]["symbols"], config["targets"]["select"] = SYMBOLS, base["targets"]["select"]
        for spectrum in ("vrp", "trp", "vt"):
            config["spectra"][spectrum]["window"] = 8
        dataset = Dataset(config, clouds, occluders=surfaces)
        echo = dataset.maker.echo
        scene = Scene(dataset.maker.network, 1, echo["tolerance"], tuple(called(echo["effects"])))
        row = dataset.row(dataset.place(count % 2 * (len(dataset) // 2)))
        scene, (first, *_, last) = scene.at_snr(8.0), scene.network.stations
        scene_signals(scene, first.name, clouds, [row], surfaces)
        explained = ExplainedSample(clouds[row["subtype"]], row, surfaces[row["subtype"]])
        sample_facts(scene, explained, last.name)


def near_field_boxes() -> None:
    """A craft near a station with the physics of its near field, whose sums over elements are polynomials."""
    config, clouds, _ = _targets()
    network = replace(Dataset(config, clouds).maker.network, symbols=100)
    dataset = Dataset(config, clouds)
    row = dataset.row(dataset.place(0)) | {"x_m": 30.0, "y_m": 45.0, "z_m": 60.0}
    for effects in ({"wavefront": {}}, {"squint": {}, "wavefront": {}, "symbol_motion": {}, "ground_reflection": {}}):
        for tolerance in (None, 1e-4):
            scene = Scene(network, 1, tolerance, tuple(called(effects)))
            received_signal(scene, network.stations[0], clouds[row["subtype"]], row)


SCENES = {
    "near and far": near_and_far,
    "many points": many_points,
    "interpreted": interpreted_echo,
    **{f"effects {group}": partial(random_effects, group) for group in range(RANDOM)},
    "rare effects": rare_effects,
    "near field": near_field_boxes,
    "scenes": partial(shipped, SHIPPED),
}
