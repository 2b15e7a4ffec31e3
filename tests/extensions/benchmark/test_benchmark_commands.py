"""The benchmark as a stranger uses it, on a small copy of its definition: data, examples, scores, confirmation."""

import importlib.util
import json
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import small_benchmark
from lowalt import benchmark
from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.extensions.benchmark import baseline_table, confirm, definition, frozen_bytes
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS
from lowalt.files.errors import InputError, InputWarning

ROOT = Path(__file__).parents[3]
ZOO = ROOT / "results/zoo/default-unseen.safetensors"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with the data of the main part and of the part low-snr of a small benchmark."""
    folder = tmp_path_factory.mktemp("benchmark")
    with pytest.MonkeyPatch.context() as patch:
        small_benchmark.shrink(patch)
        for part in ("main", "low-snr"):
            small_benchmark.write(folder / "results", part)
    definition.truth.cache_clear()
    return folder


@pytest.fixture
def small(made, monkeypatch):
    """The small benchmark, in a current folder that holds its data."""
    small_benchmark.shrink(monkeypatch)
    monkeypatch.chdir(made)
    yield made
    definition.truth.cache_clear()


def test_samples_of_a_track_are_those_of_its_keys(small):
    train, test = benchmark.load("unseen", "train"), benchmark.load("unseen", "test")
    assert train.images.shape == (64, 9, 24, 24) and test.signals.shape == (16, 3, 400)
    data = small_benchmark.Dataset(definition.config_of("main"))
    for samples, number in ((train, 5), (test, 7)):
        key = samples.key[number]
        found = next(one for one in range(len(data)) if data.key(one) == key)
        signal = data.signal(found)
        level = np.linalg.norm(signal, axis=-1, keepdims=True) / np.sqrt(signal.shape[-1])
        assert samples.signals[number] == pytest.approx(signal / level, rel=1e-5)
        assert np.array_equal(samples.images[number], small_benchmark.resized(data, found))
        assert samples.classes[samples.labels[number]] == data.record(found)["category"]
    alone = benchmark.load("one-station", "test")
    assert np.array_equal(alone.images, test.images[:, :3]) and np.array_equal(alone.signals, test.signals[:, :1])
    assert set(benchmark.load("low-snr", "test").facts.snr_db.tolist()) == {3, 18}


def test_data_that_nobody_made_are_asked_for_by_name(small):
    with pytest.raises(InputError, match="lowalt benchmark make --track town"):
        benchmark.load("town", "test")
    with pytest.raises(InputError, match="expected perhaps \\['unseen'\\]"):
        benchmark.load("unsen")


@pytest.mark.parametrize("name", ["benchmark_predict", "benchmark_features"])
@pytest.mark.parametrize("track", ["unseen", "low-snr"])
def test_an_example_writes_a_submission_that_is_scored(small, name, track, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [f"{name}.py", track])
    assert len((ROOT / f"examples/{name}.py").read_text().splitlines()) <= 30
    runpy.run_path(str(ROOT / f"examples/{name}.py"))
    assert main(["benchmark", "score", "predictions.csv", "--track", track, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["samples"] == len(benchmark.load(track, "test")) and found["percent"][0] > 35


def test_the_example_of_a_network_is_a_backbone_and_its_overlay_names_it():
    spec = importlib.util.spec_from_file_location("own", ROOT / "examples/benchmark_network.py")
    own = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(own)
    import torch

    assert own.small(24)(torch.zeros(2, 3, 24, 24)).shape == (2, 64)
    config = small_benchmark.overlaid([*definition.overlays("main"), str(ROOT / "examples/benchmark_network.yaml")])
    assert config["data"] == definition.RUN
    assert config["recognition"]["network"]["backbone"] == "examples/benchmark_network.py:small"


def test_score_prints_intervals_and_every_baseline(small, capsys):
    test = benchmark.load("unseen", "test")
    with pytest.raises(InputError, match=rf"row {test.key[0]}: p_uav is -2.5, expected a number from 0 to 1"):
        benchmark.write("mine.csv", test, np.full((len(test), 4), -2.5))
    assert not Path("mine.csv").exists(), "logits are refused before a file is written"
    benchmark.write("mine.csv", test, np.eye(4)[test.labels])
    assert main(["benchmark", "score", "mine.csv", "mine.csv", "--track", "unseen"]) == 0
    text = capsys.readouterr().out
    assert "16 samples, training seeds: 2" in text and "accuracy 100.0 (100.0 to 100.0)" in text
    assert main(["benchmark", "score", "absent.csv", "--track", "unseen"]) == 2
    assert main(["benchmark", "score", "mine.csv", "--track", "unsen"]) == 2


def test_make_compares_with_the_kept_checksums(small, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(workflow, "ended", lambda options: {"status": 0})
    monkeypatch.setattr(frozen_bytes, "REFERENCE", str(tmp_path))
    monkeypatch.setattr(frozen_bytes, "PARTS", ("main",))
    frozen_bytes.write("results", tmp_path)
    assert main(["benchmark", "make"]) == 0
    assert "are equal to the kept checksums" in capsys.readouterr().out
    table = next(Path("results/lowalt-40-v1/motion").glob("*.csv"))
    whole = table.read_text()
    table.write_text(whole.replace("1", "2", 1))
    assert main(["benchmark", "make"]) == 1
    assert f"main/motion/{table.name} differs" in capsys.readouterr().out
    table.unlink()
    assert main(["benchmark", "make"]) == 1
    assert f"main/motion/{table.name} is missing" in capsys.readouterr().out
    table.write_text(whole)


def test_make_reports_a_signal_that_differs_in_one_last_bit(small, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(workflow, "ended", lambda options: {"status": 0})
    monkeypatch.setattr(frozen_bytes, "REFERENCE", str(tmp_path))
    monkeypatch.setattr(frozen_bytes, "PARTS", ("main",))
    frozen_bytes.write("results", tmp_path)
    path = next(Path("results/lowalt-40-v1/noisy").glob("*.npy"))
    whole = np.load(path)
    changed = whole.copy()
    first = changed.view(np.float32).reshape(-1)
    first[0] = np.nextafter(first[0], np.float32(np.inf))
    np.save(path, changed)
    assert (np.load(path) != whole).sum() == 1 and main(["benchmark", "make"]) == 1
    assert f"main/noisy/{path.name} differs" in capsys.readouterr().out
    np.save(path, whole)
    assert main(["benchmark", "make"]) == 0


def test_a_confirmed_result_follows_from_the_model_file(small, tmp_path, monkeypatch, recwarn):
    monkeypatch.setattr(confirm, "USUAL", 2)
    track = TRACKS["unseen"]
    recwarn.clear()
    first = confirm.confirm(ZOO, track)
    assert not [one for one in recwarn if issubclass(one.category, InputWarning)]
    assert first == confirm.confirm(ZOO, track)
    assert first.samples == 4 * 4 * 2 and first.percent.value > 60
    assert first.seed == definition.root_seed(ZOO.read_bytes() + b"lowalt-40 v1")
    # Another seed gives other motion of the same subtypes.
    rows = [confirm.dataset(track, seed).record(0)["motion"] for seed in (first.seed, first.seed + 1)]
    assert rows[0] != rows[1]
    assert set(confirm.dataset(track, 1).plan.groups["unseen"]) == {
        "DJI Mini 4 Pro",
        "Owl",
        "NIO ET5T 2023",
        "Walking Pedestrian 5",
    }
    with pytest.raises(InputError, match="stations"):
        confirm.confirm(ZOO, TRACKS["one-station"])
    with pytest.raises(InputError, match="cannot be confirmed"):
        confirm.confirm(ZOO, TRACKS["forty"])


@pytest.mark.slow
def test_a_confirmed_row_of_the_table_is_what_the_command_finds_again(capsys):
    (row,) = [row for row in baseline_table.read() if row["confirmed_percent"]]
    assert main(["benchmark", "confirm", f"{definition.RUN}-{row['track']}", "--track", row["track"], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["percent"]
    # One answer of thousands may depend on the processor's arithmetic.
    assert found == pytest.approx([float(row[f"confirmed_{name}"]) for name in ("percent", "low", "high")], abs=0.1)


def test_frozen_features_are_those_of_each_sample_s_images_station_by_station(small, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "studies")
    monkeypatch.syspath_prepend(ROOT / "studies/benchmark")
    from frozen import SCALE, embedded, embedded_of
    from imagenet_weights import BACKBONE, write_weights

    from lowalt.recognition.recogniser import backbone

    test = benchmark.load("unseen", "test")
    found = embedded_of(test, tmp_path).reshape(len(test), 3, -1)
    model = backbone(BACKBONE, str(write_weights(tmp_path / f"{BACKBONE}.pth")), SCALE * test.size).eval()
    chosen = [5, 0, len(test) - 1]
    np.testing.assert_allclose(found[chosen], embedded(test.images[chosen], model, "viridis"), rtol=0.02, atol=0.01)
    assert abs(found[5] - found[0]).max() > 0.5
    assert (embedded_of(benchmark.load("one-station", "test"), tmp_path) == found[:, 0]).all()


def test_the_study_trains_tests_and_writes_its_table(small, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "studies")
    monkeypatch.syspath_prepend(ROOT / "studies/benchmark")
    import study

    monkeypatch.setattr(study, "OUT", tmp_path / "out")
    monkeypatch.setattr(study, "REFERENCE", str(tmp_path))
    for method in ("majority class", "nearest centroid on moments", "logistic regression on features"):
        for track in ("unseen", "open-set", "one-station"):
            study.one((method, track, 0), "results")
    # A call that found the network trained measured no training, so the time that the training kept counts.
    (study.place("logistic regression on features", "unseen", 0) / "run.json").write_text('{"train_processor_s": 1000}')
    rows = study.tables(tmp_path)
    assert {row["track"] for row in rows} == {"unseen", "open-set", "one-station"} and len(rows) == 9
    by = {(row["track"], row["method"]): row for row in rows}
    assert by["unseen", "majority class"]["percent"] == 25 and by["open-set", "majority class"]["percent"] == 50
    assert by["unseen", "logistic regression on features"]["percent"] > 60
    assert by["unseen", "logistic regression on features"]["train_core_s"] == 1000
    assert by["unseen", "majority class"]["seeds"] == "none"
    with np.load(tmp_path / "unseen.npz") as kept:
        assert kept["majority class"].shape == (1, 8)
    shutil.rmtree(tmp_path / "out")
