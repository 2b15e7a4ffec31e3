"""Names and files that follow from a configuration: those of stages, and those of planned jobs."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from configured import stages_of
from lowalt.config.layers import merge
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from planned_jobs import FEW, job_of, place, planned

ROOT = Path(__file__).parents[2]
CHUNK = SimpleNamespace(run="default", group="seen", part="00001", station="B", fold="train")
BASE = "results/default"


@pytest.fixture
def folder(tmp_path):
    """A folder in which jobs can be planned."""
    return place(tmp_path)


def test_the_chunks_with_the_first_motion_models_tell_of_every_subtype():
    assert stages_of().recognition.first_chunks == ["seen-00000", "unseen-00000"]


def test_samples_made_on_the_spot_need_clouds_and_surfaces_only_where_points_are_hidden():
    made = {"cache": False, "input": "dataset"}
    wildcards = SimpleNamespace(scheme="a-vrp-trp-vt")
    for effects in ({}, {"occlusion": {}}):
        stages = stages_of({"recognition": made, "effects": effects})
        subtypes = stages.run.subtypes
        files = {
            "dataset": f"{BASE}/config.yaml",
            "clouds": [f"{BASE}/clouds/{subtype}.npz" for subtype in subtypes],
        }
        if effects:
            files["occluders"] = [f"{BASE}/occluders/{subtype}.npz" for subtype in subtypes]
        assert stages.recognition.samples(wildcards) == files


def first_shard(overlay):
    """The first shard of the chunk, whose fold may be packed into several."""
    shards = stages_of(merge(FEW, overlay)).run.plan.shards
    return next(name for name in shards if name.startswith("seen-train-00001"))


@pytest.mark.workflow
def test_a_job_reads_the_files_of_its_own_chunk_in_the_order_of_the_stations(folder):
    overlay = {"network": {"stations": {"D": {"position_m": [0, 9, 25], "normal_deg": 0}}}}
    jobs = planned(folder, overlay, f"{BASE}/shards/{first_shard(overlay)}.tar")
    chunk = {"group": "seen", "part": "00001"}
    noise = job_of(jobs, "noise", **chunk)
    assert noise.inputs["echoes"] == [f"{BASE}/echo/seen-00001/{name}.npy" for name in "ABCD"]
    assert noise.inputs["powers"] == []
    # Reading a file of another chunk would need that chunk's jobs.
    assert {job.wildcards.get("part", "00001") for job in jobs} == {"00001"}
    assert {job.wildcards.get("group", "seen") for job in jobs} == {"seen"}
    assert job_of(jobs, "echo", station="B", **chunk).params["stations"] == ["B"]
    motion = job_of(jobs, "motion", **chunk)
    assert motion.params["span"] == ["--first", "50", "--count", "50"]
    stages = stages_of(FEW)
    clouds = [f"{BASE}/clouds/{subtype}.npz" for subtype in stages.motion.subtypes(CHUNK)]
    assert motion.inputs["clouds"] == clouds and len({*clouds}) == len(clouds)
    assert len(clouds) == len(stages.run.plan.groups["seen"])
    shard = job_of(jobs, "shard", **chunk)
    assert shard.params["content"] == [
        "--signals",
        f"{BASE}/noisy/seen-00001.npy",
        "--tiles",
        f"{BASE}/tiles/seen-00001.npz",
    ]
    together = stages_of({"echo": {"job": "chunk"}})
    assert together.echo.stations(CHUNK) == together.run.stations


@pytest.mark.workflow
def test_what_is_prepared_is_all_that_trainings_and_the_page_wait_for(folder):
    jobs = planned(folder, {"recognition": {"seeds": [4]}}, "prepared", f"{BASE}/report.html")
    prepared = {*job_of(jobs, "prepared").files}
    trained = set()
    for job in jobs:
        if job.rule == "train":
            trained |= {*job.inputs["views"], *job.inputs["frozen"]}
            assert json.loads(job.params["settings"])["seed"] == 4
    assert len(trained) > 10 and trained <= prepared
    assert {*job_of(jobs, "report").inputs["distances"]} <= prepared
    # Times are not measured while packages are fetched.
    later = ("/models/", "/predictions/", "cost")
    assert not [name for name in prepared if any(word in name for word in later)]
    without = job_of(planned(folder, {"recognition": {"cache": False}}, "prepared"), "prepared")
    assert without.files and not [name for name in without.files if "/views/" in name]


HIDDEN = {"effects": {"occlusion": {}}, "echo": {"tolerance": 1e-3}}
"""A scene in which surfaces hide points."""
POWERS = ["A.power.npy", "B.power.npy", "C.power.npy"]


def shard_jobs(folder, overlay):
    """The jobs of one shard of an overlay, and the one that packs it."""
    jobs = planned(folder, overlay, f"{BASE}/shards/{first_shard(overlay)}.tar")
    return jobs, job_of(jobs, "shard")


@pytest.mark.workflow
def test_signal_shards_need_no_tiles_and_only_hidden_points_need_surfaces(folder):
    jobs, shard = shard_jobs(folder, HIDDEN | {"shards": {"kind": "signal"}})
    assert shard.params["content"] == ["--signals", f"{BASE}/noisy/seen-00001.npy"]
    assert "tiles" not in {job.rule for job in jobs}
    echo = job_of(jobs, "echo_in_scene", station="B")
    surfaces = echo.inputs["occluders"]
    assert [path.replace("occluders", "clouds") for path in surfaces] == echo.inputs["clouds"]
    powers = job_of(jobs, "noise").inputs["powers"]
    assert [Path(path).name for path in powers] == POWERS
    jobs, _ = shard_jobs(folder, {})
    assert {job.rule for job in jobs} & {"occluders", "echo_in_scene"} == set()
    assert job_of(jobs, "noise").inputs["powers"] == []


@pytest.mark.workflow
def test_recipe_shards_need_clean_echoes_and_neither_noise_nor_tiles(folder):
    recipe = {"shards": {"kind": "recipe"}, "recognition": {"cache": False}}
    jobs, shard = shard_jobs(folder, HIDDEN | recipe)
    assert {job.rule for job in jobs} & {"noise", "tiles"} == set()
    stem = f"{BASE}/echo/seen-00001"
    assert shard.inputs["echoes"] == [f"{stem}/{name}.npy" for name in "ABC"]
    assert shard.inputs["powers"] == [f"{stem}/{name}" for name in POWERS]
    assert shard.params["content"] == [
        "--echoes",
        *shard.inputs["echoes"],
        "--powers",
        *shard.inputs["powers"],
    ]
    _, shard = shard_jobs(folder, recipe)
    assert shard.inputs["powers"] == [] and len(shard.inputs["echoes"]) == 3


@pytest.mark.parametrize(
    ("kind", "cache", "job"),
    [("image", True, "chunk"), ("signal", True, "station"), ("recipe", False, "station")],
)
def test_times_are_told_of_the_stages_that_a_run_of_this_kind_has(kind, cache, job):
    stages = stages_of(
        {"shards": {"kind": kind}, "recognition": {"cache": cache}, "echo": {"job": job}}
    )
    plan = stages.run.plan
    made = []
    for path in stages.page.files(CHUNK)["benchmarks"]:
        made.append(Path(path).relative_to(f"{BASE}/benchmarks").parts[0])
    rules = [
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
    assert list(dict.fromkeys(made)) == [rule for rule in rules if rule not in without]
    assert made.count("shard") == len(plan.shards)
    assert made.count("echo") == {"station": 3, "chunk": 1}[job] * len(plan.sources)


def test_an_own_backbone_is_read_by_its_training():
    job = SimpleNamespace(run="default", scheme="abc-vrp-trp-vt", train_seed="0")
    assert stages_of().recognition.backbone_file(job) == []
    own = {"recognition": {"network": {"backbone": "docs/notebooks.py:made"}}}
    assert stages_of(own).recognition.backbone_file(job) == ["docs/notebooks.py"]


@pytest.mark.workflow
def test_views_come_from_the_tiles_stage_at_its_sizes_alone_and_never_for_signals(folder):
    def views_of(overlay, *sizes):
        """The jobs that make views of these sizes."""
        shard = first_shard(overlay)
        paths = [f"{BASE}/views/{size}/{shard}.npz" for size in sizes]
        jobs = planned(folder, overlay, *paths)
        return [job_of(jobs, "views", size=str(size)) for size in sizes]

    *from_tiles, other_size = views_of({"tiles": {"reduced": [24, 32]}}, 24, 32, 48)
    for size, job in zip((24, 32), from_tiles, strict=True):
        images = f"{BASE}/reduced/{size}/seen-00001.npy"
        motion = f"{BASE}/motion/seen-00001.csv"
        assert job.params["reduced"] == ["--reduced", images, "--motion", motion]
        assert "snr_db" in json.loads(job.params["settings"])
    (of_signals,) = views_of({"shards": {"kind": "signal"}}, 24)
    for job in (other_size, of_signals):
        assert job.params["reduced"] == [] and not job.inputs["reduced"]
        assert "snr_db" not in json.loads(job.params["settings"])


def test_the_option_of_reduced_images_names_their_sizes():
    tiles = stages_of().tiles
    path = f"{BASE}/reduced/24/seen-00001.npy"
    output = SimpleNamespace(reduced=[path])
    assert tiles.reduced(None, output) == ["--reduced", f"24={path}"]
    assert tiles.reduced(None, SimpleNamespace(reduced=[])) == []


def test_training_reads_images_of_the_scheme_s_own_size():
    table = {"table": "config/cost/accuracy.csv", "schemes": ["ABC:VRP+TRP+VT", "48 pixels"]}
    stages = stages_of({"recognition": table})
    shards = stages.run.plan.shards
    for scheme, size in (("abc-vrp-trp-vt", 24), ("48-pixels", 48)):
        views = stages.recognition.samples(SimpleNamespace(scheme=scheme))["views"]
        assert views == [f"{BASE}/views/{size}/{shard}.npz" for shard in shards]
    uncached = stages_of({"recognition": {"cache": False}}).recognition
    read = uncached.samples(SimpleNamespace(scheme="abc-vrp-trp-vt"))
    assert read == {"index": f"{BASE}/shards/index.json"}


@pytest.mark.workflow
def test_a_run_on_another_s_data_reads_there(folder, monkeypatch):
    overlay = {"run": "mine", "data": "default", "recognition": {"training": {"steps": 9}}}
    made = folder / BASE / "config.yaml"
    (made.parent / "views").mkdir(parents=True)
    (made.parent / "SHA256SUMS").touch()
    monkeypatch.chdir(folder)
    made.write_text(yaml.safe_dump(merge(load_yaml("config/default.yaml"), FEW)))
    stages = stages_of(merge(FEW, overlay))
    job = SimpleNamespace(run="mine", scheme="abc-vrp-trp-vt")
    assert stages.recognition.samples(job)["views"][0].startswith(f"{BASE}/views/24/")
    benchmarks = stages.page.files(job)["benchmarks"]
    trained = [name for name in benchmarks if "/train/" in name or "/evaluate/" in name]
    assert trained and all(name.startswith("results/mine/") for name in trained)
    assert stages.run.data == "default"
    assert job_of(planned(folder, overlay, "prepared"), "prepared").files == []


def test_predictions_of_a_study_are_named_with_its_command_where_they_are_missing(
    tmp_path, monkeypatch
):
    stage = stages_of({"recognition": {"seeds": [0, 4]}}).accuracy_cost
    monkeypatch.chdir(tmp_path)
    folder = Path("results/default-heights-invented/predictions/unseen/abc-vrp-trp-vt-with-height")
    with pytest.raises(
        InputError, match=rf"no {folder}/0\.csv: `make study NAME=heights` makes it first"
    ):
        stage.studied(CHUNK)
    folder.mkdir(parents=True)
    for seed in (0, 4):
        (folder / f"{seed}.csv").touch()
    assert stage.studied(CHUNK) == [f"{folder}/{seed}.csv" for seed in (0, 4)]
