"""Several ranks: they train and evaluate as one."""

import csv
import json
import os
import subprocess
import sys

import pytest
import torch

from lowalt.config.layers import load_yaml
from lowalt.recognition import checkpoint, predictions, schemes
from lowalt.recognition.__main__ import main
from trainings import SETTINGS, with_training

# One process imports torch, which takes seconds, and becomes two ranks by forks, with the variables that torchrun sets;
# tests/test_recognition_nodes.py starts them by torchrun itself.
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
    table = folder / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n")
    settings = with_training(steps=6, validate_every=3, batch=batch)
    settings["augmentation"] = dict.fromkeys(SETTINGS["augmentation"], 0)
    # The shipped backbone, whose batch norm needs the statistics of the whole batch.
    shipped = load_yaml("config/default.yaml")["recognition"]["network"]["backbone"]
    settings["network"] = {**SETTINGS["network"], "dropout": 0.0, "backbone": shipped}
    return ["train", "--settings", json.dumps(settings), "--views", str(views), "--protocol", "seen",
            "--scheme", "AB:VRP+VT", "--stations", "A", "B", "C", "--schemes", str(table),
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


def test_batch_norm_over_one_rank_is_that_of_torch_and_keeps_names_and_activations(tmp_path):
    """In a process group of one rank the sums of all ranks are this rank's own."""
    from timm.layers import BatchNormAct2d
    from torch import distributed, nn

    from lowalt.recognition.batch_norm import over_ranks

    def network():
        torch.manual_seed(5)
        return nn.Sequential(nn.Conv2d(3, 4, 3), nn.BatchNorm2d(4), nn.Sequential(BatchNormAct2d(4)))

    distributed.init_process_group("gloo", init_method=f"file://{tmp_path}/group", rank=0, world_size=1)
    try:
        images = 3 + torch.randn(6, 3, 9, 9, generator=torch.Generator().manual_seed(1))
        plain, shared = network(), over_ranks(network())
        assert plain.state_dict().keys() == shared.state_dict().keys()
        for model in (plain, shared):
            (model(images) ** 3).sum().backward()
        for (name, one), other in zip(plain.named_parameters(), shared.parameters(), strict=True):
            torch.testing.assert_close(other.grad, one.grad, rtol=2e-4, atol=2e-3, msg=name)
        torch.testing.assert_close(shared.state_dict(), plain.state_dict(), rtol=1e-5, atol=1e-6)
        torch.testing.assert_close(shared.eval()(images), plain.eval()(images), rtol=1e-5, atol=1e-6)
    finally:
        distributed.destroy_process_group()
