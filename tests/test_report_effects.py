"""What effects cost and do: calls from the configuration, samples that are the run's own, differences exact by hand."""

import io
import json
import re

import numpy as np
import pytest
from PIL import Image

from chain import SPECTRA
from chain import WAVE as NETWORK
from craft import craft, row
from lowalt.common.classes import CATEGORIES
from lowalt.common.config import load, merge
from lowalt.common.csv_tables import read_csv
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.common.splits import fold
from lowalt.common.streams import stream
from lowalt.effects.catalogue import PLACES, called
from lowalt.effects.received import Scene
from lowalt.measure.effects_calls import asked_snrs, calls
from lowalt.measure.effects_cost import COLUMNS, correct, difference, gathered, recognised, rows, typical_ms, write
from lowalt.measure.effects_samples import (
    held_out,
    main,
    measure,
    pixel_change,
    read_samples,
    signal_change,
    takes,
)
from lowalt.motion import write_table
from lowalt.noise.chunk import noisy_signals
from lowalt.report.figures.effects import figure, most_changed, read_rows
from lowalt.report.page import rendered
from lowalt.report.sections.effects import COLUMNS as SHOWN
from lowalt.targets.cloud import write as write_cloud
from lowalt.tiles import Renderer, resize, split

BASE, SCHEMA = "config/default.yaml", "workflow/schemas/config.schema.yaml"
INFINITY = float("inf")
IMAGES = {"size": 16, "scale": "power", "floor_db": 40.0, "gamma": 0.5, "colour_map": "viridis"}
SPLIT = {"by": "motion", "train": 2, "val": 1, "test": 2}
SIZE = 8


def scene(effects=None, seed=3):
    return Scene(Network.from_settings(NETWORK), seed, None, tuple(called(effects or {})))


def measured(effects, snrs=(3.0, INFINITY), models=2):
    tiles = Renderer.from_settings({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    given = [row(model) for model in range(models)]
    return measure((scene(), scene(effects)), tiles, {"DJI Mini 2": craft()}, given, {}, list(snrs), SIZE, CATEGORIES)


@pytest.fixture
def config():
    return load([BASE], SCHEMA)


def test_calls_are_none_then_every_effect_alone_then_the_scenes(config, tmp_path):
    path = tmp_path / "windy.yaml"
    path.write_text("run: windy\neffects: {gusts: {wind_mps: 9.0}, receiver_noise: {}}\nnoise: {snr_db: [.inf]}\n")
    found = calls(merge(config, {"report": {"effect_scenes": [str(path)]}}), SCHEMA)
    assert list(found) == ["none", *PLACES, "windy"]
    assert found["none"] == {"effects": {}, "tolerance": None, "snr_db": [13.0, INFINITY]}
    assert found["adc"]["effects"] == {"adc": {}}
    # A link budget and a set SNR exclude each other.
    assert found["receiver_noise"]["snr_db"] == found["windy"]["snr_db"] == [INFINITY]
    assert found["windy"]["effects"]["gusts"] == {"wind_mps": 9.0}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("effects: {}\nnetwork: {symbols: 300}\n", r"changes \['network'\]"),
        ("effects: {gust: {}}\n", "gust"),
        ("effects: {canceller: {}}\n", "no clutter to cancel"),
    ],
)
def test_scenes_that_are_wrong_or_of_other_samples_are_refused(config, tmp_path, text, words):
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        calls(merge(config, {"report": {"effect_scenes": [str(path)]}}), SCHEMA)


def test_a_name_that_is_taken_and_a_run_with_effects_are_refused(config, tmp_path):
    path = tmp_path / "adc.yaml"
    path.write_text("effects: {adc: {}}\n")
    with pytest.raises(InputError, match="'adc' is taken"):
        calls(merge(config, {"report": {"effect_scenes": [str(path)]}}), SCHEMA)
    with pytest.raises(InputError, match=r"effects: \['adc'\], expected none"):
        calls(merge(config, {"effects": {"adc": {}}}), SCHEMA)


