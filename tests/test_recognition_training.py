"""Training: it learns, repeats, resumes exactly, stops on NaN by name; two ranks evaluate as one; exports agree."""

import csv
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import torch

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.recognition import checkpoint, inference, predictions, recipe, runs, samples, schemes
from lowalt.recognition.__main__ import main

TRAINING = {
    "steps": 24, "batch": 8, "snrs_per_model": 1, "rate": 3e-3, "backbone_rate": 1.0, "weight_decay": 0.05,
    "warmup": 0.1, "clip": 5.0, "label_smoothing": 0.0, "alone": 0.5, "ema": 0.99, "precision": "fp32",
    "channels_last": True, "compile": False, "validate_every": 8, "patience": 0, "checkpoint_s": 1e9,
    "threads": 1, "workers": 0,
}  # fmt: skip
SETTINGS = {
    "seed": 3, "size": 32, "colour_map": "gray",
    "network": {"backbone": "test_vit2", "weights": "none", "intra_depth": 1, "inter_depth": 1, "heads": 4,
                "feed_forward": 1, "dropout": 0.1, "hidden": 8},
    "training": TRAINING,
    "classes": ["UAV", "Bird", "Vehicle", "Pedestrian"],
    "augmentation": {"mirror": 0.5, "shift_doppler": 0.1, "shift_time": 0.2, "contrast": 0.0, "mask_doppler": 0.1,
                     "mask_time": 0.1, "drop_view": 0.1},
}  # fmt: skip
SCHEME = schemes.Scheme("AB:VRP+VT", (0, 1), (0, 2))


def with_training(**changes):
    return {**SETTINGS, "training": {**TRAINING, **changes}}


def write_views(path, models=20):
    """Four classes that differ in brightness, which no augmentation here touches: a few steps must learn them."""
    rng = stream(8, "brightness")
    rows, views = [], []
    for label in range(4):
        for model in range(models):
            fold = ("val", "test", "train", "train", "train")[model % 5]
            for snr in (3.0, np.inf):
                image = rng.integers(60 * label, 60 * label + 60, (9, 32, 32), dtype=np.uint8)
                views.append(image)
                rows.append((f"s{label}-{model}-{snr:g}", f"s{label}", model, snr, "seen", fold, label))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    nan = np.full((len(rows), 3), np.nan)
    samples.write(path, np.stack(views), samples.Facts(*columns, nan, nan))
    return path


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    return write_views(tmp_path_factory.mktemp("views") / "views.npz")


def sources(path):
    return {
        part: samples.ViewSamples([path], SCHEME.columns, {("seen", fold)})
        for part, fold in (("train", "train"), ("validation", "val"))
    }


def train(path, folder, settings=SETTINGS):
    runs.train(sources(path), SCHEME, "seen", settings, folder)
    return checkpoint.load(folder / "model.pt")[1]["weights"], (folder / "history.csv").read_text()


