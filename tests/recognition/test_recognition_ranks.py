"""Several ranks, over one node and two: they train and evaluate as one; batch norm takes its statistics over all."""

import copy
import csv
import json
import os
import subprocess
import sys

import pytest
import timm
import torch
from torch import nn

from lowalt.config.layers import load_yaml
from lowalt.recognition import batch_norm, checkpoint, predictions, runs
from lowalt.recognition.__main__ import main
from lowalt.recognition.batch_norm import over_ranks
from lowalt.workflow.launch import Launch
from trainings import SCHEME, SETTINGS, sources, with_training

# One process imports torch, which takes seconds, and becomes two ranks by forks, with the variables that torchrun sets.
# The slow tests below start them by torchrun itself.
PROGRAM = """
import json, os, sys, traceback
import timm, torch
from lowalt.recognition.__main__ import main

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
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo", "WORLD_SIZE": "2",
                   "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port}  # fmt: skip
    command = [sys.executable, "-c", PROGRAM, json.dumps(lines)]
    run = subprocess.run(command, capture_output=True, env=environment, text=True, timeout=300)
    assert run.returncode == 0, run.stderr[-3000:]


def training_line(folder, views, name, batch):
    """A command line that trains six steps without random images, into `folder`/`name`."""
    settings = {**with_training(steps=6, validate_every=3, batch=batch), "scheme": SCHEME.record}
    settings["augmentation"] = dict.fromkeys(SETTINGS["augmentation"], 0)
    # The shipped backbone, whose batch norm needs the statistics of the whole batch.
    shipped = load_yaml("config/default.yaml")["recognition"]["network"]["backbone"]
    settings["network"] = {**SETTINGS["network"], "dropout": 0.0, "backbone": shipped}
    return ["train", "--settings", json.dumps(settings), "--views", str(views), "--protocol", "seen",
            "--out", str(folder / name)]  # fmt: skip


def evaluation_line(folder, views, trained, name):
    """A command line that evaluates a finished training, into `folder`/`name`."""
    settings = json.dumps({"batch": 6, "threads": 1, "precision": "fp32", "mirror": False})
    return ["evaluate", "--settings", settings, "--views", str(views), "--model", str(trained / "model.pt"),
            "--out", str(folder / name)]  # fmt: skip


@pytest.fixture(scope="module")
def both(views, trained, tmp_path_factory):
    """A folder with the same training and the same evaluation by one rank and by two, and one of half the batch."""
    folder = tmp_path_factory.mktemp("ranks")
    main(training_line(folder, views, "one", 8))
    main(training_line(folder, views, "half", 4))
    main(evaluation_line(folder, views, trained, "one.csv"))
    lines = training_line(folder, views, "two", 8), evaluation_line(folder, views, trained, "two.csv")
    on_two_ranks(*lines)
    return folder


def test_two_ranks_evaluate_to_the_same_bytes_as_one(both):
    assert (both / "one.csv").read_bytes() == (both / "two.csv").read_bytes()
    found = predictions.read(both / "one.csv")
    assert set(found.fold) == {"val", "test"}
    assert found.correct.mean() > 0.9


def test_two_ranks_train_as_one_with_both_their_samples(both):
    """Gradients are means over the ranks' equal shares, so a step is that of one rank with the whole batch."""
    weights, losses = {}, {}
    for name, ranks in (("one", 1), ("two", 2), ("half", 1)):
        found = checkpoint.load(both / name / "model.pt")[1]["weights"]
        assert any("running_var" in key for key in found)
        weights[name] = torch.cat([value.flatten() for value in found.values() if value.is_floating_point()])
        with (both / name / "history.csv").open(newline="") as file:
            losses[name] = [float(row["validation_loss"]) for row in csv.DictReader(file)]
        assert json.loads((both / name / "run.json").read_text())["ranks"] == ranks
    apart = {name: float((weights[name] - weights["one"]).norm() / weights["one"].norm()) for name in ("two", "half")}
    # Sums in another order, which Adam magnifies where a gradient is zero except for rounding.
    assert apart["two"] < 1e-4 < 1e-3 < apart["half"]
    assert losses["two"] == pytest.approx(losses["one"], rel=1e-4)
    assert losses["half"] != pytest.approx(losses["one"], rel=1e-3)


