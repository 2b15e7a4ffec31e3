"""A user's own effect acts in its place with its settings.

An overlay alone may name it, and edits re-run its jobs.
"""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import lowalt
from lowalt.config.layers import overlaid
from lowalt.files.errors import InputError
from lowalt.scene.effects import called, dotted
from lowalt.workflow import sources
from lowalt.workflow.stages.noise import NoiseStage
from lowalt.workflow.stages.shards import ShardsStage
from lowalt.workflow.stages.tiles import TilesStage
from scenes import sample_of
from tables import rows

HALF = """
from pathlib import Path
Path("ran").touch()
SOURCE = "a test"
DEFAULTS = {"share": 0.5, "names": [], "on": True, "any": None}
IDLE = [{"share": 1}]
def visible(settings, view, rng):
    return settings["share"] * rng.random() + 0 * view.places[..., 0]
"""


@pytest.fixture
def half(tmp_path, monkeypatch):
    """The effect's file in the working directory."""
    monkeypatch.chdir(tmp_path)
    Path("half.py").write_text(HALF)
    return tmp_path


def test_it_acts_behind_the_shipped_effects_of_its_place_with_a_stream_of_its_file_s_name(half):
    named = {"half.py": {"share": "28e-2"}, "adc": {}, "clutter": {}, "fluctuation": {}}
    found = called(named)
    assert [effect.name for effect in found] == ["fluctuation", "clutter", "half.py", "adc"]
    assert found[2].place == "channel" and found[2].settings == {
        "share": 0.28,
        "names": [],
        "on": True,
        "any": None,
    }
    assert not called({"half.py": {"share": 1}})
    shutil.copytree(half, half / "elsewhere", ignore=shutil.ignore_patterns("elsewhere"))
    whole, named, moved = (
        sample_of(effects) for effects in ({}, {"half.py": {}}, {"elsewhere/half.py": {}})
    )
    np.testing.assert_array_equal(named.arrived(), moved.arrived())
    drawn = named.scene.stream("half.py", named.view.row, "A").random()
    np.testing.assert_allclose(named.arrived(), 0.5 * drawn * whole.arrived(), rtol=1e-9)


@pytest.mark.parametrize(
    ("block", "said"),
    rows("own_effects", "settings"),
)
def test_settings_of_other_types_and_unknown_ones_are_refused_in_one_sentence(half, block, said):
    Path("b").mkdir()
    Path("b/half.py").write_text(HALF)
    with pytest.raises(InputError, match=said) as refused:
        called(block)
    assert len(str(refused.value)) <= 400


@pytest.mark.parametrize(
    ("old", "new", "said"),
    rows("own_effects", "files"),
)
def test_a_file_that_does_not_keep_the_contract_is_refused_in_one_sentence(half, old, new, said):
    Path("half.py").write_text(HALF.replace(old, new))
    with pytest.raises(InputError, match=said) as refused:
        called({"half.py": {}})
    assert len(str(refused.value)) <= 400


@pytest.mark.parametrize("factor", ["view.places[0, :, 0]", "view.times_s", "0.5", "view.places"])
def test_a_factor_of_another_shape_than_the_contract_s_is_refused_in_one_sentence(half, factor):
    Path("half.py").write_text(
        HALF.replace('settings["share"] * rng.random() + 0 * view.places[..., 0]', factor)
    )
    with pytest.raises(InputError, match=r"half\.py: visible gives an array of shape"):
        sample_of({"half.py": {}}).arrived()


@pytest.mark.parametrize(
    ("step", "said"),
    [("{}['gone']", "KeyError: 'gone'"), ("exit(3)", "SystemExit: 3")],
)
def test_an_error_of_its_function_is_one_sentence_with_the_line(half, step, said):
    Path("half.py").write_text(
        HALF.replace("    return settings", f"    {step}\n    return settings")
    )
    line = HALF.split("\n").index("def visible(settings, view, rng):") + 2
    with pytest.raises(InputError, match=rf"effects: half\.py, line {line}: {said}"):
        sample_of({"half.py": {}}).arrived()


ACTING = {
    "visible": "view, rng",
    "visible_one_way": "view, rng",
    "cross_sections": "cloud, wavelength_m",
    "receive": "samples, look, rng",
    "filtered": "cells",
    "scatter": "view, rng",
    "heard": "sample",
}
WELL = {
    "visible": "np.ones(view.places.shape[:2])",
    "visible_one_way": "np.ones(view.places.shape[:2])",
    "cross_sections": "cloud.rcs_m2.copy()",
    "receive": "samples.copy()",
    "filtered": "cells.copy()",
    "scatter": "Still(np.zeros((len(view.times_s), view.network.subcarriers), complex))",
    "heard": "np.zeros((len(sample.view.times_s), sample.view.network.subcarriers), complex)",
}
"""An effect's own function that changes nothing, by name."""


