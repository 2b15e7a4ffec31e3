"""Scenes that are refused before any job starts, and the schema's keys.

A refusal says the effect and what was expected.
"""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml

from lowalt.files.errors import InputError
from lowalt.scene.chain import SceneSample
from lowalt.scene.checks import check
from lowalt.scene.effects import ADDED, PLACES, called, dotted
from lowalt.scene.observe import Scene, observe
from lowalt.scene.view import Still
from scenes import target
from tables import rows

STATIONS = {
    name: {"position_m": [x, 0.0, 10.0], "normal_deg": 0.0}
    for name, x in (("A", 0.0), ("B", 120.0))
}
ALONE = {
    "carrier_hz": 4.9e9,
    "subcarrier_spacing_hz": 120e3,
    "subcarriers": 256,
    "guard_subcarriers": 10,
    "symbol_interval_s": 2.5e-3,
    "symbols": 400,
    "transmit_array": [4, 2],
    "receive_array": [4, 2],
    "power_w": 1.0,
    "stations": {"A": STATIONS["A"]},
}
LINKED = ALONE | {"stations": STATIONS | {"AB": {"transmit": "A", "receive": "B"}}}
FMCW = {key: ALONE[key] for key in ("transmit_array", "receive_array", "power_w", "stations")} | {
    "carrier_hz": 24e9,
    "symbol_interval_s": 0.5e-3,
    "symbols": 400,
    "waveform": {"kind": "fmcw", "sweep_hz": 150e6, "sweep_s": 400e-6, "samples": 64},
}
QUIET = [float("inf")]
OF_OFDM = (
    "data_symbols",
    "power_amplifier",
    "comb_pilots",
    "cyclic_prefix",
    "interference",
    "link_offset",
    "timing_offset",
    "clock_offset",
    "carrier_offset",
)


@pytest.mark.parametrize(
    ("network", "effects", "snr_db", "said"),
    [
        *((ALONE, effects, QUIET, said) for effects, said in rows("scenes", "usual")),
        *(
            ((LINKED if links else ALONE) | changes, effects, [snr_db], said)
            for links, changes, effects, snr_db, said in rows("scenes", "networks")
        ),
        *((FMCW, {name: {}}, QUIET, rf"effects: \['{name}'\] .*kind 'fmcw'") for name in OF_OFDM),
        *(
            (FMCW | {"waveform": {"kind": "cw"}}, {name: {}}, QUIET, rf"\['{name}'\] .*kind 'cw'")
            for name in (*OF_OFDM, "symbol_motion", "clutter")
        ),
    ],
)
def test_settings_that_contradict_each_other_are_refused_by_name(network, effects, snr_db, said):
    with pytest.raises(InputError, match=said) as refused:
        check({"network": network, "effects": effects, "noise": {"snr_db": snr_db}})
    assert "expected" in str(refused.value)


@pytest.mark.parametrize(
    "effects",
    [
        {"timing_offset": {"sigma_s": 1e-6, "prefix_slack_s": 3.1e-6}},
        {"clock_offset": {"fixed_ppm": 1.0, "sigma_ppm": 0.0, "prefix_slack_s": 1.1e-6}},
    ],
)
def test_a_longer_prefix_allows_a_larger_slip(effects):
    assert check({"network": ALONE, "effects": effects, "noise": {"snr_db": QUIET}})


@pytest.mark.parametrize(
    ("blocks", "said"),
    rows("scenes", "later"),
)
def test_effects_that_later_stages_do_not_fit_are_refused(blocks, said):
    effects = {
        "clutter": {},
        "canceller": {},
        "slow_time": {"downlink": 1, "jitter_s": 1e-4, "regrid": "nudft"},
    }
    with pytest.raises(InputError, match=said):
        check({"network": ALONE, "effects": effects} | blocks)


@pytest.mark.parametrize("function", ["data", "range_cells"])
def test_two_effects_that_offer_the_same_function_are_refused_where_a_scene_has_one(
    function, monkeypatch
):
    own = ModuleType("lowalt.scene.effects.transmitter.own")
    own.DEFAULTS = {}
    own.data = len
    own.range_cells = len
    monkeypatch.setitem(PLACES, "own", "transmitter")
    monkeypatch.setitem(sys.modules, own.__name__, own)
    other = {"data": "data_symbols", "range_cells": "comb_pilots"}[function]
    with pytest.raises(
        InputError, match=f"{other} and own both offer {function}, expected one of them"
    ) as refused:
        check({"network": ALONE, "noise": {"snr_db": QUIET}, "effects": {other: {}, "own": {}}})
    assert len(str(refused.value)) < 400
    assert [effect.name for effect in called({other: {}, "phase_noise": {}})] == [
        other,
        "phase_noise",
    ]


def test_an_own_effect_that_offers_the_direct_path_of_a_link_takes_the_place_of_the_shipped_one(
    monkeypatch,
):
    own = ModuleType("lowalt.scene.effects.channel.own")
    own.DEFAULTS = {}
    own.from_sender = lambda settings, view: Still(np.full((400, 256), 3.0))
    monkeypatch.setitem(PLACES, "own", "channel")
    monkeypatch.setitem(sys.modules, own.__name__, own)
    effects = {"own": {}}
    network = check({"network": LINKED, "noise": {"snr_db": QUIET}, "effects": effects}).network
    asked = Scene(network, 1, None, tuple(called(effects)))
    cloud, row = target(np.random.default_rng(1))
    sample = SceneSample(asked, observe(asked, network.station("AB"), cloud, row))
    np.testing.assert_allclose(sample.arrived() - sample.echo(sample.view), 3.0, rtol=1e-9)


@pytest.mark.parametrize("name", PLACES)
def test_the_schema_knows_every_setting_and_each_effect_names_its_source(name):
    schema = yaml.safe_load(Path("workflow/schemas/config.schema.yaml").read_text())
    module = importlib.import_module(dotted(name))
    assert set(schema["properties"]["effects"]["properties"][name].get("properties", {})) == set(
        module.DEFAULTS
    )
    assert module.SOURCE
    assert name in ADDED or f".{PLACES[name]}." in module.__name__
    assert all(set(entry) <= set(module.DEFAULTS) for entry in getattr(module, "IDLE", ()))
    assert all(
        set(entry) <= set(module.DEFAULTS) for entry in getattr(module, "PARTS", {}).values()
    )
