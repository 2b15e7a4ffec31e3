"""What effects cost and do: rows that pair every call with none, differences by hand, the figure and the page."""

import io
import json
import re

import numpy as np
import pytest
from PIL import Image

from lowalt.common.csv_tables import read_csv
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.measure import effects_cost
from lowalt.measure.effects_cost import COLUMNS, correct, difference, gathered, recognised, rows, typical_ms, write
from lowalt.report.figures.effects import figure, most_changed, read_rows
from lowalt.report.page import rendered
from lowalt.report.sections.effects import COLUMNS as SHOWN

INFINITY = float("inf")


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
NETWORK = {"scheme": "ABC", "protocol": "seen"}


def table(calls=CALLS, **right):
    told = {"none": ALL, "gusts": ALL, "adc": ALL[:, :1], "windy": ALL[:, :1]} | right
    return {line["call"]: line for line in rows(calls, told, NETWORK, 7)}


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


def test_the_command_writes_a_line_a_call_and_says_how_many_it_has(monkeypatch, tmp_path, capsys):
    """One file with one call is enough: its samples are counted, and no other call is asked for."""
    monkeypatch.setattr(effects_cost, "read_samples", {"none.npz": CALLS[1]}.get)
    asked = []
    monkeypatch.setattr(effects_cost, "recognised", lambda *given: asked.append(given) or ({"none": ALL}, NETWORK))
    out = str(tmp_path / "effects.csv")
    settings = json.dumps({"seed": 1, "evaluation": {"batch": 2}})
    effects_cost.main(["--settings", settings, "--samples", "none.npz", "--model", "model.pt", "--out", out])
    assert capsys.readouterr().err == f"{out}: 1 calls, 6 motion models\n"
    assert [line["call"] for line in read_csv(out, *COLUMNS)] == ["none"]
    ((path, calls, evaluation, own),) = asked
    assert (path, [header["name"] for header, _ in calls], evaluation, own) == ("model.pt", ["none"], {"batch": 2}, "")


def test_the_spectrum_that_changes_most_is_shown():
    pair = np.zeros((2, 6, 4, 4), np.uint8)
    pair[1, 1], pair[1, 2, 0, 0], pair[1, 5] = 3, 255, 255
    # Number 5 is the second station's.
    assert most_changed(pair, 3) == 2
    pair[1, 1] = 20
    assert most_changed(pair, 3) == 1


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
@pytest.mark.slow
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
    text = snakemake(folder, "-n", "--configfile", "overlay.yaml", str(shown), "--", "effects_cost", status=2)
    assert "effects: ['adc'], expected none" in text
