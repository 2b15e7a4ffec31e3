"""A stopped training: it resumes exactly, and refuses foreign and damaged checkpoints by name."""

import dataclasses
import json
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
import torch

import model_files
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import checkpoint, recipe, runs, samples, training
from lowalt.recognition.__main__ import main
from trainings import SCHEME, TRAINING, Killed, equal, kill_at, sources, train, with_training


def test_resuming_after_any_step_ends_in_the_same_weights_and_history(views, tmp_path, monkeypatch):
    """Stops at 6 random moments of one run, each time just after a checkpoint or up to 5 steps
    later.
    """
    whole = train(views, tmp_path / "whole")
    moments = iter(sorted(stream(1, "kill").integers(1, TRAINING["steps"], 6).tolist()))
    settings = with_training(checkpoint_s=0)
    at = [next(moments)]
    step = runs.Trainer._step

    def breaking(self, *batch):
        if self.at.steps >= at[0]:
            at[0] = next(moments, 10**9)
            raise Killed
        step(self, *batch)

    monkeypatch.setattr(runs.Trainer, "_step", breaking)
    for _ in range(7):
        try:
            parts = train(views, tmp_path / "parts", settings)
            break
        except Killed:
            continue
    assert at[0] == 10**9
    assert equal(whole[0], parts[0]) and whole[1] == parts[1]


def test_checkpoints_come_by_the_clock_and_the_time_spent_waiting_for_data_is_told(
    views, tmp_path, monkeypatch, capsys
):
    """On a clock that stands still except for four seconds of reading a batch."""
    clock = SimpleNamespace(now=0.0, monotonic=lambda: clock.now, process_time=lambda: clock.now)
    monkeypatch.setattr(training, "time", clock)
    monkeypatch.setattr(runs, "time", clock)

    class Slow(samples.ViewSamples):
        def changed(self, *given):
            clock.now += 4
            return super().changed(*given)

    def run(**changes):
        found = sources(views) | {"train": Slow([views], SCHEME.columns, {("seen", "train")})}
        runs.train(
            found, SCHEME, "seen", with_training(steps=6, validate_every=6, **changes), tmp_path
        )

    step = kill_at(monkeypatch, 5)
    with pytest.raises(Killed):
        run(checkpoint_s=10)
    assert checkpoint.load(tmp_path / "checkpoint.pt")[1]["at"]["steps"] == 3
    monkeypatch.setattr(runs.Trainer, "_step", step)
    run(checkpoint_s=1e9)
    told = capsys.readouterr().err
    assert (
        "resumed at step 3" in told and "2 samples/s, 100.0 % of the time waiting for data" in told
    )
    record = json.loads((tmp_path / "run.json").read_text())
    assert (record["waiting_share"], record["samples_per_s"], record["train_s"]) == (1.0, 2.0, 12.0)


def training_line(views, folder, settings):
    """A training as the words of a command."""
    settings = json.dumps({**settings, "scheme": SCHEME.record})
    line = ["train", "--settings", settings, "--views", str(views), "--protocol", "seen", "--out"]
    return [*line, str(folder / "killed")]


def killed_at(moments, line, folder):
    """Kill one training at each of the moments, s after its first new checkpoint."""
    kept = folder / "killed" / "checkpoint.pt"
    for moment in moments:
        before = kept.stat().st_mtime_ns if kept.exists() else None
        process = subprocess.Popen(
            [sys.executable, "-m", "lowalt.recognition", *line], stderr=subprocess.DEVNULL
        )
        while process.poll() is None and (not kept.exists() or kept.stat().st_mtime_ns == before):
            time.sleep(0.01)
        time.sleep(moment)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL


def resumed(line, views, folder, steps, capsys):
    """Run the command of a killed training again: it ends as one that was never stopped."""
    main(line)
    assert "resumed at step" in capsys.readouterr().err
    name, state = model_files.load(folder / "killed" / "model.safetensors")
    weights, history = train(views, folder / "whole", with_training(steps=steps, validate_every=10))
    assert equal(state["weights"], weights)
    assert (folder / "killed" / "history.csv").read_text() == history
    assert json.loads(name)["protocol"] == "seen"


