"""Training: it learns, repeats bit for bit, stops on NaN by name, refuses wrong settings; its
recipe by formulas.
"""

import csv
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn
from torch.optim.optimizer import register_optimizer_step_pre_hook

import model_files
from lowalt.files.errors import InputError
from lowalt.recognition import checkpoint, inference, recipe, runs, samples
from lowalt.recognition import training as loop
from lowalt.recognition.batches import Augmented, batches, epoch_order
from lowalt.recognition.matrix_products import MatrixProduct
from lowalt.recognition.objective import objective
from trainings import SCHEME, SETTINGS, TRAINING, equal, sources, train, with_training

PATHS = os.pathsep.join(
    str(Path(__file__).parents[2] / folder) for folder in ("src", "tests/support")
)
"""Where another process finds the package and what tests share."""


def test_training_learns_an_easy_task_and_says_how(views, trained):
    with (trained / "history.csv").open(newline="") as file:
        history = list(csv.DictReader(file))
    assert [int(row["step"]) for row in history] == [40, 80]
    assert float(history[-1]["validation_accuracy"]) > 0.9
    assert float(history[-1]["train_loss"]) < float(history[0]["train_loss"])
    about = json.loads((trained / "run.json").read_text())
    assert (
        about["samples_seen"] == 640 and about["weights"] == "none" and about["train_samples"] == 96
    )
    assert not (trained / "checkpoint.pt").exists()


@pytest.mark.parametrize("precision", ["fp32", "bf16"])
def test_equal_seeds_repeat_bit_for_bit_and_others_do_not(views, tmp_path, precision):
    settings = with_training(precision=precision, steps=10, validate_every=5)
    one = train(views, tmp_path / "one", settings)
    two = train(views, tmp_path / "two", settings)
    assert equal(one[0], two[0]) and one[1] == two[1]
    assert not equal(one[0], train(views, tmp_path / "three", {**settings, "seed": 4})[0])
    assert torch.are_deterministic_algorithms_enabled() and torch.get_num_threads() == 1


@pytest.mark.parametrize("precision", ["fp32", "bf16"])
def test_a_loss_that_is_not_a_number_stops_the_run_and_leaves_no_checkpoint(
    views, tmp_path, precision
):
    beyond = {"rate": 1, "backbone_rate": 1e30, "clip": 1e30}
    overflow = with_training(**beyond, warmup=0.0, checkpoint_s=0, ema=0.0, precision=precision)
    with pytest.raises(InputError, match=r"loss is .* at step"):
        train(views, tmp_path, overflow)
    kept = tmp_path / "checkpoint.pt"
    if kept.exists():
        _, state = checkpoint.load(kept)
        assert np.isfinite(state["at"]["loss_sum"])
    assert not (tmp_path / "model.safetensors").exists()


def test_weights_that_a_finite_loss_steps_beyond_the_largest_number_are_never_written(
    views, tmp_path
):
    beyond = with_training(
        rate=1, backbone_rate=1e39, warmup=0.0, steps=2, validate_every=1, checkpoint_s=0, ema=0.0
    )
    with pytest.raises(InputError, match=r"weights .* are not finite after step 1;"):
        train(views, tmp_path / "validated", beyond)
    with pytest.raises(InputError, match=r"weights .* are not finite after step 1;"):
        train(
            views,
            tmp_path / "saved",
            {**beyond, "training": {**beyond["training"], "validate_every": 2}},
        )
    assert not list(tmp_path.rglob("*.pt"))


def test_a_gradient_that_overflows_is_left_out_and_ten_in_a_row_stop_the_run(
    views, tmp_path, monkeypatch, capsys
):
    clip = torch.nn.utils.clip_grad_norm_
    calls = []

    def overflow(parameters, *given, **named):
        calls.append(0)
        norm = clip(parameters, *given, **named)
        return norm * float("inf") if len(calls) % limit[0] == 0 else norm

    limit = [5]
    monkeypatch.setattr(torch.nn.utils, "clip_grad_norm_", overflow)
    weights, _ = train(views, tmp_path / "survives", with_training(steps=12))
    assert all(value.isfinite().all() for value in weights.values() if value.is_floating_point())
    assert "step skipped" in capsys.readouterr().err
    limit[0] = 1
    with pytest.raises(InputError, match="ten gradients in a row were not finite, last at step 9"):
        train(views, tmp_path / "stops", with_training(steps=12))


