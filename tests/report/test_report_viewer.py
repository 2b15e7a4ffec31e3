"""The viewer of samples: which it holds, what its panels and points stand for, and its controls in
a browser.
"""

import base64
import html
import io
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from chain import SPECTRA, WAVE
from craft import craft, row
from dataset import build
from lowalt.config.classes import CATEGORIES
from lowalt.config.network import Network
from lowalt.motion import positions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report import viewer, viewer_echoes, viewer_truth
from lowalt.report.page import assembled, rendered
from lowalt.report.sections import sample_viewer
from lowalt.scene.view import ways_by
from lowalt.shards import ShardSet
from lowalt.shards.sample_record import record, sample_key
from pages import browsed, narrow, sound

STATIONS = {
    "A": {"position_m": [0, 0, 25], "normal_deg": 0},
    "B": {"position_m": [400, 0, 25], "normal_deg": 180},
}
NETWORK = WAVE | {"stations": STATIONS}
IMAGES = {"size": 16, "scale": "decibel", "floor_db": 40.0, "gamma": 1.0, "colour_map": "viridis"}
LEVELS = (3.0, 8.0, 13.0, float("inf"))


def shards(names):
    """Keys, labels, models and SNRs of three motion models of each subtype; names: subtypes by label."""
    found = [
        (sample_key(name, model, snr).encode(), label, model, snr)
        for label, some in enumerate(names)
        for name in some
        for model in (7, 1, 4)
        for snr in LEVELS
    ]
    keys, labels, models, snrs = (np.array(column) for column in zip(*found, strict=True))
    return SimpleNamespace(keys=keys, labels=labels, models=models, snrs_db=snrs)


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
    found = viewer.motion(cloud, moving, Network.from_settings(NETWORK))
    kept = np.frombuffer(base64.b64decode(found["points"]), "<i2").reshape(
        viewer.FRAMES, found["count"], 3
    )
    assert found["seconds"] == cycle_s(cloud, moving)
    times = np.arange(viewer.FRAMES) / viewer.FRAMES * found["seconds"]
    wanted = positions(cloud, still_row(moving), times)
    assert found["count"] == len(cloud.points) <= viewer.POINTS
    wanted = wanted - (wanted.min(axis=(0, 1)) + wanted.max(axis=(0, 1))) / 2
    assert abs(kept / 32767 * found["scale_m"] - wanted).max() <= found["scale_m"] / 32767
    # A body is grey, and each of its points has the colour of its part.
    assert found["colours"][:10] == ["#8a8f98"] * 10
    assert len(set(found["colours"][10:])) == 1 and found["colours"][10] != "#8a8f98"


def test_the_truth_of_a_still_target_is_one_line_at_its_folded_speed():
    network = Network.from_settings(NETWORK)
    station = network.stations[0]
    largest = network.largest_mps(station)
    # Straight away from the station, half as fast again as its largest speed.
    away = {"x_m": 300.0, "y_m": 0.0, "z_m": 25.0, "vx_mps": 1.5 * largest, "vy_mps": 0.0}
    moving = row(0) | away | {"vz_mps": 0.0, "rate_hz": 0.0}
    cloud = craft()
    picture, _ = viewer_truth.truth(cloud, moving, network, np.arange(10))
    image = Image.open(io.BytesIO(base64.b64decode(picture.partition(",")[2])))
    assert image.mode == "P" and image.info["transparency"] == 0
    assert image.size == (viewer_truth.COLUMNS, viewer_truth.ROWS)
    lines, columns = np.nonzero(np.asarray(image))
    # Folded by twice the largest, so half the largest towards the station.
    assert set(columns) == set(range(viewer_truth.COLUMNS))
    assert abs((lines + 0.5) / viewer_truth.ROWS - 0.75).max() < 0.02


