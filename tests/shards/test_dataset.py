"""Samples made on the spot are those that the stages write: bytes, numbering, workers, samples
without end.
"""

import itertools
import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

import lowalt
from lowalt.__main__ import main as lowalt_command
from lowalt.config.layers import merge
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, card
from lowalt.shards import dataset as module
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset, Endless
from lowalt.targets import occluders
from lowalt.targets.cloud import read
from lowalt.targets.cloud import write as write_cloud
from lowalt.targets.records import records_of
from lowalt.tiles.png import decode
from small_configuration import configuration as usual
from stage_runs import check_members, run_stages

ROOT = Path(__file__).parents[2]


def configuration(**changes) -> dict:
    """The small data set in half of the default's band, so that cubes have half of its cells."""
    config = usual(**changes)
    return config | {"network": config["network"] | {"subcarriers": 128}}


@pytest.fixture(scope="module")
def dataset():
    return Dataset(configuration())


@pytest.fixture(scope="module", params=["image", "signal", "recipe", "cube"])
def index(request, dataset, tmp_path_factory):
    return run_stages(dataset, tmp_path_factory.mktemp(request.param), request.param)


def test_every_sample_has_the_bytes_of_its_shard(dataset, index):
    assert len(dataset) == 3 * 4 * 2
    check_members(dataset, ShardSet(index))


def test_a_whole_data_set_is_written_without_the_workflow(dataset, index, tmp_path):
    found = write_run(dataset, tmp_path, ShardSet(index).kind)
    assert found == json.loads(index.read_text())
    for path in sorted(tmp_path.rglob("*.tar")) + sorted(tmp_path.rglob("clouds/*.npz")):
        assert (
            path.read_bytes() == (index.parent.parent / path.relative_to(tmp_path)).read_bytes()
        ), path.name


def remade(capsys, index, *words) -> tuple[int, str]:
    """The exit status of the command `remake`, and what it says."""
    status = lowalt_command(["remake", str(index), *map(str, words)])
    return status, "".join(capsys.readouterr())


def test_a_stored_sample_is_made_again_and_another_is_told(index, tmp_path, capsys):
    key = ShardSet(index).keys[0].decode()
    clouds = shutil.copytree(index.parent.parent / "clouds", tmp_path / "clouds")
    for path in clouds.iterdir():
        cloud = read(path)
        cloud.points[:] *= 1.01
        cloud.track[:] *= 1.01
        write_cloud(path, cloud)
    for words, ends, says in (
        ([key], 0, "1 samples made again"),
        (["crow-000000-snrinf"], 2, "not in"),
        ([key, "--clouds", clouds], 1, f"sample {key}: its"),
        ([key, "--clouds", tmp_path / "none"], 2, "cloud of"),
    ):
        status, said = remade(capsys, index, *words)
        assert status == ends and says in said


def test_samples_to_make_again_are_drawn_and_an_index_must_say_how(index):
    from lowalt.shards.remake import Remaker, some

    stored = ShardSet(index)
    assert len(set(some(stored, 5))) == 5 and some(stored, 100) == list(range(len(stored)))
    damaged = index.parent / "old.json"
    damaged.write_text(index.read_text().replace("lowalt-shards-2", "lowalt-shards-9"))
    with pytest.raises(InputError, match="lowalt-shards-9"):
        ShardSet(damaged)
    damaged.unlink()
    stored.index["echo"] = None
    with pytest.raises(InputError, match=r"lowalt 0\.2 or later"):
        Remaker(stored, {})


def test_folds_and_groups_choose_samples(dataset, index):
    chosen = Dataset(configuration(), dataset.clouds, groups=["seen"], folds=["train", "test"])
    stored = ShardSet(index, groups=["seen"], folds=["train", "test"])
    assert sorted(chosen.key(number) for number in range(len(chosen))) == sorted(
        k.decode() for k in stored.keys
    )
    with pytest.raises(
        IndexError, match=rf"sample {len(chosen)}: expected 0 to {len(chosen) - 1}$"
    ):
        chosen[len(chosen)]
    with pytest.raises(InputError, match="folds"):
        Dataset(configuration(), dataset.clouds, folds=["training"])


def test_image_signal_and_record_belong_together(dataset):
    sample = dataset[5]
    record, data = dataset.members(5, "image")
    assert (decode(data)[0] == sample.image).all()
    assert (dataset.maker.renderer.tile(sample.signal) == sample.image).all()
    assert sample.record == json.loads(record) == json.loads(json.dumps(sample.record))
    assert lowalt.Dataset is Dataset and lowalt.Endless is Endless


