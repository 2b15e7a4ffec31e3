"""The viewer of samples: which it holds, what its panels and points stand for, and its controls in
a browser.
"""

import base64
import html
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

from chain import SPECTRA, WAVE
from craft import craft, row
from dataset import build
from lowalt.motion import positions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report import viewer, viewer_echoes
from lowalt.report.figures.style import embedded
from lowalt.report.page import assembled, rendered
from lowalt.shards import ShardSet
from lowalt.shards.sample_record import sample_key
from lowalt.tiles.png import encode
from pages import browsed, sound

STATIONS = {
    "A": {"position_m": [0, 0, 25], "normal_deg": 0},
    "B": {"position_m": [400, 0, 25], "normal_deg": 180},
}
NETWORK = WAVE | {"stations": STATIONS}
IMAGES = {"size": 16, "scale": "decibel", "floor_db": 40.0, "gamma": 1.0, "colour_map": "viridis"}
LEVELS = (3.0, 8.0, 13.0, float("inf"))


def shards(names):
    """Keys, labels and SNRs of three motion models of each subtype; names: subtypes by label."""
    found = [
        (sample_key(name, model, snr).encode(), label, snr)
        for label, some in enumerate(names)
        for name in some
        for model in (7, 1, 4)
        for snr in LEVELS
    ]
    keys, labels, snrs = (np.array(column) for column in zip(*found, strict=True))
    return SimpleNamespace(keys=keys, labels=labels, snrs_db=snrs)


def test_each_class_has_a_seen_and_an_unseen_subtype_and_predicted_samples_go_first():
    held = shards((("Air B", "Air A", "Air C"), ("Owl",)))
    predicted = {sample_key("Air B", 7, snr) for snr in LEVELS}
    numbers = viewer.chosen(held, predicted, {"air-c"})
    keys = [held.keys[number].decode() for number in numbers]
    assert keys[0] == "air-b-000007-snrinf"
    by_name = {key.rpartition("-0000")[0] for key in keys}
    assert by_name == {"air-b", "air-c", "owl"}
    assert len(keys) == len(set(keys)) == 3 * viewer.MODELS * viewer.SNRS
    assert {key for key in keys if key.startswith("air-b")} == {
        sample_key("Air B", model, snr) for model in (7, 1) for snr in (3.0, 13.0, float("inf"))
    }
    # The first rounds hold every subtype once a model, without noise.
    assert {key.rpartition("-")[2] for key in keys[:6]} == {"snrinf"}


def test_points_of_the_motion_are_those_of_the_target_in_order():
    cloud = craft()
    moving = row(0)
    found = viewer.motion(cloud, moving)
    kept = np.frombuffer(base64.b64decode(found["points"]), "<i2").reshape(
        viewer.FRAMES, found["count"], 3
    )
    assert found["seconds"] == cycle_s(cloud, moving)
    times = np.arange(viewer.FRAMES) / viewer.FRAMES * found["seconds"]
    wanted = positions(cloud, still_row(moving), times)
    assert found["count"] == len(cloud.points) <= viewer.POINTS
    wanted = wanted - (wanted.min(axis=(0, 1)) + wanted.max(axis=(0, 1))) / 2
    assert abs(kept / 32767 * found["scale_m"] - wanted).max() <= found["scale_m"] / 32767
    assert found["part"] == cloud.part.tolist()


def test_probabilities_are_those_of_the_first_seed_of_each_scheme(tmp_path):
    for seed, share in (("0", "0.75"), ("1", "0.5")):
        (tmp_path / f"{seed}.csv").write_text(f"key,p_uav,p_bird\na,{share},0.25\nb,1,0\n")
        (tmp_path / f"{seed}.json").write_text('{"protocol": "seen", "scheme": "A:VRP"}')
    files = [tmp_path / "0.csv", tmp_path / "1.csv"]
    assert {"a", "b"} <= viewer.predicted_keys(files)
    assert viewer.probabilities(files, {"a"}, ("UAV", "Bird")) == {
        "a": {"seen A:VRP": [0.75, 0.25]}
    }