@pytest.fixture(scope="module")
def trained(views, tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    train(views, folder, with_training(steps=150, validate_every=50))
    return folder


def equal(one, other):
    return one.keys() == other.keys() and all(torch.equal(value, other[key]) for key, value in one.items())


def test_training_learns_an_easy_task_and_says_how(views, trained):
    with (trained / "history.csv").open(newline="") as file:
        history = list(csv.DictReader(file))
    assert [int(row["step"]) for row in history] == [50, 100, 150]
    assert float(history[-1]["validation_accuracy"]) > 0.9
    assert float(history[-1]["train_loss"]) < float(history[0]["train_loss"])
    about = json.loads((trained / "run.json").read_text())
    assert about["samples_seen"] == 1200 and about["weights"] == "none" and about["train_samples"] == 96
    assert not (trained / "checkpoint.pt").exists()


@pytest.mark.parametrize("precision", ["fp32", "bf16"])
def test_equal_seeds_repeat_bit_for_bit_and_others_do_not(views, tmp_path, precision):
    settings = with_training(precision=precision, steps=10, validate_every=5)
    one = train(views, tmp_path / "one", settings)
    two = train(views, tmp_path / "two", settings)
    assert equal(one[0], two[0]) and one[1] == two[1]
    assert not equal(one[0], train(views, tmp_path / "three", {**settings, "seed": 4})[0])


def test_workers_that_read_ahead_change_no_bit(views, tmp_path):
    one = train(views, tmp_path / "here", with_training(steps=9, validate_every=3))
    two = train(views, tmp_path / "ahead", with_training(steps=9, validate_every=3, workers=2))
    assert equal(one[0], two[0]) and one[1] == two[1]


class Killed(Exception):
    pass


def test_resuming_after_any_step_ends_in_the_same_weights_and_history(views, tmp_path, monkeypatch):
    """Stops at 20 random moments of one run, each time just after a checkpoint or up to 5 steps later."""
    whole = train(views, tmp_path / "whole")
    moments = iter(sorted(stream(1, "kill").integers(1, TRAINING["steps"], 20).tolist()))
    settings = with_training(checkpoint_s=0)
    at, step = [next(moments)], runs.Trainer._step

    def breaking(self, *batch):
        if self.at.steps >= at[0]:
            at[0] = next(moments, 10**9)
            raise Killed
        step(self, *batch)

    monkeypatch.setattr(runs.Trainer, "_step", breaking)
    for _ in range(21):
        try:
            parts = train(views, tmp_path / "parts", settings)
            break
        except Killed:
            continue
    assert at[0] == 10**9
    assert equal(whole[0], parts[0]) and whole[1] == parts[1]


def killed_at(moments, views, folder, settings):
    """Kill one training at each of the moments, s after its first new checkpoint; what is left of it, as a command."""
    table = folder / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n")
    line = ["train", "--settings", json.dumps(settings), "--views", str(views), "--protocol", "seen",
            "--stations", "A", "B", "C",
            "--scheme", "AB:VRP+VT", "--schemes", str(table), "--out", str(folder / "killed")]  # fmt: skip
    kept = folder / "killed" / "checkpoint.pt"
    for moment in moments:
        before = kept.stat().st_mtime_ns if kept.exists() else None
        process = subprocess.Popen([sys.executable, "-m", "lowalt.recognition", *line], stderr=subprocess.DEVNULL)
        while process.poll() is None and (not kept.exists() or kept.stat().st_mtime_ns == before):
            time.sleep(0.01)
        time.sleep(moment)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    return line


@pytest.mark.parametrize(
    ("kills", "steps"), [(1, 60), pytest.param(20, 600, marks=pytest.mark.slow)], ids=["once", "twenty times"]
)
def test_a_killed_process_resumes_from_the_command_line(views, tmp_path, capsys, kills, steps):
    settings = with_training(steps=steps, validate_every=10, checkpoint_s=0)
    line = killed_at(stream(2, "kill").uniform(0, 0.3, kills), views, tmp_path, settings)
    main(line)
    assert "resumed at step" in capsys.readouterr().err
    name, state = checkpoint.load(tmp_path / "killed" / "model.pt")
    weights, history = train(views, tmp_path / "whole", with_training(steps=steps, validate_every=10))
    assert equal(state["weights"], weights)
    assert (tmp_path / "killed" / "history.csv").read_text() == history
    assert json.loads(name)["protocol"] == "seen"


def test_foreign_damaged_and_missing_checkpoints_are_refused_by_name(views, trained, tmp_path):
    name, state = checkpoint.load(trained / "model.pt")
    other = tmp_path / "other"
    checkpoint.save(other / "checkpoint.pt", name, {})
    with pytest.raises(InputError, match="another run, its settings differ"):
        train(views, other)
    with pytest.raises(InputError, match=r"model\.pt"):
        runs.load(tmp_path / "model.pt")
    raw = (trained / "model.pt").read_bytes()
    (tmp_path / "cut.pt").write_bytes(raw[: len(raw) // 2])
    with pytest.raises(InputError, match=r"cut\.pt"):
        runs.load(tmp_path / "cut.pt")
    state["weights"] = {key: value + 1 if value.ndim == 2 else value for key, value in state["weights"].items()}
    content = torch.load(trained / "model.pt", weights_only=True)
    torch.save({**content, "state": state}, tmp_path / "changed.pt")
    with pytest.raises(InputError, match=r"changed\.pt: checkpoint is damaged"):
        runs.load(tmp_path / "changed.pt")
    checkpoint.save(tmp_path / "empty.pt", name, {"weights": {}})
    with pytest.raises(InputError, match=r"empty\.pt: not a trained model"):
        runs.load(tmp_path / "empty.pt")


def test_a_checkpoint_of_other_data_with_equal_counts_is_refused(views, tmp_path, monkeypatch):
    """Inverted images, the same keys and labels: another run, though every count is the same."""
    step = runs.Trainer._step

    def breaking(self, *batch):
        if self.at.steps == 5:
            raise Killed
        step(self, *batch)

    monkeypatch.setattr(runs.Trainer, "_step", breaking)
    settings = with_training(checkpoint_s=0)
    with pytest.raises(Killed):
        train(views, tmp_path, settings)
    monkeypatch.setattr(runs.Trainer, "_step", step)
    inverted, relabelled = sources(views), sources(views)
    inverted["train"].images = 255 - inverted["train"].images
    facts = relabelled["validation"].facts
    relabelled["validation"].facts = dataclasses.replace(facts, label=(facts.label + 1) % 4)
    for found in (inverted, relabelled):
        with pytest.raises(InputError, match="another run, its samples differ"):
            runs.train(found, SCHEME, "seen", settings, tmp_path)
    train(views, tmp_path, settings)


def test_a_gpu_s_generator_is_saved_and_taken_up_with_the_processor_s():
    class Gpu:
        state = torch.arange(4, dtype=torch.uint8)

        @classmethod
        def get_rng_state(cls, device):
            return cls.state.clone()

        @classmethod
        def set_rng_state(cls, state, device):
            cls.state = state

    device = torch.device("cuda:1")
    states = recipe.random_state(device, Gpu)
    drawn, Gpu.state = torch.rand(3), torch.zeros(4, dtype=torch.uint8)
    recipe.set_random_state(device, states, Gpu)
    assert torch.equal(torch.rand(3), drawn) and Gpu.state.tolist() == [0, 1, 2, 3]
    assert set(recipe.random_state(torch.device("cpu"))) == {"cpu"}
    with pytest.raises(InputError, match="this training runs on cpu"):
        recipe.set_random_state(torch.device("cpu"), states)


@pytest.mark.parametrize("precision", ["fp32", "bf16"])
def test_a_loss_that_is_not_a_number_stops_the_run_and_leaves_no_checkpoint(views, tmp_path, precision):
    overflow = with_training(rate=1e30, clip=1e30, warmup=0.0, checkpoint_s=0, ema=0.0, precision=precision)
    with pytest.raises(InputError, match=r"loss is .* at step"):
        train(views, tmp_path, overflow)
    kept = tmp_path / "checkpoint.pt"
    if kept.exists():
        _, state = checkpoint.load(kept)
        assert np.isfinite(state["at"]["loss_sum"])
    assert not (tmp_path / "model.pt").exists()


def test_weights_that_a_finite_loss_steps_beyond_the_largest_number_are_never_written(views, tmp_path):
    beyond = with_training(rate=1e39, warmup=0.0, steps=2, validate_every=1, checkpoint_s=0, ema=0.0)
    with pytest.raises(InputError, match=r"weights .* are not finite after step 1;"):
        train(views, tmp_path / "validated", beyond)
    with pytest.raises(InputError, match=r"weights .* are not finite after step 1;"):
        train(views, tmp_path / "saved", {**beyond, "training": {**beyond["training"], "validate_every": 2}})
    assert not list(tmp_path.rglob("*.pt"))


def test_a_gradient_that_overflows_is_left_out_and_ten_in_a_row_stop_the_run(views, tmp_path, monkeypatch, capsys):
    clip, calls = torch.nn.utils.clip_grad_norm_, []

    def overflow(parameters, *given, **named):
        calls.append(0)
        norm = clip(parameters, *given, **named)
        return norm * float("inf") if len(calls) % limit[0] == 0 else norm

    limit = [5]
    monkeypatch.setattr(torch.nn.utils, "clip_grad_norm_", overflow)
    weights, _ = train(views, tmp_path / "survives", with_training(steps=12))
    assert all(value.isfinite().all() for value in weights.values() if value.is_floating_point())
    assert "step left out" in capsys.readouterr().err
    limit[0] = 1
    with pytest.raises(InputError, match="ten gradients in a row"):
        train(views, tmp_path / "stops", with_training(steps=12))


def test_a_batch_of_one_class_is_survived_and_a_set_without_one_refused(views, tmp_path):
    found = sources(views)
    facts = found["train"].facts
    found["train"].facts = facts.take(np.arange(len(facts)))
    runs.train(found, SCHEME, "seen", with_training(batch=1, steps=8, validate_every=8), tmp_path / "one")
    assert (tmp_path / "one" / "model.pt").exists()
    few = np.flatnonzero(facts.label != 2)
    found["train"].facts, found["train"].images = facts.take(few), found["train"].images[few]
    with pytest.raises(InputError, match=r"no training sample of \['Vehicle'\]"):
        runs.train(found, SCHEME, "seen", SETTINGS, tmp_path / "none")


def test_arithmetic_is_bf16_only_where_the_processor_has_it(monkeypatch):
    for units, expected in (({"avx2": True}, "fp32"), ({"avx2": True, "amx_bf16": False}, "fp32"),
                            ({"avx512_bf16": True}, "bf16"), ({"amx_bf16": True}, "bf16")):  # fmt: skip
        monkeypatch.setattr(torch.cpu, "get_capabilities", lambda units=units: units)
        assert inference.arithmetic("auto", "cpu") == expected
    assert (inference.arithmetic("fp32", "cpu"), inference.arithmetic("bf16", "cpu")) == ("fp32", "bf16")


def test_early_stopping_counts_validations_without_gain(views, tmp_path):
    settings = with_training(rate=0.0, steps=400, validate_every=2, patience=3)
    _, history = train(views, tmp_path, settings)
    assert len(history.splitlines()) == 1 + 4


@pytest.mark.parametrize("change", [{"steps": 0}, {"rate": -1.0}, {"precision": "fp16"}, {"warmup": 2}, {"epochs": 3}])
def test_wrong_training_settings_are_refused_by_name(change):
    with pytest.raises(InputError, match=next(iter(change))):
        recipe.check({**TRAINING, **change})


def test_the_rate_rises_linearly_and_falls_as_a_cosine():
    assert recipe.schedule(0.05, 0.1) == pytest.approx(0.5)
    assert recipe.schedule(0.1, 0.1) == pytest.approx(1.0)
    assert recipe.schedule(0.55, 0.1) == pytest.approx(0.5)
    assert recipe.schedule(1.0, 0.1) == pytest.approx(0.0, abs=1e-12)


def test_every_parameter_has_one_group_and_only_matrices_decay(trained):
    model = runs.load(trained / "model.pt").model
    groups = recipe.optimiser(model, {**TRAINING, "backbone_rate": 0.1}).param_groups
    members = [id(value) for group in groups for value in group["params"]]
    assert sorted(members) == sorted(id(value) for value in model.parameters())
    for group in groups:
        assert all(value.ndim > 1 for value in group["params"]) or group["weight_decay"] == 0
    slow = {id(value) for group in groups if group["factor"] == 0.1 for value in group["params"]}
    assert slow == {id(value) for value in model.backbone.parameters()}


def run_ranks(arguments, ranks):
    if ranks == 1:
        main(arguments)
        return
    port = str(20000 + os.getpid() % 20000)
    launch = ["-m", "torch.distributed.run", "--nproc-per-node", str(ranks), "--master-port", port]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    command = [sys.executable, *launch, "-m", "lowalt.recognition", *arguments]
    subprocess.run(command, check=True, capture_output=True, env=environment)


def predict_all(trained, views, out, ranks):
    settings = json.dumps({"batch": 6, "threads": 1, "precision": "fp32", "mirror": False})
    run_ranks(["evaluate", "--settings", settings, "--views", str(views), "--model", str(trained / "model.pt"),
               "--out", str(out)], ranks)  # fmt: skip
    return predictions.read(out)


def test_two_ranks_evaluate_to_the_same_bytes_as_one(trained, views, tmp_path):
    found = predict_all(trained, views, tmp_path / "one.csv", 1)
    predict_all(trained, views, tmp_path / "two.csv", 2)
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    assert set(found.fold) == {"val", "test"}
    assert found.correct.mean() > 0.9


def test_two_ranks_train_as_one_with_both_their_samples(views, tmp_path):
    """Gradients are means over the ranks' equal shares, so a step is that of one rank with the whole batch."""
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n")
    weights, losses = {}, {}
    for name, ranks, batch in (("one", 1, 8), ("two", 2, 8), ("half", 1, 4)):
        settings = with_training(steps=12, validate_every=6, batch=batch)
        settings["augmentation"] = dict.fromkeys(SETTINGS["augmentation"], 0)
        # The shipped backbone, whose batch norm needs the statistics of the whole batch.
        shipped = load_yaml("config/default.yaml")["recognition"]["network"]["backbone"]
        settings["network"] = {**SETTINGS["network"], "dropout": 0.0, "backbone": shipped}
        line = ["train", "--settings", json.dumps(settings), "--views", str(views), "--protocol", "seen"]
        run_ranks(
            [
                *line,
                "--scheme",
                "AB:VRP+VT",
                "--stations",
                "A",
                "B",
                "C",
                "--schemes",
                str(table),
                "--out",
                str(tmp_path / name),
            ],
            ranks,
        )
        found = checkpoint.load(tmp_path / name / "model.pt")[1]["weights"]
        assert any("running_var" in key for key in found)
        weights[name] = torch.cat([value.flatten() for value in found.values() if value.is_floating_point()])
        with (tmp_path / name / "history.csv").open(newline="") as file:
            losses[name] = [float(row["validation_loss"]) for row in csv.DictReader(file)]
        assert json.loads((tmp_path / name / "run.json").read_text())["ranks"] == ranks
    apart = {name: float((weights[name] - weights["one"]).norm() / weights["one"].norm()) for name in ("two", "half")}
    # Sums in another order, which Adam magnifies where a gradient is zero but for rounding.
    assert apart["two"] < 1e-4 < 1e-3 < apart["half"]
    assert losses["two"] == pytest.approx(losses["one"], rel=1e-4)
    assert losses["half"] != pytest.approx(losses["one"], rel=1e-3)


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
        assert [entry.value for entry in found.Scalars(name)] == pytest.approx([float(row[name]) for row in history])
    assert 0 <= found.Scalars("waiting_share")[-1].value <= 1


def test_tensorboard_asked_for_and_absent_is_named(views, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(InputError, match=r"tensorboard is not installed.*lowalt\[tensorboard\]"):
        runs.train(sources(views), SCHEME, "seen", with_training(steps=4), tmp_path, events=True)


@pytest.mark.slow
def test_a_compiled_network_trains_to_the_same_history(views, tmp_path):
    settings = with_training(steps=6, validate_every=3)
    settings["network"] = {**SETTINGS["network"], "dropout": 0.0}
    plain = train(views, tmp_path / "plain", settings)
    compiled = train(views, tmp_path / "compiled", {**settings, "training": {**settings["training"], "compile": True}})
    assert compiled[0].keys() == plain[0].keys()
    one, other = (np.loadtxt(text.splitlines()[1:], delimiter=",") for _, text in (plain, compiled))
    np.testing.assert_allclose(other, one, rtol=1e-3)


@pytest.mark.slow
def test_an_onnx_file_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    pytest.importorskip("onnxscript")
    onnxruntime = pytest.importorskip("onnxruntime")
    from lowalt.recognition.export import export

    model = runs.load(trained / "model.pt")
    export(model, tmp_path / "model.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "model.onnx"), providers=["CPUExecutionProvider"])
    source = sources(views)["validation"]
    for count in (1, 5):
        index = source.views(np.arange(count))
        with torch.inference_mode():
            expected = model.model(torch.from_numpy(index)).softmax(1).numpy()
        (found,) = session.run(None, {session.get_inputs()[0].name: index})
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_an_exported_program_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    from lowalt.recognition.export import export

    model = runs.load(trained / "model.pt")
    export(model, tmp_path / "model.pt2")
    program = torch.export.load(tmp_path / "model.pt2").module()
    source = sources(views)["validation"]
    for count in (1, 5):
        index = torch.from_numpy(source.views(np.arange(count)))
        with torch.inference_mode():
            torch.testing.assert_close(program(index), model.model(index).softmax(1), atol=1e-6, rtol=1e-5)
    with pytest.raises(InputError, match="pt2 or"):
        export(model, tmp_path / "model.bin")


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
