"""The workflow of `config/methods.yaml`: which files its trainings read, and which configurations are refused."""

import os
import re
from types import SimpleNamespace

import pytest
import yaml

from configured import ROOT, Inputs, parts, run_of
from lowalt.common.config import merge
from lowalt.common.errors import InputError
from lowalt.common.yaml_files import load_yaml
from lowalt.workflow import options
from snakemake_runs import run

METHODS = {"table": "config/methods.csv", "schemes": ["signal CNN", "images voting", "RBF-SVM on features"]}


@pytest.fixture(autouse=True)
def checkout(tmp_path, monkeypatch):
    """A folder with a finished default run, as far as another run looks at it."""
    (tmp_path / "config").symlink_to(ROOT / "config")
    (tmp_path / "results/default").mkdir(parents=True)
    (tmp_path / "results/default/config.yaml").write_text(yaml.safe_dump(load_yaml(ROOT / "config/default.yaml")))
    monkeypatch.chdir(tmp_path)


def test_every_row_of_the_methods_is_trained_in_both_protocols_or_timed():
    run = run_of(load_yaml("config/methods.yaml"))
    assert len(run.trainings) == 11 * 2 * 3 and len(run.schemes) == 15
    assert {run.schemes[name].sees for name in run.schemes} == {"images", "signals", "features"}
    assert run.image_sizes == [24] and run.asked.sees == "images"


def test_the_run_of_uavs_and_birds_has_two_classes_and_the_default_s_rows_and_groups():
    run, whole = run_of(load_yaml("config/uav-bird.yaml")), run_of()
    assert run.classes == ("UAV", "Bird") and len(run.records) == 20
    assert {name: item["published"] for name, item in run.records.items()} == {
        name: whole.records[name]["published"] for name in run.records
    }


def test_a_training_reads_what_its_method_sees_from_the_data_set_s_own_run():
    _, products, _ = parts({"run": "mine", "data": "default", "recognition": METHODS})
    found = {
        scheme: products.samples(SimpleNamespace(run="mine", scheme=scheme))
        for scheme in ("signal-cnn", "images-voting", "rbf-svm-on-features")
    }
    assert [list(files) for files in found.values()] == [["signals"], ["views"], ["signals"]]
    assert found["signal-cnn"]["signals"][0].startswith("results/default/slow_time/seen-train-")
    assert options.samples(None, Inputs(signals="a b")) == "--signals a b"
    assert products.own_views(None)[0].startswith("results/mine/views/24/")
    # A run on another's data has no table of echoes at a tolerance; only a classical model is timed as trained.
    assert products.fidelity(None) == [] and options.fidelity(None, Inputs(fidelity=[])) == ""
    assert products.timed_model(SimpleNamespace(run="mine", scheme="signal-cnn")) == []
    (model,) = products.timed_model(SimpleNamespace(run="mine", scheme="rbf-svm-on-features"))
    assert model == "results/mine/models/unseen/rbf-svm-on-features/0/model.pt"
    assert options.timed_model(None, Inputs(model=model)) == f"--model {model}"


def test_signals_come_from_the_noise_stage_where_shards_hold_images():
    job = SimpleNamespace(run="default", group="seen", part="00001", fold="train")
    _, products, settings = parts({"recognition": METHODS})
    assert products.noisy_chunk(job)["noisy"] == "results/default/noisy/seen-00001.npy"
    assert options.noisy_chunk(job, Inputs(products.noisy_chunk(job))).startswith("--noisy results/default/noisy/")
    assert "inf" in settings.slow_time(job)
    _, products, _ = parts({"recognition": METHODS, "shards": {"kind": "signal"}, "tiles": {"reduced": []}})
    assert products.noisy_chunk(job) == {} and options.noisy_chunk(job, Inputs()) == ""


HEIGHT = {"table": "config/track.csv", "schemes": ["A:VRP+TRP+VT with height"]}


