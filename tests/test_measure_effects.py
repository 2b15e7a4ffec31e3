"""Samples with and without effects: calls from the configuration, samples that are the run's own, changes by hand."""

import json

import numpy as np
import pytest

from chain import SPECTRA
from chain import WAVE as NETWORK
from craft import craft, row
from lowalt.common.classes import CATEGORIES
from lowalt.common.config import load, merge
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.common.splits import fold
from lowalt.measure.effects_calls import asked_snrs, calls
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
from lowalt.scene.catalogue import PLACES, called
from lowalt.scene.observe import Scene
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


def test_noise_of_all_cells_is_that_of_each_snr_in_its_own_place():
    noise, snrs = {"cell_noise": {}}, (30.0, 3.0, -10.0)
    found = measured(noise, snrs, models=1)
    tiles = Renderer.from_settings({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    for level, snr in enumerate(snrs):
        (heard,) = takes([scene(noise).at_snr(snr)], {"DJI Mini 2": craft()}, [row(0)], {})
        np.testing.assert_array_equal(found["views"][0, level], resize(split(tiles.tile(heard.signal[0]), 3), SIZE))
    assert len({images.tobytes() for images in found["views"][0]}) == 3


@pytest.mark.parametrize(("categories", "shown"), [(("Bird", "UAV", "UAV"), 1), (("Bird", "Bird", "Vehicle"), 0)])
def test_the_example_is_the_first_sample_of_the_first_class_or_else_the_first(categories, shown):
    given = [row(model) | {"category": category} for model, category in enumerate(categories)]
    tiles = Renderer.from_settings({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    clouds = {"DJI Mini 2": craft()}
    found = measure((scene(), scene()), tiles, clouds, given, {}, [INFINITY], SIZE, CATEGORIES)
    clean = takes([scene()], clouds, given, {})[0].signal
    np.testing.assert_array_equal(found["example"][0], split(tiles.tile(clean[shown]), 3))


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