def test_the_truth_of_a_rotor_spreads_as_far_as_its_tips_move():
    network = Network.from_settings(NETWORK)
    cloud = craft()
    moving = row(0)
    times_s = np.linspace(0, 1 / moving["rate_hz"], 400)
    station = network.stations[1]
    speeds = viewer_truth.speeds_mps(cloud, moving, station, times_s)
    ways = positions(cloud, moving, times_s) - np.asarray(station.position_m)
    ranges = np.linalg.norm(ways, axis=-1)
    # The slope of the range, by differences over the cycle's four hundredth.
    slopes = np.gradient(ranges, times_s, axis=0)
    assert abs(speeds - slopes)[1:-1].max() < 2e-3 * abs(speeds).max()
    assert np.ptp(speeds[:, :10]) < 1 < np.ptp(speeds[:, 10:])


def test_a_link_s_range_is_the_mean_over_its_ends():
    sender = SimpleNamespace(position_m=(0.0, 0.0, 0.0), transmitter=None)
    link = SimpleNamespace(position_m=(10.0, 0.0, 0.0), transmitter=sender)
    point = np.array([4.0, 0.0, 0.0])
    assert ways_by(sender, point) / 2 == 4
    assert ways_by(link, point) / 2 == (4 + 6) / 2


def test_probabilities_are_those_of_the_first_seed_of_each_scheme(tmp_path):
    for seed, share in (("0", "0.75"), ("1", "0.5")):
        (tmp_path / f"{seed}.csv").write_text(f"key,p_uav,p_bird\na,{share},0.25\nb,1,0\n")
        (tmp_path / f"{seed}.json").write_text('{"protocol": "seen", "scheme": "A:VRP"}')
    files = [tmp_path / "0.csv", tmp_path / "1.csv"]
    assert {"a", "b"} <= viewer.predicted_keys(files)
    assert viewer.probabilities(files, {"a"}, ("UAV", "Bird")) == {
        "a": {"seen A:VRP": [0.75, 0.25]}
    }


def sample(renderer, subtype, effect, snr_db, step, signals):
    """A sample of a subtype whose tile differs with `step`."""
    moving = row(1) | {"subtype": subtype}
    found = record(moving, snr_db, "test", 1, renderer.network)
    tile = np.arange(32 * 48, dtype=np.uint8).reshape(32, 48) * step
    return viewer.ViewedSample(effect, json.loads(found), tile, signals)


HOSTILE = "</script><script>document.body.dataset.ran = 1</script><img src=x onerror=ran()>"


