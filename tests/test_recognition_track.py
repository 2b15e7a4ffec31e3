"""The height that stations measure: its closed form, its errors, and its cache files."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from dataset import RENDER, build
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.recognition import track
from lowalt.recognition.views import facts_of
from lowalt.shards import ShardSet
from lowalt.shards.__main__ import main as write_index
from pictures import NETWORK

NET = Network.from_settings(NETWORK)
CELL_M = 299_792_458 / (2 * 256 * 120e3)


def entry(key="crow-000001-snr003", snr_db=3.0, range_m=200.0, omega=0.25):
    """The part of a sample's record that a height is measured from."""
    seen = {name: {"range_m": range_m, "omega": omega} for name in "ABC"}
    names = dict.fromkeys(("subtype", "category", "group", "model"))
    return {"key": key, "seed": 5, "snr_db": snr_db, "noise": snr_db < 300, "geometry": seen, "motion": {}, **names}


def test_without_noise_a_height_is_that_of_the_range_cell_s_centre():
    station = NET.stations[1]
    for range_m, cell in ((20.4 * CELL_M, 20), (20.6 * CELL_M, 21), (258.2 * CELL_M, 2), (0.0, 0)):
        found = track.measured_height_m(NET, station, range_m, -0.125)
        assert found == pytest.approx(25 - 0.125 * cell * CELL_M, abs=1e-12)
    assert track.measured_height_m(NET, station, 10 * CELL_M, 0.9, 0.3) == pytest.approx(25 + 10 * CELL_M, abs=1e-12)
    assert track.elevation_error(NET, station, math.inf) == 0
    told = track.heights_m(entry(snr_db=300.0), NET)
    assert told == pytest.approx([25 + 0.25 * 41 * CELL_M] * 3, abs=1e-12)


def test_the_error_is_the_bound_of_the_array_s_own_fisher_information():
    elements, symbols, snr = (16, 4), 3, 10**0.8
    net = replace(NET, receive=elements, symbols=symbols)
    kappa = net.stations[2].frequency_hz / net.carrier_hz
    h, v = (axis.ravel() for axis in np.meshgrid(*map(np.arange, elements), indexing="ij"))
    psi_h, psi_v = 0.4, -0.9
    steer = np.exp(1j * (psi_h * h + psi_v * v))
    amplitudes = np.exp(1j * np.array([0.3, 1.9, -2.0])) * np.sqrt(snr / 64)
    # Both directions and every symbol's complex amplitude are unknown; noise has unit power at each element.
    columns = [np.outer(amplitudes, 1j * axis * steer).ravel() for axis in (v, h)]
    for number in range(symbols):
        one = np.zeros((symbols, 64), complex)
        one[number] = steer
        columns += [one.ravel(), 1j * one.ravel()]
    jacobian = np.stack(columns, axis=1)
    bound = np.linalg.inv(2 * (jacobian.conj().T @ jacobian).real)[0, 0]
    found = track.elevation_error(net, net.stations[2], 8.0)
    assert found == pytest.approx(math.sqrt(bound) / (math.pi * kappa), rel=1e-9)
    with pytest.raises(InputError, match="has 1 row, expected two or more"):
        track.elevation_error(replace(NET, receive=(16, 1)), NET.stations[0], 8.0)


def test_drawn_errors_spread_as_the_bound_says_and_differ_from_station_to_station():
    told = np.array([track.heights_m(entry(f"crow-{number:06d}-snr003"), NET) for number in range(300)])
    wanted = [track.elevation_error(NET, station, 3.0) * 41 * CELL_M for station in NET.stations]
    np.testing.assert_allclose(told.std(0) / wanted, 1, atol=0.12)
    np.testing.assert_allclose(told.mean(0), 25 + 0.25 * 41 * CELL_M, atol=4 * max(wanted) / 300**0.5)
    np.testing.assert_allclose(np.corrcoef(told.T), np.eye(3), atol=0.2)


def test_errors_follow_from_seed_and_key_whatever_the_order_or_the_other_stations():
    keys = [f"crow-{number:06d}-snr003" for number in range(6)]
    told = {key: track.heights_m(entry(key), NET) for key in keys}
    assert {key: track.heights_m(entry(key), NET) for key in keys[::-1]} == told
    assert len({heights[0] for heights in told.values()}) == 6
    fewer = replace(NET, stations=NET.stations[1:])
    assert track.heights_m(entry(keys[0]), fewer) == told[keys[0]][1:]
    assert track.heights_m({**entry(keys[0]), "seed": 6}, NET) != told[keys[0]]


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return build(tmp_path_factory.mktemp("data"), "signal")


def test_a_cache_holds_the_heights_of_a_shard_s_samples_by_key(data, tmp_path):
    line = ["--settings", "{}", "--index", str(data / "index.json"), "--shard", "seen-train-00000.tar"]
    track.main([*line, "--out", str(tmp_path / "tracks.npz")])
    shards = ShardSet(data / "index.json", ["seen"], ["train"])
    wanted = np.array([track.heights_m(shards.record(number), NET) for number in range(len(shards))])
    with np.load(tmp_path / "tracks.npz") as found:
        assert found["key"].tolist() == [key.decode() for key in shards.keys]
        np.testing.assert_array_equal(found["height_m"], wanted)
        np.testing.assert_array_equal(found["range_m"], facts_of(shards, np.arange(len(shards))).range_m)
    exact = np.array([shards.record(number)["motion"]["z_m"] for number in range(len(shards))])
    quiet = np.array([not shards.record(number)["noise"] for number in range(len(shards))])
    assert abs(wanted[quiet] - exact[quiet, None]).max() < CELL_M / 2
    changed, shard = data / "changed.json", data / "seen-train-00000.tar"
    scene = json.dumps({**RENDER, "echo": {"tolerance": None, "effects": {"clutter": {}}}})
    write_index(["index", "--settings", scene, "--shards", str(shard), "--out", str(changed)])
    with pytest.raises(InputError, match="scene with the effects \\['clutter'\\]"):
        track.cache_shard(changed, "seen-train-00000.tar", tmp_path / "none.npz")


def test_a_link_or_a_target_without_a_place_has_no_height():
    nowhere = entry()
    nowhere["geometry"] = {name: {"range_m": None, "omega": None} for name in "ABC"}
    with pytest.raises(InputError, match="sample crow-000001-snr003 has no place"):
        track.heights_m(nowhere, NET)
    link = replace(NET.stations[0], transmitter=NET.stations[1], receiver=NET.stations[0])
    with pytest.raises(InputError, match="station 'A' is a link"):
        track.heights_m(entry(), replace(NET, stations=(link,)))
