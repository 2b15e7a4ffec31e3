"""Aspect, shadows, blocked ways and the cyclic prefix on links: against laws, integrals and samples by hand."""

from dataclasses import replace

import numpy as np
import pytest

import every_effect
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import waveform
from lowalt.effects.catalogue import called
from lowalt.effects.channel import cross_sections, cyclic_prefix, direct_path, occlusion
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.response import response
from test_effects_links import A, B, link, linked

ROW = {"subtype": "Thing", "category": "UAV", "group": "seen", "model": 3, "x_m": 60.0, "y_m": 25.0, "z_m": 30.0}


def seen(station, radio=None, size_m=0.5):
    """A box with a rotor and its surfaces as a station or link sees them."""
    cloud, surfaces = every_effect.targets(np.random.default_rng(3), size_m, False)
    row = dict.fromkeys(every_effect.NUMBERS, 0.0) | ROW | {"rate_hz": 7.0, "vx_mps": 3.0, "playback": 1.0}
    radio = radio or linked(symbols=6, subcarriers=32)
    return observe(Scene(radio, 5, None, ()), station, cloud, row, surfaces)


@pytest.mark.parametrize(
    ("module", "settings"),
    [(occlusion, {"blades": "opaque"}), (occlusion, {"strength": 0.6}), (cross_sections, {}),
     (cross_sections, {"blades": "diffuse", "power": 2.0})],
)  # fmt: skip
def test_a_link_back_to_its_own_place_weighs_points_as_the_station(module, settings):
    settings = module.DEFAULTS | settings
    for seed in range(3):
        own, back = (
            module.visible(settings, seen(end), np.random.default_rng(seed)) for end in (A, link(A, A))
        )  # fmt: skip
        assert own == pytest.approx(back, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    "effects",
    [{"occlusion": {}, "cross_sections": {}}, {"cyclic_prefix": {"prefix_s": 2e-7}},
     {"line_of_sight": {"environment": "UMi", "blocked_db": 9.0}}],
)  # fmt: skip
def test_a_link_back_to_its_own_place_hears_the_stations_own_echo(effects):
    radio, view = linked(symbols=6, subcarriers=32), seen(A)
    station, scene = replace(link(A, A), name="A"), Scene(radio, 5, None, tuple(called(effects)))
    own, back = (received_signal(scene, end, view.cloud, view.row, view.occluders).signal for end in (A, station))
    assert abs(own - back).max() < 1e-12 * abs(own).max()


def test_a_point_echoes_on_a_link_where_both_ends_see_it():
    settings = occlusion.DEFAULTS | {"blades": "opaque"}
    there, home = (occlusion.visible(settings, seen(one)) for one in (link(), link(B, A)))
    shaded = [occlusion.hidden(seen(replace(end, frequency_hz=A.frequency_hz))) for end in (A, B)]
    truth = ~(shaded[0] | shaded[1])
    assert (there == truth).all() and (home == truth).all() and (shaded[0] != shaded[1]).any()


def test_a_lambert_surface_is_the_product_of_both_cosines():
    view, settings = seen(link()), cross_sections.DEFAULTS | {"blades": "diffuse", "power": 2.0}
    found = cross_sections.visible(settings, view) ** 2
    for point in range(found.shape[1]):
        cosines = []
        for end in (A, B):
            away = np.asarray(end.position_m) - view.places[2, point]
            cosines.append(max(view.normals[2, point] @ away / np.linalg.norm(away), 0.0))
        assert found[2, point] == pytest.approx(6 * cosines[0] * cosines[1], rel=1e-12)


def test_a_facet_is_the_physical_optics_of_a_disc_between_both_ends():
    view, size = seen(link()), 9.0
    cosines = [cross_sections.aspect_cosine(end) for end in view.ends()]
    mine = np.arange(view.places.shape[1])
    found = cross_sections.bistatic_facet(view, mine, cosines, size)
    node, weight = np.polynomial.legendre.leggauss(60)
    radius, turn = 0.5 * (node + 1), 2 * np.pi * np.arange(64) / 64
    lit = 0
    for n, point in np.argwhere((cosines[0] > 0) & (cosines[1] > 0)):
        normal = view.normals[n, point]
        ways = [np.asarray(end.position_m) - view.places[n, point] for end in (A, B)]
        q = sum(way / np.linalg.norm(way) for way in ways)
        across = q - (q @ normal) * normal
        disc = np.exp(1j * size * radius[:, None] * np.linalg.norm(across) * np.cos(turn))
        share = abs((disc.mean(axis=1) * radius * weight).sum())
        truth = (0.5 * (q @ normal) * share) ** 2 / cross_sections._plate_mean(size)
        assert found[n, point] == pytest.approx(truth, rel=1e-9, abs=1e-12)
        lit += 1
    assert lit > 5 and (found[(cosines[0] <= 0) | (cosines[1] <= 0)] == 0).all()


