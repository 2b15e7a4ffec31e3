"""The workflow's logic without Snakemake: names and files that follow from a configuration."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from configured import parts
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow import options

ROOT = Path(__file__).parents[2]
CHUNK = SimpleNamespace(run="default", group="seen", part="00001", station="B", fold="train")


def test_the_chunks_with_the_first_motion_models_tell_of_every_subtype():
    _, products, _ = parts()
    assert products.first_motion(CHUNK) == [
        f"results/default/motion/{group}-00000.csv" for group in ("seen", "unseen")
    ]


def test_samples_made_on_the_spot_need_clouds_and_surfaces_only_where_points_are_hidden():
    made = {"cache": False, "input": "dataset"}
    wildcards = SimpleNamespace(scheme="a-vrp-trp-vt")
    for effects in ({}, {"occlusion": {}}):
        run, products, _ = parts({"recognition": made, "effects": effects})
        paths = {
            name: [f"results/default/{folder}/{subtype}.npz" for subtype in run.subtypes]
            for name, folder in (("clouds", "clouds"), ("surfaces", "occluders"))[
                : 1 + len(effects)
            ]
        }
        assert products.samples(wildcards) == {"dataset": "results/default/config.yaml", **paths}


def test_a_job_reads_the_files_of_its_own_chunk_in_the_order_of_the_stations():
    run, products, _ = parts(
        {"network": {"stations": {"D": {"position_m": [0, 9, 25], "normal_deg": 0}}}}
    )
    base = "results/default"
    assert products.chunk_echoes(CHUNK) == [f"{base}/echo/seen-00001/{name}.npy" for name in "ABCD"]
    assert (
        products.listening(CHUNK) == ["B"]
        and parts({"echo": {"job": "chunk"}})[1].listening(CHUNK) == run.stations[:3]
    )
    assert products.span(CHUNK) == ["--first", "50", "--count", "50"]
    content = {"signals": f"{base}/noisy/seen-00001.npy", "tiles": f"{base}/tiles/seen-00001.npz"}
    assert products.shard_content(CHUNK) == content
    assert options.content(None, content) == [
        "--signals",
        content["signals"],
        "--tiles",
        content["tiles"],
    ]
    clouds = products.chunk_clouds(CHUNK)
    assert len(clouds) == len(run.plan.groups["seen"]) and len(set(clouds)) == len(clouds)
    assert all(Path(path).stem in run.subtypes for path in clouds)


def test_what_is_prepared_is_all_that_trainings_and_the_page_wait_for():
    run, products, _ = parts()
    prepared = set(products.prepared(CHUNK))
    samples = [products.samples(SimpleNamespace(scheme=scheme)) for scheme in run.schemes_by_slug]
    trained = {name for read in samples for name in read["views"]}
    assert trained | {"results/default/SHA256SUMS"} <= prepared
    page = products.report(CHUNK)
    assert page["distances"] in prepared
    # Times are not measured while packages are fetched.
    assert not {
        name for name in prepared if "/models/" in name or "/predictions/" in name or "cost" in name
    }
    _, without, _ = parts({"recognition": {"cache": False}})
    assert not {name for name in without.prepared(CHUNK) if "/views/" in name}


def test_stages_before_the_first_training_and_tables_do_without_torch():
    """In a process of its own: torch is not to be found there, as while `make` is still fetching
    it.
    """
    stages = [
        "targets",
        "targets.gallery",
        "motion",
        "echo",
        "noise",
        "tiles",
        "shards",
        "shards.card",
        "recognition",
    ]
    stages += [
        "recognition.views",
        "recognition.freeze",
        "recognition.distances",
        "measure.echo_cost",
    ]
    stages += ["report.figures.cost_plots", "config.layers", "workflow.run"]
    stages += [
        f"recognition.{name}"
        for name in ("sample_sources", "evaluated", "tables", "score", "augment")
    ]
    program = "import sys; sys.modules['torch'] = sys.modules['timm'] = None; import importlib as i"
    program += f"; [i.import_module('lowalt.' + name) for name in {stages}]"
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


def test_signal_shards_need_no_tiles_and_only_hidden_points_need_surfaces():
    _, products, _ = parts(
        {"shards": {"kind": "signal"}, "effects": {"occlusion": {}}, "echo": {"tolerance": 1e-3}}
    )
    assert products.shard_content(CHUNK) == {"signals": "results/default/noisy/seen-00001.npy"}
    surfaces = products.chunk_occluders(CHUNK)
    assert [path.replace("occluders", "clouds") for path in surfaces] == products.chunk_clouds(
        CHUNK
    )
    assert [Path(path).name for path in products.chunk_powers(CHUNK)] == [
        "A.power.npy",
        "B.power.npy",
        "C.power.npy",
    ]
    _, usual, _ = parts()
    assert usual.chunk_occluders(CHUNK) == usual.chunk_powers(CHUNK) == []


def test_recipe_shards_need_clean_echoes_and_neither_noise_nor_tiles():
    _, products, _ = parts(
        {"shards": {"kind": "recipe"}, "effects": {"occlusion": {}}, "echo": {"tolerance": 1e-3}}
    )
    stem = "results/default/echo/seen-00001"
    content = {
        "echoes": [f"{stem}/{name}.npy" for name in "ABC"],
        "powers": [f"{stem}/{n}.power.npy" for n in "ABC"],
    }
    assert products.shard_content(CHUNK) == content
    assert products.reduced(SimpleNamespace(size="24")) == {}
    made = {Path(path).parent.name for path in products.benchmarks(CHUNK)}
    assert "shard" in made and not made & {"noise", "tiles"}
    _, usual, _ = parts({"shards": {"kind": "recipe"}})
    assert usual.shard_content(CHUNK)["powers"] == []


@pytest.mark.parametrize(
    ("kind", "cache", "job"),
    [("image", True, "chunk"), ("signal", True, "station"), ("recipe", False, "station")],
)
def test_times_are_told_of_the_stages_that_a_run_of_this_kind_has(kind, cache, job):
    run, products, _ = parts(
        {"shards": {"kind": kind}, "recognition": {"cache": cache}, "echo": {"job": job}}
    )
    made = [
        Path(path).relative_to("results/default/benchmarks").parts[0]
        for path in products.benchmarks(CHUNK)
    ]
    stages = [
        "cloud",
        "motion",
        "echo",
        "noise",
        "tiles",
        "shard",
        "index.jsonl",
        "views",
        "train",
        "evaluate",
        "distances.jsonl",
        "tables.jsonl",
    ]
    without = {"image": set(), "signal": {"tiles"}, "recipe": {"noise", "tiles", "views"}}[kind]
    assert list(dict.fromkeys(made)) == [stage for stage in stages if stage not in without]
    assert made.count("shard") == len(run.plan.shards)
    assert made.count("echo") == {"station": 3, "chunk": 1}[job] * len(run.plan.sources)


def test_an_own_backbone_is_read_by_its_training():
    job = SimpleNamespace(run="default", scheme="abc-vrp-trp-vt", train_seed="0")
    _, products, _ = parts()
    assert list(products.training_samples(job)) == ["views"]
    _, products, _ = parts({"recognition": {"network": {"backbone": "docs/notebooks.py:made"}}})
    assert products.training_samples(job)["backbone"] == "docs/notebooks.py"


def test_views_come_from_the_tiles_stage_at_its_sizes_alone_and_never_for_signals():
    _, products, texts = parts({"tiles": {"reduced": [24, 32]}})
    for size, made in ((24, True), (32, True), (48, False)):
        job = SimpleNamespace(run="default", group="seen", part="00001", size=str(size))
        files = (
            {"reduced": f"reduced/{size}/seen-00001.npy", "motion": "motion/seen-00001.csv"}
            if made
            else {}
        )
        assert products.reduced(job) == {
            name: f"results/default/{path}" for name, path in files.items()
        }
        assert ("snr_db" in json.loads(texts.views(job))) == made
    _, products, texts = parts({"shards": {"kind": "signal"}})
    assert products.reduced(SimpleNamespace(size="24")) == {}
    output = SimpleNamespace(reduced=["results/default/reduced/24/seen-00001.npy"])
    assert options.reduced(None, output) == [
        "--reduced",
        "24=results/default/reduced/24/seen-00001.npy",
    ]
    assert options.reduced(None, SimpleNamespace(reduced=[])) == []


def test_training_reads_images_of_the_scheme_s_own_size():
    run, products, _ = parts(
        {
            "recognition": {
                "table": "config/cost/accuracy.csv",
                "schemes": ["ABC:VRP+TRP+VT", "48 pixels"],
            }
        }
    )
    for scheme, size in (("abc-vrp-trp-vt", 24), ("48-pixels", 48)):
        views = products.samples(SimpleNamespace(scheme=scheme))["views"]
        assert views == [f"results/default/views/{size}/{shard}.npz" for shard in run.plan.shards]
    _, uncached, _ = parts({"recognition": {"cache": False}})
    assert uncached.samples(SimpleNamespace(scheme="abc-vrp-trp-vt")) == {
        "index": "results/default/shards/index.json"
    }


def test_a_run_on_another_s_data_reads_there(tmp_path, monkeypatch):
    overlay = {"run": "mine", "data": "default", "recognition": {"training": {"steps": 9}}}
    made = tmp_path / "results/default/config.yaml"
    (made.parent / "views").mkdir(parents=True)
    (made.parent / "SHA256SUMS").touch()
    (tmp_path / "config").symlink_to(ROOT / "config")
    monkeypatch.chdir(tmp_path)
    made.write_text(yaml.safe_dump(load_yaml("config/default.yaml")))
    run, products, _ = parts(overlay)
    job = SimpleNamespace(run="mine", scheme="abc-vrp-trp-vt")
    assert products.samples(job)["views"][0].startswith("results/default/views/24/")
    folders = {
        Path(name).parts[1]
        for name in products.benchmarks(job)
        if "/train/" in name or "/evaluate/" in name
    }
    assert folders == {"mine"} and run.data == "default"
    assert products.prepared(job) == []


def test_predictions_of_a_study_are_named_with_its_command_where_they_are_missing(
    tmp_path, monkeypatch
):
    _, products, _ = parts({"recognition": {"seeds": [0, 4]}})
    monkeypatch.chdir(tmp_path)
    folder = Path("results/default-heights-invented/predictions/unseen/abc-vrp-trp-vt-with-height")
    with pytest.raises(
        InputError, match=rf"no {folder}/0\.csv: `make study NAME=heights` makes it first"
    ):
        products.studied(CHUNK)
    folder.mkdir(parents=True)
    for seed in (0, 4):
        (folder / f"{seed}.csv").touch()
    assert products.studied(CHUNK) == [f"{folder}/{seed}.csv" for seed in (0, 4)]