def test_the_network_is_asked_at_the_middle_snr_and_without_noise():
    assert asked_snrs([23, 3, 13, 8, 18, INFINITY]) == [13, INFINITY]
    assert asked_snrs([8, 3]) == [3, INFINITY]
    assert asked_snrs([INFINITY]) == [INFINITY]


def test_held_out_are_the_first_models_of_the_test_fold():
    given = [row(model) for model in range(20)]
    found = [one["model"] for one in held_out(given, SPLIT, 5, 3)]
    want = [model for model in range(20) if fold(SPLIT, 5, "DJI Mini 2", model) == "test"]
    assert found == want[:3] and len(want) == 8
    assert [one["model"] for one in held_out(given, SPLIT, 5, 99)] == want
    with pytest.raises(InputError, match="no test models"):
        held_out(given[:1], SPLIT | {"test": 0}, 5, 1)
    with pytest.raises(InputError, match=r"split\.by: 'sample'"):
        held_out(given, SPLIT | {"by": "sample"}, 5, 1)


def test_changes_are_what_their_definitions_say():
    before = np.array([[3.0, 4.0j], [1.0, 1.0]])
    np.testing.assert_allclose(signal_change(before, before + np.array([[0, 5.0], [0, 0]])), [1.0, 0.0])
    np.testing.assert_allclose(signal_change(before, -before), [2.0, 2.0])
    black, grey = np.zeros((2, 4), np.uint8), np.array([[0, 8, 9, 255], [0, 0, 0, 0]], np.uint8)
    assert pixel_change(black, grey) == pixel_change(grey, black) == (2 / 8, (8 + 9 + 255) / 8)
    with pytest.raises(InputError, match="shapes"):
        pixel_change(black, grey[:1])