def test_a_batch_of_one_class_is_survived_and_a_set_without_one_refused(views, tmp_path):
    found = sources(views)
    facts = found["train"].facts
    found["train"].facts = facts.take(np.arange(len(facts)))
    runs.train(
        found, SCHEME, "seen", with_training(batch=1, steps=8, validate_every=8), tmp_path / "one"
    )
    assert (tmp_path / "one" / "model.safetensors").exists()
    few = np.flatnonzero(facts.label != 2)
    found["train"].facts = facts.take(few)
    found["train"].images = found["train"].images[few]
    with pytest.raises(InputError, match=r"no training sample of \['Vehicle'\]"):
        runs.train(found, SCHEME, "seen", SETTINGS, tmp_path / "none")


def test_arithmetic_is_bf16_only_where_the_processor_has_it(monkeypatch):
    for units, expected in (
        ({"avx2": True}, "fp32"),
        ({"avx2": True, "amx_bf16": False}, "fp32"),
        ({"avx512_bf16": True}, "bf16"),
        ({"amx_bf16": True}, "bf16"),
    ):
        monkeypatch.setattr(torch.cpu, "get_capabilities", lambda units=units: units)
        assert inference.arithmetic("auto", "cpu") == expected
    assert (inference.arithmetic("fp32", "cpu"), inference.arithmetic("bf16", "cpu")) == (
        "fp32",
        "bf16",
    )


@pytest.mark.parametrize(("patience", "steps"), [(3, 400), (0, 8)])
def test_early_stopping_counts_validations_without_gain_and_no_patience_asked_for_never_stops(
    views, tmp_path, patience, steps
):
    settings = with_training(rate=0.0, steps=steps, validate_every=2, patience=patience)
    _, history = train(views, tmp_path, settings)
    assert len(history.splitlines()) == 1 + 4


def test_batches_follow_each_epoch_s_order_and_validations_the_steps_and_the_end(views, tmp_path):
    read = []

    class Noted(samples.ViewSamples):
        def changed(self, numbers, *given):
            read.append(numbers.tolist())
            return super().changed(numbers, *given)

    parts = sources(views) | {"train": Noted([views], SCHEME.columns, {("seen", "train")})}
    settings = with_training(steps=8, batch=13, validate_every=3)
    runs.train(parts, SCHEME, "seen", settings, tmp_path)
    keys = (settings["seed"], ("seen", SCHEME.name))
    orders = [batches(epoch_order(parts["train"].facts, *keys, epoch, 1), 13) for epoch in range(3)]
    assert len(orders[0]) == 3
    assert read == [part.tolist() for order in orders for part in order][:8]
    rows = (tmp_path / "history.csv").read_text().splitlines()[1:]
    assert [row.split(",")[:3] for row in rows] == [
        ["3", "0", "39"],
        ["6", "1", "78"],
        ["8", "2", "104"],
    ]


@pytest.mark.parametrize(
    ("last", "precision", "kind"), [(True, "fp32", MatrixProduct), (False, "bf16", nn.Conv2d)]
)
def test_weights_lie_in_memory_as_asked_and_products_stand_for_convolutions_in_float32(
    views, tmp_path, last, precision, kind
):
    settings = with_training(channels_last=last)
    settings["training"] = recipe.check(settings["training"])
    run = loop.TrainingRun(("a",), "x", tmp_path)
    machine = inference.Machine(torch.device("cpu"), precision)
    model = loop.Trainer(
        nn.Conv2d(4, 8, 3), sources(views), SCHEME.columns, settings, run, machine
    ).model
    assert model.weight.is_contiguous(memory_format=torch.channels_last) == last
    assert type(model) is kind and model.training


def test_every_parameter_has_one_group_and_only_matrices_decay(trained):
    model = runs.load(trained / "model.safetensors").model
    groups = recipe.optimiser(model, {**TRAINING, "backbone_rate": 0.1}).param_groups
    members = [id(value) for group in groups for value in group["params"]]
    assert sorted(members) == sorted(id(value) for value in model.parameters())
    matrices = {
        id(value)
        for name, value in model.named_parameters()
        if value.ndim > 1 and "modality" not in name
    }
    decays = {id(value): group["weight_decay"] for group in groups for value in group["params"]}
    assert 0 < len(matrices) < len(decays)
    assert decays == {
        member: TRAINING["weight_decay"] if member in matrices else 0.0 for member in members
    }
    slow = {id(value) for group in groups if group["factor"] == 0.1 for value in group["params"]}
    assert slow == {id(value) for value in model.backbone.parameters()}


