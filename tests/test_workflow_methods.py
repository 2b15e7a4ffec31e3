"""The workflow of `config/methods.yaml`: which files its trainings read, and which configurations are refused."""

import os
import re
from pathlib import Path
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
    assert len(run.trainings) == 12 * 2 * 3 and len(run.schemes) == 16
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
    assert options.samples(None, Inputs(signals=["a", "b"])) == ["--signals", "a", "b"]
    assert products.own_views(None)[0].startswith("results/mine/views/24/")
    # A run on another's data has no table of echoes at a tolerance; only a classical model is timed as trained.
    assert products.fidelity(None) == [] and options.fidelity(None, Inputs(fidelity=[])) == []
    assert products.timed_model(SimpleNamespace(run="mine", scheme="signal-cnn")) == []
    (model,) = products.timed_model(SimpleNamespace(run="mine", scheme="rbf-svm-on-features"))
    assert model == "results/mine/models/unseen/rbf-svm-on-features/0/model.pt"
    assert options.timed_model(None, Inputs(model=model)) == ["--model", model]


def test_signals_come_from_the_noise_stage_where_shards_hold_images():
    job = SimpleNamespace(run="default", group="seen", part="00001", fold="train")
    _, products, settings = parts({"recognition": METHODS})
    assert products.noisy_chunk(job)["noisy"] == "results/default/noisy/seen-00001.npy"
    assert options.noisy_chunk(job, Inputs(products.noisy_chunk(job)))[0] == "--noisy"
    assert "inf" in settings.slow_time(job)
    _, products, _ = parts({"recognition": METHODS, "shards": {"kind": "signal"}, "tiles": {"reduced": []}})
    assert products.noisy_chunk(job) == {} and options.noisy_chunk(job, Inputs()) == []


HEIGHT = {"table": "config/track.csv", "schemes": ["A:VRP+TRP+VT with height"]}


def test_tracks_are_read_by_schemes_with_the_cue_alone_from_the_data_set_s_own_run():
    run, products, _ = parts(load_yaml("config/track.yaml"))
    assert len(run.trainings) == 2 * 2 * 3 and run.data == "default"
    job = SimpleNamespace(run="track", scheme="a-vrp-trp-vt-with-height", protocol="seen", train_seed="0")
    found = products.training_samples(job)
    assert list(found) == ["views", "tracks"] and len(found["tracks"]) == len(run.plan.shards)
    assert found["tracks"][0] == "results/default/tracks/seen-train-00000.npz"
    assert options.samples(None, Inputs(views="a", tracks=["b", "c"])) == ["--views", "a", "--tracks", "b", "c"]
    _, products, _ = parts({"recognition": HEIGHT | {"cache": False}})
    assert list(products.samples(job)) == ["index", "tracks"]
    assert options.samples(None, Inputs(index="a", tracks=["b", "c"])) == ["--index", "a", "--tracks", "b", "c"]
    _, products, _ = parts()
    assert list(products.samples(SimpleNamespace(run="default", scheme="a-vrp-trp-vt"))) == ["views"]
    assert products.tracks(None)[0] == "results/default/tracks/seen-train-00000.npz"
    with pytest.raises(InputError, match="expected one without cues to ask about effects"):
        _ = run.asked


def finished_invented(*kinds):
    """A finished run of invented sizes in the working folder, as far as another run sees it: two shards to train on.

    kinds: folders with a file for each of these shards.
    """
    folder = Path("results/invented")
    (folder / "shards").mkdir(parents=True)
    made = merge(load_yaml(ROOT / "config/default.yaml"), load_yaml(ROOT / "config/invented.yaml"))
    (folder / "config.yaml").write_text(yaml.safe_dump(made))
    for shard in ("seen-train-00000", "seen-train-00001", "seen-val-00000"):
        (folder / f"shards/{shard}.tar").touch()
    for kind in kinds:
        (folder / kind).mkdir(parents=True)
        for part in (0, 1):
            (folder / f"{kind}/seen-train-0000{part}.npz").touch()
    return folder


