"""Training and evaluation in one call each: the model file and the accuracies that the commands
give.
"""

import json
import math
import shutil

import pytest
import torch
import yaml

import lowalt
import model_files
from lowalt.config.layers import merge
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import named_models, runs, score
from lowalt.recognition.__main__ import main
from lowalt.recognition.inference import Machine
from lowalt.recognition.sample_sources import Source
from lowalt.shards.build import write_run

CHANGES = {
    "run": "small",
    "targets": {"select": ["DJI Mini 2", "Crow", "AITO M9 2024", "Walking Pedestrian 1"]},
    "motion": {"models": 4, "models_per_chunk": 4},
    "split": {"train": 2, "val": 1, "test": 1},
    "noise": {"snr_db": [8, float("inf")]},
    "images": {"size": 32},
    "recognition": {"training": {"steps": 6, "batch": 4, "validate_every": 3, "compile": False}},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one call")
    config = merge(load_yaml("config/default.yaml"), CHANGES)
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    write_run(lowalt.Dataset(config), folder, "image")
    return folder


def test_one_call_trains_and_another_evaluates_as_the_commands_do(run, tmp_path):
    trained = lowalt.train(run, "A:VRP+TRP+VT", "seen", out=tmp_path / "model", steps=3)
    history = (tmp_path / "model/history.csv").read_text()
    assert (
        model_files.load(tmp_path / "model/model.safetensors")[1]["protocol"] == "seen"
        and "\n3," in history
    )
    found = lowalt.evaluate(trained, run)
    assert found == lowalt.evaluate(trained, run)
    block = json.dumps(
        yaml.safe_load((run / "config.yaml").read_text())["recognition"]["evaluation"]
    )
    index = str(run / "shards/index.json")
    table = str(tmp_path / "p.csv")
    main(
        [
            "evaluate",
            "--settings",
            block,
            "--index",
            index,
            "--model",
            str(tmp_path / "model/model.safetensors"),
            "--out",
            table,
        ]
    )
    assert (
        found
        == score.score(table, index, "seen")
        == lowalt.evaluate(tmp_path / "model/model.safetensors", run)
    )
    parts = [line.rpartition(",")[2] for line in (tmp_path / "p.csv").read_text().splitlines()]
    assert (
        parts[0] == "part"
        and parts.count("test") == found["samples"]
        and set(parts[1:]) == {"test", "validation"}
    )


def test_training_reads_no_test_sample(run, tmp_path):
    """No statistic of test samples, such as a mean for normalising, can enter: the weights come out
    without them.
    """
    without = shutil.copytree(run, tmp_path / "run")
    gone = list((without / "shards").glob("*-test-*"))
    for path in gone:
        path.unlink()
    models = [
        lowalt.train(
            folder, "A:VRP+TRP+VT", "seen", out=tmp_path / f"model {number}", steps=3
        ).model
        for number, folder in enumerate((run, without))
    ]
    kept, found = (model.state_dict() for model in models)
    assert gone and kept.keys() == found.keys()
    assert all(torch.equal(kept[name], found[name]) for name in kept)


def test_an_answer_depends_on_its_own_sample_alone(run, tmp_path):
    trained = lowalt.train(run, "A:VRP+TRP+VT", "seen", out=tmp_path / "model", steps=3)
    source = Source.of_run(run / "shards/index.json", trained.size)
    settings = {"batch": 3, "threads": 1, "precision": "float32", "mirror": False}
    machine = Machine.here("float32")
    of_fold = {}
    for pairs in ({("seen", "test")}, {("seen", "val"), ("seen", "test")}):
        samples = source.samples(trained.scheme.columns, pairs, trained.size)
        shares = runs.answers(trained, samples, settings, machine)
        of_fold[len(pairs)] = dict(zip(samples.facts.key.tolist(), shares, strict=True))
    assert of_fold[1].keys() < of_fold[2].keys()
    for key, share in of_fold[1].items():
        assert of_fold[2][key] == pytest.approx(share, abs=1e-5)


def test_a_folder_that_is_no_run_and_a_setting_that_is_none_are_refused(run, tmp_path):
    with pytest.raises(InputError, match="expected the folder of a finished run"):
        lowalt.evaluate("results/zoo/default-seen.safetensors", tmp_path)
    with pytest.raises(InputError, match="stepps"):
        lowalt.train(run, "A:VRP+TRP+VT", out=tmp_path / "model", stepps=3)


def test_a_name_where_no_extension_brings_models_is_no_choice_among_none(monkeypatch):
    monkeypatch.setattr(named_models, "offered", lambda kind: {})
    with pytest.raises(InputError, match=r"not a file, expected one$"):
        named_models.path_of("default-seen")


def test_confusion_is_read_at_one_snr_or_summed_over_all(tmp_path):
    counts = {"seen,A,3": [3, 1, 0, 4], "seen,A,inf": [4, 0, 1, 3], "seen,B,3": [9, 9, 9, 9]}
    pairs = ["Bird,Bird", "Bird,UAV", "UAV,Bird", "UAV,UAV"]
    lines = [
        f"{about},{pair},{count}"
        for about, row in counts.items()
        for pair, count in zip(pairs, row, strict=True)
    ]
    head = "protocol,scheme,snr_db,category,predicted,samples"
    (tmp_path / "confusion_by_snr.csv").write_text("\n".join([head, *lines, ""]))
    at_3 = lowalt.confusion(tmp_path, "A", "seen", snr_db=3)
    assert at_3.classes == ("Bird", "UAV") and at_3.samples.tolist() == [[3, 1], [0, 4]]
    assert at_3.percent.tolist() == [[75, 25], [0, 100]]
    assert lowalt.confusion(tmp_path, "A", "seen", snr_db=math.inf).samples.tolist() == [
        [4, 0],
        [1, 3],
    ]
    assert lowalt.confusion(tmp_path, "A", "seen").samples.tolist() == [[7, 1], [1, 7]]
    for wrong, words in (
        ({"snr_db": 5}, "snr_db 5 is not there"),
        ({"scheme": "C"}, "scheme 'C' is not there"),
    ):
        with pytest.raises(InputError, match=words):
            lowalt.confusion(tmp_path, **{"scheme": "A", "protocol": "seen", **wrong})


def test_every_name_that_the_package_lists_leads_to_an_object_with_a_docstring():
    assert set(lowalt.__all__) <= set(dir(lowalt))
    assert all(len(getattr(lowalt, name).__doc__) > 60 for name in lowalt.__all__)