def test_a_rank_beside_the_first_writes_and_says_nothing(views, trained, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("RANK", "1")
    settings = with_training(steps=2, validate_every=1, checkpoint_s=0)
    runs.train(sources(views), SCHEME, "seen", settings, tmp_path / "run", events=True)
    block = {"batch": 64, "threads": 1, "precision": "fp32", "mirror": False}
    runs.evaluate(runs.load(trained / "model.pt"), sources(views)["validation"], block, tmp_path / "some.csv")
    assert not list(tmp_path.iterdir()) and not capsys.readouterr().err


@pytest.mark.slow
def test_two_nodes_of_one_process_train_to_the_bytes_of_the_workflow_s_launcher_of_two(views, tmp_path):
    """The launcher: the words that the rule `train` puts before the module (`recognition.processes: 2`)."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    nodes = ["torch.distributed.run", "--nnodes", "2", "--nproc-per-node", "1", "--master-addr", "127.0.0.1"]
    nodes += ["--master-port", str(20002 + os.getpid() % 20000), "--node-rank"]
    for name, launchers in (("one", [Launch.of({"processes": 2}).words]), ("two", [[*nodes, "0"], [*nodes, "1"]])):
        line = ["-m", "lowalt.recognition"] if name == "two" else ["lowalt.recognition"]
        line += training_line(tmp_path, views, name, 8)
        commands = [[sys.executable, "-m", *words, *line] for words in launchers]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        for process in [subprocess.Popen(command, env=environment, **pipes) for command in commands]:
            said, _ = process.communicate(timeout=300)
            assert process.returncode == 0, said[-3000:]
        assert json.loads((tmp_path / name / "run.json").read_text())["ranks"] == 2
    for name in ("model.pt", "history.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


@pytest.fixture
def ranks(monkeypatch):
    """Stands for so many ranks with the same images: a sum over them is that many times each one's."""
    found = {"count": 1}
    monkeypatch.setattr(batch_norm.distributed, "all_reduce", lambda values: values.mul_(found["count"]))
    return found


def layer():
    """A layer with weights, running means and settings of its own."""
    torch.manual_seed(4)
    own = nn.BatchNorm2d(3, eps=1e-2, momentum=0.3)
    for value in (own.weight, own.bias, own.running_mean):
        nn.init.normal_(value)
    own.running_var.uniform_(0.5, 2)
    return own


@pytest.mark.parametrize("count", [1, 2])
def test_a_step_of_all_ranks_is_that_of_one_with_the_whole_batch(ranks, count):
    ranks["count"] = count
    own = layer()
    shared = over_ranks(nn.Sequential(copy.deepcopy(own)))[0]
    assert type(shared) is batch_norm.BatchNormOverRanks and (shared.eps, shared.momentum) == (1e-2, 0.3)
    images = (5 + torch.randn(2, 3, 4, 5)).requires_grad_()
    both = torch.cat([images.detach()] * count).requires_grad_()
    wanted, found = own(both), shared(images)
    torch.testing.assert_close(found, wanted[:2], rtol=1e-4, atol=1e-4)
    assert found.dtype == images.dtype and found.is_contiguous(memory_format=torch.channels_last)
    gradient = torch.randn_like(found)
    found.backward(gradient)
    wanted.backward(torch.cat([gradient] * count))
    torch.testing.assert_close(images.grad, both.grad[:2], rtol=1e-3, atol=1e-4)
    for name in ("running_mean", "running_var", "num_batches_tracked"):
        torch.testing.assert_close(getattr(shared, name), getattr(own, name), rtol=1e-4, atol=1e-5)
    before = shared.running_mean.clone()
    torch.testing.assert_close(shared.eval()(both), own.eval()(both), rtol=1e-4, atol=1e-4)
    assert torch.equal(shared.running_mean, before) and shared.num_batches_tracked == 1


def test_every_batch_norm_of_a_backbone_is_replaced_with_its_activation(ranks):
    torch.manual_seed(5)
    own = timm.create_model("test_efficientnet", num_classes=0).train()
    shared = over_ranks(copy.deepcopy(own))
    counts = [sum(isinstance(one, nn.BatchNorm2d) for one in model.modules()) for model in (own, shared)]
    assert counts[0] == counts[1] == sum(type(one) is batch_norm.BatchNormOverRanks for one in shared.modules()) > 3
    images = torch.randn(4, 3, 32, 32)
    torch.testing.assert_close(shared(images), own(images), rtol=1e-3, atol=1e-3)
    assert shared.state_dict().keys() == own.state_dict().keys()
