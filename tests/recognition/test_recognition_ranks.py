"""Several ranks: they train and evaluate as one, and batch norm is refused where no GPU shares its
statistics.
"""

import csv
import json
import os
import subprocess
import sys

import pytest
import timm
import torch
from torch import nn

import model_files
from lowalt.files.errors import InputError
from lowalt.recognition import predictions, runs
from lowalt.recognition.__main__ import main
from lowalt.recognition.inference import Machine
from trainings import SCHEME, SETTINGS, sources, with_training

# One process imports torch, which takes seconds, and becomes two ranks by forks, with the variables
# that torchrun sets. The slow tests below start them by torchrun itself.
PROGRAM = """
import gc, json, os, sys, traceback

gc.disable()
import timm, torch
from lowalt.recognition.__main__ import main

gc.freeze()
gc.enable()

ranks = {}
for rank in range(2):
    child = os.fork()
    if child:
        ranks[child] = rank
        continue
    try:
        os.environ |= {"RANK": str(rank), "LOCAL_RANK": str(rank)}
        for line in json.loads(sys.argv[1]):
            main(line)
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)
while ranks:
    child, status = os.wait()
    del ranks[child]
    if status:
        for other in ranks:
            os.kill(other, 9)
        sys.exit(1)
"""


def on_two_ranks(*lines):
    """Run command lines of `python -m lowalt.recognition` one after the other on two ranks."""
    port = str(20000 + os.getpid() % 20000)
    environment = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "GLOO_SOCKET_IFNAME": "lo",
        "WORLD_SIZE": "2",
        "MASTER_ADDR": "127.0.0.1",
        "MASTER_PORT": port,
    }
    command = [sys.executable, "-c", PROGRAM, json.dumps(lines)]
    run = subprocess.run(command, capture_output=True, env=environment, text=True, timeout=300)
    assert run.returncode == 0, run.stderr[-3000:]


def training_line(folder, views, name, batch):
    """A command line that trains six steps without random images, into `folder`/`name`."""
    settings = {**with_training(steps=6, validate_every=3, batch=batch), "scheme": SCHEME.record}
    settings["augmentation"] = dict.fromkeys(SETTINGS["augmentation"], 0)
    # A backbone without batch norm, whose statistics torch shares between GPUs alone.
    settings["network"] = {**SETTINGS["network"], "dropout": 0.0, "backbone": "test_convnext"}
    return [
        "train",
        "--settings",
        json.dumps(settings),
        "--views",
        str(views),
        "--protocol",
        "seen",
        "--out",
        str(folder / name),
    ]


def evaluation_line(folder, views, trained, name):
    """A command line that evaluates a finished training, into `folder`/`name`."""
    settings = json.dumps({"batch": 6, "threads": 1, "precision": "fp32", "mirror": False})
    return [
        "evaluate",
        "--settings",
        settings,
        "--views",
        str(views),
        "--model",
        str(trained / "model.safetensors"),
        "--out",
        str(folder / name),
    ]


@pytest.fixture(scope="module")
def both(views, trained, tmp_path_factory):
    """A folder with the same training and the same evaluation by one rank and by two, and one of
    half the batch.
    """
    folder = tmp_path_factory.mktemp("ranks")
    main(training_line(folder, views, "one", 8))
    main(training_line(folder, views, "half", 4))
    main(evaluation_line(folder, views, trained, "one.csv"))
    lines = (
        training_line(folder, views, "two", 8),
        evaluation_line(folder, views, trained, "two.csv"),
    )
    on_two_ranks(*lines)
    return folder


def test_two_ranks_evaluate_to_the_same_bytes_as_one(both):
    assert (both / "one.csv").read_bytes() == (both / "two.csv").read_bytes()
    found = predictions.read(both / "one.csv")
    assert set(found.fold) == {"val", "test"}
    assert found.correct.mean() > 0.9


def test_two_ranks_train_as_one_with_both_their_samples(both):
    """Gradients are means over the ranks' equal shares, so a step is that of one rank with the
    whole batch.
    """
    weights = {}
    losses = {}
    for name, ranks in (("one", 1), ("two", 2), ("half", 1)):
        found = model_files.load(both / name / "model.safetensors")[1]["weights"]
        weights[name] = torch.cat(
            [value.flatten() for value in found.values() if value.is_floating_point()]
        )
        with (both / name / "history.csv").open(newline="") as file:
            losses[name] = [float(row["validation_loss"]) for row in csv.DictReader(file)]
        assert json.loads((both / name / "run.json").read_text())["ranks"] == ranks
    apart = {
        name: float((weights[name] - weights["one"]).norm() / weights["one"].norm())
        for name in ("two", "half")
    }
    # Sums in another order, which Adam magnifies where a gradient is zero except for rounding.
    assert apart["two"] < 1e-4 < 1e-3 < apart["half"]
    assert losses["two"] == pytest.approx(losses["one"], rel=1e-4)
    assert losses["half"] != pytest.approx(losses["one"], rel=1e-3)


def test_a_rank_beside_the_first_writes_and_says_nothing(
    views, trained, tmp_path, monkeypatch, capsys
):
    monkeypatch.setenv("RANK", "1")
    settings = with_training(steps=2, validate_every=1, checkpoint_s=0)
    runs.train(sources(views), SCHEME, "seen", settings, tmp_path / "run", events=True)
    block = {"batch": 64, "threads": 1, "precision": "fp32", "mirror": False}
    runs.evaluate(
        runs.load(trained / "model.safetensors"),
        sources(views)["validation"],
        block,
        tmp_path / "some.csv",
    )
    assert not list(tmp_path.iterdir()) and not capsys.readouterr().err


@pytest.mark.slow
def test_torchrun_starts_such_a_training(views, tmp_path):
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    torchrun = [
        sys.executable,
        "-m",
        "torch.distributed.run",
        "--standalone",
        "--nproc-per-node",
        "2",
        "-m",
    ]
    command = [*torchrun, "lowalt.recognition", *training_line(tmp_path, views, "two", 8)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr[-3000:]
    assert json.loads((tmp_path / "two/run.json").read_text())["ranks"] == 2


def test_batch_norm_over_ranks_of_processors_is_refused_and_over_gpus_shared():
    own = timm.create_model("test_resnet", num_classes=0)
    on_processors, on_gpus = (Machine(torch.device(kind), "fp32", 0, 2) for kind in ("cpu", "cuda"))
    with pytest.raises(
        InputError,
        match=r"share no batch norm, and the backbone has [a-z0-9.]+; expected GPUs",
    ):
        on_processors.with_shared_statistics(own)
    assert Machine(torch.device("cpu"), "fp32").with_shared_statistics(own) is own
    names = own.state_dict().keys()
    shared = on_gpus.with_shared_statistics(own)
    norms = [
        layer for layer in shared.modules() if isinstance(layer, nn.modules.batchnorm._BatchNorm)
    ]
    assert (
        norms
        and all(isinstance(layer, nn.SyncBatchNorm) for layer in norms)
        and shared.state_dict().keys() == names
    )
