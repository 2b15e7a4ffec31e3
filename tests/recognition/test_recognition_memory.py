"""Large trainings fit and keep their GPU busy: batches in parts, activations computed again, lasting workers."""

import json
import os

import numpy as np
import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import inference, objective, recipe, recogniser, runs
from lowalt.recognition.batches import Prefetch, Unchanged
from lowalt.recognition.schemes import SPECTRA
from lowalt.tiles import colour_map
from trainings import SCHEME, SETTINGS, TRAINING, equal, sources, train, with_training

MACHINE = inference.Machine(torch.device("cpu"), "fp32")
PALETTES = np.stack([colour_map("gray")] * len(SPECTRA))


def gradients(views, backbone="test_vit2", again=False, dropout=0.0, **changes):
    """Gradients of one batch by name, its loss, and the bytes of activations kept for the gradient."""
    torch.manual_seed(4)
    block = {**SETTINGS["network"], "backbone": backbone, "dropout": dropout}
    model = recogniser.Recogniser(SCHEME, block, 32, PALETTES, 4).train()
    if again:
        recogniser.checkpoint_activations(model)
    source = sources(views)["train"]
    images, labels = torch.from_numpy(source.views(np.arange(10))), torch.from_numpy(source.facts.label[:10])
    kept = []

    def keep(value):
        kept.append(value.numel() * value.element_size())
        return value

    settings = recipe.check({**TRAINING, **changes})
    with torch.autograd.graph.saved_tensors_hooks(keep, lambda value: value):
        loss = objective.descent(model, images, labels, settings, MACHINE)
    return {name: value.grad for name, value in model.named_parameters()}, float(loss), sum(kept)


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_parts_of_a_batch_add_up_to_the_gradient_of_the_whole(views, parts):
    """Ten samples in three parts are 4, 4 and 2: each part counts by its samples."""
    whole, loss, _ = gradients(views, label_smoothing=0.1)
    found, told, _ = gradients(views, label_smoothing=0.1, accumulate=parts)
    assert told == pytest.approx(loss, rel=1e-6)
    for name, value in whole.items():
        scale = float(value.abs().max())
        torch.testing.assert_close(found[name], value, rtol=0, atol=1e-5 * scale, msg=name)


@pytest.mark.parametrize("backbone", ["test_vit2", "test_convnext"])
def test_activations_computed_again_change_no_gradient_and_keep_less(views, backbone):
    """With dropout: the second pass must drop what the first one dropped."""
    plain, loss, kept = gradients(views, backbone, dropout=0.3)
    again, told, less = gradients(views, backbone, again=True, dropout=0.3)
    assert told == loss and less < 0.7 * kept
    for name, value in plain.items():
        torch.testing.assert_close(again[name], value, rtol=0, atol=1e-6 * float(value.abs().max()), msg=name)


def test_batch_norm_is_refused_where_it_would_count_twice(views, tmp_path):
    settings = with_training(activation_checkpointing=True)
    settings["network"] = {**SETTINGS["network"], "backbone": "test_resnet"}
    with pytest.raises(InputError, match=r"activation_checkpointing: the backbone .* has batch norms"):
        train(views, tmp_path, settings)


class Who:
    """Samples that say which process reads them."""

    def __init__(self, count):
        self.facts = np.arange(count)

    def inputs(self, numbers):
        return np.array([[os.getpid(), number] for number in numbers])


def test_workers_read_in_order_and_live_as_long_as_their_reader():
    read = Prefetch(Unchanged(Who(12)), workers=2, pin=False)
    processes = set()
    for first in (0, 6, 3):
        found = torch.cat(list(read([np.array([first, first + 1]), np.array([first + 2])]))).numpy()
        assert found[:, 1].tolist() == [first, first + 1, first + 2]
        processes |= set(found[:, 0].tolist())
        # A pass that is not finished must not leave batches to the next one.
        next(read([np.array([9]), np.array([10]), np.array([11])]))
    assert len(processes) == 2 and os.getpid() not in processes


def test_evaluation_by_workers_writes_the_same_bytes(views, trained, tmp_path):
    model, source = runs.load(trained / "model.safetensors"), sources(views)["validation"]
    block = {"batch": 7, "threads": 1, "precision": "fp32", "mirror": True}
    for name, more in (("here", {}), ("workers", {"workers": 2})):
        runs.evaluate(model, source, {**block, **more}, tmp_path / f"{name}.csv")
    assert (tmp_path / "here.csv").read_bytes() == (tmp_path / "workers.csv").read_bytes()
    assert json.loads((tmp_path / "workers.json").read_text())["evaluated_samples"] == len(source.facts)
    with pytest.raises(InputError, match="unknown"):
        runs.evaluate(model, source, {**block, "worker": 2}, tmp_path / "none.csv")


def test_workers_that_read_ahead_change_no_bit_of_a_training(views, tmp_path):
    one = train(views, tmp_path / "here", with_training(steps=9, validate_every=3))
    two = train(views, tmp_path / "ahead", with_training(steps=9, validate_every=3, workers=2))
    assert equal(one[0], two[0]) and one[1] == two[1]
