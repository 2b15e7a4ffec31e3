"""Effects as a whole: the chain against a slow truth, no effect that a scene does not name, streams of their own."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import reference_effects
from lowalt.common.config import faults, load, plain
from lowalt.common.errors import InputError
from lowalt.common.network import Network, Station
from lowalt.common.streams import stream
from lowalt.common.yaml_files import load_yaml
from lowalt.echo import echo_matrix, echo_signal
from lowalt.echo.radar import radar
from lowalt.effects import interface, waveform
from lowalt.effects import response_tables as tables
from lowalt.effects.catalogue import BY_NEED, ORDER, PLACES, called, dotted
from lowalt.effects.checks import check
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.response import ImagePath, response
from lowalt.motion.poses import placed, rotated
from lowalt.motion.table import NUMBERS
from lowalt.targets.cloud import Cloud


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def network(**changes) -> Network:
    """A small network of one station at 10 m height."""
    values = {
        "carrier_hz": 4.9e9, "subcarrier_spacing_hz": 120e3, "subcarriers": 32, "guard_subcarriers": 10,
        "symbol_interval_s": 2.5e-3, "symbols": 24, "transmit": (4, 2), "receive": (4, 2), "power": 1.0,
    }  # fmt: skip
    values |= changes
    place = values.pop("place", (0.0, 0.0, 10.0))
    return Network(**values, stations=(Station("A", place, 0.3, values["carrier_hz"]),))


def target(rng, points=9, size_m=0.5, wheel_hz=0.0):
    """A cloud of a body and a rotor with random points, and its row of the motion table."""
    part = (np.arange(points) % 2).astype(np.int64)
    cloud = Cloud(
        points=rng.uniform(-size_m, size_m, (points, 3)), part=part, kinds=("body", "rotor"), names=("body", "rotor 0"),
        parents=np.array([-1, -1]), hinges=np.array([[np.nan] * 3, [0.1, 0.0, 0.0]]),
        axes=np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]), normals=np.full((points, 3), np.nan),
        rcs_m2=rng.uniform(0.1, 2.0, points),
        record={"subtype": "Thing", "category": "UAV", "source": "test", "checksum": ""},
    )  # fmt: skip
    row = dict.fromkeys(NUMBERS, np.nan) | {
        "subtype": "Thing", "category": "UAV", "group": "seen", "model": 3, "x_m": 60.0, "y_m": 25.0, "z_m": 30.0,
        "vx_mps": 5.0, "vy_mps": -3.0, "vz_mps": 1.0, "yaw_rad": 0.7, "pitch_rad": 0.1, "roll_rad": -0.1,
        "rate_hz": wheel_hz or 60.0, "phase_0_rad": 0.4,
    }  # fmt: skip
    return cloud, row


def scene(effects, tolerance=None, radio=None):
    return Scene(radio or network(), 5, tolerance, tuple(called(effects)))


def relative(value, truth):
    return abs(value - truth).max() / abs(truth).max()


@pytest.mark.parametrize("shapes", [((4, 2), (4, 2)), ((3, 2), (5, 1))])
@pytest.mark.parametrize("squint, wavefront", [(False, False), (True, False), (False, True), (True, True)])
def test_response_is_the_sum_over_every_element_path_and_subcarrier(rng, shapes, squint, wavefront):
    radio = network(subcarriers=17, symbols=3, transmit=shapes[0], receive=shapes[1])
    station = radio.stations[0]
    places = np.array([12.0, 3.0, 14.0]) + rng.normal(size=(3, 5, 3))
    rcs, aim, factor = rng.uniform(0.1, 2, 5), np.array([12.0, 3.0, 14.0]), rng.uniform(0, 1, (3, 5))
    image, coefficient = places * [1, 1, -1], rng.normal(size=(3, 5)) + 1j * rng.normal(size=(3, 5))
    ours = response(
        radio, station, places, rcs, aim, paths=[ImagePath(image, coefficient)], factor=factor, squint=squint,
        wavefront=wavefront,
    )  # fmt: skip
    truth = reference_effects.subcarriers(
        radio, station, places, rcs, aim, [(image, coefficient)], factor, squint, wavefront
    )
    assert relative(ours, truth) < 2e-12


def test_places_and_normals_are_those_of_the_poses(rng):
    cloud, row = target(rng, points=11)
    normals = rng.normal(size=(11, 3))
    cloud = replace(cloud, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))
    view = observe(scene({}), network().stations[0], cloud, row)
    assert view.places == pytest.approx(placed(cloud, view.motion.rotation, view.motion.translation), rel=1e-14)
    assert view.normals == pytest.approx(rotated(view.motion.rotation, cloud.normals, cloud.part), abs=1e-14)


@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-7])
@pytest.mark.parametrize("squint, wavefront", [(False, False), (True, False), (False, True), (True, True)])
def test_a_coarser_response_errs_by_no_more_than_it_may(rng, squint, wavefront, error):
    radio = network(subcarriers=40, subcarrier_spacing_hz=3e6, symbols=2, transmit=(16, 4), receive=(9, 3))
    station, aim = radio.stations[0], np.array([25.0, 30.0, 14.0])
    places, rcs = aim + rng.normal(size=(2, 40, 3)), rng.uniform(0.1, 2, 40)
    image = ImagePath(places * [1, 1, -1], 0.7j)
    given = (radio, station, places, rcs, aim)
    ours = response(*given, paths=[image], squint=squint, wavefront=wavefront, error=error)
    exact = response(*given, paths=[image], squint=squint, wavefront=wavefront)
    near = np.linalg.norm(places - station.position_m, axis=2).min()
    elements = np.prod(radio.transmit) * np.prod(radio.receive)
    peaks = radar(radio, station).scale * elements * np.sqrt(rcs).sum() / near**2 * (1 + 0.7) ** 2
    assert 1e-15 * peaks < abs(ours - exact).max() <= error * peaks


def test_a_table_keeps_no_order_that_its_error_allows_to_leave_out():
    for error in (1e-3, 1e-6, 1e-9):
        mix, values = tables.joined(2.0, 5, 64, error)
        assert mix.shape[1] == len(values) and 0.1 * error < abs(mix[:, -1]).sum()
    kept = [tables.joined(2.0, 5, 64, error)[0].shape[1] for error in (1e-3, 1e-6, 1e-9)]
    assert kept[0] < kept[1] < kept[2] < 60


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 300), st.floats(5.0, 5e4), st.floats(0.01, 40.0), st.integers(0, 2**32 - 1))
def test_response_agrees_with_the_echo_kernel_at_any_range_and_size(count, range_m, size_m, seed):
    rng = np.random.default_rng(seed)
    radio = network(subcarriers=count, symbols=3)
    station, aim = radio.stations[0], np.array([range_m, 0.3 * range_m, 20.0])
    places = aim + rng.uniform(-min(size_m, range_m / 3), min(size_m, range_m / 3), (3, 6, 3))
    ours = response(radio, station, places, np.ones(6), aim)
    assert relative(ours, echo_matrix(radio, station, places, 1.0, aim, "subcarriers")) < 1e-10


def test_motion_inside_a_symbol_is_the_sum_over_every_time_sample(rng):
    radio = network(subcarriers=16, symbols=2, transmit=(2, 2), receive=(2, 2))
    station = radio.stations[0]
    cloud, row = target(rng, points=5, wheel_hz=500.0)
    called_for = scene({"symbol_motion": {}}, None, radio)
    ours = received_signal(called_for, station, cloud, row)
    view = observe(called_for, station, cloud, row)
    sent = waveform.sent(stream(5, "effect", "waveform", "Thing", 3, "A"), 2, 16)
    truth = reference_effects.moving(
        radio, station, lambda t: view.at(np.array([t])).places, cloud.rcs_m2, view.aim_m, radio.times_s, sent
    )
    cells = np.fft.ifft(truth, axis=1)
    assert relative(ours.signal, cells[[0, 1], abs(cells).argmax(axis=1)]) < 1e-10
    still = received_signal(scene({}, None, radio), station, cloud, row)
    assert relative(ours.signal, still.signal) > 1e-3


WORK = {
    "transmitter": (interface.DrawsData, interface.ChangesWaveform, interface.PicksSubcarriers, interface.SamplesTime),
    "channel": (
        interface.PointsBeams, interface.SetsCrossSections, interface.WeighsPoints, interface.WeighsRoutes,
        interface.AddsPaths, interface.AddsEchoes, interface.AddsSignals, interface.AddsTargets, interface.BoundsItself,
    ),
    "motion": (interface.PerturbsMotion,), "receiver": (interface.ChangesSamples,),
    "detection": (interface.FiltersCells, interface.ChoosesCells),
}  # fmt: skip
"""The protocols of each place of which an effect's module satisfies exactly one."""


