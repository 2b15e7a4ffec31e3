"""Where a training stands (`lowalt.recognition.training`): its loop, its validations and its files, step by step.

The network, its samples and its steps are made up, so that each number follows by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import checkpoint, inference, recipe
from lowalt.recognition import training as loop
from lowalt.recognition.statistics import cross_entropy
from trainings import SCHEME, SETTINGS, TRAINING, sources, with_training

MACHINE = inference.Machine(torch.device("cpu"), "fp32")


class FourSamples:
    """Facts of four samples."""

    label = np.array([0, 1, 1, 2])

    def __len__(self):
        return 4


class Made(loop.Trainer):
    """A trainer of ten samples whose steps only count; `seen` notes what it does in its order."""

    def __init__(self, folder=None, machine=MACHINE, **block):
        self.block = recipe.check({**TRAINING, "batch": 3, "steps": 8, "validate_every": 3, **block})
        self.at, self.machine, self.folder, self.name = loop.TrainingState(), machine, folder, "made"
        self.train = SimpleNamespace(facts=range(10))
        self.validation = SimpleNamespace(facts=FourSamples())
        self.model = torch.nn.Linear(2, 3)
        self.ema, self.read_validation = SimpleNamespace(module=self.model), None
        self.best_weights, self.waited_s, self.metrics = {}, 0.0, None
        self.seen = []

    def _order(self, epoch):
        return 10 * epoch + np.arange(10)

    def read(self, numbered):
        return iter([(step, part.tolist()) for step, part in numbered])

    def _step(self, step, part):
        assert step == self.at.steps
        self.seen.append(part)
        self.at.steps += 1

    def save(self):
        self.seen.append("saved")


class Looping(Made):
    """The same, whose validations are only noted."""

    stops_at = None

    def _validate(self):
        self.seen.append(f"validated {self.at.steps}")
        self.at.history.append((self.at.steps, 0, 0, 0.0, 0.0, 0.0, 0.0))
        self.at.done = self.at.steps == self.stops_at

    def _say(self, start, first):
        self.seen.append(f"said from {first}")


FIRST = [[0, 1, 2], [3, 4, 5], [6, 7, 8], "validated 3", "said from 0"]
SECOND = [[10, 11, 12], [13, 14, 15], [16, 17, 18], "validated 6", "said from 0", [20, 21, 22], [23, 24, 25],
          "validated 8", "said from 0"]  # fmt: skip


def test_batches_follow_each_epoch_s_order_and_validations_the_steps_and_the_end():
    """Ten samples give three batches of three an epoch; the one that is left belongs to no batch."""
    trainer = Looping()
    assert vars(trainer.at) == {"epoch": 0, "batch": 0, "steps": 0, "loss_sum": 0.0, "loss_steps": 0, "skipped": 0,
                                "best": -1.0, "since_best": 0, "history": [], "done": False}  # fmt: skip
    at = trainer.fit()
    assert trainer.seen == FIRST + SECOND and (at.steps, at.epoch, at.batch) == (8, 2, 2)


def test_a_training_goes_on_inside_an_epoch_and_ends_where_it_is_done():
    trainer = Looping()
    trainer.at = loop.TrainingState(batch=2, steps=2)
    trainer.fit()
    assert trainer.seen[:3] == [[6, 7, 8], "validated 3", "said from 2"]
    trainer = Looping()
    trainer.stops_at = 6
    at = trainer.fit()
    assert trainer.seen == [*FIRST, *SECOND[:5]] and (at.epoch, at.batch) == (2, 0)


def test_checkpoints_come_by_the_clock_and_time_for_data_is_counted(monkeypatch):
    """Each look at the clock takes a second: two around each read, one for the question whether to save."""
    clock = iter(range(1000))
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    trainer = Looping(checkpoint_s=6, steps=6, validate_every=6)
    trainer.fit()
    # The clock says 1 at the beginning, 4, 7 and 10 after three steps, 11 after the save, 14, 17 and 20.
    assert [entry if isinstance(entry, str) else len(entry) for entry in trainer.seen] == [
        3, 3, 3, "saved", 3, 3, 3, "validated 6", "said from 0", "saved"]  # fmt: skip
    assert trainer.waited_s == 6


def told(monkeypatch, trainer, accuracies):
    """Let each of the next validations find so many of the four samples right; return the probabilities."""
    found = []
    for right in accuracies:
        guess = (trainer.validation.facts.label + (np.arange(4) >= right)) % 3
        found.append(0.1 + 0.7 * np.eye(3)[guess])
    answers = iter(found)
    monkeypatch.setattr(loop, "probabilities", lambda *given: next(answers))
    return found


def test_the_best_weights_are_the_last_of_the_best_and_gains_alone_start_the_count_anew(monkeypatch):
    trainer = Made(patience=3)
    accuracies = [0, 2, 2, 1, 3, 3, 2, 3]
    found = told(monkeypatch, trainer, accuracies)
    expected = [(0.0, 0, False), (0.5, 0, False), (0.5, 1, False), (0.5, 2, False), (0.75, 0, False),
                (0.75, 1, False), (0.75, 2, False), (0.75, 3, True)]  # fmt: skip
    kept = None
    for number, wanted in enumerate(expected, start=1):
        trainer.at.steps, trainer.at.epoch, trainer.at.loss_sum, trainer.at.loss_steps = 3 * number, 7, 9.0, 2
        with torch.no_grad():
            trainer.model.weight += 1
        trainer._validate()
        assert (trainer.at.best, trainer.at.since_best, trainer.at.done) == wanted
        assert (trainer.at.loss_sum, trainer.at.loss_steps) == (0.0, 0)
        kept = trainer.model.weight.clone() if number in (1, 2, 3, 5, 6, 8) else kept
        assert torch.equal(trainer.best_weights["weight"], kept)
        share = 3 * number / 8
        rate = trainer.block["rate"] * recipe.schedule(share, trainer.block["warmup"])
        loss = cross_entropy(found[number - 1], trainer.validation.facts.label)
        row = (3 * number, 7, 9 * number, rate, 4.5, pytest.approx(loss), pytest.approx(accuracies[number - 1] / 4))
        assert trainer.at.history[-1] == row
    endless = Made(patience=0)
    told(monkeypatch, endless, [2] * 9)
    for _ in range(9):
        endless.at.loss_steps = 1
        endless._validate()
    assert not endless.at.done


def test_only_the_first_rank_writes_and_what_is_not_finite_is_never_written(tmp_path):
    for rank, names in ((1, []), (0, ["checkpoint.pt"])):
        trainer = Made(tmp_path, inference.Machine(torch.device("cpu"), "fp32", rank, 2))
        trainer._state = lambda trainer=trainer: {"at": vars(trainer.at)}
        loop.Trainer.save(trainer)
        assert [path.name for path in tmp_path.iterdir()] == names
        loop.Trainer.finish(trainer, {"more": 5})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["history.csv", "model.pt"]
    assert checkpoint.load(tmp_path / "model.pt")[1] == {"weights": {}, "more": 5}
    trainer.at.loss_sum = math.inf
    with pytest.raises(InputError, match="loss is inf in epoch 0 at step 0"):
        loop.Trainer.save(trainer)
    trainer.at.loss_sum = 0.0
    with torch.no_grad():
        trainer.model.bias[1] = math.nan
    with pytest.raises(InputError, match="weights bias are not finite after step 0"):
        loop.Trainer.save(trainer)


def test_what_is_said_of_a_validation_is_its_row_and_the_pace_since_the_start(monkeypatch, capsys):
    """From step 2 to step 6 of 8 in two seconds: 6 samples a second, and one second left."""
    trainer, noted = Made(), []
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: 102.0))
    trainer.at.steps, trainer.waited_s = 6, 0.5
    trainer.at.history = [None, (6, 1, 18, 1e-3, 1.25, 0.75, 0.625)]
    trainer.metrics = lambda step, values: noted.append((step, values))
    trainer._say(100.0, 2)
    assert capsys.readouterr().err == (
        "step 6/8 loss 1.2500 validation 62.50 % (loss 0.7500) "
        "6 samples/s, 25.0 % of the time waiting for data, 1 s left\n"
    )
    assert noted == [(6, {"rate": 1e-3, "train_loss": 1.25, "validation_loss": 0.75, "validation_accuracy": 0.625,
                          "samples_per_s": 6.0, "waiting_share": 0.25})]  # fmt: skip
    trainer.machine = inference.Machine(torch.device("cpu"), "fp32", 1, 2)
    trainer._say(100.0, 2)
    assert not capsys.readouterr().err and len(noted) == 1


def built(views, tmp_path, monkeypatch, precision="fp32", ranks=1, **changes):
    """A real trainer of these settings; what its model was turned into."""
    turned = []
    for name in ("as_products", "over_ranks"):
        monkeypatch.setattr(loop, name, lambda model, name=name: turned.append(name) or model)
    monkeypatch.setattr(torch, "compile", lambda model: turned.append("compiled") or model)
    monkeypatch.setattr(inference.Machine, "parallel", lambda self, model: model)
    settings = with_training(**changes)
    machine = inference.Machine(torch.device("cpu"), precision, 0, ranks)
    model = torch.nn.Conv2d(4, 8, 3)
    trainer = loop.Trainer(model, sources(views), SCHEME.columns, settings, ("a",), "x", tmp_path, machine)
    return trainer, turned


@pytest.mark.parametrize(
    ("given", "turned"),
    [({}, ["as_products"]), ({"precision": "bf16"}, []), ({"compile": True}, ["compiled"]),
     ({"ranks": 2}, ["over_ranks", "as_products"])],
)  # fmt: skip
def test_products_take_the_place_of_convolutions_in_plain_float32_alone(views, tmp_path, monkeypatch, given, turned):
    assert built(views, tmp_path, monkeypatch, **given)[1] == turned


def test_weights_lie_in_memory_as_the_settings_say(views, tmp_path, monkeypatch):
    for last in (True, False):
        trainer, _ = built(views, tmp_path, monkeypatch, channels_last=last)
        assert trainer.model.weight.is_contiguous(memory_format=torch.channels_last) == last
    assert trainer.model.training and SETTINGS["training"]["batch"] == 8
    trainer.at.steps, parts = 5, [np.arange(8), np.arange(8, 16)]
    assert [(step, part.tolist()) for step, part in trainer._numbered(parts)] == [
        (5, parts[0].tolist()), (6, parts[1].tolist())]  # fmt: skip