def test_metrics_for_tensorboard_are_those_of_the_history(views, tmp_path, monkeypatch):
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    settings = with_training(steps=8, validate_every=4)
    runs.train(sources(views), SCHEME, "seen", settings, tmp_path, events=True)
    found = EventAccumulator(str(tmp_path / "events")).Reload()
    with (tmp_path / "history.csv").open(newline="") as file:
        history = list(csv.DictReader(file))
    for name in ("train_loss", "validation_accuracy", "rate"):
        assert [entry.step for entry in found.Scalars(name)] == [4, 8]
        assert [entry.value for entry in found.Scalars(name)] == pytest.approx(
            [float(row[name]) for row in history]
        )
    assert 0 <= found.Scalars("waiting_share")[-1].value <= 1


def test_tensorboard_asked_for_and_absent_is_named(views, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(
        InputError, match=r"tensorboard is not installed.*`pip install tensorboard`"
    ):
        runs.train(sources(views), SCHEME, "seen", with_training(steps=4), tmp_path, events=True)


@pytest.mark.slow
def test_a_compiled_network_trains_to_the_same_history(views, tmp_path):
    settings = with_training(steps=6, validate_every=3)
    settings["network"] = {**SETTINGS["network"], "dropout": 0.0}
    plain = train(views, tmp_path / "plain", settings)
    settings = {**settings, "training": {**settings["training"], "compile": True}}
    # The compiler refuses a process in which another test has imported the distutils that comes
    # with Python.
    program = (
        "import json, sys; from pathlib import Path; from trainings import train; given = map(Path,"
        " sys.argv[1:3])"
    )
    program += "; train(*given, json.loads(sys.argv[3]))"
    command = [sys.executable, "-c", program, views, tmp_path / "compiled", json.dumps(settings)]
    ended = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": PATHS}, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    weights = model_files.load(tmp_path / "compiled/model.safetensors")[1]["weights"]
    history = tmp_path / "compiled/history.csv"
    assert weights.keys() == plain[0].keys()
    one, other = (
        np.loadtxt(text.splitlines()[1:], delimiter=",") for text in (plain[1], history.read_text())
    )
    np.testing.assert_allclose(other, one, rtol=1e-3)


def test_every_step_has_the_rate_of_its_share_and_a_gradient_no_longer_than_the_clip(
    views, tmp_path, request
):
    rates = []
    lengths = []

    def note(optimiser, *given):
        rates.append([(group["lr"], group["factor"]) for group in optimiser.param_groups])
        values = [
            value.grad.norm() for group in optimiser.param_groups for value in group["params"]
        ]
        lengths.append(float(torch.stack(values).norm()))

    request.addfinalizer(register_optimizer_step_pre_hook(note).remove)
    train(
        views,
        tmp_path,
        with_training(steps=4, validate_every=4, warmup=0.5, clip=0.01, backbone_rate=0.25),
    )
    for share, found in zip((0.5, 1.0, 0.5, 0.0), rates, strict=True):
        assert all(rate == pytest.approx(3e-3 * share * factor) for rate, factor in found)
    assert {factor for _, factor in rates[0]} == {1.0, 0.25} and lengths == pytest.approx(
        [0.01] * 4, rel=1e-3
    )


def test_augmentation_differs_from_step_to_step_and_rank_to_rank_and_comes_again(views):
    source = sources(views)["train"]
    numbers = np.arange(16)
    block = SETTINGS["augmentation"] | {"mask_time": 0.5}

    def read(step, rank=0):
        return Augmented(source, SCHEME.columns, block, (3, "a"), rank, 1)[
            step, np.tile(numbers, rank + 1)
        ][0][:4]

    assert (read(5) == read(5)).all() and (read(5) != read(6)).any()
    both = [
        Augmented(source, SCHEME.columns, block, (3, "a"), rank, 2)[5, numbers.repeat(2)]
        for rank in (0, 1)
    ]
    assert (both[0][1] == both[1][1]).all() and (both[0][0] != both[1][0]).any()


@pytest.mark.parametrize(("weight", "smoothing"), [(0.5, 0.2), (2.0, 0.0), (0.0, 0.3)])
def test_the_loss_weighs_each_station_alone_against_all_together(weight, smoothing):
    rng = np.random.default_rng(3)
    together, of_stations = (torch.from_numpy(rng.normal(size=(count, 4))) for count in (3, 6))
    labels = np.array([2, 0, 3])

    class Model(nn.Module):
        shape = 2, 1  # stations and spectra

        def forward(self, images, alone=False):
            return (together, of_stations) if alone else together

    def entropy(logits, label):
        shares = np.exp(logits) / np.exp(logits).sum()
        wanted = (1 - smoothing) * np.eye(4)[label] + smoothing / 4
        return -(wanted * np.log(shares)).sum()

    all_together = np.mean(
        [entropy(row, label) for row, label in zip(together.numpy(), labels, strict=True)]
    )
    # Samples one after the other, and the stations of each.
    each = np.mean(
        [entropy(row, labels[number // 2]) for number, row in enumerate(of_stations.numpy())]
    )
    block = {"alone": weight, "label_smoothing": smoothing}
    machine = inference.Machine(torch.device("cpu"), "fp32")
    found = objective(Model(), torch.zeros(3, 2, 8, 8), torch.from_numpy(labels), block, machine)
    assert float(found) == pytest.approx((all_together + weight * each) / (1 + weight), rel=1e-6)


@pytest.mark.parametrize("decay", [0.0, 0.6, 0.998])
def test_the_average_is_that_of_all_weights_so_far_by_powers_of_the_decay(
    views, tmp_path, monkeypatch, decay
):
    weights = []
    averages = []
    step = loop.Trainer._step

    def stepped(trainer, *batch):
        step(trainer, *batch)
        for noted, model in ((weights, trainer.model), (averages, trainer.average.module)):
            noted.append(model.classifier[0].weight.detach().double().clone())

    monkeypatch.setattr(loop.Trainer, "_step", stepped)
    train(views, tmp_path, with_training(steps=8, validate_every=8, ema=decay))
    for count in (1, 2, 8):
        ages = decay ** np.arange(count)[::-1]
        expected = sum(age * value for age, value in zip(ages, weights, strict=False)) / ages.sum()
        torch.testing.assert_close(averages[count - 1], expected, rtol=0, atol=2e-6)


def test_the_final_weights_are_those_validated_last_of_the_best(monkeypatch, views, tmp_path):
    right = iter([0.4, 0.8, 0.8, 0.6])
    kept = []

    def told(model, source, numbers, *_, **named):
        share = next(right)
        kept.append({name: value.clone() for name, value in model.state_dict().items()})
        labels = source.facts.label[numbers]
        wrong = np.arange(len(labels)) >= share * len(labels)
        return np.eye(4)[(labels + wrong) % 4]

    monkeypatch.setattr(loop, "probabilities", told)
    runs.train(sources(views), SCHEME, "seen", with_training(steps=12, validate_every=3), tmp_path)
    weights = model_files.load(tmp_path / "model.safetensors")[1]["weights"]
    assert all(torch.equal(value, kept[2][name]) for name, value in weights.items())
    assert len({float(state["classifier.0.weight"].sum()) for state in kept}) == 4


@pytest.mark.parametrize(
    ("block", "change"),
    [
        ("training", {"steps": 0}),
        ("training", {"rate": -1.0}),
        ("training", {"precision": "fp16"}),
        ("training", {"warmup": 2}),
        ("training", {"epochs": 3}),
        ("training", {"batch": True}),
        ("training", {"ema": math.nan}),
        ("training", {"threads": 1.0}),
        ("augmentation", {"mirror": 1.5}),
        ("augmentation", {"mask_time": "0.1"}),
        ("augmentation", {"flip": 1}),
    ],
)
def test_wrong_settings_are_refused_by_name(views, tmp_path, block, change):
    with pytest.raises(
        InputError, match=rf"recognition\.{block}: .*{next(iter(change))}.*, expected"
    ):
        train(views, tmp_path, {**SETTINGS, block: {**SETTINGS[block], **change}})


def test_a_batch_has_at_least_a_sample_a_part_and_one_part_where_nothing_is_said():
    assert recipe.check(TRAINING) == {
        **TRAINING,
        "accumulate": 1,
        "activation_checkpointing": False,
    }
    assert recipe.check({**TRAINING, "batch": 3, "accumulate": 3})["accumulate"] == 3
    with pytest.raises(InputError, match="accumulate is 4, expected at most batch, 3"):
        recipe.check({**TRAINING, "batch": 3, "accumulate": 4})