def test_a_stopped_training_resumes_from_the_command_line(views, tmp_path, capsys, monkeypatch):
    line = training_line(
        views, tmp_path, with_training(steps=12, validate_every=10, checkpoint_s=0)
    )
    step = kill_at(monkeypatch, 5)
    with pytest.raises(Killed):
        main(line)
    monkeypatch.setattr(runs.Trainer, "_step", step)
    resumed(line, views, tmp_path, 12, capsys)


# Every process imports torch. A single kill comes with the first checkpoint, long before the last
# of few steps.
@pytest.mark.slow
@pytest.mark.parametrize(("kills", "steps"), [(1, 24), (20, 600)], ids=["once", "twenty times"])
def test_a_killed_process_resumes_from_the_command_line(views, tmp_path, capsys, kills, steps):
    line = training_line(
        views, tmp_path, with_training(steps=steps, validate_every=10, checkpoint_s=0)
    )
    killed_at(stream(2, "kill").uniform(0, 0.3 * (kills > 1), kills), line, tmp_path)
    resumed(line, views, tmp_path, steps, capsys)


def test_foreign_damaged_and_missing_checkpoints_and_models_are_refused_by_name(
    views, trained, tmp_path
):
    name, _ = model_files.load(trained / "model.safetensors")
    other = tmp_path / "other"
    checkpoint.save(other / "checkpoint.pt", name, {})
    with pytest.raises(InputError, match="another run, its settings differ"):
        train(views, other)
    saved = torch.load(other / "checkpoint.pt", weights_only=True)
    torch.save({**saved, "state": {"a": 1}}, other / "checkpoint.pt")
    with pytest.raises(InputError, match=r"checkpoint\.pt: checkpoint is damaged"):
        train(views, other)
    with pytest.raises(InputError, match=r"model\.safetensors"):
        runs.load(tmp_path / "model.safetensors")
    raw = (trained / "model.safetensors").read_bytes()
    cut, changed, empty = (tmp_path / f"{word}.safetensors" for word in ("cut", "changed", "empty"))
    cut.write_bytes(raw[: len(raw) // 2])
    with pytest.raises(InputError, match=r"cut\.safetensors"):
        runs.load(cut)
    changed.write_bytes(raw[:-1] + bytes([raw[-1] ^ 1]))
    with pytest.raises(InputError, match=r"changed\.safetensors: model file is damaged"):
        runs.load(changed)
    model_files.save(empty, name, {"weights": {}})
    with pytest.raises(InputError, match=r"empty\.safetensors: .*missing key"):
        runs.load(empty)


def test_a_checkpoint_of_other_data_with_equal_counts_is_refused(views, tmp_path, monkeypatch):
    """Inverted images, the same keys and labels: another run, though every count is the same."""
    step = kill_at(monkeypatch, 5)
    settings = with_training(steps=8, checkpoint_s=0)
    with pytest.raises(Killed):
        train(views, tmp_path, settings)
    monkeypatch.setattr(runs.Trainer, "_step", step)
    inverted = sources(views)
    relabelled = sources(views)
    inverted["train"].images = 255 - inverted["train"].images
    facts = relabelled["validation"].facts
    relabelled["validation"].facts = dataclasses.replace(facts, label=(facts.label + 1) % 4)
    for found in (inverted, relabelled):
        with pytest.raises(InputError, match="another run, its samples differ"):
            runs.train(found, SCHEME, "seen", settings, tmp_path)
    train(views, tmp_path, settings)


def test_a_gpu_s_generator_is_saved_and_taken_up_with_the_processor_s(monkeypatch):
    of_gpu = {"state": torch.arange(4, dtype=torch.uint8)}
    monkeypatch.setattr(torch.cuda, "get_rng_state", lambda device: of_gpu["state"].clone())
    monkeypatch.setattr(
        torch.cuda, "set_rng_state", lambda state, device: of_gpu.update(state=state)
    )
    device = torch.device("cuda:1")
    states = recipe.random_state(device)
    drawn = torch.rand(3)
    of_gpu["state"] = torch.zeros(4, dtype=torch.uint8)
    recipe.set_random_state(device, states)
    assert torch.equal(torch.rand(3), drawn) and of_gpu["state"].tolist() == [0, 1, 2, 3]
    assert set(recipe.random_state(torch.device("cpu"))) == {"cpu"}
    with pytest.raises(
        InputError, match=r"random states of \['cpu', 'cuda'\], but this training runs on cpu"
    ):
        recipe.set_random_state(torch.device("cpu"), states)