def test_no_effect_changes_nothing_and_gives_the_images_of_the_run():
    found = measured({})
    for name in ("signal_change", "cells_changed", "pixels_changed", "pixel_difference"):
        assert not found[name].any()
    np.testing.assert_array_equal(*found["example"])
    tiles = Renderer.from_settings({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    clean = takes([scene()], {"DJI Mini 2": craft()}, [row(0), row(1)], {})[0].signal
    noisy = noisy_signals(clean.swapaxes(0, 1), [row(0), row(1)], ["A", "B"], [3.0, INFINITY], 3)
    for model, level in np.ndindex(2, 2):
        np.testing.assert_array_equal(
            found["views"][model, level], resize(split(tiles.tile(noisy[model, level]), 3), SIZE)
        )
    assert (found["total_ms"] > 0).all() and (found["base_ms"] > 0).all()


def test_a_wrong_cell_shows_in_cells_signal_and_spectra_as_often_as_it_is_asked_for():
    always = {"cell_error": {"probability": 1.0, "spread_cells": 1, "mode": "fixed", "hold": "symbol"}}
    found = measured(always)
    assert (found["cells_changed"] == 1).all()
    assert (found["signal_change"] > 0.1).all() and (found["pixel_difference"] > 0).all()
    # Noise is set against the echo itself, not against what the wrong cell holds.
    before, after = takes([scene(), scene(always)], {"DJI Mini 2": craft()}, [row(0)], {})
    np.testing.assert_allclose(after.power, np.mean(abs(before.signal.astype(complex)) ** 2, axis=2), rtol=1e-6)


def fake(name, effects, added, snrs, motion=6):
    """A call's header and arrays, as read back."""
    rng = np.random.default_rng(len(name))
    shape = (motion, 2)
    return {"name": name, "effects": effects, "hardware": "here"}, {
        "subtype": np.array(["Crow"] * motion), "model": np.arange(motion), "label": np.full(motion, 1),
        "snr_db": np.array(snrs), "base_ms": np.full(shape, 2.0), "total_ms": np.full(shape, 2.0 + added),
        "signal_change": np.full(shape, 0.25), "cells_changed": np.full(shape, 0.5),
        "pixels_changed": np.full(motion, 0.125), "pixel_difference": np.full(motion, 3.0),
        "example": rng.integers(0, 256, (2, 6, 8, 8), dtype=np.uint8), "example_subtype": np.array("Crow"),
        "spectra": np.array(["vrp", "trp", "vt"]),
    }  # fmt: skip


CALLS = [
    fake("gusts", ["gusts"], 1.0, [13.0, INFINITY]), fake("none", [], 0.0, [13.0, INFINITY]),
    fake("adc", ["adc"], 4.0, [INFINITY]), fake("windy", ["gusts", "adc"], 4.5, [INFINITY]),
]  # fmt: skip
ALL = np.ones((6, 2), bool)


def table(calls=CALLS, **right):
    told = {"none": ALL, "gusts": ALL, "adc": ALL[:, :1], "windy": ALL[:, :1]} | right
    return {line["call"]: line for line in rows(calls, told, {"scheme": "ABC", "protocol": "seen"}, 7)}


def test_rows_pair_every_call_with_none_on_the_same_snrs():
    none = ALL.copy()
    none[0, 0] = False
    windy = ALL[:, :1].copy()
    windy[:3] = False
    found = table(none=none, windy=windy)
    assert list(found) == ["none", "gusts", "adc", "windy"]
    assert found["none"]["accuracy_with_percent"] == pytest.approx(100 * 11 / 12)
    assert found["gusts"]["difference_points"] == pytest.approx(100 / 12)
    # The one sample missed without effects was at 13 dB, where a link budget is never asked.
    assert (found["windy"]["accuracy_without_percent"], found["windy"]["accuracy_with_percent"]) == (100.0, 50.0)
    assert found["windy"]["difference_points"] == -50.0
    assert found["windy"]["low"] < -50 < found["windy"]["high"] <= 0
    assert (found["none"]["low"], found["none"]["high"]) == (0.0, 0.0)
    assert (found["windy"]["snr_db"], found["none"]["snr_db"]) == ("inf", "13 inf")
    assert (found["windy"]["samples"], found["none"]["samples"], found["none"]["motion_models"]) == (6, 12, 6)
    assert found["adc"]["cells_changed_percent"] == 50 and found["adc"]["pixels_changed_percent"] == 12.5


def test_parts_of_a_scene_add_up_and_are_left_out_where_one_is_missing():
    found = table()
    assert [found[name]["added_ms"] for name in found] == [0.0, 1.0, 4.0, 4.5]
    assert [found[name]["parts_ms"] for name in found] == ["", "", "", 5.0]
    assert table([call for call in CALLS if call[0]["name"] != "adc"])["windy"]["parts_ms"] == ""


def test_files_of_a_call_are_gathered_in_their_order_and_calls_in_the_chains():
    more = fake("gusts", ["gusts"], 3.0, [13.0, INFINITY], motion=2)
    found = gathered([CALLS[3], CALLS[2], CALLS[0], CALLS[1], more])
    assert [header["name"] for header, _ in found] == ["none", "gusts", "adc", "windy"]
    header, arrays = found[1]
    assert header == CALLS[0][0] and arrays["model"].tolist() == [0, 1, 2, 3, 4, 5, 0, 1]
    assert arrays["total_ms"].shape == (8, 2) and arrays["total_ms"][5:7, 0].tolist() == [3.0, 5.0]
    np.testing.assert_array_equal(arrays["example"], CALLS[0][1]["example"])
    assert arrays["snr_db"].tolist() == [13.0, INFINITY] and arrays["spectra"].tolist() == ["vrp", "trp", "vt"]
    with pytest.raises(InputError, match="gusts: files of other effects or SNRs"):
        gathered([CALLS[0], fake("gusts", ["gusts"], 3.0, [INFINITY])])


def test_time_is_the_mean_of_subtypes_medians_so_that_one_interruption_moves_nothing():
    times = np.array([[2.0, 2.0, 1e6], [6.0, 6.0, 1e6], [6.0, 6.0, 6.0]])
    assert typical_ms(times, np.array(["Crow", "Owl", "Owl"])) == 4.0


def test_samples_that_do_not_belong_together_are_refused():
    with pytest.raises(InputError, match="expected 'none' among"):
        table([CALLS[0]])
    other = fake("adc", ["adc"], 4.0, [INFINITY], motion=5)
    with pytest.raises(InputError, match="adc: its motion models are not those of 'none'"):
        table([*CALLS[:2], other])
    with pytest.raises(InputError, match=r"adc: SNRs \[5.0\]"):
        table([*CALLS[:2], fake("adc", ["adc"], 4.0, [5.0])])


def test_intervals_resample_whole_motion_models():
    without = np.ones((40, 6), bool)
    lost = without.copy()
    lost[:10] = False
    names = np.arange(40).astype(str)
    value, low, high = difference(without, lost, names, stream(1, "a"))
    # Models are lost whole, so 40 of them decide and not 240 samples: the interval is that of one sample a model.
    assert (value, low, high) == difference(without[:, :1], lost[:, :1], names, stream(1, "a"))
    spread = 1.96 * 100 * np.sqrt(0.25 * 0.75 / 40)
    assert value == -25.0 and high - low == pytest.approx(2 * spread, rel=0.1)


def test_the_most_probable_class_decides():
    told = np.array([[[0.1, 0.9], [0.6, 0.4]], [[0.3, 0.7], [0.2, 0.8]]])
    np.testing.assert_array_equal(correct(told, np.array([1, 0])), [[True, False], [False, False]])


def test_the_table_is_read_back_and_the_figure_has_a_pair_for_every_call(tmp_path):
    lines = list(table().values())
    write(tmp_path / "effects.csv", lines)
    back = read_csv(tmp_path / "effects.csv", *COLUMNS)
    assert [line["call"] for line in back] == ["none", "gusts", "adc", "windy"]
    assert float(back[3]["parts_ms"]) == 5.0 and back[2]["effects"] == "adc"
    lines = read_rows(tmp_path / "effects.csv")
    assert [(line["added_ms"], line["parts_ms"]) for line in lines[2:]] == [(4.0, ""), (4.5, 5.0)]
    examples = {header["name"]: ("Crow", arrays["example"], ["vrp", "trp", "vt"]) for header, arrays in CALLS}
    picture = np.asarray(Image.open(io.BytesIO(figure(lines, examples))).convert("RGB"))
    # Without effects there is no pair: more calls make a taller picture.
    fewer = np.asarray(Image.open(io.BytesIO(figure(lines[:2], examples))).convert("RGB"))
    assert picture.shape[0] > fewer.shape[0]
    # Of 48 colours at most, so that a figure of all effects stays below a megabyte.
    assert 40 < len(np.unique(picture.reshape(-1, 3), axis=0)) <= 48


def test_the_spectrum_that_changes_most_is_shown():
    pair = np.zeros((2, 6, 4, 4), np.uint8)
    pair[1, 1], pair[1, 2, 0, 0], pair[1, 5] = 3, 255, 255
    # Number 5 is the second station's.
    assert most_changed(pair, 3) == 2
    pair[1, 1] = 20
    assert most_changed(pair, 3) == 1


def test_the_command_writes_what_it_measured_and_names_what_is_missing(tmp_path):
    write_cloud(tmp_path / "craft.npz", craft())
    write_table(tmp_path / "chunk.csv", [row(model) for model in range(5)])
    block = {"name": "adc", "effects": {"adc": {"bits": 4}}, "network": NETWORK, "spectra": SPECTRA, "images": IMAGES,
             "split": SPLIT, "seed": 3, "tolerance": None, "snr_db": ["inf"], "size": SIZE, "models": 1,
             "classes": CATEGORIES}  # fmt: skip
    line = ["--settings", json.dumps(block), "--motion", str(tmp_path / "chunk.csv"), "--clouds",
            str(tmp_path / "craft.npz"), "--out", str(tmp_path / "adc.npz")]  # fmt: skip
    main(line)
    header, arrays = read_samples(tmp_path / "adc.npz")
    assert (header["name"], header["effects"]) == ("adc", ["adc"])
    assert arrays["views"].shape == (1, 1, 6, SIZE, SIZE) and arrays["example"].shape == (2, 6, 16, 16)
    assert fold(SPLIT, 3, "DJI Mini 2", int(arrays["model"][0])) == "test"
    (tmp_path / "adc.npz").write_bytes(b"not a file")
    with pytest.raises(InputError, match=r"adc\.npz: not a file of an effect's samples"):
        read_samples(tmp_path / "adc.npz")
    line[1] = json.dumps(block | {"effects": {"occlusion": {}}})
    with pytest.raises(InputError, match="occlusion"):
        main(line)


def test_a_trained_network_is_asked_about_every_sample_in_its_place(tmp_path):
    torch = pytest.importorskip("torch")
    from lowalt.recognition import checkpoint, network, runs, schemes

    scheme = schemes.Scheme("BC:VRP+VT", (1, 2), (0, 2))
    block = {"backbone": "test_vit2", "weights": "none", "intra_depth": 1, "inter_depth": 1, "heads": 4,
             "feed_forward": 1, "dropout": 0.0, "hidden": 0}  # fmt: skip
    torch.manual_seed(1)
    weights = network.Recogniser(scheme, block, 32, np.zeros((3, 256, 3), np.uint8), 4).state_dict()
    weights["palettes.table"] = torch.randn(2, 256, 3)
    about = {"scheme": vars(scheme), "protocol": "seen", "network": block, "size": 32, "seed": 0, "colour_map": "gray"}
    checkpoint.save(tmp_path / "model.pt", "{}", {"weights": weights, **about})
    views = stream(2, "views").integers(0, 256, (3, 2, 9, 32, 32), dtype=np.uint8)
    model = runs.load(tmp_path / "model.pt").model
    with torch.inference_mode():
        told = np.array(
            [[int(model(torch.from_numpy(one[None, [3, 5, 6, 8]])).argmax()) for one in levels] for levels in views]
        )
    # Labels that are right at one sample of each motion model at least.
    label = told[:, 0]
    settings = {"batch": 4, "threads": 1, "precision": "fp32", "mirror": False}
    arrays = {"spectra": np.array(["vrp", "trp", "vt"]), "views": views, "label": label}
    right, about = recognised(tmp_path / "model.pt", [({"name": "none"}, arrays)], settings)
    np.testing.assert_array_equal(right["none"], told == label[:, None])
    assert about == {"scheme": "BC:VRP+VT", "protocol": "seen"}
    with pytest.raises(InputError, match="images of 16 pixels"):
        small = {"views": views[..., ::2, ::2], "label": label}
        recognised(tmp_path / "model.pt", [({"name": "none"}, small)], settings)


def test_the_page_shows_every_row(tmp_path):
    write(tmp_path / "effects.csv", list(table().values()))
    lines = read_csv(tmp_path / "effects.csv", *SHOWN)
    text = rendered("effects", {"own": True, "rows": lines, "plot": None, "picture": "data:here"})
    cells = [re.findall(r"<td>(.*?)</td>", line) for line in text.splitlines() if line.startswith("<tr><td>")]
    assert [line[0] for line in cells] == ["none", "gusts", "adc", "windy"]
    assert cells[3][1:4] == ["4.50", "5.00", "0.25"] and cells[1][2] == ""
    assert 'src="data:here"' in text


@pytest.mark.workflow
def test_effects_are_priced_where_asked_for_and_nowhere_else(tmp_path):
    pytest.importorskip("snakemake")
    from test_workflow import planned, snakemake, workplace

    folder = workplace(tmp_path)
    priced = {"effect_samples", "occluders", "effects_table"}
    assert not priced & planned(folder)
    assert priced | {"cloud", "motion", "train"} <= planned(folder, "--", "effects_cost")
    shown = folder / "shown.yaml"
    shown.write_text("report: {effects: true}\n")
    assert priced | {"report"} <= planned(folder, "--configfile", "overlay.yaml", str(shown))
    shown.write_text("effects: {adc: {}}\n")
    text = snakemake(folder, "-n", "--configfile", "overlay.yaml", str(shown), "--", "effects_cost", good=False)
    assert "effects: ['adc'], expected none" in text