@pytest.mark.parametrize(("overlay", "data"), [([], "default"), (["config/track-invented-confirm.yaml"], "confirm")])
def test_heights_of_another_run_come_from_its_own_tracks_shard_by_shard(overlay, data):
    folder = finished_invented()
    config = merge(load_yaml("config/default.yaml"), load_yaml("config/track-invented.yaml"))
    if overlay:
        config = merge(config, load_yaml(overlay[0]))
        made = merge(load_yaml("config/default.yaml"), load_yaml("config/confirm.yaml"))
        Path("results/confirm").mkdir()
        Path("results/confirm/config.yaml").write_text(yaml.safe_dump(made))
    run, products, _ = parts(config)
    assert run.data == data and len(run.trainings) == 2 * 2 * 3
    job = SimpleNamespace(run=run.name, scheme="abc-vrp-trp-vt-with-height", protocol="unseen", train_seed="0")
    for kind, target in (("views/24", "training_samples"), ("tracks", "tracks")):
        words = f"no results/invented/{kind}/seen-train-00000.npz; expected what the target `{target}` makes in the run"
        with pytest.raises(InputError, match=words):
            products.training_samples(job)
        (folder / kind).mkdir(parents=True)
        for shard in ("seen-train-00000", "seen-train-00001", "seen-val-00000"):
            (folder / f"{kind}/{shard}.npz").touch()
    found = products.training_samples(job)
    assert list(found) == ["views", "tracks", "extra", "extra_tracks"]
    assert found["tracks"][0] == f"results/{data}/tracks/seen-train-00000.npz"
    for key, kind in (("extra", "views/24"), ("extra_tracks", "tracks")):
        assert found[key] == [f"results/invented/{kind}/seen-train-0000{part}.npz" for part in (0, 1)]
    assert list(products.samples(job)) == ["views", "tracks"]
    assert products.frozen(job)[1] == "results/invented/SHA256SUMS"
    more = {"extra": ["a"], "extra_tracks": ["c", "d"]}
    assert options.extra(None, Inputs(more)) == ["--extra", "a", "--extra-tracks", "c", "d"]


