"""What a setting of a training or a table says is done: each test fails where one named part of it is left out."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import torch

from lowalt.numerics.streams import stream
from lowalt.recognition import augment, checkpoint, inference, predictions, recipe, runs, statistics, tables
from lowalt.recognition import training as loop
from lowalt.recognition.ahead import Augmented
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.objective import objective
from made_predictions import facts, read_rows, run_files
from trainings import SCHEME, SETTINGS, sources, with_training, write_views

MACHINE = inference.Machine(torch.device("cpu"), "fp32")


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    return write_views(tmp_path_factory.mktemp("views") / "views.npz", models=10)


class Trace:
    """What every optimiser step of a training saw: rates by group, norm of the gradient, weights after it."""

    def __init__(self, monkeypatch):
        self.rates, self.norms, self.weights, self.averages = [], [], [], []
        step, trainer_step = torch.optim.AdamW.step, loop.Trainer._step

        def seen(optimiser, *given):
            gradients = [value.grad for group in optimiser.param_groups for value in group["params"]]
            self.norms.append(float(torch.stack([value.norm() for value in gradients if value is not None]).norm()))
            self.rates.append([(group["factor"], group["lr"]) for group in optimiser.param_groups])
            return step(optimiser, *given)

        def stepped(trainer, *batch):
            trainer_step(trainer, *batch)
            self.weights.append(trainer.model.classifier[0].weight.detach().double().clone())
            self.averages.append(trainer.average.module.classifier[0].weight.detach().double().clone())

        monkeypatch.setattr(torch.optim.AdamW, "step", seen)
        monkeypatch.setattr(loop.Trainer, "_step", stepped)


def traced(monkeypatch, views, folder, **changes):
    trace = Trace(monkeypatch)
    settings = with_training(steps=12, validate_every=6, **changes)
    runs.train(sources(views), SCHEME, "seen", settings, folder)
    return trace, settings["training"]


def test_the_rate_of_every_step_is_that_of_the_schedule_and_the_backbone_has_its_own(monkeypatch, views, tmp_path):
    trace, block = traced(monkeypatch, views, tmp_path, backbone_rate=0.25, warmup=0.25)
    assert len(trace.rates) == 12
    for number, groups in enumerate(trace.rates, start=1):
        expected = block["rate"] * recipe.schedule(number / 12, 0.25)
        assert {factor for factor, _ in groups} == {0.25, 1.0}
        for factor, rate in groups:
            assert rate == pytest.approx(factor * expected, rel=1e-12, abs=1e-18)
    assert len({groups[0][1] for groups in trace.rates}) > 6


def test_gradients_are_clipped_to_the_norm_asked_for(monkeypatch, views, tmp_path):
    trace, _ = traced(monkeypatch, views, tmp_path, clip=0.01)
    assert max(trace.norms) == pytest.approx(0.01, rel=1e-4)


@pytest.mark.parametrize("decay", [0.6, 0.998])
def test_the_average_is_that_of_all_weights_by_powers_of_the_decay_from_the_first_step(
    monkeypatch, views, tmp_path, decay
):
    trace, _ = traced(monkeypatch, views, tmp_path, ema=decay)
    for step in (1, 2, 5, 12):
        ages = decay ** np.arange(step)[::-1]
        expected = sum(age * weights for age, weights in zip(ages, trace.weights, strict=False)) / ages.sum()
        torch.testing.assert_close(trace.averages[step - 1], expected, rtol=0, atol=2e-6)
    apart = (trace.averages[-1] - trace.weights[-1]).abs().max()
    assert apart > 1e-4


def test_no_average_is_the_weights_themselves(monkeypatch, views, tmp_path):
    trace, _ = traced(monkeypatch, views, tmp_path, ema=0.0)
    assert torch.equal(trace.averages[-1], trace.weights[-1])


def test_the_kept_weights_are_the_last_of_the_best_validations(monkeypatch, views, tmp_path):
    right, kept = iter([0.4, 0.8, 0.8, 0.6]), []

    def told(model, source, numbers, *_, **named):
        share = next(right)
        kept.append({name: value.clone() for name, value in model.state_dict().items()})
        labels = source.facts.label[numbers]
        wrong = np.arange(len(labels)) >= share * len(labels)
        return np.eye(4)[(labels + wrong) % 4]

    monkeypatch.setattr(loop, "probabilities", told)
    runs.train(sources(views), SCHEME, "seen", with_training(steps=12, validate_every=3), tmp_path)
    weights = checkpoint.load(tmp_path / "model.pt")[1]["weights"]
    assert all(torch.equal(value, kept[2][name]) for name, value in weights.items())
    assert len({float(state["classifier.0.weight"].sum()) for state in kept}) == 4


def test_matrices_have_the_weight_decay_asked_for_and_it_draws_them_to_zero(views):
    class Plain(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.classifier = torch.nn.Linear(4, 4)

    model = Plain()
    before = {name: value.detach().clone() for name, value in model.named_parameters()}
    rate, decay = 0.1, 0.25
    steps = recipe.optimiser(model, {"rate": rate, "backbone_rate": 1.0, "weight_decay": decay})
    for value in model.parameters():
        value.grad = torch.zeros_like(value)
    steps.step()
    torch.testing.assert_close(model.classifier.weight.data, before["classifier.weight"] * (1 - rate * decay))
    torch.testing.assert_close(model.classifier.bias.data, before["classifier.bias"])


class Answers(torch.nn.Module):
    """A network with given logits, together and of each station alone."""

    shape = (2, 2)

    def __init__(self):
        super().__init__()
        self.together = torch.tensor([[2.0, 0.0, -1.0, 0.5], [0.0, 1.0, 0.0, 3.0]])
        self.alone = torch.arange(16.0).reshape(4, 4) / 7

    def forward(self, images, alone=False):
        return (self.together, self.alone) if alone else self.together


@pytest.mark.parametrize(("smoothing", "weight"), [(0.0, 0.0), (0.3, 0.0), (0.0, 0.5), (0.2, 2.0)])
def test_the_loss_is_the_smoothed_cross_entropy_of_both_parts_by_weight(smoothing, weight):
    def by_hand(logits, labels):
        losses = []
        for row, label in zip(logits.tolist(), labels, strict=True):
            total = math.log(sum(math.exp(value) for value in row))
            target = [(1 - smoothing) * (number == label) + smoothing / 4 for number in range(4)]
            losses.append(sum(share * (total - value) for share, value in zip(target, row, strict=True)))
        return sum(losses) / len(losses)

    model, labels = Answers(), [0, 3]
    images = torch.zeros(2, 4, 1, 1, dtype=torch.uint8)
    block = {"label_smoothing": smoothing, "alone": weight}
    found = objective(model, images, torch.tensor(labels), block, MACHINE)
    expected = by_hand(model.together, labels)
    if weight:
        expected = (expected + weight * by_hand(model.alone, [0, 0, 3, 3])) / (1 + weight)
    assert float(found) == pytest.approx(expected, rel=1e-6)


def test_batches_are_augmented_by_the_stream_of_seed_run_and_step(views):
    source, block = sources(views)["train"], SETTINGS["augmentation"]
    reader = Augmented(source, SCHEME.columns, block, (3, "seen", "AB"), 0, 1)
    numbers = np.array([5, 1, 7])
    found, labels = reader[4, numbers]
    plain = source.views(numbers)
    generator = stream(3, "recognition-augment", "seen", "AB", 4, 0)
    assert (found.numpy() == augment.augment(plain, SCHEME.columns, block, generator)).all()
    assert (found.numpy() != plain).any((1, 2, 3)).all()
    assert labels.tolist() == source.facts.label[numbers].tolist()


def test_thresholds_come_from_validation_samples_and_not_from_those_they_are_judged_by(tmp_path):
    found = facts(models=200)
    score = stream(1, "scores").uniform(0, 1, len(found))
    # Scores of test samples are half of those of validation samples.
    score[found.fold == "test"] /= 2
    rest = np.repeat(((1 - score) / 3)[:, None], 3, 1)
    path, *_ = run_files(tmp_path, "seen", "A:VT", 0.9)
    predictions.write(path, predictions.from_facts(found, (0,), np.column_stack([score, rest])))
    tables.write([Evaluated(path)], ["A:VT"], {}, tmp_path, 1)
    uav = found.label == 0
    levels = {
        fold: statistics.threshold(score[found.fold == fold], found.label[found.fold == fold], 0.8)
        for fold in ("val", "test")
    }
    assert levels["val"] > 1.5 * levels["test"]
    for row in read_rows(tmp_path / "alarms.csv"):
        if row["threshold"] == "not measurable":
            continue
        asked = float(row["asked_percent"]) / 100
        mine = found.fold == "val"
        level = statistics.threshold(score[mine], found.label[mine], asked)
        assert float(row["threshold"]) == level
        reached = (score[uav & (found.fold == "test")] >= level).mean()
        assert float(row["detected_percent"]) == pytest.approx(100 * reached, abs=1e-3)
    rows = read_rows(tmp_path / "alarms.csv")
    # 120 UAVs validate: a tenth of them are twelve samples, a twentieth are six.
    assert [row["threshold"] == "not measurable" for row in rows] == [False, True, True]


def test_a_comparison_averages_all_seeds_and_not_the_first(tmp_path):
    one, other = (
        [Evaluated(run_files(tmp_path, "seen", name, share, seed=seed)[0]) for seed, share in enumerate(shares)]
        for name, shares in (("ABC:VRP+TRP+VT", (0.9, 0.6, 0.3)), ("A:VRP+TRP+VT", (0.5, 0.5, 0.5)))
    )
    ((resampled, seeds, difference, low, high),) = tables.comparison_rows(one, other, 1)
    each = [100 * (a.test.correct.mean() - b.test.correct.mean()) for a, b in zip(one, other, strict=True)]
    assert (resampled, seeds) == ("seeds, motion models", 3)
    assert float(difference) == pytest.approx(np.mean(each), abs=1e-3)
    assert abs(each[0] - np.mean(each)) > 20
    # Seeds that lie 60 points apart make an interval of many points.
    assert float(high) - float(low) > 30


def test_every_table_that_the_report_s_page_or_recognition_s_document_names_is_kept_or_made_by_a_rule():
    kept = {
        path.name for folder in ("results/reference", "results/benchmarks", "config") for path in Path(folder).iterdir()
    }
    rules = "".join(path.read_text() for path in [*Path("workflow").rglob("*.smk"), *Path("src/lowalt").rglob("*.py")])
    made = set(re.findall(r"[\w-]+\.csv", rules))
    # Tables that the stage writes by their stems.
    made |= {f"{name}.csv" for name in re.findall(r'"(\w+)": \(', Path("src/lowalt/recognition/tables.py").read_text())}
    pages = [Path("results/README.md"), Path("design/recognition.md"), *Path("src/lowalt/report").rglob("*.html")]
    named = {(page.name, name) for page in pages for name in re.findall(r"(?<![\w}*-])[\w-]+\.csv\b", page.read_text())}
    assert len(named) > 5
    assert not {(page, name) for page, name in named if name not in kept | made}
