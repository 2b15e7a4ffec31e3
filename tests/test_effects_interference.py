"""Other stations' signals: sample by sample, their power a range cell in closed form, offsets, levels and refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lowalt.common.config import load
from lowalt.common.errors import InputError
from lowalt.common.network import Network, Station
from lowalt.effects.catalogue import called
from lowalt.effects.channel import interference
from lowalt.effects.checks import check
from lowalt.effects.explain import scene_facts
from lowalt.effects.explain_text import text as explanation
from lowalt.effects.levels import levels
from lowalt.effects.listening import Listening
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.receiver import link_offset
from lowalt.effects.sending import Sending
from lowalt.effects.waveform import Frame
from test_effects import network, target

ROOT = Path(__file__).parent.parent
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
C, SPACING = 299_792_458.0, 120e3
NO_CLOCKS = {"sigma_ppm": 0.0, "sigma_s": 0.0}


def stations(first=0, count=32):
    """Two stations, the second one's sub-band `first` subcarriers above the first one's."""
    a = Station("A", (0.0, 0.0, 10.0), 0.3, 4.9e9)
    return a, Station("B", (220.0, 10.0, 15.0), 2.8, 4.9e9 + first * SPACING)


def radio_of(first=0, **changes):
    return replace(network(**({"transmit": (1, 1), "receive": (1, 1)} | changes)), stations=stations(first))


def listening(view, sending, names=frozenset()):
    """The look of a view, its points weighed alike."""
    return Listening(view, sending, names, draw, lambda _: 1.0)


def stream_of(radio, **settings):
    """What station A hears of B, the view and the settings."""
    settings = interference.DEFAULTS | settings
    cloud, row = target(np.random.default_rng(4))
    view = observe(Scene(radio, 5, None, ()), radio.station("A"), cloud, row)
    heard = interference.heard(settings, listening(view, Sending([], radio, draw)))
    return heard, view, settings


def draw(name):
    """A generator of its own for every stream."""
    return np.random.default_rng([sum(map(ord, name)), len(name)])


def by_hand(radio, view, settings, first):
    """Samples of B's stream at A: every subcarrier at every instant, symbol by symbol of a stream without pauses."""
    m = radio.subcarriers
    prefix_s, useful_s = 144 / 2048 / SPACING, 1 / SPACING
    data = [Sending([], radio, draw).aired_as(f"{name} of B") for name in ("previous waveform", "waveform",
                                                                           "next waveform")]  # fmt: skip
    clocks = link_offset.errors(settings, radio, draw("link_offset"))
    ppm, late = (b - a for a, b in zip(clocks["A"], clocks["B"], strict=True))
    a, b = (np.asarray(station.position_m) for station in stations())
    ways = []
    if settings["loss_db"] is not None:
        away = np.linalg.norm(a - b)
        ways.append(lambda n, f: (np.sqrt(radio.power) * C / radio.carrier_hz / (4 * np.pi * away), away))
    scale = np.sqrt(radio.power) * C / radio.carrier_hz / (4 * np.pi) ** 1.5
    if settings["by_target"]:
        for point, rcs in enumerate(view.cloud.rcs_m2):

            def way(n, f, point=point, rcs=rcs):
                legs = [np.linalg.norm(view.places[n, point] - end) for end in (a, b)]
                return scale * np.sqrt(rcs) / np.prod(legs), sum(legs)

            ways.append(way)
    aim = sum(np.linalg.norm(view.aim_m - end) for end in (a, b))
    result, used = np.zeros((radio.symbols, m), complex), set()
    for n in range(radio.symbols):
        for i in range(m):
            t = i / (m * SPACING)
            for k in range(max(first, 0), min(m + first, m)):
                f = 4.9e9 + k * SPACING
                base = (k - m // 2) * SPACING
                for number, one in enumerate(ways):
                    amplitude, path = one(n, f)
                    # Each way is cut at one delay: the masts' distance, or the way by the aim.
                    cut = t - late - (path if number == 0 and settings["loss_db"] is not None else aim) / C
                    which = 0 if cut < -prefix_s else 2 if cut >= useful_s else 1
                    used.add(which)
                    local = t - late - (which - 1) * (useful_s + prefix_s)
                    phase = base * local - f * path / C
                    result[n, i] += amplitude * data[which][n, k - first] * np.exp(2j * np.pi * phase) / m
            oscillator = 4.9e9 + m // 2 * SPACING
            result[n, i] *= np.exp(2e-6j * np.pi * ppm * oscillator * (view.times_s[n] + t))
    return result, used


@pytest.mark.parametrize(
    ("first", "settings", "symbols"),
    [
        (0, NO_CLOCKS, {0, 1}),
        (0, {"sigma_ppm": 3.0, "sigma_s": 0.0, "by_target": False}, {0, 1}),
        (20, {"sigma_ppm": 0.0, "sigma_s": 2e-6}, {0, 1}),
        (-9, {"sigma_ppm": 0.5, "sigma_s": -3e-6, "loss_db": None}, {1, 2}),
    ],
)
def test_every_sample_of_another_stations_stream(first, settings, symbols):
    radio = radio_of(first, symbols=2, subcarriers=32)
    heard, view, settings = stream_of(radio, **settings, leakage_db=None)
    truth, used = by_hand(radio, view, settings, first)
    assert used == symbols
    # The reference's phases are rounded at some thousand turns.
    assert abs(heard - truth).max() < 1e-10 * abs(truth).max()


@pytest.mark.parametrize(("first", "share"), [(0, 1.0), (16, 0.75), (74, 10**-4.5), (-500, 10**-4.5)])
def test_a_range_cell_gets_the_power_over_the_number_of_subcarriers(first, share):
    radio = radio_of(first, symbols=400, subcarriers=64)
    heard = stream_of(radio, by_target=False)[0]
    own = Sending([], radio, draw)
    cells = own.cells(own.received(heard, slice(None)))
    friis = radio.power * (C / radio.carrier_hz / (4 * np.pi * np.linalg.norm(np.subtract(*(
        station.position_m for station in stations()))))) ** 2  # fmt: skip
    leaked = share if share < 0.01 else share + (1 - share) * 10**-4.5
    power = abs(cells) ** 2
    assert power.mean() / (friis * leaked / 64) == pytest.approx(1.0, rel=0.03)
    # No cell and no Doppler line stands out: of 64 means of 400 exponential values, each deviates by 5 %.
    assert power.mean(axis=0) / power.mean() == pytest.approx(1.0, rel=0.25)
    lines = (abs(np.fft.fft(cells, axis=0)) ** 2).mean(axis=1)
    assert lines / lines.mean() == pytest.approx(1.0, rel=0.75)


def test_other_data_than_qpsk_raise_it_by_their_mean_inverse_power():
    radio = radio_of(0, symbols=400, subcarriers=64)
    effects = called({"data_symbols": {"order": 16}})
    cloud, row = target(np.random.default_rng(4))
    view = observe(Scene(radio, 5, None, ()), radio.station("A"), cloud, row)
    own = Sending(effects, radio, draw)
    heard = interference.heard(interference.DEFAULTS, listening(view, own))
    cells = own.cells(own.received(heard, slice(None)))
    plain, _, _ = stream_of(radio)
    known = Sending([], radio, draw)
    ratio = np.mean(abs(cells) ** 2) / np.mean(abs(known.cells(known.received(plain, slice(None)))) ** 2)
    assert ratio == pytest.approx(17 / 9, rel=0.05)


def test_without_leakage_stations_on_other_sub_bands_change_no_bit():
    radio = radio_of(42)
    cloud, row = target(np.random.default_rng(4))
    noisy = {"receiver_noise": {}}
    alone, with_others = (
        received_signal(Scene(radio, 5, None, tuple(called(effects))), radio.station("A"), cloud, row).signal
        for effects in (noisy, noisy | {"interference": {"leakage_db": None}})
    )
    assert (alone == with_others).all()
    louder = received_signal(
        Scene(radio, 5, None, tuple(called(noisy | {"interference": {}}))), radio.station("A"), cloud, row
    ).signal
    assert 0 < abs(louder - alone).max() < abs(alone).max()


def linked(first=74):
    a, b = stations(first)
    c = Station("C", (100.0, 300.0, 12.0), 4.7, 4.9e9 + 2 * first * SPACING)
    link = Station("A-B", b.position_m, b.normal_rad, a.frequency_hz, a, b)
    return replace(network(transmit=(1, 1), receive=(1, 1), symbols=200, subcarriers=64), stations=(a, link, b, c))


def test_a_link_hears_its_receivers_own_transmitter_by_the_isolation():
    radio = linked()
    cloud, row = target(np.random.default_rng(4))
    view = observe(Scene(radio, 5, None, ()), radio.station("A-B"), cloud, row)
    assert [one.name for one in interference.others(view)] == ["B", "C"]
    settings = interference.DEFAULTS | NO_CLOCKS | {"loss_db": None, "by_target": False, "isolation_db": 70.0}
    heard = interference.heard(settings, listening(view, Sending([], radio, draw)))
    power = np.mean(np.sum(abs(heard) ** 2, axis=1))
    assert 10 * np.log10(power / radio.power) == pytest.approx(-70.0 - 45.0, abs=0.15)
    own = interference.arrivals(interference.DEFAULTS, view, radio.station("B"), frozenset(), lambda _: 1.0)[1]
    back = observe(Scene(radio, 5, None, ()), replace(radio.station("B"), frequency_hz=4.9e9), cloud, row)
    own_echo = received_signal(Scene(radio, 5, None, ()), back.station, cloud, row).signal
    cells = abs(np.fft.ifft(own.response, axis=1)).max(axis=1)
    assert cells / abs(own_echo) == pytest.approx(1.0, rel=1e-11)


def test_a_links_offset_leaves_each_other_station_its_own():
    radio = linked(first=0)
    cloud, row = target(np.random.default_rng(4))
    view = observe(Scene(radio, 5, None, ()), radio.station("A-B"), cloud, row)
    clocks = {"sigma_ppm": 2.0, "sigma_s": 0.0}
    settings = interference.DEFAULTS | clocks
    own = Sending([], radio, draw)
    alone, moved = (
        interference.heard(settings, listening(view, own, names)) for names in (frozenset(), frozenset({"link_offset"}))
    )
    look = Frame(radio, view.station, np.ones((200, 64)))
    assert abs(moved - alone).max() > 0.1 * abs(alone).max()
    assert abs(link_offset.receive(clocks, moved, look, draw("link_offset")) - alone).max() < 1e-9 * abs(alone).max()


def test_levels_are_those_of_the_samples():
    radio = replace(radio_of(0, symbols=300, subcarriers=64))
    heard, view, settings = stream_of(radio, **NO_CLOCKS)
    view = replace(view, cloud=replace(view.cloud, rcs_m2=np.r_[50.0, np.zeros(len(view.cloud.rcs_m2) - 1)]))
    for changes, way in (({"by_target": False}, "directly"), ({"loss_db": None}, "by the target")):
        asked = settings | changes
        heard = interference.heard(asked, listening(view, Sending([], radio, draw)))
        (effect,) = called({"interference": asked})
        found = {level.name: level.value for level in levels(view, {"interference": effect}, 1e-12)}
        dbm = 10 * np.log10(np.mean(np.sum(abs(heard) ** 2, axis=1))) + 30
        assert found[f"station B {way}, one subcarrier"] == pytest.approx(dbm, abs=0.3)
        assert found["other stations, one range cell"] == pytest.approx(dbm - 10 * np.log10(64), abs=0.3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("network: {guard_subcarriers: -20}", "sub-bands overlap, expected effects.interference"),
        ("network: {guard_subcarriers: -256}\neffects: {interference: {}}", "guard_subcarriers is -256"),
        ("effects: {interference: {prefix_s: 1.0e-6}, cyclic_prefix: {}}", "interference.prefix_s"),
        ("network: {stations: {B: null, C: null}}\nmotion: {region: {polygon_m: [[0, 0], [90, 0], [90, 90]]}}\n"
         "effects: {interference: {}}", "one station"),
    ],
)  # fmt: skip
def test_contradictions_are_refused_by_name(tmp_path, text, words):
    path = tmp_path / "scene.yaml"
    path.write_text(f"run: broken\n{text}\n")
    with pytest.raises(InputError, match=words):
        check(load([ROOT / "config/default.yaml", path], SCHEMA))


def test_the_scene_of_one_sub_band_has_one_and_explains_who_is_heard(monkeypatch):
    monkeypatch.chdir(ROOT)
    paths = [ROOT / "config/default.yaml", ROOT / "config/scenes/reuse.yaml"]
    config = load(paths, SCHEMA)
    check(config)
    assert {one.frequency_hz for one in Network.from_settings(config["network"]).stations} == {4.9e9}
    text = explanation(scene_facts(config, None, [("DJI Mavic 3 Pro", 0)], "A", False))
    assert "station B directly, one subcarrier" in text and "station C by the target, one subcarrier" in text
    assert "expected echo over other stations, in a range cell" in text