@pytest.fixture
def page():
    """A page of the viewer alone, with two subtypes whose tiles differ."""
    renderer = viewer.Renderer.from_settings(
        {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    )
    panels = viewer.panels(renderer)
    assert [(panel["row"], panel["column"]) for panel in panels] == [
        (r, c) for r in range(2) for c in range(3)
    ]
    vt = panels[2]
    # Filters are matched at the lowest subcarrier, and echoes turn at the middle one.
    assert vt["low"] == -vt["high"] == pytest.approx(-6.0, rel=2e-3) and set(vt["y"]) <= set(
        np.arange(-6.0, 6.5, 0.5)
    )
    # Fewer symbols than the signal has: a window of 4 of 24, 2.5 ms apart.
    assert (vt["left"], vt["right"]) == pytest.approx((1.5 * 2.5e-3, 21.5 * 2.5e-3)) and max(
        vt["x"]
    ) <= vt["right"]
    tile = [
        embedded(
            encode(
                np.arange(32 * 48, dtype=np.uint8).reshape(32, 48) * step, renderer.images.palette
            )
        )
        for step in (0, 1)
    ]
    network, times = renderer.network, renderer.network.times_s
    signals = np.stack([np.exp(2j * np.pi * 30 * times), 0 * times])
    speeds = {
        network.stations[0].name: {"radial_mps": 17.0},
        network.stations[1].name: {"radial_mps": None},
    }
    shared = {
        "category": "UAV",
        "group": "seen",
        "snr": "no noise",
        "network": tile[1],
        "echoes": viewer_echoes.echoes(signals, speeds, network),
    }
    one = {
        **shared,
        "subtype": "One",
        "model": 1,
        "tile": tile[0],
        "probabilities": {"seen A": [0.2, 0.8]},
    }
    two = {**shared, "subtype": "Two", "model": 5, "tile": tile[1], "probabilities": {}}
    data = {
        "samples": [one, two],
        "motions": {"One 1": viewer.motion(craft(), row(0))},
        "classes": ["UAV", "Bird"],
        "stations": ["A", "B"],
    }
    values = {
        "data": data,
        "panels": panels,
        "size": 16,
        "shown": 16,
        "rows": 2,
        "columns": 3,
        "pixels": 8,
        "stations": ["A", "B"],
        "floor_db": 40.0,
        "look_s": 0.06,
    }
    text = assembled(
        "viewer", [{"id": "samples", "title": "Samples", "html": rendered("sample_viewer", values)}]
    )
    sound(text)
    return text, tile


def test_every_control_of_the_viewer_works(page, tmp_path):
    text, tiles = page
    script = """
    const at = (name) => document.getElementById("viewer-" + name), said = [], ink = () => at("motion").toDataURL();
    const tell = () => said.push([at("name").textContent,
      document.querySelector("image").getAttribute("href").length, at("shares").textContent].join("|"));
    tell();
    const before = ink();
    at("motion").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    const turned = ink();
    at("frame").value = 7; at("frame").dispatchEvent(new Event("input"));
    said.push(String(before !== turned), String(turned !== ink()), at("time").textContent);
    at("play").click(); said.push(at("play").textContent); at("play").click(); said.push(at("play").textContent);
    at("subtype").value = "Two"; at("subtype").dispatchEvent(new Event("change"));
    tell();
    const drawn = (kind) => [...document.querySelectorAll("path." + kind)].map((path) => path.getAttribute("d"));
    const marks = [...document.querySelectorAll("path.speed")].map((path) => path.getAttribute("transform"));
    document.body.dataset.echo = JSON.stringify([at("speeds").textContent, drawn("power"), drawn("phase"), marks]);
    document.body.dataset.said = said.join(";");
    """
    found = browsed(tmp_path, text, script)
    said = re.search('data-said="(.*?)"', found, re.S)[1].split(";")
    assert said[0].startswith(f"UAV: One (seen), motion model 1, no noise|{len(tiles[0])}|")
    assert "seen A20.080.0Bird, wrong" in said[0]
    assert said[1:3] == ["true", "true"] and said[4:6] == ["Pause", "Play"]
    assert said[3].endswith("ms.") and "of a cycle of" in said[3]
    none = "No network was asked about this sample."
    assert said[6] == f"UAV: Two (seen), motion model 5, no noise|{len(tiles[1])}|{none}"
    spoken, power, phase, marks = json.loads(
        html.unescape(re.search('data-echo="(.*?)"', found, re.S)[1])
    )
    network = viewer.Renderer.from_settings(
        {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    ).network
    station = network.stations[0]
    shown = network.folded_mps(17.0, station)
    folds = round((17.0 - shown) / (2 * network.largest_mps(station)))
    assert (
        f"A 17 m/s (shown at {round(shown, 2)} m/s, folded {folds} time" in spoken
        and "B" not in spoken
    )
    # The power of a line is flat at the top of its panel, that of a silent station at the bottom.
    assert set(re.findall(r"[ML][\d.]+ ([\d.]+)", power[0])) == {"0.0"}
    assert set(re.findall(r"[ML][\d.]+ ([\d.]+)", power[1])) == {"64.0"}
    heights = [float(value) for value in re.findall(r"M[\d.]+ ([\d.]+)", phase[0])]
    wanted = [150 - 64 * (30 * time % 1) for time in network.times_s]
    assert len(heights) == network.symbols
    assert all(min(abs(a - b), 64 - abs(a - b)) < 0.3 for a, b in zip(heights, wanted, strict=True))
    # One mark in each of the first station's three spectra, at the height of the folded speed.
    assert [mark is not None for mark in marks] == [True] * 3 + [False] * 3


def test_a_speed_is_shown_where_its_phase_repeats():
    network = viewer.Renderer.from_settings(
        {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    ).network
    station = network.stations[1]
    middle_hz = station.frequency_hz + (network.subcarriers - 1) / 2 * network.subcarrier_spacing_hz
    limit = 299_792_458 / (4 * middle_hz * network.symbol_interval_s)
    assert network.largest_mps(station) == pytest.approx(limit)
    shown = network.folded_mps(np.array([0.4 * limit, -3.2 * limit, limit, -limit]), station)
    assert shown == pytest.approx(np.array([0.4, 0.8, 1.0, 1.0]) * limit)
    turns = (
        2 * middle_hz / 299_792_458 * network.symbol_interval_s * np.array([-3.2 * limit, shown[1]])
    )
    assert turns[0] % 1 == pytest.approx(turns[1] % 1)
    entries = viewer_echoes.echoes(
        np.ones((2, 4)), {"A": {"radial_mps": None}, "B": {"radial_mps": -3.2 * limit}}, network
    )
    assert (
        "speed" not in entries[0]
        and entries[1]["shown"] == round(0.8 * limit, 2)
        and entries[1]["folds"] == 2
    )


def test_power_and_phase_come_back_from_their_bytes():
    signal = np.array([1.0, 0.1j, -0.5, 1e-9, 0])
    power = np.frombuffer(base64.b64decode(viewer_echoes.power(signal)), np.uint8)
    assert ((power / 255.0 - 1) * viewer_echoes.FLOOR_DB)[:3] == pytest.approx(
        [0, -20, -6.02], abs=0.1
    )
    assert power[3:].tolist() == [0, 0] and set(
        base64.b64decode(viewer_echoes.power(0 * signal))
    ) == {0}
    phase = np.frombuffer(base64.b64decode(viewer_echoes.phase(signal)), np.uint8)
    assert phase[:3].tolist() == [0, 64, 128]


def test_the_clearest_sample_of_a_motion_model_stands_first_and_a_browser_can_read_all_of_them(
    tmp_path,
):
    shards = ShardSet(build(tmp_path, "image") / "index.json")
    found = viewer.samples(shards, None, {}, [], {}, 16)
    levels = {}
    for sample in found["samples"]:
        levels.setdefault((sample["subtype"], sample["model"]), []).append(sample["snr"])
    assert len(levels) > 3 and all(
        snrs[0] == "no noise" for snrs in levels.values() if "no noise" in snrs
    )
    assert max(map(len, levels.values())) > 1
    json.dumps(found, allow_nan=False)