def received_with(function: str, result: str):
    """The signal of a scene with an own effect whose function returns this."""
    Path("mine.py").write_text(
        "import numpy as np\nfrom lowalt.scene.view import Still\nSOURCE = 'a test'\nDEFAULTS = "
        "{}\n"
        "def put(array, value):\n    array = array.astype(np.result_type(array, type(value)))\n"
        "    array.flat[0] = value\n    return array\n"
        f"def {function}(settings, {ACTING[function]}):\n    return {result}\n"
    )
    return sample_of({"mine.py": {}}).received().signal


@pytest.mark.parametrize("function", ACTING)
@pytest.mark.parametrize("value", ["np.nan", "np.inf"])
def test_a_result_that_is_not_finite_is_refused_in_one_sentence(half, function, value):
    well = WELL[function]
    bad = (
        f"Still(put({well}.response, {value}))"
        if function == "scatter"
        else f"put({well}, {value})"
    )
    assert np.isfinite(received_with(function, well)).all()
    with pytest.raises(
        InputError, match=rf"mine\.py: {function} gives NaN or infinity, expected finite numbers"
    ):
        received_with(function, bad)


@pytest.mark.parametrize("function", ["visible", "visible_one_way", "cross_sections"])
def test_a_complex_factor_is_refused_in_one_sentence(half, function):
    with pytest.raises(
        InputError,
        match=rf"mine\.py: {function} gives an array of complex128, expected real numbers",
    ):
        received_with(function, f"put({WELL[function]}, 1j)")


def test_a_cross_section_below_zero_is_refused(half):
    with pytest.raises(
        InputError, match=r"mine\.py: cross_sections gives -1 m2, expected no number below 0"
    ):
        received_with("cross_sections", "put(cloud.rcs_m2, -1.0)")


def test_an_edited_file_is_loaded_again_and_leaves_no_byte_code_beside_it(half):
    for share in (0.5, 0.7):
        Path("half.py").write_text(HALF.replace("0.5", str(share)))
        assert called({"half.py": {}})[0].settings["share"] == share
    assert sorted(path.name for path in half.iterdir()) == ["half.py", "ran"]


def test_an_overlay_names_it_and_takes_it_out_and_reading_overlays_runs_nothing(half):
    Path("half.py").write_text(HALF + "# Run once for each of its contents.\n")
    Path("mine.yaml").write_text("targets: {select: [Owl]}\neffects: {half.py: {share: 0.5}}\n")
    Path("without.yaml").write_text("effects: {half.py: null}\n")
    config = overlaid(["config/tiny.yaml", "mine.yaml"])
    assert config["effects"] == {"half.py": {"share": 0.5}}
    assert overlaid(["config/tiny.yaml", "mine.yaml", "without.yaml"])["effects"] == {}
    assert not Path("ran").exists()
    data = lowalt.Dataset(config)
    row = data.row(data.place(0))
    plain = lowalt.Dataset({**config, "effects": {}}, data.clouds)
    heard, whole = (each.maker.received(row)[0] for each in (data, plain))
    assert 0 < abs(heard).max() < 0.5 * abs(whole).max()


def test_its_file_is_an_input_of_the_jobs_that_use_it_alone(half):
    Path("half.py").write_text(HALF + "\nfrom lowalt.measure import fifty_digits\n")
    config = {
        "effects": {"half.py": {}, "canceller": {}},
        "shards": {"kind": "cube"},
        "spectra": {"vt": {}},
    }
    echo = sources.code("lowalt.scene", *map(dotted, config["effects"]))
    assert "half.py" in echo and any(name.endswith("measure/fifty_digits.py") for name in echo)
    run = SimpleNamespace(config=config)
    assert "half.py" in sources.code("lowalt.shards", *ShardsStage(run).modules)
    for modules in (NoiseStage(run).modules, TilesStage(run).modules):
        assert "half.py" not in sources.code("lowalt.tiles", *modules)
    cells = config | {"spectra": {"range_doppler": {}}}
    modules = TilesStage(SimpleNamespace(config=cells)).modules
    assert "half.py" in sources.code("lowalt.tiles", *modules)