@pytest.mark.parametrize("name", ["invented", "track-invented", "methods"])
def test_a_target_on_the_default_s_data_first_makes_all_that_its_run_reads_there(name):
    """Clouds, motion, shards and benchmarks come with every data set; all else must be asked for by name."""
    finished_invented("views/24", "tracks")
    recipe = re.search(rf"^{name}:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)[1]
    asked = re.search(r" -- (.+)", recipe)[1].split()
    config = re.findall(r"--configfile (\S+)", recipe)[-1]
    _, default, _ = parts()
    made = {
        "prepared": default.prepared(None), "tracks": default.tracks(None), "slow_times": default.slow_times(None),
        "training_samples": [*default.own_views(None), "results/default/SHA256SUMS", "results/default/config.yaml"],
        "data": default.data(None),
    }  # fmt: skip
    run, products, _ = parts(load_yaml(config))
    jobs = [
        SimpleNamespace(run=run.name, scheme=scheme.slug, protocol="seen", train_seed="0") for scheme in run.trained
    ]
    read = [products.report(jobs[0]), *({**products.training_samples(job), "": products.frozen(job)} for job in jobs)]
    paths = {
        path for files in read for given in files.values() for path in ([given] if isinstance(given, str) else given)
    }
    always = ("benchmarks", "clouds", "motion", "shards")
    wanted = {path for path in paths if path.startswith("results/default/") and path.split("/")[2] not in always}
    assert run.data == "default" and "results/default/distances.csv" in wanted
    assert wanted <= {path for target in asked for path in made[target]}


def test_signals_of_another_run_come_from_its_own_slow_times():
    folder = finished_invented()
    block = METHODS | {"extra": ["invented"]}
    _, products, _ = parts({"run": "mine", "data": "default", "recognition": block})
    job = SimpleNamespace(run="mine", scheme="signal-cnn", protocol="unseen", train_seed="0")
    with pytest.raises(InputError, match=r"no results/invented/slow_time/.* what the target `slow_times` makes"):
        products.training_samples(job)
    (folder / "slow_time").mkdir()
    for part in (0, 1):
        (folder / f"slow_time/seen-train-0000{part}.npz").touch()
    found = products.training_samples(job)
    assert list(found) == ["signals", "extra"]
    assert found["extra"] == [f"results/invented/slow_time/seen-train-0000{part}.npz" for part in (0, 1)]


def dry_run(folder, block, target):
    """What is printed for a target of a run `mine` of two subtypes with this block `recognition`, with its commands."""
    pytest.importorskip("snakemake")
    for name in ("workflow", "profiles", "src", "envs", "Snakefile"):
        (folder / name).symlink_to(ROOT / name)
    overlay = {"run": "mine", "targets": {"select": ["DJI Mini 2", "Crow"]}, "recognition": block}
    (folder / "mine.yaml").write_text(yaml.safe_dump(overlay))
    line = ["--dry-run", "--printshellcmds", "--cores", "1", "--configfile", "mine.yaml", "--", target]
    environment = {name: value for name, value in os.environ.items() if name != "LOWALT_INPUTS"}
    status, text = run(folder, line, environment | {"PYTHONPATH": str(ROOT / "src")})
    assert status == 0, text[-3000:]
    return text


@pytest.mark.workflow
@pytest.mark.slow
def test_a_dry_run_makes_tracks_for_schemes_with_the_cue_alone(tmp_path):
    rows = "plain,A,VRP,attention,,seen,\nwith height,A,VRP,attention,,seen,height\n"
    (tmp_path / "schemes.csv").write_text("scheme,stations,spectra,fusion,backbone,protocols,cues\n" + rows)
    block = {"table": "schemes.csv", "schemes": ["plain", "with height"], "protocols": ["seen"]}
    text = dry_run(tmp_path, block, "models")
    jobs = {re.search(r"scheme=([a-z-]+)", job)[1]: job for job in re.findall(r"rule train:\n(?: .+\n)+", text)}
    assert {name: "results/mine/tracks/" in job for name, job in jobs.items()} == {"plain": False, "with-height": True}
    assert "rule track:" in text


@pytest.mark.workflow
@pytest.mark.slow
def test_a_dry_run_trains_with_the_heights_of_another_run_and_evaluates_without(tmp_path):
    folder = finished_invented("views/24", "tracks")
    (folder / "SHA256SUMS").touch()
    block = HEIGHT | {"extra": ["invented"], "protocols": ["unseen"], "seeds": [0, 1]}
    text = dry_run(tmp_path, block, "results/mine/accuracy.csv")
    caches, heights = (" ".join(f"results/invented/{kind}/seen-train-0000{part}.npz" for part in (0, 1))
                       for kind in ("views/24", "tracks"))  # fmt: skip
    asked = ("train", "evaluate")
    trained, evaluated = (re.findall(rf"python -m +lowalt.recognition {name} .+", text) for name in asked)
    assert len(trained) == len(evaluated) == 2
    assert text.count("rule track:") == len(set(re.findall(r"results/mine/tracks/[a-z]\S+npz", text)))
    for line in trained:
        assert " --tracks results/mine/tracks/seen-train-00000.npz " in line
        assert f" --extra {caches} --extra-tracks {heights} " in line
        assert " --frozen results/mine/SHA256SUMS results/invented/SHA256SUMS " in line
    assert all(" --tracks results/mine/tracks/" in line and "invented" not in line for line in evaluated)


@pytest.mark.parametrize(
    ("overlay", "key"),
    [({"recognition": {"cache": False, "input": "dataset"}}, "input"), ({"effects": {"clutter": {}}}, "effects"),
     ({"recognition": {"training": {"stream": 0.5}}}, "training.stream"),
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