def test_the_catalogue_names_every_effect_module_and_only_those():
    for entry in ORDER:
        module = __import__(dotted(entry.partition("/")[2]), fromlist=["idle"])
        assert module.SOURCE and isinstance(module.DEFAULTS, dict)
        assert isinstance(module, interface.Effect)
        provided = [one for one in WORK[PLACES[entry.partition("/")[2]]] if isinstance(module, one)]
        assert len(provided) == 1
    assert len(set(ORDER)) == len(ORDER)


def test_the_defaults_of_every_effect_are_allowed_and_those_kept():
    """A scene that names an effect alone means the kept values: where one is to change, so does such a scene's data."""
    schema = "workflow/schemas/config.schema.yaml"
    given = {name: __import__(dotted(name), fromlist=["DEFAULTS"]).DEFAULTS for name in sorted(PLACES)}
    assert faults(load(["config/default.yaml"], schema) | {"effects": given}, load_yaml(schema)) == []
    lines = [json.dumps({name: plain(values)}) for name, values in given.items()]
    assert lines == Path("tests/data/effect_defaults.jsonl").read_text().splitlines()


def test_idle_effects_leave_every_bit(rng):
    cloud, row = target(rng)
    station = network().stations[0]
    idle = {"adc": {"bits": 0}, "receiver_noise": {"temperature_k": 0.0}}
    assert called(idle) == []
    plain = echo_signal(network(), station, observe(scene({}), station, cloud, row).motion, cloud.rcs_m2, [60, 25, 30])
    received = received_signal(scene(idle), station, cloud, row)
    assert (received.signal == plain.signal).all() and (received.cell == plain.cell).all()