def test_a_building_hides_a_target_from_a_station_and_from_its_way_of_every_link():
    far = replace(B, position_m=(400.0, 100.0, 15.0), frequency_hz=A.frequency_hz)
    radio = replace(linked(symbols=6, subcarriers=32, transmit=(2, 1), receive=(2, 1)), stations=(A, far))
    own = seen(A, radio)
    shut = called({"line_of_sight": {"environment": "UMi", "blocked_db": 10.0}})
    found = []
    for model in range(12):
        row, echoes = own.row | {"model": model}, []
        for end in (A, far, link(A, far), link(far, A)):
            clear, seen_now = (
                abs(received_signal(Scene(radio, 5, None, tuple(some)), end, own.cloud, row).signal[0])
                for some in ((), shut)
            )
            echoes.append(round(20 * np.log10(seen_now / clear)))
        found.append(echoes)
    one, two, out, back = np.array(found).T
    assert (out == (one + two) // 2).all() and (back == out).all()
    assert set(two) == {0, -20} and {0, -10} <= set(out)


def test_a_links_echo_and_its_direct_path_are_cut_at_their_own_delays():
    radio = replace(linked(symbols=2, subcarriers=32, transmit=(1, 1), receive=(1, 1)), symbols=2)
    effects = {"direct_path": {"loss_db": 20.0}, "cyclic_prefix": {"prefix_s": 3e-7}}
    scene, station, own = Scene(radio, 5, None, tuple(called(effects))), link(), seen(link(), radio)
    found = received_signal(scene, station, own.cloud, own.row)
    view = observe(scene, station, own.cloud, own.row)
    data, before = (waveform.sent(scene.stream(name, view.row, station.name), 2, 32)
                    for name in ("waveform", "previous waveform"))  # fmt: skip
    base, rate = waveform.baseband_hz(radio), 32 * radio.subcarrier_spacing_hz
    ways = []
    for point in range(len(view.cloud.rcs_m2)):
        places = view.places[:, point : point + 1]
        one = response(radio, station, places, view.cloud.rcs_m2[point : point + 1], view.aim_m)
        legs = [np.linalg.norm(places[:, 0] - np.asarray(end.position_m), axis=1) for end in (A, B)]
        ways.append((one, sum(legs) / SPEED_OF_LIGHT))
    masts = np.linalg.norm(np.subtract(A.position_m, B.position_m)) / SPEED_OF_LIGHT
    ways.append((direct_path.scatter({"loss_db": 20.0}, view, None), np.full(2, masts)))
    result = np.zeros((2, 32), complex)
    for one, delay in ways:
        for n in range(2):
            # The direct path's prefix counts in whole samples from its range cell, as that of the land.
            cell = round(delay[n] * rate)
            late = np.ceil((delay[n] - 3e-7) * rate) if delay[n] != masts else cell - round(3e-7 * rate)
            for i in range(32):
                sent = before[n] * np.exp(2j * np.pi * base * 3e-7) if i < late else data[n]
                if i < late and delay[n] == masts:
                    sent = before[n] * np.exp(2j * np.pi * base * round(3e-7 * rate) / rate)
                result[n, i] += (one[n] * sent * np.exp(2j * np.pi * base * i / rate)).sum() / 32
    cells = np.fft.ifft(waveform.demodulate(result, data), axis=1)
    value = cells[np.arange(2), abs(cells).argmax(axis=1)]
    assert abs(found.signal - value).max() < 1e-10 * abs(value).max()
    assert cyclic_prefix.first_samples({"prefix_s": 3e-7}, view).min() > 0 and masts > 3e-7
    far = seen(link(A, replace(B, position_m=(400.0, 100.0, 15.0))), radio)
    legs = [np.linalg.norm(far.places - np.asarray(end.station.position_m), axis=2) for end in far.ends()]
    late = np.ceil((sum(legs) / SPEED_OF_LIGHT - 3e-7) * rate)
    assert (cyclic_prefix.first_samples({"prefix_s": 3e-7}, far) == np.clip(late, 0, 32)).all()
    plain = received_signal(replace(scene, effects=scene.effects[1:]), station, own.cloud, own.row)
    assert abs(plain.signal - found.signal).max() > 1e-3 * abs(value).max()