@pytest.fixture(scope="module")
def renderer():
    """The renderer of the samples below, of two stations."""
    settings = {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    return viewer.Renderer.from_settings(settings)


@pytest.fixture(scope="module")
def values(renderer):
    """The viewer's values of three samples: one target with and without an effect, and another of
    which the cloud is not known, with a name that is code."""
    times = renderer.network.times_s
    signals = np.stack([np.exp(2j * np.pi * 30 * times), 0 * times])
    viewed = [
        sample(renderer, "DJI Mini 2", viewer.WITHOUT, np.inf, 0, signals),
        sample(renderer, "DJI Mini 2", "clutter", np.inf, 1, signals),
        sample(renderer, HOSTILE, viewer.WITHOUT, 8.0, 1, None),
    ]
    shares = {viewed[0].record["key"]: {"unseen ABC:VRP+TRP+VT": [0.2, 0.8, 0.0, 0.0]}}
    clouds = {"DJI Mini 2": craft()}
    groups = {"DJI Mini 2": "seen"}
    return viewer.shown(viewed, renderer, clouds, groups, CATEGORIES, shares, (16, 8))


@pytest.fixture(scope="module")
def page(values):
    """A page of the viewer alone."""
    html_of_viewer = rendered("sample_viewer", values)
    return assembled("viewer", [{"id": "samples", "title": "Samples", "html": html_of_viewer}])


def test_panels_have_the_axes_of_their_spectra_and_truth_those_of_the_look(values, renderer):
    panels = values["panels"]
    assert [(panel["row"], panel["column"]) for panel in panels] == [
        (r, c) for r in range(2) for c in range(3)
    ]
    vt = panels[2]
    # Filters are matched at the lowest subcarrier, and echoes turn at the middle one.
    assert vt["low"] == -vt["high"] == pytest.approx(-6.0, rel=2e-3)
    assert set(vt["y"]) <= set(np.arange(-6.0, 6.5, 0.5))
    # Fewer symbols than the signal has: a window of 4 of 24, 2.5 ms apart.
    assert (vt["left"], vt["right"]) == pytest.approx((1.5 * 2.5e-3, 21.5 * 2.5e-3))
    assert max(vt["x"]) <= vt["right"]
    truth = values["truths"][1]
    assert (truth["left"], truth["right"]) == (0, pytest.approx(24 * 2.5e-3))
    assert truth["high"] == -truth["low"]
    assert truth["high"] == renderer.network.largest_mps(renderer.network.stations[1])
    assert all(panel["timed"] for panel in [*panels, *values["truths"]])


def test_the_page_of_the_viewer_is_whole_and_holds_no_code_of_a_name(page):
    sound(page)
    assert HOSTILE not in page


def told(found, name):
    """What a page's script left in an attribute `data-{name}` of the body, read as JSON."""
    return json.loads(html.unescape(re.search(f'data-{name}="(.*?)"', found, re.S)[1]))


def test_every_control_of_the_viewer_works(page, values, renderer, tmp_path):
    script = """
    const at = (name) => document.getElementById("viewer-" + name), said = {};
    const ink = () => at("motion").toDataURL();
    const shown = () => [...document.querySelectorAll(".station")].filter((node) => !node.hidden).length;
    const tell = (name) => { said[name] = [at("name").textContent, document.querySelector("image.tile").getAttribute("href"),
      at("shares").textContent, at("effect").parentElement.hidden, shown()]; };
    const choose = (name, value) => { at(name).value = value; at(name).dispatchEvent(new Event("change")); };
    const now = () => [...document.querySelectorAll(".now")].filter((line) => line.style.display !== "none").length;
    tell("first");
    const drawn = (kind) => [...document.querySelectorAll("path." + kind)].map((path) => path.getAttribute("d"));
    said.power = drawn("power"); said.phase = drawn("phase"); said.speeds = at("speeds").textContent;
    said.marks = [...document.querySelectorAll("path.speed")].map((path) => path.getAttribute("transform"));
    said.truth = [...document.querySelectorAll("image.truth")].map((image) => image.getAttribute("href"));
    const before = ink();
    at("motion").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    const turned = ink();
    said.start = now();
    at("frame").value = 0.031; at("frame").dispatchEvent(new Event("input"));
    said.moved = [before !== turned, turned !== ink(), at("time").textContent, now()];
    said.step = Number(at("frame").step);
    at("play").click(); said.play = [at("play").textContent]; at("play").click(); said.play.push(at("play").textContent);
    choose("effect", "clutter"); tell("effect");
    choose("station", "all"); tell("all");
    choose("subtype", at("subtype").options[1].value); tell("hostile");
    choose("subtype", "DJI Mini 2");
    const light = ink();
    document.documentElement.dataset.theme = "dark";
    setTimeout(() => { said.themed = light !== ink(); document.body.dataset.said = JSON.stringify(said); });
    """
    found = browsed(tmp_path, page, script)
    assert "data-ran" not in found
    said = told(found, "said")
    one, with_effect, other = values["data"]["samples"]
    name = "UAV: DJI Mini 2 (seen), motion model 1, no noise"
    percents = "answerunseen ABC:VRP+TRP+VT20.080.00.00.0Bird, wrong"
    assert said["first"][:2] == [name, one["tile"]] and percents in said["first"][2]
    assert said["first"][3:] == [False, 1]
    assert said["effect"][:2] == [f"{name}, with clutter", with_effect["tile"]]
    assert said["all"][4] == 2
    none = "No network was asked about this sample."
    hostile = f"UAV: {HOSTILE}, motion model 1, 8 dB"
    assert said["hostile"] == [hostile, other["tile"], none, True, 2]
    # The red line stands in the truth and the echo of both stations, and in every spectrum whose
    # axis has the instant.
    assert said["start"] == 4 and said["moved"] == [True, True, "0.031 s", 10]
    assert said["step"] == pytest.approx(1 / 80 / viewer.FRAMES)
    assert said["play"] == ["Pause", "Play"] and said["themed"]
    assert said["speeds"].endswith(" Played 120 times slower.")
    assert said["truth"] == values["data"]["motions"]["DJI Mini 2 1"]["truth"]
    check_echoes(said, one, renderer.network)


def check_echoes(said, one, network):
    """What the viewer draws of the echoes: a tone at station A and nothing at station B."""
    speed = one["echoes"][0]
    words = f"A {speed['range']} m and {speed['speed']} m/s (not folded)"
    assert words in said["speeds"] and "B" not in said["speeds"]
    # The power of a line is flat at the top of its panel, that of a silent station at the bottom.
    assert set(re.findall(r"[ML][\d.]+ ([\d.]+)", said["power"][0])) == {"0.0"}
    assert set(re.findall(r"[ML][\d.]+ ([\d.]+)", said["power"][1])) == {"64.0"}
    heights = [float(value) for value in re.findall(r"M[\d.]+ ([\d.]+)", said["phase"][0])]
    wanted = [150 - 64 * (30 * time % 1) for time in network.times_s]
    assert len(heights) == network.symbols
    assert all(min(abs(a - b), 64 - abs(a - b)) < 0.3 for a, b in zip(heights, wanted, strict=True))
    # A mark in the truth and in each spectrum, at the height of the speed that is shown.
    largest = network.largest_mps(network.stations[0])
    height = float(re.search(r"translate\(0 ([\d.]+)\)", said["marks"][0])[1])
    assert height == pytest.approx(150 * (largest - speed["shown"]) / (2 * largest), abs=0.06)
    assert all(said["marks"])


def test_the_viewer_fits_a_telephone_and_its_panels_stand_below_each_other(page, tmp_path):
    script = """
    const page = frame.contentDocument, box = (node) => node.getBoundingClientRect();
    const panels = [...page.querySelectorAll("svg.panel")].map(box).filter((found) => found.width);
    const shares = page.getElementById("viewer-shares");
    document.body.dataset.said = JSON.stringify([page.documentElement.scrollWidth, panels.length,
      Math.max(...panels.map((found) => found.right)), new Set(panels.map((found) => found.left)).size,
      shares.scrollWidth - shares.clientWidth]);
    """
    wide, count, right, columns, hidden = told(narrow(tmp_path, page, script), "said")
    assert wide <= 390 and count == 5 and right <= 390 and columns == 1 and hidden == 0


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
        np.ones((2, 4)),
        {"A": {"radial_mps": None}, "B": {"radial_mps": -3.2 * limit, "range_m": 20.04}},
        network,
    )
    assert (
        "speed" not in entries[0]
        and entries[1]["shown"] == round(0.8 * limit, 2)
        and entries[1]["folds"] == 2
        and entries[1]["range"] == 20.0
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
    numbers = viewer.chosen(shards, set(), set())
    viewed = sample_viewer.viewed(shards, numbers, None)
    sides = viewer.PIXELS, 16
    found = viewer.shown(viewed, shards.renderer, {}, {}, shards.classes, {}, sides)["data"]
    levels = {}
    for sample in found["samples"]:
        levels.setdefault((sample["subtype"], sample["model"]), []).append(sample["snr"])
    assert len(levels) > 3 and all(
        snrs[0] == "no noise" for snrs in levels.values() if "no noise" in snrs
    )
    assert max(map(len, levels.values())) > 1
    json.dumps(found, allow_nan=False)
