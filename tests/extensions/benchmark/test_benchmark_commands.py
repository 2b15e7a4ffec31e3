"""The benchmark as a stranger uses it, on a small copy of its definition.

Data, examples, scores and confirmation.
"""

import hashlib
import importlib.util
import json
import re
import runpy
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_benchmark

from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.extensions import benchmark
from lowalt.extensions.benchmark import baseline_table, confirm, costs, definition, frozen_bytes
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS
from lowalt.files.errors import InputError, InputWarning
from lowalt.recognition import model_file, runs
from lowalt.recognition.samples import statement
from lowalt.recognition.schemes import Scheme

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
    small_benchmark.clear()
    return folder


@pytest.fixture
def small(made, monkeypatch):
    """The small benchmark, in a current folder that holds its data."""
    small_benchmark.shrink(monkeypatch)
    monkeypatch.chdir(made)
    yield made
    small_benchmark.clear()


def test_samples_of_a_track_are_those_of_its_keys(small):
    train = benchmark.load("unseen", "train")
    test = benchmark.load("unseen", "test")
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
    assert np.array_equal(alone.images, test.images[:, :3]) and np.array_equal(
        alone.signals, test.signals[:, :1]
    )
    assert set(benchmark.load("low-snr", "test").facts.snr_db.tolist()) == {3, 18}


def test_data_that_nobody_made_are_asked_for_by_name(small):
    with pytest.raises(InputError, match="lowalt benchmark make --track clutter"):
        benchmark.load("clutter", "test")
    with pytest.raises(InputError, match="expected perhaps \\['unseen'\\]"):
        benchmark.load("unsen")


