"""An effect of the user's own offers all that a shipped one can.

It reads a file, needs surfaces and clouds, adds to the record, breaks tracks, and filters what
noise passes.
"""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import lowalt
from configured import run_of
from lowalt.config.layers import merge, overlaid
from lowalt.files.errors import InputError
from lowalt.scene import effects, set_noise
from lowalt.scene.checks import check, refuse_unknown_subtypes
from lowalt.shards import clean
from lowalt.shards.plan import Plan
from lowalt.workflow import refusals
from lowalt.workflow.stages.recognition import RecognitionStage
from lowalt.workflow.stages.shards import ShardsStage
from lowalt.workflow.stages.stage import RunStage

RAIN = """
from pathlib import Path
import numpy as np
SOURCE = "a test"
DEFAULTS = {"rates": None, "beside": [], "name": "rain"}
FILES = ("rates",)
SURFACES = True
JUMPS = True
WAVES = ("reflected by walls",)
def files(settings):
    path = settings["rates"]
    return [path, *Path(path).read_text().split()] if path else []
def subtypes(settings):
    return settings["beside"]
def record(settings, network, row, rng):
    return {settings["name"]: [len(network.stations), row["model"], round(rng.random(), 6)]}
def visible(settings, view, rng):
    return np.ones(view.places.shape[:2])
"""
HALF = """
SOURCE = "a test"
DEFAULTS = {}
def filtered(settings, cells):
    return 0.5 * cells
"""
CHUNK = SimpleNamespace(run="default", group="seen", part="00001", station="B", fold="train")


@pytest.fixture(scope="module")
def usual():
    """The default run, which knows no effect."""
    return run_of()


@pytest.fixture
def rain(usual, tmp_path, monkeypatch):
    """The effect's file and the files that it reads, in the working directory."""
    monkeypatch.chdir(tmp_path)
    Path("rain.py").write_text(RAIN)
    Path("rates.txt").write_text("january.txt february.txt")
    return {"rain.py": {"rates": "rates.txt", "beside": ["Owl"]}}


def test_the_contract_s_questions_are_answered_for_it_and_for_shipped_effects(rain):
    assert effects.named_files(rain) == {"effects.rain.py.rates": "rates.txt"}
    assert effects.effect_files(rain) == ["rates.txt", "january.txt", "february.txt"]
    assert effects.effect_files({"rain.py": {}}) == []
    both = {"companions": {"subtypes": ["Crow", "Owl"]}, **rain}
    assert effects.needed_subtypes(both) == ["Crow", "Owl"]
    assert effects.breaks_tracks(both) == ["companions", "rain.py"]
    assert effects.of_record({**both, "adc": None, "companions": None}) == {
        "companions": {},
        **rain,
    }
    assert effects.needs_surfaces(rain) and effects.needs_surfaces({"occlusion": None})
    assert not effects.needs_surfaces({"adc": {}})
    for question in (effects.effect_files, effects.needed_subtypes, effects.breaks_tracks):
        assert question({}) == []


def test_rules_take_its_files_clouds_and_surfaces_and_its_share_of_the_record(usual, rain):
    run = replace(usual, config=merge(usual.config, {"effects": rain}))
    stage = RunStage(run)
    assert stage.effect_files == ["rates.txt", "january.txt", "february.txt"]
    assert set(stage.scene_subtypes(CHUNK)) == {*stage.subtypes(CHUNK), "owl"}
    assert stage.opaque_subtypes(CHUNK) == stage.subtypes(CHUNK)
    assert json.loads(ShardsStage(run).settings(CHUNK))["record"] == rain
    assert ShardsStage(run).modules == ["rain.py"]
    run.config["recognition"]["input"] = "dataset"
    assert "occluders" in RecognitionStage(run).samples(CHUNK)


@pytest.mark.parametrize(
    ("path", "said"), [("gone.txt", "'gone.txt' is not there"), ("{x}.txt", ".*without braces")]
)
def test_a_missing_file_and_one_with_braces_are_refused_by_key(usual, rain, path, said):
    config = merge(usual.config, {"effects": {"rain.py": {"rates": path}}})
    with pytest.raises(InputError, match=rf"^effects\.rain\.py\.rates: {said}"):
        refusals.refuse_braces(config, None)
        refusals.refuse_missing(config)


def test_what_it_needs_and_the_scene_does_not_have_is_refused(usual, rain):
    tracks = merge(usual.config, {"effects": rain, "motion": {"looks": 3}})
    with pytest.raises(InputError, match=r"effects: \['rain\.py'\] together with motion\.looks"):
        Plan.of(tracks, {})
    with pytest.raises(InputError, match=r"rain\.py\.subtypes: \['Owl'\], expected subtypes"):
        refuse_unknown_subtypes(rain, ["Crow"])
    walls = merge(usual.config, {"effects": {**rain, "walls": {}}})
    with pytest.raises(InputError, match="both hold the waves reflected by walls"):
        check(walls)
    with pytest.raises(InputError, match="surfaces are known for the target's own subtype only"):
        check(merge(usual.config, {"effects": {**rain, "companions": {"subtypes": ["Crow"]}}}))


def test_its_fields_are_in_the_record_of_every_sample(rain):
    own = {"rain.py": {"name": "drops"}, "companions": {}}
    data = lowalt.Dataset(overlaid(["config/tiny.yaml", {"effects": own}]))
    place = data.place(0)
    record = data.record(0)
    drawn = effects.look_stream(data.plan.seed, "rain.py", data.row(place)).random()
    stations = len(data.maker.network.stations)
    assert record["drops"] == [stations, record["model"], round(drawn, 6)]
    fields = list(record)
    assert fields[fields.index("model") :][1:3] == ["companions", "drops"]


@pytest.mark.parametrize("name", ["label", "model", "power_w", "companions"])
def test_a_field_that_the_record_has_already_is_refused(rain, name):
    own = {"rain.py": {"name": name}, "companions": {}}
    data = lowalt.Dataset(overlaid(["config/tiny.yaml", {"effects": own}]))
    with pytest.raises(InputError, match=rf"\['{name}'\]"):
        data.record(0)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("def files(settings): return 'rates.txt'", "files gives 'rates.txt', expected a list of"),
        ("def subtypes(settings): return [1]", r"subtypes gives \[1\], expected a list of texts"),
        ("FILES = ('rate',)", r"FILES is \('rate',\), expected names of DEFAULTS"),
    ],
)
def test_an_answer_of_another_kind_is_refused(rain, function, said):
    Path("rain.py").write_text(f"{RAIN}\n{function}\n")
    with pytest.raises(InputError, match=rf"rain\.py: {said}"):
        effects.effect_files(rain)
        effects.needed_subtypes(rain)


def test_its_filter_is_refused_for_shards_whose_readers_would_need_its_code(rain):
    Path("half.py").write_text(HALF)
    with pytest.raises(InputError, match=r"'recipe' with the effect 'half\.py', whose code"):
        clean.refuse({"half.py": {}})
    clean.refuse({"canceller": {}, **rain})


def test_noise_passes_its_filter(rain):
    Path("half.py").write_text(HALF)
    passed = set_noise.filters({"half.py": None, "adc": {}, **rain})
    assert passed == {"half.py": {}}
    np.testing.assert_array_equal(set_noise.behind(np.ones(4), passed), np.full(4, 0.5))