def test_torch_loads_samples_in_workers(dataset):
    torch = pytest.importorskip("torch")
    loader = torch.utils.data.DataLoader(
        torch.utils.data.Subset(dataset, range(4)),
        num_workers=2,
        batch_size=None,
        multiprocessing_context="fork",
    )
    for number, sample in enumerate(loader):
        assert (np.asarray(sample.signal) == dataset.signal(number)).all()
    copy = pickle.loads(pickle.dumps(dataset))
    assert copy.members(3, "signal") == dataset.members(3, "signal")


def test_samples_without_end_are_new_and_parts_share_them(dataset):
    parts = [
        list(itertools.islice(Endless(dataset, part=part, parts=2).places(), 12))
        for part in range(2)
    ]
    assert {place.model for place in parts[0]} == {4, 6} and {
        place.model for place in parts[1]
    } == {5, 7}
    known = {dataset.key(number) for number in range(len(dataset))}
    sample = next(iter(Endless(dataset)))
    assert sample.record["key"] not in known and sample.record["model"] == 4
    # A model beyond the count is the one that a larger configuration has.
    wider = configuration()
    wider["motion"] |= {"models": 8, "models_per_chunk": 4}
    larger = Dataset(wider, dataset.clouds)
    number = next(n for n in range(len(larger)) if larger.key(n) == sample.record["key"])
    assert (larger.signal(number) == sample.signal).all()
    with pytest.raises(InputError, match="part 2 of 2"):
        Endless(dataset, part=2, parts=2)


LAND = {"clutter": {"gamma": 0.5}}
CANCELLED = LAND | {"canceller": {"kind": "mean"}}


@pytest.mark.parametrize(("kind", "effects"), [("signal", CANCELLED), ("recipe", LAND)])
def test_a_scene_with_effects_is_made_as_its_stages_make_it(kind, effects, dataset, tmp_path):
    changes = {"targets": {"select": ["Walking Pedestrian 5"]}, "echo": {"tolerance": 1e-3}}
    scene = Dataset(merge(configuration(effects=effects), changes), dataset.clouds)
    check_members(scene, ShardSet(run_stages(scene, tmp_path, kind)))


def test_a_sample_with_noise_in_all_cells_is_the_same_whatever_was_made_before(dataset):
    config = configuration(effects={"cell_noise": {}}, noise={"snr_db": [3, 13]})
    scenes = [Dataset(config, dataset.clouds, groups=["unseen"]) for _ in range(2)]
    first, (_, again) = scenes[0].signal(1), [scenes[1].signal(number) for number in range(2)]
    assert (first == again).all() and (first != scenes[0].signal(0)).any()


def test_samples_of_a_scene_that_hides_points_are_made_again_with_its_surfaces(
    dataset, tmp_path, capsys
):
    config = configuration(effects={"occlusion": {}})
    config["targets"]["select"] = ["DJI Mini 2"]
    config["motion"] |= {"models": 4, "models_per_chunk": 4}
    config["noise"] = {"snr_db": [13]}
    record = records_of(config["targets"], None)["DJI Mini 2"]
    surfaces = occluders.make(record, None, config["seed"])
    scene = Dataset(
        config, dataset.clouds, occluders={"DJI Mini 2": surfaces | {"subtype": "DJI Mini 2"}}
    )
    write_run(scene, tmp_path, "signal")
    index = str(tmp_path / "shards/index.json")
    key = scene.key(0)
    status, said = remade(capsys, index, key)
    assert status == 2 and "has no surfaces" in said
    occluders.write(tmp_path / "occluders/dji-mini-2.npz", surfaces, "DJI Mini 2")
    (tmp_path / "config.yaml").write_text(json.dumps({"run": "hidden"}))
    card.write(index, tmp_path / "config.yaml")
    assert remade(capsys, index, key)[0] == 0
    assert lowalt_command(["verify", index, "--remake", "1"]) == 0
    elsewhere = (tmp_path / "occluders").rename(tmp_path / "elsewhere")
    assert remade(capsys, index, key)[0] == 2
    status, said = remade(capsys, index, key, "--occluders", elsewhere)
    assert status == 0 and "1 samples made again, equal in every byte" in said
    moved = surfaces | {"vertices": surfaces["vertices"] + 1.0}
    occluders.write(elsewhere / "dji-mini-2.npz", moved, "DJI Mini 2")
    status, said = remade(capsys, index, key, "--occluders", elsewhere)
    assert status == 1 and f"sample {key}: its signal comes out otherwise" in said


def test_a_cloud_is_made_once_and_when_a_sample_of_its_target_is_asked_for(monkeypatch):
    made = []
    whole = module.made_cloud
    monkeypatch.setattr(
        module,
        "made_cloud",
        lambda record, *rest: made.append(record["subtype"]) or whole(record, *rest),
    )
    samples = Dataset(configuration())
    assert len(samples.clouds) == 3 and not made
    asked = [samples[0].record["subtype"] for _ in range(2)]
    assert made == asked[:1]