def test_tracks_are_read_by_schemes_with_the_cue_alone_from_the_data_set_s_own_run():
    run, products, _ = parts(load_yaml("config/track.yaml"))
    assert len(run.trainings) == 2 * 2 * 3 and run.data == "default"
    job = SimpleNamespace(run="track", scheme="a-vrp-trp-vt-with-height", protocol="seen", train_seed="0")
    found = products.training_samples(job)
    assert list(found) == ["views", "tracks"] and len(found["tracks"]) == len(run.plan.shards)
    assert found["tracks"][0] == "results/default/tracks/seen-train-00000.npz"
    assert options.samples(None, Inputs(views="a", tracks="b c")) == "--views a --tracks b c"
    _, products, _ = parts({"recognition": HEIGHT | {"cache": False}})
    assert list(products.samples(job)) == ["index", "tracks"]
    assert options.samples(None, Inputs(index="a", tracks="b c")) == "--index a --tracks b c"
    _, products, _ = parts()
    assert list(products.samples(SimpleNamespace(run="default", scheme="a-vrp-trp-vt"))) == ["views"]
    assert products.tracks(None)[0] == "results/default/tracks/seen-train-00000.npz"
    with pytest.raises(InputError, match="expected one without cues to ask about effects"):
        _ = run.asked


@pytest.mark.workflow
@pytest.mark.slow
def test_a_dry_run_makes_tracks_for_schemes_with_the_cue_alone(tmp_path):
    pytest.importorskip("snakemake")
    for name in ("workflow", "profiles", "src", "envs", "Snakefile"):
        (tmp_path / name).symlink_to(ROOT / name)
    rows = "plain,A,VRP,attention,,seen,\nwith height,A,VRP,attention,,seen,height\n"
    (tmp_path / "schemes.csv").write_text("scheme,stations,spectra,fusion,backbone,protocols,cues\n" + rows)
    block = {"table": "schemes.csv", "schemes": ["plain", "with height"], "protocols": ["seen"]}
    overlay = {"run": "mine", "targets": {"select": ["DJI Mini 2", "Crow"]}, "recognition": block}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(overlay))
    line = ["--dry-run", "--cores", "1", "--configfile", "mine.yaml", "--", "models"]
    environment = {name: value for name, value in os.environ.items() if name != "LOWALT_INPUTS"}
    status, text = run(tmp_path, line, environment | {"PYTHONPATH": str(ROOT / "src")})
    assert status == 0, text[-3000:]
    jobs = {re.search(r"scheme=([a-z-]+)", job)[1]: job for job in re.findall(r"rule train:\n(?: .+\n)+", text)}
    assert {name: "results/mine/tracks/" in job for name, job in jobs.items()} == {"plain": False, "with-height": True}
    assert "rule track:" in text


@pytest.mark.parametrize(
    ("overlay", "key"),
    [({"recognition": {"cache": False, "input": "dataset"}}, "input"), ({"effects": {"clutter": {}}}, "effects"),
     ({"recognition": {"training": {"stream": 0.5}}}, "training.stream"), ({"recognition": {"extra": ["x"]}}, "extra"),
     ({"recognition": {"timed": HEIGHT["schemes"]}}, "timed"),
     ({"network": {"stations": {"AB": {"transmit": "A", "receive": "B"}}}}, "links")],
)  # fmt: skip
def test_heights_that_nobody_measures_are_refused_by_name(overlay, key):
    with pytest.raises(InputError, match=f"with height' has the cue 'height' and {key} is .*, expected no {key}"):
        run_of(merge({"recognition": HEIGHT}, overlay))


@pytest.mark.parametrize(
    ("overlay", "words"),
    [({"recognition": {"cache": False}}, "sees signals, expected cache: true"),
     ({"network": {"symbols": 384}}, "size 400, expected the 384 symbols")],
)  # fmt: skip
def test_schemes_on_signals_that_cannot_be_read_are_refused_by_name(overlay, words):
    with pytest.raises(InputError, match=words):
        run_of(merge({"recognition": METHODS}, overlay))
