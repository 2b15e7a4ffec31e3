"""Random streams of effects: those that draw nothing get none, and questions about modules are asked once."""

import importlib
from dataclasses import replace

import numpy as np
import pytest

from every_effect import targets
from lowalt.effects import catalogue, interface, receiving
from lowalt.effects.catalogue import ORDER, dotted
from lowalt.effects.effect_streams import drawn
from lowalt.effects.received import Scene, received_signal
from test_effects import network, scene, target

MODULES = {name: importlib.import_module(dotted(name)) for name in catalogue.PLACES}
STILL = [name for name, module in MODULES.items() if isinstance(module, receiving.DrawsNothing)]
BESIDE = {"cell_error": {}}
"""An effect that draws."""


@pytest.mark.parametrize("name", STILL)
def test_an_effect_that_draws_nothing_gets_no_stream_and_leaves_its_generator_as_it_is(name, rng, monkeypatch):
    made, stream = [], Scene.stream
    monkeypatch.setattr(Scene, "stream", lambda own, *keys: made.append(keys[0]) or stream(own, *keys))
    (cloud, surfaces), (_, row) = targets(rng, 0.5, False), target(rng)
    before = receiving.UNUSED.bit_generator.state
    asked = scene({name: {}} | BESIDE)
    received_signal(asked, network().stations[0], cloud, row, surfaces)
    assert receiving.UNUSED.bit_generator.state == before
    assert name not in made and set(BESIDE) <= set(made)


def test_streams_of_effects_that_draw_do_not_depend_on_others(rng):
    (_, row), station = target(rng), network().stations[0]
    alone = drawn(scene(BESIDE), row, station, "cell_error")
    beside = drawn(scene(BESIDE | {"detector": {}}), row, station, "cell_error")
    np.testing.assert_array_equal(alone.random(5), beside.random(5))
    assert drawn(scene(BESIDE | {"detector": {}}), row, station, "detector") is receiving.UNUSED


@pytest.mark.parametrize(
    ("name", "ends", "alike"),
    [
        ("link_offset", "AB BA AC A", {"AB", "BA", "AC", "A"}), ("fluctuation", "AB BA AC A", {"AB", "BA"}),
        ("cell_error", "AB BA AC A", {"AB"}),
    ],
)  # fmt: skip
def test_stations_of_a_look_share_draws_that_belong_to_all_of_them_and_both_ways_those_of_their_pair(
    name, ends, alike, rng
):
    (_, row), (plain,) = target(rng), network().stations
    one = {station: replace(plain, name=station) for station in "ABC"}
    found = {}
    for both in ends.split():
        hears = (
            one[both] if len(both) == 1 else replace(plain, name=both, transmitter=one[both[0]], receiver=one[both[1]])
        )
        found[both] = float(drawn(scene({name: {}}), row, hears, name).random())
    assert {both for both in found if found[both] == found["AB"]} == alike
    # The stream of another station of the look is asked for by name.
    assert (
        drawn(scene({name: {}}), row, one["A"], name, one["B"]).random()
        == drawn(scene({name: {}}), row, one["B"], name).random()
    )


def test_every_answer_of_every_effect_is_kept():
    protocols = [one for one in vars(interface).values() if getattr(one, "_is_protocol", False)]
    assert catalogue._satisfies.cache_info().maxsize > 4 * len(ORDER) * len(protocols)


@pytest.fixture
def rng():
    return np.random.default_rng(7)
