"""Links between two stations: range sum, Doppler of the bisector, the direct path, and offsets between oscillators."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import reference_effects
from lowalt.common.config import load
from lowalt.common.errors import InputError
from lowalt.common.network import Network, Station, masts_m
from lowalt.echo import echo_signal
from lowalt.echo.pointwise.reference_range import reference
from lowalt.echo.radar import radar
from lowalt.effects import waveform
from lowalt.effects.catalogue import called
from lowalt.effects.channel import direct_path
from lowalt.effects.checks import check
from lowalt.effects.levels import levels
from lowalt.effects.one_way import range_sum
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.receiver import link_offset
from lowalt.effects.response import OneWayFactors, response
from lowalt.shards.record import geometry
from test_effects import network, target

ROOT = Path(__file__).parent.parent
C = 299_792_458.0
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
A = Station("A", (0.0, 0.0, 10.0), 0.3, 4.9e9)
B = Station("B", (120.0, 10.0, 15.0), 2.8, 4.95e9)


def link(sends=A, hears=B):
    """The link from one station to another."""
    return Station(f"{sends.name}-{hears.name}", hears.position_m, hears.normal_rad, sends.frequency_hz, sends, hears)


def linked(**changes):
    """A network of two stations and both links between them."""
    return replace(network(**changes), stations=(A, link(), B, link(B, A)))


def scene(effects, radio):
    return Scene(radio, 5, None, tuple(called(effects)))


@pytest.mark.parametrize("squint, wavefront", [(False, False), (True, False), (False, True), (True, True)])
def test_a_links_response_is_the_product_of_both_ways_summed_over_points(squint, wavefront):
    rng = np.random.default_rng(1)
    radio = linked(subcarriers=17, symbols=3, transmit=(3, 2), receive=(5, 1))
    aim = np.array([50.0, 40.0, 20.0])
    places, rcs = aim + rng.normal(size=(3, 5, 3)), rng.uniform(0.1, 2, 5)
    found = response(radio, link(), places, rcs, aim, squint=squint, wavefront=wavefront)
    scale = np.sqrt(radio.power / (6 * 5)) * C / radio.carrier_hz / (4 * np.pi) ** 1.5
    back = replace(B, frequency_hz=A.frequency_hz)
    truth = np.zeros((3, 17), complex)
    for n in range(3):
        for m in range(17):
            f = A.frequency_hz + m * radio.subcarrier_spacing_hz
            ways = [
                reference_effects.one_way(radio, end, shape, places[n], aim, f, squint, wavefront)
                for end, shape in ((A, radio.transmit), (back, radio.receive))
            ]
            truth[n, m] = (scale * np.sqrt(rcs) * ways[0] * ways[1]).sum()
    # The reference's phases are rounded at some thousand turns.
    assert abs(found - truth).max() < 1e-11 * abs(truth).max()


@pytest.mark.parametrize("squint, wavefront", [(False, False), (True, True)])
@pytest.mark.parametrize("receive", [(4, 2), (3, 1)])
def test_a_link_back_to_its_own_place_is_the_station_itself_to_the_last_bit(receive, squint, wavefront):
    rng = np.random.default_rng(2)
    radio = linked(transmit=(4, 2), receive=receive, symbols=5)
    aim = np.array([50.0, 40.0, 20.0])
    places, asked = aim + rng.normal(size=(5, 7, 3)), {"squint": squint, "wavefront": wavefront}
    # Factors that are kept, `once` being false, pass through the same loops for stations and links.
    own, back = (
        OneWayFactors(radio, end, places, aim, error=1e-14, once=False, **asked).summed(np.ones(7))
        for end in (A, link(A, A))
    )
    assert (own == back).all()
    # Equal arrays on the direct path alone have loops of their own (`direct_loops`).
    assert abs(response(radio, A, places, np.ones(7), aim, **asked) - back).max() <= 1e-13 * abs(back).max()


def test_a_links_range_sum_is_carried_and_off_by_rounding_alone():
    rng = np.random.default_rng(5)
    origin = np.array([50.0, 40.0, 20.0]) + 10 ** rng.uniform(0, 4, (5000, 1)) * rng.normal(size=(5000, 3))
    whole, found = reference(origin, radar(linked(), A)), range_sum(linked(), link(A, A), origin)
    assert (found[:, 5] == whole[:, 5]).all() and abs(found[:, [4, 6]]).max() <= 0.5
    assert abs(found[:, [4, 6]] - whole[:, [4, 6]]).max() <= 2.0**-53


def test_both_directions_of_a_link_are_alike_at_one_frequency():
    rng = np.random.default_rng(3)
    radio, aim = linked(transmit=(4, 2), receive=(4, 2), symbols=2), np.array([50.0, 40.0, 20.0])
    places, there = aim + rng.normal(size=(2, 7, 3)), replace(B, frequency_hz=A.frequency_hz)
    one, two = (response(radio, way, places, np.ones(7), aim) for way in (link(A, there), link(there, A)))
    assert abs(one - two).max() < 1e-12 * abs(one).max()


@pytest.mark.parametrize("course_deg", [0.0, 40.0, 90.0, 200.0])
def test_doppler_is_that_of_the_bisector(course_deg):
    speed, place = 7.0, np.array([50.0, 60.0, 12.0])
    course = np.array([np.cos(np.radians(course_deg)), np.sin(np.radians(course_deg)), 0.0])
    step = 1e-4
    radio = linked(transmit=(1, 1), receive=(1, 1), symbols=2)
    places = (place + np.array([-0.5, 0.5])[:, None] * step * speed * course)[:, None]
    found = response(radio, link(), places, np.ones(1), place)[:, 0]
    ways = [np.asarray(end.position_m) - place for end in (A, B)]
    toward = [way / np.linalg.norm(way) for way in ways]
    half = 0.5 * np.arccos(toward[0] @ toward[1])
    bisector = (toward[0] + toward[1]) / np.linalg.norm(toward[0] + toward[1])
    closing = 2 * speed * (course @ bisector) * np.cos(half) * A.frequency_hz / C
    assert np.angle(found[1] / found[0]) / (2 * np.pi * step) == pytest.approx(closing, abs=1e-4 * speed * 33)


def test_stations_of_a_network_with_links_hear_what_they_always_heard():
    cloud, row = target(np.random.default_rng(4))
    for name in "AB":
        with_links, without = linked(), replace(linked(), stations=(A, B))
        one = received_signal(scene({"direct_path": {}}, with_links), with_links.station(name), cloud, row)
        two = received_signal(scene({}, without), without.station(name), cloud, row)
        assert abs(one.signal - two.signal).max() < 1e-12 * abs(two.signal).max() and one.power == pytest.approx(
            two.power
        )


def test_the_direct_path_is_friis_and_lies_at_the_masts_distance():
    radio = linked(transmit=(1, 1), receive=(1, 1), subcarriers=64, subcarrier_spacing_hz=480e3)
    cloud, row = target(np.random.default_rng(4))
    settings = {"loss_db": 6.0}
    view = observe(scene({}, radio), radio.station("A-B"), cloud, row)
    found = direct_path.scatter(settings, view, None)
    distance = np.linalg.norm(np.subtract(A.position_m, B.position_m))
    level = np.sqrt(radio.power) * C / radio.carrier_hz / (4 * np.pi * distance) * 10 ** (-6 / 20)
    np.testing.assert_allclose(abs(found), level, rtol=1e-12)
    cells = abs(np.fft.ifft(found[0]))
    assert cells.argmax() == round(distance / C * 64 * 480e3)
    monostatic = observe(scene({}, radio), A, cloud, row)
    assert not direct_path.scatter(settings, monostatic, None).any()
    (effect,) = called({"direct_path": settings})
    for seen, told in ((view, [20 * np.log10(level) + 30]), (monostatic, [])):
        table = levels(seen, {"direct_path": effect}, 1e-12)
        values = [line.value for line in table if line.name == "direct path, one subcarrier"]
        assert values == pytest.approx(told)


def test_the_direct_path_enters_by_both_arrays_patterns():
    radio = linked(transmit=(4, 2), receive=(3, 1))
    cloud, row = target(np.random.default_rng(4))
    view = observe(scene({}, radio), radio.station("A-B"), cloud, row)
    found = direct_path.scatter({"loss_db": 0.0}, view, None)[0, 0]
    distance, total = np.linalg.norm(np.subtract(A.position_m, B.position_m)), 1.0
    for end, other, shape in ((A, B, (4, 2)), (B, A, (3, 1))):
        # A point at the other mast, its way and its 1/r taken out again.
        place = np.asarray(other.position_m)[None]
        one = reference_effects.one_way(
            radio, replace(end, frequency_hz=A.frequency_hz), shape, place, view.aim_m, A.frequency_hz, False, False
        )
        total = total * one[0] * distance * np.exp(2j * np.pi * A.frequency_hz / C * distance)
    level = np.sqrt(radio.power / 24) * C / radio.carrier_hz / (4 * np.pi * distance)
    truth = level * total * np.exp(-2j * np.pi * A.frequency_hz / C * distance)
    assert abs(found - truth) < 1e-9 * abs(truth)


def frame(radio, station):
    return waveform.Frame(radio, station, waveform.sent(np.random.default_rng(3), radio.symbols, radio.subcarriers))


def test_offsets_are_opposite_on_both_links_and_none_at_stations():
    radio = linked(symbols=64)
    settings, responses = {"sigma_ppm": 0.01, "sigma_s": 0.0}, np.ones((64, 32))
    lines = {}
    for station in radio.stations:
        look = frame(radio, station)
        samples = waveform.transmit(responses, look.sent)
        out = link_offset.receive(settings, samples, look, np.random.default_rng(8))
        if station.transmitter is None:
            assert out is samples
            continue
        slow = np.fft.ifft(waveform.demodulate(out, look.sent), axis=1)[:, 0]
        lines[station.name] = np.angle(np.sum(slow[1:] * slow[:-1].conj())) / (2 * np.pi * radio.symbol_interval_s)
    ppm = {name: found[0] for name, found in link_offset.errors(settings, radio, np.random.default_rng(8)).items()}
    expected = 1e-6 * (ppm["A"] - ppm["B"]) * frame(radio, link()).oscillator_hz
    assert lines["A-B"] == pytest.approx(expected, rel=1e-3)
    assert lines["B-A"] == pytest.approx(-expected * B.frequency_hz / A.frequency_hz, rel=1e-3)


def test_a_late_sender_makes_echoes_late():
    radio = linked(symbols=4)
    look = frame(radio, radio.station("A-B"))
    settings = {"sigma_ppm": 0.0, "sigma_s": 1 / (32 * 120e3)}
    samples = waveform.transmit(np.ones((4, 32)), look.sent)
    found = waveform.demodulate(link_offset.receive(settings, samples, look, np.random.default_rng(1)), look.sent)
    clocks = {name: one[1] for name, one in link_offset.errors(settings, radio, np.random.default_rng(1)).items()}
    slope = np.angle(np.sum(found[:, 1:] * found[:, :-1].conj())) / (2 * np.pi * 120e3)
    assert slope == pytest.approx(-(clocks["A"] - clocks["B"]), rel=1e-9)


def test_the_scene_of_links_has_nine_and_keeps_the_stations_sub_bands():
    config = load([ROOT / "config/default.yaml", ROOT / "config/scenes/links.yaml"], SCHEMA)
    check(config)
    radio, plain = Network.from_settings(config["network"]), load([ROOT / "config/default.yaml"], SCHEMA)["network"]
    assert [one.name for one in radio.stations] == ["A", "A-B", "A-C", "B", "B-A", "B-C", "C", "C-A", "C-B"]
    own = Network.from_settings(plain)
    assert [radio.station(one.name) for one in own.stations] == list(own.stations)
    assert radio.station("B-C").frequency_hz == own.station("B").frequency_hz
    assert radio.station("B-C").position_m == own.station("C").position_m
    assert masts_m(config["network"]) == masts_m(plain) and len(masts_m(plain)) == 3


def test_a_links_record_has_the_half_range_sum():
    _, row = target(np.random.default_rng(4))
    seen = json.loads(json.dumps(geometry(row, linked())))
    assert seen["A-B"]["range_m"] == pytest.approx(0.5 * (seen["A"]["range_m"] + seen["B"]["range_m"]))
    assert seen["A-B"]["radial_mps"] == pytest.approx(0.5 * (seen["A"]["radial_mps"] + seen["B"]["radial_mps"]))
    assert seen["A-B"]["psi"] == seen["B"]["psi"]


@pytest.mark.parametrize(
    ("effects", "entry", "words"),
    [
        ("{}", "A-B: {transmit: A, receive: B}", "links between two stations"),
        ("{direct_path: {}}", "A-B: {transmit: A, receive: Z}", "expected two of"),
        ("{direct_path: {}}", "A-A: {transmit: A, receive: A}", "expected two of"),
        ("{direct_path: {}, background_channel: {}}", "A-B: {transmit: A, receive: B}", "background_channel"),
        ("{direct_path: {}}", "A-B: {transmit: A, normal_deg: 3.0}", "stations.A-B"),
    ],
)
def test_impossible_links_are_refused_by_name(tmp_path, effects, entry, words):
    path = tmp_path / "scene.yaml"
    path.write_text(f"run: broken\nnetwork: {{stations: {{{entry}}}}}\neffects: {effects}\n")
    with pytest.raises(InputError, match=words):
        check(load([ROOT / "config/default.yaml", path], SCHEMA))


def test_effects_of_links_need_links_and_the_engine_refuses_them():
    with pytest.raises(InputError, match="no station of the network is a link"):
        check({**load([ROOT / "config/default.yaml"], SCHEMA), "effects": {"link_offset": {}}})
    cloud, row = target(np.random.default_rng(4))
    view = observe(scene({}, linked()), A, cloud, row)
    with pytest.raises(InputError, match="link between two stations"):
        echo_signal(linked(), link(), view.motion, cloud.rcs_m2, view.aim_m)
