"""Bounds of physics by need: named hard scenes, the largest speeds of a target, and a search for counter-examples."""

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from lowalt.common.network import Network, Station
from lowalt.effects import received as module
from lowalt.effects import waveform
from lowalt.effects.catalogue import BY_NEED, called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import squint, symbol_motion
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.response import response
from lowalt.effects.speeds import Speeds
from lowalt.effects.target_echo import EXACT
from lowalt.motion.poses import Perturbation
from lowalt.motion.table import NUMBERS
from lowalt.targets.cloud import Cloud


def network(**changes) -> Network:
    """The default's signal with few symbols, at one station 25 m up that looks along x."""
    values = {
        "carrier_hz": 4.9e9, "subcarrier_spacing_hz": 120e3, "subcarriers": 256, "guard_subcarriers": 10,
        "symbol_interval_s": 2.5e-3, "symbols": 4, "transmit": (16, 4), "receive": (16, 4), "power": 1.0,
    } | changes  # fmt: skip
    return Network(**values, stations=(Station("A", (0.0, 0.0, 25.0), 0.0, values["carrier_hz"]),))


def target(points, rotor=False, **motion):
    """A cloud of points on a body, or on a rotor about z through the origin, and its row of the motion table."""
    points = np.asarray(points, float)
    kinds = ("body", "rotor")
    cloud = Cloud(
        points=points, part=np.full(len(points), int(rotor)), kinds=kinds, names=kinds, parents=np.array([-1, -1]),
        hinges=np.array([[np.nan] * 3, [0.0] * 3]), axes=np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]),
        normals=np.full(points.shape, np.nan), rcs_m2=np.ones(len(points)),
        record={"subtype": "Thing", "category": "UAV", "source": "test", "checksum": ""},
    )  # fmt: skip
    row = dict.fromkeys(NUMBERS, 0.0) | {"subtype": "Thing", "category": "UAV", "group": "seen", "model": 0}
    return cloud, row | {"z_m": 25.0} | motion


def summed(asked: Scene, cloud: Cloud, row: dict) -> np.ndarray:
    """The slow truth of a scene whose only effect is motion inside a symbol: every time sample has poses of its own."""
    radio, station = asked.network, asked.network.stations[0]
    view = observe(asked, station, cloud, row)
    sent = waveform.sent(asked.stream("waveform", row, station.name), radio.symbols, radio.subcarriers)
    samples = np.empty((radio.symbols, radio.subcarriers), complex)
    for i in range(radio.subcarriers):
        later = view.at(view.times_s + i / (radio.subcarriers * radio.subcarrier_spacing_hz))
        whole = waveform.transmit(response(radio, station, later.places, cloud.rcs_m2, view.aim_m), sent)
        samples[:, i] = whole[:, i]
    cells = np.fft.ifft(waveform.demodulate(samples, sent), axis=1)
    return cells[np.arange(len(cells)), abs(cells).argmax(axis=1)]


def scene(radio, effects, tolerance=None):
    return Scene(radio, 3, tolerance, tuple(called(effects)))


def excess(radio, cloud, row, effects, tolerance):
    """Change by what was left out, over the tolerance: at most 1 where every bound holds."""
    station = radio.stations[0]
    received = received_signal(scene(radio, effects, tolerance), station, cloud, row)
    truth = received_signal(scene(radio, effects), station, cloud, row)
    return abs(received.signal - truth.signal).max() / abs(truth.signal).max() / tolerance, received.decisions


@pytest.mark.parametrize("shape", [(16, 4), (32, 8)])
@pytest.mark.parametrize("range_m", [30.0, 100.0, 200.0])
def test_squint_acts_on_the_spherical_part_of_the_path_too(shape, range_m):
    radio = network(transmit=shape, receive=shape)
    cloud, row = target([[0, 0, 0], [5e-4, 0, 0], [0, 5e-4, 0]], x_m=range_m)
    both = {"squint": {}, "wavefront": {}}
    view = observe(scene(radio, both), radio.stations[0], cloud, row)
    given = radio, radio.stations[0], view.places, cloud.rcs_m2, view.aim_m
    change = np.fft.ifft(response(*given, wavefront=True) - response(*given, wavefront=True, squint=True), axis=1)
    peaks = abs(np.fft.ifft(response(*given), axis=1)).max()
    assert abs(change).max() / peaks <= squint.bound({}, view, frozenset({"wavefront"})).max()
    assert abs(change).max() / peaks > 2 * squint.bound({}, view).max()
    share, decisions = excess(radio, cloud, row, both, 1e-4)
    assert share <= 1 and decisions[1].computed