@pytest.mark.parametrize("name", ["benchmark_predict", "benchmark_features"])
@pytest.mark.parametrize("track", ["unseen", "low-snr"])
def test_an_example_writes_a_submission_that_is_scored(small, name, track, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [f"{name}.py", track])
    assert len((ROOT / f"examples/{name}.py").read_text().splitlines()) <= 30
    runpy.run_path(str(ROOT / f"examples/{name}.py"))
    printed = capsys.readouterr().out
    assert (
        printed.startswith(f"{track}: reading the data\n") and "predictions.csv: written" in printed
    )
    assert main(["benchmark", "score", "predictions.csv", "--track", track, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["samples"] == len(benchmark.load(track, "test")) and found["percent"][0] > 35


def test_the_example_of_a_choice_holds_out_subtypes_of_every_split(small, monkeypatch, capsys):
    """The splits of the small benchmark are replaced by parts.

    It has only one subtype of each class that trains.
    """
    asked = []
    load = benchmark.load
    monkeypatch.setattr(
        benchmark,
        "load",
        lambda track, part, split: asked.append((part, split)) or load(track, part),
    )
    assert len((ROOT / "examples/benchmark_choose.py").read_text().splitlines()) <= 30
    runpy.run_path(str(ROOT / "examples/benchmark_choose.py"))
    assert asked == [(part, split) for split in benchmark.INNER for part in ("train", "validation")]
    text = capsys.readouterr().out
    assert text.count("held out") == 5 and re.search(
        r"C = 1.0: \d+\.\d % of the subtypes that did not train", text
    )


def test_the_example_of_a_network_is_a_backbone_and_its_overlay_names_it():
    spec = importlib.util.spec_from_file_location("own", ROOT / "examples/benchmark_network.py")
    own = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(own)
    import torch

    assert own.small(24)(torch.zeros(2, 3, 24, 24)).shape == (2, 64)
    config = small_benchmark.overlaid(
        [*definition.overlays("main"), str(ROOT / "examples/benchmark_network.yaml")]
    )
    assert config["data"] == definition.RUN
    assert config["recognition"]["network"]["backbone"] == "examples/benchmark_network.py:small"


def test_score_prints_intervals_and_every_baseline(small, capsys):
    test = benchmark.load("unseen", "test")
    with pytest.raises(
        InputError, match=rf"row {test.key[0]}: p_uav is -2.5, expected a number from 0 to 1"
    ):
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
    path = next(Path("results/lowalt-40-v1/noisy").glob("*.npy"))
    signals = path.read_bytes()
    last_bit = bytes([signals[-1] ^ 1])
    path.write_bytes(signals[:-1] + last_bit)
    assert main(["benchmark", "make"]) == 1
    assert f"main/noisy/{path.name} differs" in capsys.readouterr().out
    path.write_bytes(signals)


def test_make_says_what_it_costs_and_makes_the_images_that_the_tracks_use(
    small, monkeypatch, capsys, tmp_path
):
    asked = []
    monkeypatch.setattr(
        workflow, "ended", lambda options: asked.append(options.target) or {"status": 0}
    )
    monkeypatch.setattr(frozen_bytes, "compared", lambda part, folder: [])
    job = {"rule_name": "views", "s": 1, "cpu_time": 1, "max_rss": 1}
    for part in ("main", "low-snr"):
        times = Path("results", definition.run_name(part), "benchmarks")
        for name, cpu_s in (
            ("noise/seen-00000", 7),
            ("views/24/unseen-train-00000", 2.5),
            ("echo/a", "NA"),
        ):
            (times / name).parent.mkdir(parents=True, exist_ok=True)
            (times / f"{name}.jsonl").write_text(json.dumps(job | {"cpu_time": cpu_s}) + "\n")
        for pair in ("seen-train", "seen-val", "seen-test", "unseen-val", "unseen-test"):
            (times / f"views/24/{pair}-00000.jsonl").write_text(json.dumps(job) + "\n")
    monkeypatch.setattr(costs, "REFERENCE", str(tmp_path))
    costs.write("results", tmp_path)
    assert main(["benchmark", "make", "--track", "unseen", "--json"]) == 0
    assert re.search(
        "unseen: from empty 11 core-s, 0.1 min on two cores, [0-9]+ MB", capsys.readouterr().err
    )
    images = {Path(name).stem.rpartition("-")[0] for name in asked[0] if "/views/24/" in name}
    assert (
        images == {"seen-train", "seen-val", "unseen-val", "unseen-test"} and "signals" in asked[0]
    )
    assert main(["benchmark", "make", "--track", "low-snr"]) == 0
    assert "low-snr: from empty 27 core-s" in capsys.readouterr().err
    assert main(["benchmark", "make", "--track", "clutter"]) == 0
    assert "clutter: from empty cost not measured" in capsys.readouterr().err
    missing = Path("results/lowalt-40-v1/views/24")
    kept = missing.rename(tmp_path / "views")
    with pytest.raises(
        InputError, match=r"no image of .*; `lowalt benchmark make --track seen` makes them"
    ):
        _ = benchmark.load("seen", "test").images
    kept.rename(missing)


def stating(path, track, **changed):
    """A model of the zoo in a file that states the training of a track.

    changed: other entries of its identity.
    """
    content = model_file.read(ZOO)
    stated = {
        "protocol": track.protocol,
        "trained_on": statement(track.samples("train").facts),
        **changed,
    }
    identity = {**content.identity, **stated}
    model = {**content.model, "protocol": stated["protocol"]}
    model_file.write(path, replace(content, identity=identity, model=model))
    return path


def test_a_confirmed_result_follows_from_the_model_file(small, tmp_path, monkeypatch, recwarn):
    monkeypatch.setattr(confirm, "USUAL", 2)
    track = TRACKS["unseen"]
    model = stating(tmp_path / "own.safetensors", track)
    recwarn.clear()
    first = confirm.confirm(model, track)
    assert not [one for one in recwarn if issubclass(one.category, InputWarning)]
    assert first == confirm.confirm(model, track)
    assert first.samples == 4 * 4 * 2 and first.percent.value > 60
    assert first.seed == definition.root_seed(model.read_bytes() + b"lowalt-40 v1")
    # Another seed gives other motion of the same subtypes.
    rows = [
        confirm.dataset(track, seed).record(0)["motion"] for seed in (first.seed, first.seed + 1)
    ]
    assert rows[0] != rows[1]
    assert set(confirm.dataset(track, 1).plan.groups["unseen"]) == {
        "DJI Mini 4 Pro",
        "Owl",
        "NIO ET5T 2023",
        "Walking Pedestrian 5",
    }
    with pytest.raises(InputError, match="stations"):
        confirm.confirm(model, TRACKS["one-station"])
    with pytest.raises(InputError, match="cannot be confirmed"):
        confirm.confirm(model, TRACKS["forty"])


def test_a_model_that_states_another_training_than_the_track_s_is_not_confirmed(
    small, tmp_path, monkeypatch
):
    monkeypatch.setattr(confirm, "USUAL", 1)
    unseen = TRACKS["unseen"]
    few = TRACKS["few-shot-1"]
    trains = statement(unseen.samples("train").facts)
    seen = statement(TRACKS["seen"].samples("train").facts)
    wrong = {
        "the protocol 'seen', and the track unseen trains in": {"protocol": "seen"},
        "trained on DJI Mini 4 Pro, fold train, which the track unseen does not": {
            "trained_on": seen
        },
        "trained on Crow, fold test, which": {"trained_on": [*trains, ["Crow", "test", 1]]},
        "does not state trained_on": {"trained_on": []},
        "trained_on.0": {"trained_on": [["Crow", "train"]]},
    }
    for sentence, changed in wrong.items():
        model = stating(tmp_path / "own.safetensors", unseen, **changed)
        with pytest.raises(InputError, match=sentence):
            confirm.confirm(model, unseen)
    with pytest.raises(InputError, match="does not state trained_on, so nobody can tell"):
        confirm.confirm(ZOO, unseen)
    model = stating(tmp_path / "own.safetensors", few)
    assert confirm.confirm(model, few).samples == 4 * 2 * 2
    more = [
        [name, fold, 2 if name == "Owl" else count]
        for name, fold, count in statement(few.samples("train").facts)
    ]
    with pytest.raises(
        InputError, match="states 2 motion models of Owl, of which the track few-shot-1 trains on 1"
    ):
        confirm.confirm(stating(tmp_path / "own.safetensors", few, trained_on=more), few)
    with pytest.raises(InputError, match="fold train, which the track unseen does not train on"):
        confirm.confirm(model, unseen)


def test_a_training_states_what_it_trained_on(small, tmp_path):
    train = benchmark.load("unseen", "train")
    validation = benchmark.load("unseen", "validation")
    config = definition.config_of("main")
    block = config["recognition"]
    scheme = Scheme("A:VRP", (0, 1, 2), (0, 1, 2))
    kept = {key: block[key] for key in ("network", "augmentation", "size")}
    settings = scheme.settled(
        {
            **kept,
            "seed": 0,
            "classes": list(train.classes),
            "colour_map": "gray",
            "training": {**block["training"], "steps": 1, "validate_every": 1},
        }
    )
    runs.train({"train": train, "validation": validation}, scheme, "unseen", settings, tmp_path)
    confirm.refuse_other_training(
        confirm.stated_by(tmp_path / "model.safetensors"), TRACKS["unseen"], tmp_path
    )
    with pytest.raises(InputError, match="the track seen trains in the protocol 'seen'"):
        confirm.refuse_other_training(
            confirm.stated_by(tmp_path / "model.safetensors"), TRACKS["seen"], tmp_path
        )


@pytest.mark.slow
def test_a_confirmed_row_of_the_table_is_what_the_command_finds_again(capsys):
    rows = baseline_table.read()
    (row,) = [
        row for row in rows if (row["track"], row["method"]) == ("unseen", "small CNN on images")
    ]
    model = ROOT / f"results/zoo/{definition.RUN}-unseen.safetensors"
    assert row["confirmed_sha256"] == hashlib.sha256(model.read_bytes()).hexdigest()
    assert (
        main(
            [
                "benchmark",
                "confirm",
                f"{definition.RUN}-{row['track']}",
                "--track",
                row["track"],
                "--json",
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)["percent"]
    # One answer of thousands may depend on the processor's arithmetic.
    assert found == pytest.approx(
        [float(row[f"confirmed_{name}"]) for name in ("percent", "low", "high")], abs=0.1
    )


def test_frozen_features_are_those_of_each_sample_s_images_station_by_station(
    small, tmp_path, monkeypatch
):
    monkeypatch.syspath_prepend(ROOT / "studies")
    monkeypatch.syspath_prepend(ROOT / "studies/benchmark")
    from frozen import SCALE, embedded, embedded_of
    from imagenet_weights import BACKBONE, write_weights

    from lowalt.recognition.recogniser import backbone

    test = benchmark.load("unseen", "test")
    found = embedded_of(test, tmp_path).reshape(len(test), 3, -1)
    model = backbone(
        BACKBONE, str(write_weights(tmp_path / f"{BACKBONE}.pth")), SCALE * test.size
    ).eval()
    chosen = [5, 0, len(test) - 1]
    np.testing.assert_allclose(
        found[chosen], embedded(test.images[chosen], model, "viridis"), rtol=0.02, atol=0.01
    )
    assert abs(found[5] - found[0]).max() > 0.5
    assert (embedded_of(benchmark.load("one-station", "test"), tmp_path) == found[:, 0]).all()


@pytest.mark.slow
def test_the_study_trains_tests_and_writes_its_table(small, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "studies")
    monkeypatch.syspath_prepend(ROOT / "studies/benchmark")
    import kept_results
    import study

    monkeypatch.setattr(study, "OUT", tmp_path / "out")
    for method in (
        "majority class",
        "nearest centroid on moments",
        "logistic regression on features",
    ):
        for track in ("unseen", "open-set", "one-station"):
            study.one((method, track, 0), "results")
    # A call that found the network trained measured no training, so the time that the training kept
    # counts.
    (study.place("logistic regression on features", "unseen", 0) / "run.json").write_text(
        '{"train_processor_s": 1000}'
    )
    rows = study.tables(tmp_path)
    assert {row["track"] for row in rows} == {"unseen", "open-set", "one-station"} and len(
        rows
    ) == 9
    by = {(row["track"], row["method"]): row for row in rows}
    assert (
        by["unseen", "majority class"]["percent"] == 25
        and by["open-set", "majority class"]["percent"] == 50
    )
    assert by["unseen", "logistic regression on features"]["percent"] > 60
    assert by["unseen", "logistic regression on features"]["train_core_s"] == 1000
    assert by["unseen", "majority class"]["seeds"] == "none"
    with np.load(tmp_path / "unseen.npz") as kept:
        assert kept["majority class"].shape == (1, 8)
    kept_results.write_table(rows, tmp_path)
    # Where only some trainings are there, the rows of the others stay, and so does a row of more
    # seeds.
    table = {(row["track"], row["method"]): row for row in baseline_table.read(tmp_path)}
    table["unseen", "logistic regression on features"] |= {"seeds": "3", "percent": "12"}
    kept_results.write_table(
        [{**row, "percent": float(row["percent"])} for row in table.values()], tmp_path
    )
    shutil.rmtree(tmp_path / "out/majority-class")
    shutil.rmtree(study.place("nearest centroid on moments", "open-set", 0))
    again = {(row["track"], row["method"]): row for row in study.tables(tmp_path)}
    assert set(again) == set(table)
    assert again["unseen", "majority class"]["percent"] == 25
    assert again["unseen", "logistic regression on features"]["percent"] == 12
    assert again["open-set", "logistic regression on features"][
        "macro_f1_percent"
    ] == pytest.approx(by["open-set", "logistic regression on features"]["macro_f1_percent"])
    with np.load(tmp_path / "unseen.npz") as kept:
        assert len(kept.files) == 3
    with pytest.raises(InputError, match=r"would lose the rows of .*, 1 in all"):
        kept_results.write_table(list(again.values())[1:], tmp_path)
    shutil.rmtree(tmp_path / "out")