NOTHING = {
    "rotor_spread": {"spread": 0, "wander": 0}, "gusts": {"wind_mps": 0}, "cross_sections": {"strength": 0},
    "fluctuation": {"pattern": False, "spread_db": 0}, "element_pattern": {"gain_dbi": 0.0, "back_db": 0.0},
    "occlusion": {"strength": 0}, "ground_reflection": {"permittivity": 1, "conductivity_s_m": 0},
    "clutter": {"gamma": 0}, "receiver_noise": {"temperature_k": 0}, "timing_offset": {"sigma_s": 0},
    "clock_offset": {"sigma_ppm": 0}, "carrier_offset": {"sigma_ppm": 0}, "phase_noise": {"points": []},
    "iq_imbalance": {"gain_db": 0, "phase_deg": 0}, "adc": {"bits": 0}, "canceller": {"kind": "none"},
    "cell_error": {"probability": 0}, "slow_time": {"downlink": 1}, "data_symbols": {"order": 4},
    "power_amplifier": {"backoff_db": None}, "comb_pilots": {"spacing": 1}, "pointing_error": {"sigma_deg": 0},
    "transmit_leakage": {"isolation_db": None}, "cell_noise": {"snr_db": float("inf")},
    "detector": {"cfar": "none", "gate_cells": None}, "link_offset": {"sigma_ppm": 0, "sigma_s": 0},
    "companions": {"count": [0, 0]}, "line_of_sight": {"blocked_db": 0}, "walls": {"facades": []},
    "background_channel": {"reference_points": 0}, "direct_path": {"loss_db": None},
    "interference": {"loss_db": None, "isolation_db": None, "by_target": False}, "reflected_aspect": {"follow": []},
}  # fmt: skip
"""Every effect that has a strength, without any."""


@pytest.mark.parametrize("name", sorted(set(PLACES) - set(BY_NEED) - {"mean_cross_section"}))
def test_every_effect_is_idle_at_zero_strength_and_not_by_default(name):
    assert called({name: NOTHING[name]}) == []
    assert [effect.name for effect in called({name: {}})] == [name]


def test_adding_an_effect_moves_no_other_draw(rng):
    cloud, row = target(rng)
    station = network().stations[0]
    drawn = {}
    for effects in (
        {"receiver_noise": {}},
        {"receiver_noise": {}, "iq_imbalance": {"gain_db": 1e-9, "phase_deg": 0.0}},
    ):
        drawn[len(effects)] = received_signal(scene(effects), station, cloud, row).signal
    silent = received_signal(scene({}), station, cloud, row).signal
    assert relative(drawn[2], drawn[1]) < 1e-9 < relative(drawn[1], silent)


def test_unknown_effects_and_parameters_are_named():
    with pytest.raises(InputError, match="unknown effect 'rain'"):
        called({"rain": {}})
    with pytest.raises(InputError, match=r"effects.adc: unknown parameter\(s\) \['bytes'\]"):
        called({"adc": {"bytes": 3}})


def test_a_link_budget_and_set_snrs_are_refused_together():
    block = {"carrier_hz": 4.9e9, "subcarrier_spacing_hz": 120e3, "subcarriers": 32, "guard_subcarriers": 10,
             "symbol_interval_s": 2.5e-3, "symbols": 24, "transmit_array": [4, 2], "receive_array": [4, 2],
             "power_w": 1.0, "stations": {"A": {"position_m": [0, 0, 10], "normal_deg": 0}}}  # fmt: skip
    config = {"network": block, "effects": {"receiver_noise": {}}, "noise": {"snr_db": [3]}}
    config["echo"] = {"tolerance": None}
    with pytest.raises(InputError, match="link budget or set SNRs, not both"):
        check(config)
    check(config | {"noise": {"snr_db": [float("inf")]}})
    with pytest.raises(InputError, match="no clutter to cancel"):
        check(config | {"effects": {"canceller": {}}})