@pytest.mark.parametrize("turns", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("tolerance", [None, 5e-3])
def test_a_rotor_may_turn_far_within_a_symbol(turns, tolerance):
    radio = network(subcarrier_spacing_hz=1e3, subcarriers=64)
    cloud, row = target([[0.1, 0, 0], [-0.1, 0, 0], [0, 0.1, 0]], rotor=True, x_m=60.0, rate_hz=turns * 1e3)
    station = radio.stations[0]
    asked = scene(radio, {"symbol_motion": {}}, tolerance)
    received = received_signal(asked, station, cloud, row)
    truth = summed(asked, cloud, row)
    assert abs(received.signal - truth).max() <= (tolerance or 1e-10) * abs(truth).max()
    assert received.decisions[0].computed


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_travel_is_at_least_every_path_and_little_more(factor):
    cloud, row = target([[0.3, 0.1, 0.2], [0.0, 0.2, 0.0]], rotor=True, x_m=60.0, vx_mps=20.0, rate_hz=150.0 / factor)
    cloud.record["rate_factors"] = {cloud.names[1]: factor}
    radio = network()
    times = radio.times_s
    grid = np.append(times, 2 * times[-1] - times[-2])
    rng = np.random.default_rng(4)
    added = Perturbation({1: rng.normal(size=len(grid))}, 0.01 * rng.normal(size=(len(grid), 3)),
                         0.05 * rng.normal(size=(len(grid), 3)))  # fmt: skip
    for perturbations in ((), (added,)):
        view = observe(scene(radio, {}), radio.stations[0], cloud, row)
        object.__setattr__(view, "perturbations", perturbations)
        object.__setattr__(view, "grid_s", grid)
        fine = view.at(np.linspace(0.0, times[-1], 20001)).places
        fastest = np.linalg.norm(np.diff(fine, axis=0), axis=2).max() / (times[-1] / 20000)
        claimed = Speeds(view).travel_m(1.0)[1]
        assert fastest <= claimed * (1 + 1e-6) and claimed < (1.01 if not perturbations else 3.0) * fastest + 30.0


def test_interpolation_keeps_the_tolerance_against_what_a_canceller_leaves(monkeypatch):
    made = []

    class Recorded(Chain):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            made.append(self)

    monkeypatch.setattr(module, "Chain", Recorded)
    radio = network(symbols=24, subcarriers=64)
    cloud, row = target([[0, 0, 0], [0.4, 0.2, 0.1]], x_m=80.0, y_m=30.0, vx_mps=2e-4)
    effects = {"squint": {}, "clutter": {"clutter_to_signal_db": -60.0, "wind_mps": 0.0}, "canceller": {}}
    received = received_signal(scene(radio, effects, 1e-3), radio.stations[0], cloud, row)
    largest = abs(received.signal).max()
    assert largest < 0.01 * np.sqrt(received.power)
    assert made[0].interpolation() <= 1e-3 * largest


def decoded(place):
    """A scene from eleven numbers in [0, 1]: range, direction, height, arrays, spacing, points, rotor, speeds."""
    u = np.asarray(place)
    range_m, angle, up = 10 ** (0.9 + 2.0 * u[0]), 3.0 * (u[1] - 0.5), u[2]
    shape = (1 + int(31 * u[3]), 1 + int(7 * u[4]))
    spacing = 10 ** (3.0 + 2.5 * u[5])
    radio = network(
        symbols=3, subcarriers=32, transmit=shape, receive=shape, subcarrier_spacing_hz=spacing,
        symbol_interval_s=2.0 / spacing,
    )  # fmt: skip
    rng = np.random.default_rng(int(1e6 * u[6]))
    points = 10 ** (3.0 * u[7] - 3.0) * rng.uniform(-0.5, 0.5, (2, 3))
    return radio, *target(
        points, rotor=u[8] > 0.5, x_m=range_m * np.cos(angle), y_m=range_m * np.sin(angle), z_m=25.0 + up * range_m,
        vx_mps=10 ** (3.0 * u[9] - 1.0), rate_hz=10 ** (3.0 * u[10]),
    )  # fmt: skip


def used(place, name, others):
    """Largest change of a range cell by physics `name`, with `others` computed, over its bound."""
    radio, cloud, row = decoded(place)
    asked = scene(radio, {one: {} for one in BY_NEED})
    view = observe(asked, radio.stations[0], cloud, row)
    chain = Chain(list(asked.effects), view, lambda purpose: asked.stream(purpose, row, "A"), 1.0)
    change = abs(chain.cells(others | {name}) - chain.cells(others)).max()
    return change / (chain.bounds(frozenset(BY_NEED))[name] + 10 * chain.interpolation())


@pytest.mark.filterwarnings("error")
def test_a_part_without_amplitude_adds_nothing_to_a_bound_even_an_infinite_one(monkeypatch):
    radio = network()
    cloud, row = target([[0.0, 0.0, 0.0]], x_m=100.0)
    asked = scene(radio, {"squint": {}}, tolerance=1e-3)
    view = observe(asked, radio.stations[0], cloud, row)
    chain = Chain(list(asked.effects), view, lambda name: asked.stream(name, row, "A"), 1.0)
    body, rotor = chain.peaks[0]
    assert body > 0 and rotor == 0
    monkeypatch.setattr(squint, "bound", lambda settings, view, others: np.array([[0.25, np.inf]]))
    assert chain.bounds(frozenset({"squint"})) == {"squint": 0.25 * chain.peaks[:, 0].max()}
    chain.__dict__["peaks"] = np.zeros_like(chain.peaks)
    chain.limit(1e-3)
    assert chain.interpolation() == 0 and chain.bounds(frozenset({"squint"})) == {"squint": 0.0}


def test_the_bound_of_interpolation_holds_the_rounding_of_positions_where_motion_inside_a_symbol_is_computed():
    place = [
        0.9862630952568765,
        0.29339956096105435,
        0.5208163509082427,
        0.2586623394532822,
        0.23922688847725226,
        0.17350896379637493,
        0.6282748940622144,
        0.3708711388727066,
        0.1341072962994907,
        0.4572968063277512,
        0.4954088629249479,
    ]
    share = used(place, "cyclic_prefix", frozenset(BY_NEED) - {"cyclic_prefix"})
    assert 1e-4 < share <= 1
    radio, cloud, row = decoded(place)
    asked = scene(radio, {"symbol_motion": {}})
    view = observe(asked, radio.stations[0], cloud, row)
    chain = Chain(list(asked.effects), view, lambda name: asked.stream(name, row, "A"), 1.0)
    chain.limit(1e-15 * chain.peaks.sum(axis=1).max())
    assert chain.error == EXACT


@pytest.mark.slow
@pytest.mark.parametrize("alone", [True, False])
@pytest.mark.parametrize("name", BY_NEED)
def test_an_optimiser_finds_no_scene_that_breaks_a_bound(name, alone):
    others = frozenset() if alone else frozenset(BY_NEED) - {name}
    found = differential_evolution(
        lambda place: -np.log10(max(used(place, name, others), 1e-12)), [(0.0, 1.0)] * 11, maxiter=14, popsize=4,
        seed=1, polish=False, tol=0,
    )  # fmt: skip
    share = used(found.x, name, others)
    print(f"{name} with {sorted(others)}: {found.nfev} scenes, largest change {share:.3f} of its bound")
    assert 1e-3 < share <= 1


def test_motion_is_bounded_for_every_sample_of_a_symbol():
    rng = np.random.default_rng(8)
    for _ in range(20):
        radio, cloud, row = decoded(rng.uniform(size=11))
        view = observe(scene(radio, {}), radio.stations[0], cloud, row)
        moved = view.at(view.times_s + rng.random() * symbol_motion.duration_s(view))
        step = np.linalg.norm(moved.places - view.places, axis=2).max()
        assert step <= Speeds(view).travel_m(symbol_motion.duration_s(view)).max() * (1 + 1e-9)
